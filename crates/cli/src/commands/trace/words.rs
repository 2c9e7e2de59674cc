//! What `trace` says to people.

use std::path::{Path, PathBuf};

use sigmark::claim::{Accused, Trace};

use super::issued::{Copies, IssuedCopy};
use crate::{
    args,
    commands::verify::{caveat, probability, registered, remark},
    report::{self, Lines, Seconds},
};

/// Who was named, and what it rests on.
pub(super) fn summary(
    suspect: &Path,
    arguments: &args::Trace,
    trace: &Trace,
    copies: &Copies,
    seconds: &Seconds,
) -> Lines {
    let (suspect, original) = (suspect.display(), arguments.original.display());
    let asked = report::counted(trace.candidates, "copy", "copies");
    let accused: Vec<(&Accused, &IssuedCopy)> = accused(trace, copies).collect();
    let headline = match accused.as_slice() {
        [] if trace.mismatch.is_some() => {
            format!("NOBODY NAMED: {suspect} is not {original}, nor a part of it")
        }
        [] => format!(
            "NOBODY NAMED: {suspect} has the shape of {original}, and nothing in it of any of {asked}"
        ),
        [(_, copy)] => format!("NAMED: {suspect} was made of the copy for {}", named(copy)),
        several => format!(
            "NAMED: {suspect} was made of {} copies at least",
            report::grouped(several.len())
        ),
    };
    let mut lines = Lines::new(headline);
    if let Some(mismatch) = trace.mismatch {
        lines.field("reason", remark(mismatch));
    }
    for (accused, copy) in &accused {
        lines.field("copy for", named(copy));
        lines.field("  certificate", copy.certificate.display());
        lines.field(
            "  chance",
            format!(
                "that an innocent is named so: {} at most (T0 = {:.1})",
                probability(accused.p_value),
                accused.margin
            ),
        );
    }
    lines.field("asked for", asked);
    tell_of_certificates(&mut lines, trace, copies);
    let key = copies.key.fingerprint();
    lines.field(
        "key",
        match arguments.public_key.is_none() {
            true => format!("{key}, the certificates' own: whose it is, they can't say"),
            false => key,
        },
    );
    if let Some(by) = trace.registration() {
        let registered = registered(by, trace.poses, trace.overlap, trace.missing);
        lines.field("registered", registered);
    }
    if !accused.is_empty() {
        lines.field(
            "mind",
            "it says of which copy the file was made, not who gave it away: copies can be stolen, and who issues them has them all",
        );
        if let Some(caveat) = trace.registration().and_then(caveat) {
            lines.field("mind", caveat);
        }
    }
    lines.field("time", report::seconds_text(seconds));
    lines
}

/// Whose copies they are.
pub(crate) fn accused<'a>(
    trace: &'a Trace,
    copies: &'a Copies,
) -> impl Iterator<Item = (&'a Accused, &'a IssuedCopy)> {
    let copy = |accused: &'a Accused| Some((accused, copies.copies.get(accused.candidate)?));
    trace.accused.iter().filter_map(copy)
}

/// The recipient, or the certificate where it names none.
pub(crate) fn named(copy: &IssuedCopy) -> String {
    match copy.recipient.as_str() {
        "" => format!("nobody by name ({})", copy.certificate.display()),
        recipient => report::quoted(recipient),
    }
}

fn tell_of_certificates(lines: &mut Lines, trace: &Trace, copies: &Copies) {
    if copies.passed_over > 0 {
        let count = report::counted(copies.passed_over, "certificate", "certificates");
        lines.field("passed over", format!("{count} of other originals or keys"));
    }
    if !copies.unreadable.is_empty() {
        let count = report::counted(copies.unreadable.len(), "file", "files");
        lines.field(
            "unreadable",
            format!("{count}; whose copy they are for was not asked for"),
        );
    }
    let of = |numbers: &[usize]| -> Vec<PathBuf> {
        let copies = numbers.iter().filter_map(|&number| copies.copies.get(number));
        copies.map(|copy| copy.certificate.clone()).collect()
    };
    for path in of(&trace.altered) {
        let path = path.display();
        lines.field(
            "altered",
            format!("{path}: the key did not sign it: it was edited or damaged, and the mark that it was issued with was not asked for"),
        );
    }
    for path in of(&trace.unsigned) {
        let path = path.display();
        lines.field(
            "not named",
            format!("{path}: its mark is there, but the key did not sign it: it was edited"),
        );
    }
}
