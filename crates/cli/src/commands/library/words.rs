//! What a search says to people.

use std::path::Path;

use anyhow::Result;
use sigmark::Outcome;

use super::look_up::{Catalogue, Finding, Looked, LookedUp, Marked};
use crate::{
    args::Searching,
    commands::verify::{caveat, probability, recognised_by},
    report::{self, Lines, Seconds},
};

/// So many of the others are named.
const OTHERS: usize = 3;

/// Which original it is, whose copy, and what that rests on.
pub(super) fn summary(
    suspect: &Path,
    catalogue: &Catalogue,
    search: &Searching,
    found: &LookedUp,
    seconds: &Seconds,
) -> Result<Lines> {
    let suspect = suspect.display();
    let searched = report::counted(catalogue.index.len(), "original", "originals");
    let mut lines = match found.best() {
        None => {
            let library = search.library.display();
            let mut lines = Lines::new(format!(
                "NOT FOUND: {suspect} is none of {searched} in {library}, nor a part of one"
            ));
            let read = found
                .candidates
                .iter()
                .filter(|looked| looked.finding.is_some())
                .count();
            lines.field("looked at", report::counted(read, "original", "originals"));
            lines
        }
        Some(best) => of_original(&suspect.to_string(), catalogue, found, best)?,
    };
    let others = found.candidates.iter().enumerate();
    let others =
        others.filter(|(number, looked)| Some(*number) != found.best && looked.candidate.is_worth_a_look);
    let others: Vec<String> = others
        .take(OTHERS)
        .map(|(_, looked)| {
            let verdict = looked.finding.as_ref().map_or("not read", Finding::name);
            format!(
                "{} ({:.2}, {})",
                looked.record.name,
                looked.candidate.score,
                verdict.replace('_', " ")
            )
        })
        .collect();
    if !others.is_empty() {
        lines.field("also near", report::listed(&others));
    }
    lines.field("searched", searched);
    lines.field("time", report::seconds_text(seconds));
    Ok(lines)
}

fn of_original(suspect: &str, catalogue: &Catalogue, found: &LookedUp, best: &Looked) -> Result<Lines> {
    let name = &best.record.name;
    let mut lines = match &best.finding {
        Some(Finding::Marked(marked)) => of_mark(suspect, found, best, marked),
        _ => {
            let mut lines = Lines::new(format!(
                "SHAPE FOUND: {suspect} has the shape of {name}, or of a part of it; no mark was found"
            ));
            let certificates = match best.read {
                0 if best.is_claimed() => {
                    "none that could be read with: this says which model it is, and is no claim".into()
                }
                0 if best.of_others > 0 => format!(
                    "{} for this original, none by the key that was given: this says which model it is, and is no claim",
                    report::counted(best.of_others, "certificate", "certificates")
                ),
                0 => "none for this original: this says which model it is, and is no claim".into(),
                count => format!(
                    "{} asked for, and nothing of their marks",
                    report::counted(count, "certificate", "certificates")
                ),
            };
            lines.field("certificates", certificates);
            lines
        }
    };
    lines.field("original", format!("{name}, {}", best.record.digest));
    for file in catalogue.library.files(best.record.id)? {
        lines.field("  file", file.path);
    }
    let lying = best.finding.as_ref().and_then(Finding::lying);
    if let Some(by) = lying.and_then(|lying| lying.registration) {
        lines.field("recognised", recognised_by(by));
        if let Some(caveat) = caveat(by).filter(|_| matches!(best.finding, Some(Finding::Marked(_)))) {
            lines.field("mind", caveat);
        }
    }
    if let Some(lying) = lying {
        lines.field(
            "lies there",
            format!(
                "{:.1} % of the suspect on the original, {:.1} % of the original on the suspect",
                100.0 * lying.overlap,
                100.0 * lying.coverage
            ),
        );
    }
    Ok(lines)
}

fn of_mark(suspect: &str, found: &LookedUp, best: &Looked, marked: &Marked) -> Lines {
    let name = &best.record.name;
    let p = probability(found.p_value(marked));
    let mut lines = Lines::new(match marked.verdict.outcome {
        Outcome::Verified => {
            format!("VERIFIED: {suspect} carries the signature that was written into {name}")
        }
        _ => format!(
            "DETECTED: {suspect} carries a mark of {name}; for its owner the chance of being wrong is below {p}"
        ),
    });
    if let Some(certificate) = best.certificates.get(marked.certificate) {
        let statement = certificate.statement();
        for (what, text) in [
            ("copy for", &statement.recipient),
            ("message", &statement.message),
        ] {
            if !text.is_empty() {
                lines.field(what, report::quoted(text));
            }
        }
        lines.field("signed by", format!("key {}", statement.public_key.fingerprint()));
    }
    let counted = report::counted(found.readings, "reading", "readings");
    lines.field(
        "chance",
        format!("a model without this mark comes as far with probability {p} at most, {counted} counted"),
    );
    if found.is_evidence(marked) {
        lines.field(
            "evidence",
            "it holds against a stranger's claim, too: below 2^-120",
        );
    }
    lines
}
