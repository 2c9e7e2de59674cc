use std::{path::Path, sync::Arc};

use anyhow::{Context, Result};
use job::JobError;
use registration::MatchedBy;
use serde_json::{Value, json};
use sigmark::{
    Certificate, GeometryDigest, Mismatch, Outcome, SigmarkError, Verdict, Verifier, mark::MarkError,
};

use crate::{
    Answer,
    args::Verify,
    files::{self, Text},
    keys,
    progress::Progress,
    report::{self, Lines, Seconds},
};

pub(crate) fn run(arguments: &Verify) -> Result<Answer> {
    let progress = Arc::new(Progress::within(arguments.time_limit.duration()));
    progress.begin("reading", "reading");
    let text = files::read_text(&arguments.certificate, Text::Certificate)?;
    let certificate =
        Certificate::from_json(&text).with_context(|| arguments.certificate.display().to_string())?;
    let public_key = keys::read_public(&arguments.public_key)?;
    let original = files::open_mesh(&arguments.original)?;
    let suspect = files::open_mesh(&arguments.suspect)?;
    let verifier = Verifier::new(original.mesh(), &certificate, &public_key).map_err(|error| {
        let swapped = matches!(error, SigmarkError::AnotherOriginal { .. })
            && GeometryDigest::of(suspect.mesh()) == certificate.original().digest;
        if swapped {
            the_wrong_way_round(arguments)
        } else {
            blame(error, arguments)
        }
    })?;
    let verdict = verifier
        .p_bound(arguments.p_bound)
        .verify(suspect.mesh(), &progress.job(arguments.common.threads()))
        .map_err(|error| blame(error, arguments))?;
    let seconds = progress.finish();

    let lines = summary(arguments, &verdict, &certificate, &seconds);
    report::print(
        arguments.common.json,
        &object(&verdict, &certificate, &seconds),
        &lines,
    )?;
    Ok(match verdict.outcome.is_found() {
        true => Answer::Yes,
        false => Answer::No,
    })
}

/// What `--json` prints.
fn object(verdict: &Verdict, certificate: &Certificate, seconds: &Seconds) -> Value {
    json!({
        "outcome": verdict.outcome.name(),
        "extraction_rate": verdict.extraction_rate,
        "p_value": verdict.p_value,
        "correlation": verdict.correlation,
        "bits": verdict.bits,
        "bit_errors": verdict.bit_errors,
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
        "message": certificate.message(),
        "public_key": certificate.public_key().fingerprint(),
        "seconds": report::seconds_json(seconds),
    })
}

/// The error with the name of the file that it is about.
fn blame(error: SigmarkError, arguments: &Verify) -> anyhow::Error {
    let file: &Path = match error {
        SigmarkError::Job(JobError::Cancelled) => return arguments.time_limit.exceeded(),
        SigmarkError::AnotherKey { .. } => &arguments.public_key,
        SigmarkError::Certificate(_) | SigmarkError::Mark(MarkError::EmptyLayout { .. }) => {
            &arguments.certificate
        }
        SigmarkError::Mark(MarkError::Registration(_) | MarkError::Mesh(_)) => &arguments.suspect,
        _ => &arguments.original,
    };
    anyhow::Error::new(error).context(file.display().to_string())
}

fn the_wrong_way_round(arguments: &Verify) -> anyhow::Error {
    anyhow::anyhow!(
        "{suspect}: is the original, and {original} is not: the two are the wrong way round; \
         try `sigmark verify {original} --original {suspect} …`",
        suspect = arguments.suspect.display(),
        original = arguments.original.display()
    )
}

fn summary(arguments: &Verify, verdict: &Verdict, certificate: &Certificate, seconds: &Seconds) -> Lines {
    let (suspect, original) = (arguments.suspect.display(), arguments.original.display());
    let headline = match verdict.outcome {
        Outcome::Verified => {
            format!("VERIFIED: {suspect} carries the signature that was written into {original}")
        }
        Outcome::Detected { p } => format!(
            "DETECTED: {suspect} carries the mark of {original}; the chance of being wrong is below {}",
            probability(p)
        ),
        _ if verdict.mismatch.is_some() => {
            format!("NOT FOUND: {suspect} is not {original}, nor a part of it")
        }
        _ => {
            format!("NOT FOUND: {suspect} has the shape of {original}, but nothing of its mark")
        }
    };
    let mut lines = Lines::new(headline);
    if let Some(mismatch) = verdict.mismatch {
        lines.field("reason", remark(mismatch));
    }
    let fingerprint = certificate.public_key().fingerprint();
    let whose = if verdict.outcome.is_found() {
        "signed by"
    } else {
        "looked for"
    };
    lines.field(whose, format!("key {fingerprint}"));
    if !certificate.message().is_empty() {
        lines.field("message", certificate.message());
    }
    if let (Some(rate), Some(errors)) = (verdict.extraction_rate, verdict.bit_errors) {
        let (bits, rate) = (verdict.bits, 100.0 * rate);
        lines.field("bits", format!("{} of {bits} agree ({rate:.2} %)", bits - errors));
        let p = probability(verdict.p_value);
        let chance = format!("an unmarked mesh agrees this well with probability {p} at most");
        lines.field("chance", chance);
    }
    if let (Some(transform), Some(residual)) = (verdict.transform, verdict.residual) {
        lines.field("registered", registered(verdict));
        let mirrored = if transform.mirrors() { ", mirrored" } else { "" };
        let scale = transform.scale;
        let apart = format!("{residual:.2e} of the diagonal apart (RMS), scale {scale:.6}{mirrored}");
        lines.field("alignment", apart);
    }
    lines.field("time", report::seconds_text(seconds));
    lines
}

/// Why the suspect is another shape.
fn remark(mismatch: Mismatch) -> String {
    match mismatch {
        Mismatch::Surface { overlap, least } => format!(
            "does not align: in the best position, {:.1} % of the suspect's surface lies on the original; {:.0} % are needed",
            100.0 * overlap,
            100.0 * least
        ),
        Mismatch::Shape { in_place, .. } => format!(
            "another shape: it has the original's triangles, but {:.1} % of its vertices lie where those of the original do",
            100.0 * in_place
        ),
        _ => "another shape".into(),
    }
}

/// What the suspect was recognised by, and how much of the original it is.
fn registered(verdict: &Verdict) -> String {
    let by = match verdict.matched_by {
        MatchedBy::Connectivity => "by its vertices",
        MatchedBy::Surroundings => "by the vertices that are left",
        _ => "by its surface",
    };
    let poses = match verdict.poses {
        0 | 1 => String::new(),
        poses => format!("; it could lie there in {poses} ways, which the probability allows for"),
    };
    format!(
        "{by}: {:.1} % of the suspect lies on the original, {:.1} % of the original's vertices were seen{poses}",
        100.0 * verdict.overlap,
        100.0 * (1.0 - verdict.missing)
    )
}

/// A probability as people read it; tiny ones as a power of ten.
fn probability(p: f64) -> String {
    if p >= 1e-3 {
        format!("{p:.3}")
    } else if p > 0.0 {
        format!("10^{}", p.log10().ceil())
    } else {
        "10^-300".into()
    }
}
