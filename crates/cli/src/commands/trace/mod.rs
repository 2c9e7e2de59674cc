mod issued;
mod words;

use std::{path::Path, sync::Arc, time::SystemTime};

use anyhow::Result;
use job::JobError;
use mesh_io::Asset;
use serde_json::{Value, json};
use sigmark::{SigmarkError, claim::Trace, mark::MarkError};

use super::verify::remark;
use crate::{
    Answer, args,
    claims::{self, ReadFile, certificates_in},
    figures, files, keys,
    progress::Progress,
    report,
    report_page::TracePage,
    suspects::{Inquiry, Session},
};

pub(crate) use issued::Copies;
pub(crate) use words::{accused, named};

pub(crate) fn run(arguments: &args::Trace) -> Result<Answer> {
    let report = arguments.report.as_ref();
    let session = Session::begin(report, arguments.force, &arguments.time_limit, &arguments.common);
    session.check_report(&[
        (Some(&arguments.original), "the original"),
        (arguments.public_key.as_ref(), "the public key"),
    ])?;
    let original = files::open_mesh(&arguments.original)?;
    session.check_apart_from(&arguments.original, "the original", &original)?;
    let suspects = session.listed(&arguments.suspects)?;
    let inquiry = Asking {
        arguments,
        session: &session,
        copies: copies(arguments, &session, &original)?,
        original: &original,
    };
    let page = arguments.report.as_ref().map(|_| inquiry.page());
    session.judge(&&inquiry, &suspects, page, "Somebody named in")
}

/// The copies that are asked for.
fn copies(arguments: &args::Trace, session: &Session<'_>, original: &Asset) -> Result<Copies> {
    let paths = certificates_in(&arguments.certificates)?;
    session.check_apart_from_all(&paths, "a certificate")?;
    let (mut key, mut key_file) = (None, None);
    if let Some(path) = &arguments.public_key {
        let (read, pem) = keys::read_public(path)?;
        (key, key_file) = (Some(read), Some(ReadFile::of(path, pem.as_bytes())));
    }
    let progress = Arc::new(Progress::within(arguments.time_limit.duration()));
    progress.begin("certificates", "reading certificates");
    let job = progress.job(arguments.common.threads());
    let of = (&*arguments.original, original.mesh());
    let copies = Copies::read(of, key, &arguments.certificates, &paths, &job);
    let mut copies = session.within_limit(copies, &job)?;
    copies.tracer = copies
        .tracer
        .p_bound(arguments.p_bound)
        .with_rig(claims::rig_of(original, &arguments.original));
    copies.key_file = key_file;
    Ok(copies)
}

/// Certificates, by which it is asked of suspects whose they are.
struct Asking<'a> {
    arguments: &'a args::Trace,
    session: &'a Session<'a>,
    original: &'a Asset,
    copies: Copies,
}

impl<'a> Inquiry for &'a Asking<'_> {
    type Page = TracePage<'a>;

    fn judge(&self, path: &Path, progress: &Arc<Progress>, page: Option<&mut TracePage<'a>>) -> Result<bool> {
        let suspect = files::open_mesh(path)?;
        self.session.check_apart_from(path, "a suspect", &suspect)?;
        let job = progress.job(self.arguments.common.threads());
        let traced = self.copies.tracer.trace(&*suspect.scene()?, &job);
        let trace = traced.map_err(|error| self.blame(error, path))?;
        if let Some(page) = page {
            progress.begin("report", "drawing");
            self.session
                .within_limit(page.judged(path, &suspect, &trace, &job), &job)?;
        }
        let seconds = progress.finish();
        let mut object = self.described(&trace);
        object["suspect"] = json!(path);
        object["seconds"] = report::seconds_json(&seconds);
        let lines = words::summary(path, self.arguments, &trace, &self.copies, &seconds);
        report::print(self.arguments.common.json, &object, &lines)?;
        Ok(trace.is_found())
    }
}

impl Asking<'_> {
    /// A page that nobody was judged on yet.
    fn page(&self) -> TracePage<'_> {
        TracePage::new(self.arguments, self.original, &self.copies, SystemTime::now())
    }

    /// As `--json` prints it, but for the suspect and the time that it took.
    fn described(&self, trace: &Trace) -> Value {
        let accused = words::accused(trace, &self.copies).map(|(accused, copy)| {
            json!({
                "recipient": copy.recipient,
                "message": copy.message,
                "certificate": copy.certificate,
                "p_value": accused.p_value,
                "correlation": accused.correlation,
                "margin": accused.margin,
            })
        });
        let path = |&number: &usize| self.copies.copies.get(number).map(|copy| &copy.certificate);
        let mut object = figures::of_trace(trace);
        object.extend(figures::members(json!({
            "accused": accused.collect::<Vec<_>>(),
            "passed_over": self.copies.passed_over,
            "unreadable": self.copies.unreadable,
            "unsigned": trace.unsigned.iter().filter_map(path).collect::<Vec<_>>(),
            "altered": trace.altered.iter().filter_map(path).collect::<Vec<_>>(),
            "p_bound": self.arguments.p_bound,
            "remark": trace.mismatch.map(remark),
            "original": self.arguments.original,
            "public_key": self.copies.key.fingerprint(),
            "own_key": self.arguments.public_key.is_none(),
        })));
        Value::Object(object)
    }

    /// The error with the name of the file that it is about.
    fn blame(&self, error: SigmarkError, suspect: &Path) -> anyhow::Error {
        let file: &Path = match error {
            SigmarkError::Job(JobError::Cancelled) => return self.arguments.time_limit.exceeded_at(suspect),
            SigmarkError::Mark(MarkError::Registration(_) | MarkError::Mesh(_)) => suspect,
            _ => &self.arguments.original,
        };
        anyhow::Error::new(error).context(file.display().to_string())
    }
}
