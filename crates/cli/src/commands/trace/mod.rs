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
    batch::{self, Found},
    files::{self, Output},
    interrupt, keys,
    progress::Progress,
    report::{self, Lines},
    report_page::TracePage,
};

pub(crate) use issued::Copies;
pub(crate) use words::{accused, named};

/// How several suspects were answered.
#[derive(Default)]
struct Count {
    found: usize,
    failed: usize,
}

pub(crate) fn run(arguments: &args::Trace) -> Result<Answer> {
    let begun = || {
        let progress = Progress::within(arguments.time_limit.duration());
        progress.begin("reading", "reading");
        progress
    };
    // The first suspect's time begins with the certificates'.
    let mut first = Some(begun());
    check_report(arguments)?;
    let original = files::open_mesh(&arguments.original)?;
    let key = arguments
        .public_key
        .as_deref()
        .map(keys::read_public)
        .transpose()?;
    let suspects = batch::meshes(&arguments.suspects, None)?;
    if let Some(report) = &arguments.report {
        for Found { path, .. } in &suspects {
            files::check_apart(report, path, "a suspect")?;
        }
    }
    let copies = {
        let progress = Arc::new(begun());
        let job = progress.job(arguments.common.threads());
        let key = key.map(|(key, _)| key);
        let paths = issued::listed(&arguments.certificates)?;
        if let Some(report) = &arguments.report {
            for path in &paths {
                files::check_apart(report, path, "a certificate")?;
            }
        }
        let read = Copies::read(original.mesh(), key, &arguments.certificates, &paths, &job);
        read.map_err(|error| match job.is_cancelled() {
            true => arguments.time_limit.exceeded(),
            false => error,
        })?
    };
    let inquiry = Inquiry {
        arguments,
        original: &original,
        copies: Copies {
            tracer: copies.tracer.p_bound(arguments.p_bound),
            ..copies
        },
    };
    let mut page = arguments
        .report
        .as_ref()
        .map(|_| TracePage::new(arguments, SystemTime::now()));
    let mut count = Count::default();
    for (i, Found { path, .. }) in suspects.iter().enumerate() {
        let progress = first.take().unwrap_or_else(begun);
        let progress = Arc::new(progress.numbered(i + 1, suspects.len()));
        match inquiry.judge(path, &progress, page.as_mut()) {
            Ok(found) => count.found += usize::from(found),
            // The others may be what they may.
            Err(error) if suspects.len() > 1 && !interrupt::is_asked_for() => {
                count.failed += 1;
                drop(progress);
                report::failure(&error);
                let error = report::in_one_line(&error);
                if let Some(page) = &mut page {
                    page.failed(path, &error);
                }
                if arguments.common.json {
                    report::print(true, &json!({ "suspect": path, "error": error }), &Lines::new(""))?;
                }
            }
            Err(error) => return Err(error),
        }
    }
    conclude(arguments, &count, suspects.len(), page)
}

/// A report can be written, and replaces nothing that was named to be read.
fn check_report(arguments: &args::Trace) -> Result<()> {
    let Some(path) = &arguments.report else {
        return Ok(());
    };
    files::check_apart(path, &arguments.original, "the original")?;
    if let Some(key) = &arguments.public_key {
        files::check_apart(path, key, "the public key")?;
    }
    files::check_free(path, arguments.force)
}

/// What is asked of every suspect.
struct Inquiry<'a> {
    arguments: &'a args::Trace,
    original: &'a Asset,
    copies: Copies,
}

impl Inquiry<'_> {
    /// Judges a suspect and prints whose it is; tells whether anybody was named.
    fn judge(&self, path: &Path, progress: &Arc<Progress>, page: Option<&mut TracePage<'_>>) -> Result<bool> {
        let suspect = files::open_mesh(path)?;
        let job = progress.job(self.arguments.common.threads());
        let traced = self.copies.tracer.trace(&*suspect.scene()?, &job);
        let trace = traced.map_err(|error| self.blame(error, path))?;
        if let Some(page) = page {
            progress.begin("report", "drawing");
            let judged = page.judged(path, self.original, &suspect, &trace, &self.copies, &job);
            judged.map_err(|error| match job.is_cancelled() {
                true => self.arguments.time_limit.exceeded(),
                false => error,
            })?;
        }
        let seconds = progress.finish();
        let mut object = self.described(&trace);
        object["suspect"] = json!(path);
        object["seconds"] = report::seconds_json(&seconds);
        let lines = words::summary(path, self.arguments, &trace, &self.copies, &seconds);
        report::print(self.arguments.common.json, &object, &lines)?;
        Ok(trace.is_found())
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
        json!({
            "accused": accused.collect::<Vec<_>>(),
            "candidates": trace.candidates,
            "passed_over": self.copies.passed_over,
            "unreadable": self.copies.unreadable,
            "unsigned": trace.unsigned.iter().filter_map(path).collect::<Vec<_>>(),
            "p_bound": self.arguments.p_bound,
            "registration": trace.transform.map(|_| trace.matched_by),
            "poses": trace.poses,
            "overlap": trace.overlap,
            "coverage": trace.coverage,
            "missing": trace.missing,
            "transform": trace.transform.map(|transform| transform.to_matrix()),
            "mirrored": trace.transform.map(|transform| transform.mirrors()),
            "attack_model": trace.attack_model,
            "remark": trace.mismatch.map(remark),
            "original": self.arguments.original,
            "public_key": self.copies.key.fingerprint(),
            "own_key": self.arguments.public_key.is_none(),
        })
    }

    /// The error with the name of the file that it is about.
    fn blame(&self, error: SigmarkError, suspect: &Path) -> anyhow::Error {
        let file: &Path = match error {
            SigmarkError::Job(JobError::Cancelled) => return self.arguments.time_limit.exceeded(),
            SigmarkError::Mark(MarkError::Registration(_) | MarkError::Mesh(_)) => suspect,
            _ => &self.arguments.original,
        };
        anyhow::Error::new(error).context(file.display().to_string())
    }
}

/// Writes the report, if there is one, and counts where there were several suspects.
fn conclude(
    arguments: &args::Trace,
    count: &Count,
    suspects: usize,
    page: Option<TracePage<'_>>,
) -> Result<Answer> {
    let mut lines = (suspects > 1).then(|| words::total(count.found, count.failed, suspects));
    if let (Some(path), Some(page)) = (&arguments.report, page) {
        let html = page.html();
        files::write_together(&[Output::public((path, html.as_bytes()))], arguments.force)?;
        let written = format!("The report is in {}", path.display());
        match &mut lines {
            Some(lines) => lines.line(written),
            None => lines = Some(Lines::new(written)),
        }
    }
    if let Some(lines) = lines.filter(|_| !arguments.common.json) {
        report::print(false, &Value::Null, &lines)?;
    }
    Ok(match count {
        Count { failed: 1.., .. } => Answer::Failed,
        Count { found: 1.., .. } => Answer::Yes,
        _ => Answer::No,
    })
}
