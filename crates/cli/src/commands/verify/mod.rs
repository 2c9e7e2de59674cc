mod words;

use std::{path::Path, sync::Arc, time::SystemTime};

use anyhow::Result;
use job::JobError;
use mesh_io::Asset;
use serde_json::{Map, Value, json};
use sigmark::{Compared, GeometryDigest, SigmarkError, Verdict, Verifier, mark::MarkError};

use crate::{
    Answer,
    args::{Profile, Verify},
    batch::{self, Found},
    claims::{Claim, ClaimFiles},
    files::{self, Output},
    interrupt,
    progress::Progress,
    report::{self, Lines},
    report_page::Page,
    stamps::Stamps,
};

pub(crate) use words::{found_parts, probability, remark};

/// How several suspects were answered.
#[derive(Default)]
struct Count {
    found: usize,
    failed: usize,
}

pub(crate) fn run(arguments: &Verify) -> Result<Answer> {
    check_report(arguments)?;
    let begun = || {
        let progress = Progress::within(arguments.time_limit.duration());
        progress.begin("reading", "reading");
        progress
    };
    // The first suspect's time begins with the claim's.
    let mut first = Some(begun());
    let files = ClaimFiles {
        certificate: arguments.certificate.clone(),
        original: arguments.original.clone(),
        public_key: arguments.public_key.clone(),
    };
    let claim = files.read()?;
    let roots = arguments.stamp_roots.as_deref();
    let stamps = Stamps::of(&claim.certificate, &arguments.certificate, roots)?;
    let suspects = batch::meshes(&arguments.suspects, None)?;
    if let Some(report) = &arguments.report {
        // What was looked for, or found in a folder.
        files::check_apart(report, &claim.original_path, "the original")?;
        check_companions(report, &claim.original_path, &claim.original)?;
        for Found { path, .. } in &suspects {
            files::check_apart(report, path, "a suspect")?;
        }
    }
    let inquiry = Inquiry::new(arguments, claim, stamps, &suspects)?;
    let mut page = arguments.report.as_ref().map(|_| inquiry.page());
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
                inquiry.failed(path, &error, page.as_mut())?;
            }
            Err(error) => return Err(error),
        }
    }
    inquiry.conclude(&count, suspects.len(), page)
}

/// A report can be written, and replaces nothing that was named to be read.
fn check_report(arguments: &Verify) -> Result<()> {
    let Some(path) = &arguments.report else {
        return Ok(());
    };
    let given = [
        (Some(&arguments.certificate), "the certificate"),
        (arguments.original.as_ref(), "the original"),
        (arguments.public_key.as_ref(), "the public key"),
        (arguments.stamp_roots.as_ref(), "the list of root certificates"),
    ];
    for (input, what) in given {
        input.map_or(Ok(()), |input| files::check_apart(path, input, what))?;
    }
    files::check_free(path, arguments.force)
}

/// A report replaces no file that belongs to a mesh.
fn check_companions(report: &Path, mesh: &Path, asset: &Asset) -> Result<()> {
    let what = format!("a part of {}", mesh.display());
    asset
        .companions()
        .try_for_each(|(name, _)| files::check_apart(report, &mesh.with_file_name(name), &what))
}

/// A claim, by which suspects are judged one after the other.
struct Inquiry<'a> {
    arguments: &'a Verify,
    claim: Claim,
    stamps: Stamps,
    verifier: Verifier,
}

impl<'a> Inquiry<'a> {
    fn new(arguments: &'a Verify, claim: Claim, stamps: Stamps, suspects: &[Found]) -> Result<Self> {
        let verifier = claim.verifier_for_owner().map_err(|error| {
            let certificate = || arguments.certificate.clone();
            let first = suspects
                .first()
                .map_or_else(certificate, |found| found.path.clone());
            the_wrong_way_round(&error, suspects, &claim)
                .unwrap_or_else(|| blame(error, arguments, &claim, &first))
        })?;
        let verifier = verifier
            .p_bound(arguments.p_bound)
            .paper_profile(arguments.profile == Some(Profile::Paper));
        Ok(Self {
            arguments,
            claim,
            stamps,
            verifier,
        })
    }

    /// A page that nobody was judged on yet.
    fn page(&self) -> Page<'_> {
        Page::new(self.arguments, &self.claim, &self.stamps, SystemTime::now())
    }

    /// Judges a suspect and prints the verdict; tells whether it is what was asked for.
    fn judge(&self, path: &Path, progress: &Arc<Progress>, page: Option<&mut Page<'_>>) -> Result<bool> {
        let Self {
            arguments,
            claim,
            stamps,
            verifier,
        } = self;
        let suspect = files::open_mesh(path)?;
        if let Some(report) = &arguments.report {
            check_companions(report, path, &suspect)?;
        }
        let job = progress.job(arguments.common.threads());
        let verdict = verifier
            .verify(&*suspect.scene()?, &job)
            .map_err(|error| blame(error, arguments, claim, path))?;
        if let Some(page) = page {
            progress.begin("report", "drawing");
            let judged = page.judged(path, &suspect, &verdict, &job);
            judged.map_err(|error| match job.is_cancelled() {
                true => arguments.time_limit.exceeded(),
                false => error,
            })?;
        }
        let seconds = progress.finish();
        let mut object = described(&verdict, claim);
        object.insert("suspect".into(), json!(path));
        object.insert("stamps".into(), stamps.json());
        object.insert("seconds".into(), report::seconds_json(&seconds));
        let lines = words::summary(path, arguments, &verdict, claim, stamps, &seconds);
        report::print(arguments.common.json, &object.into(), &lines)?;
        Ok(is_answered_with_yes(arguments, &verdict))
    }

    /// Says of one of several suspects why it could not be judged.
    fn failed(&self, path: &Path, error: &anyhow::Error, page: Option<&mut Page<'_>>) -> Result<()> {
        report::failure(error);
        let error = report::in_one_line(error);
        if let Some(page) = page {
            page.failed(path, &error);
        }
        match self.arguments.common.json {
            true => report::print(true, &json!({ "suspect": path, "error": error }), &Lines::new("")),
            false => Ok(()),
        }
    }

    /// Writes the report, if there is one, and counts where there were several suspects.
    fn conclude(&self, count: &Count, suspects: usize, page: Option<Page<'_>>) -> Result<Answer> {
        let mut lines = None;
        if suspects > 1 {
            lines = Some(words::total(count.found, count.failed, suspects));
        }
        if let (Some(path), Some(page)) = (&self.arguments.report, page) {
            let html = page.html();
            files::write_together(&[Output::public((path, html.as_bytes()))], self.arguments.force)?;
            let written = format!("The report is in {}", path.display());
            match &mut lines {
                Some(lines) => lines.line(written),
                None => lines = Some(Lines::new(written)),
            }
        }
        if let Some(lines) = lines.filter(|_| !self.arguments.common.json) {
            report::print(false, &Value::Null, &lines)?;
        }
        Ok(match count {
            Count { failed: 1.., .. } => Answer::Failed,
            Count { found: 1.., .. } => Answer::Yes,
            _ => Answer::No,
        })
    }
}

/// Whether a suspect bears what was asked for: the mark, or evidence.
pub(crate) fn is_answered_with_yes(arguments: &Verify, verdict: &Verdict) -> bool {
    match arguments.dispute {
        true => verdict.is_evidence(),
        false => verdict.outcome.is_found(),
    }
}

/// A verdict as `--json` prints it, but for the time that it took.
pub(crate) fn described(verdict: &Verdict, claim: &Claim) -> Map<String, Value> {
    let statement = claim.certificate.statement();
    let object = json!({
        "outcome": verdict.outcome.name(),
        "evidence": verdict.is_evidence(),
        "scheme": statement.scheme,
        "signed": if verdict.binds_original { "statement" } else { "message" },
        "extraction_rate": verdict.extraction_rate,
        "p_value": verdict.p_value,
        "p_dispute": verdict.p_dispute(),
        "correlation": verdict.correlation,
        "margin": verdict.margin,
        "payload": verdict.payload.name(),
        "bits": verdict.bits,
        "bit_errors": verdict.bit_errors,
        "patches_read": verdict.patches_read,
        "registration": verdict.transform.map(|_| verdict.matched_by),
        "poses": verdict.poses,
        "overlap": verdict.overlap,
        "coverage": verdict.coverage,
        "missing": verdict.missing,
        "residual": verdict.residual,
        "transform": verdict.transform.map(|transform| transform.to_matrix()),
        "mirrored": verdict.transform.map(|transform| transform.mirrors()),
        "attack_model": verdict.attack_model,
        "remark": verdict.mismatch.map(remark),
        "parts": verdict.parts.iter().map(|part| json!({
            "part": part.part,
            "name": claim.original.name_of(part.vertex),
            "seen": part.seen,
            "transform": part.transform.map(|transform| transform.to_matrix()),
        })).collect::<Vec<_>>(),
        "marked_parts": verdict.marked_parts,
        "original": claim.original_path,
        "original_is": match verdict.compared_with {
            Compared::Original => "file",
            _ => "geometry",
        },
        "message": statement.message,
        "recipient": statement.recipient,
        "public_key": statement.public_key.fingerprint(),
        "own_key": claim.own_key,
    });
    match object {
        Value::Object(members) => members,
        _ => Map::new(),
    }
}

/// The error with the name of the file that it is about.
fn blame(error: SigmarkError, arguments: &Verify, claim: &Claim, suspect: &Path) -> anyhow::Error {
    let file: &Path = match error {
        SigmarkError::Job(JobError::Cancelled) => return arguments.time_limit.exceeded(),
        SigmarkError::AnotherKey { .. } => arguments.public_key.as_deref().unwrap_or(&arguments.certificate),
        SigmarkError::Certificate(_) | SigmarkError::PaperProfile => &arguments.certificate,
        SigmarkError::Mark(MarkError::Registration(_) | MarkError::Mesh(_)) => suspect,
        _ => &claim.original_path,
    };
    anyhow::Error::new(error).context(file.display().to_string())
}

/// Where a suspect is the original that the certificate names.
fn the_wrong_way_round(error: &SigmarkError, suspects: &[Found], claim: &Claim) -> Option<anyhow::Error> {
    let digest = claim.certificate.statement().original.digest;
    let is_original = |found: &&Found| {
        files::open_mesh(&found.path).is_ok_and(|asset| GeometryDigest::of(asset.mesh()) == digest)
    };
    let SigmarkError::AnotherOriginal { .. } = error else {
        return None;
    };
    let suspect = suspects.iter().find(is_original)?.path.display();
    let original = claim.original_path.display();
    Some(anyhow::anyhow!(
        "{suspect}: is the original, and {original} is not: the two are the wrong way round; \
         try `sigmark verify {original} --original {suspect} …`"
    ))
}
