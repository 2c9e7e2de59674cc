//! What `verify` says to people.

use std::path::Path;

use registration::MatchedBy;
use sigmark::{Compared, Mismatch, Outcome, PayloadKind, Verdict};

use crate::{
    args::Verify,
    claims::Claim,
    report::{self, Lines, Seconds},
    stamps::Stamps,
};

/// The verdict, and what it rests on.
pub(super) fn summary(
    suspect: &Path,
    arguments: &Verify,
    verdict: &Verdict,
    claim: &Claim,
    stamps: &Stamps,
    seconds: &Seconds,
) -> Lines {
    let mut lines = Lines::new(headline(suspect, arguments, verdict, claim));
    if let Some(mismatch) = verdict.mismatch {
        lines.field("reason", remark(mismatch));
    }
    if let Compared::SameGeometry { residual } = verdict.compared_with {
        lines.field("original", another_file(residual));
    }
    tell_who(&mut lines, verdict, claim);
    stamps.tell("existed", &mut lines);
    tell_what_was_read(&mut lines, arguments, verdict, claim);
    tell_how_it_lies(&mut lines, verdict);
    if verdict.outcome.is_found() && verdict.marked_parts > 1 {
        lines.field("parts", found_parts(verdict, claim));
    }
    lines.field("time", report::seconds_text(seconds));
    lines
}

/// What was found, in a line.
fn headline(suspect: &Path, arguments: &Verify, verdict: &Verdict, claim: &Claim) -> String {
    let (suspect, original) = (suspect.display(), claim.original_path.display());
    let lacks_evidence = arguments.dispute && !verdict.is_evidence();
    match verdict.outcome {
        Outcome::Verified if !verdict.binds_original => {
            format!(
                "VERIFIED, paper's profile: {suspect} carries a signature of a message, which is over no model"
            )
        }
        Outcome::Verified if verdict.is_for_owner_alone() => {
            format!(
                "VERIFIED, for the owner alone: {suspect} carries the signature that was written into the model of {original}"
            )
        }
        Outcome::Verified if lacks_evidence => format!(
            "NO EVIDENCE: {suspect} carries what was written into {original}, but so many of its bits are lost or wrong that a \
             stranger's claim is not ruled out"
        ),
        Outcome::Verified => {
            format!("VERIFIED: {suspect} carries the signature that was written into {original}")
        }
        Outcome::Detected { .. } if lacks_evidence => format!(
            "NO EVIDENCE: {suspect} agrees with the mark of {original}, but not so well that a stranger's claim is ruled out"
        ),
        Outcome::Detected { p } => format!(
            "DETECTED: {suspect} carries the mark of {original}; for its owner the chance of being wrong is below {}",
            probability(p)
        ),
        _ if verdict.mismatch.is_some() => {
            format!("NOT FOUND: {suspect} is not {original}, nor a part of it")
        }
        _ => format!("NOT FOUND: {suspect} has the shape of {original}, but nothing of its mark"),
    }
}

/// How many bits agree, from how many patches, and what that is worth; nothing where none was read.
fn tell_what_was_read(lines: &mut Lines, arguments: &Verify, verdict: &Verdict, claim: &Claim) {
    let (Some(rate), Some(errors)) = (verdict.extraction_rate, verdict.bit_errors) else {
        return;
    };
    let (bits, rate) = (verdict.bits, 100.0 * rate);
    let mended = match verdict.outcome {
        Outcome::Verified if errors > 0 => ", which the code mends",
        _ => "",
    };
    let patches = claim.certificate.statement().alphas.len();
    let read = match verdict.patches_read {
        read if read < patches => {
            let enough = match (verdict.outcome, arguments.enough) {
                (Outcome::Detected { p }, Some(enough)) if p <= enough => ", which is enough",
                _ => "",
            };
            format!(", read from {read} of {patches} patches{enough}")
        }
        _ => String::new(),
    };
    lines.field(
        "bits",
        format!("{} of {bits} agree ({rate:.2} %){mended}{read}", bits - errors),
    );
    if let Some(margin) = verdict.margin.filter(|_| errors > 0) {
        lines.field("margin", format!("T0 = {margin:.1}"));
    }
    tell_how_sure(lines, verdict);
}

/// How the suspect was laid onto the original, and what is to be minded there; nothing where it was not.
fn tell_how_it_lies(lines: &mut Lines, verdict: &Verdict) {
    let (Some(by), Some(residual)) = (verdict.registration(), verdict.residual) else {
        return;
    };
    let registered = registered(by, verdict.poses, verdict.overlap, verdict.missing);
    lines.field("registered", registered);
    let placed = verdict.transform.map_or_else(String::new, |transform| {
        let mirrored = if transform.mirrors() { ", mirrored" } else { "" };
        format!(", scale {:.6}{mirrored}", transform.scale)
    });
    let apart = format!("{residual:.2e} of the diagonal apart (RMS){placed}");
    lines.field("alignment", apart);
    if let Some(caveat) = caveat(by).filter(|_| verdict.outcome.is_found()) {
        lines.field("mind", caveat);
    }
}

/// Which connected parts were found, by name where they have one.
pub(crate) fn found_parts(verdict: &Verdict, claim: &Claim) -> String {
    const MOST: usize = 6;
    let mut names: Vec<String> = Vec::new();
    for part in &verdict.parts {
        let name = claim.original.name_of(part.vertex);
        let name = name.map_or_else(|| format!("part {}", part.part), str::to_string);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let more = if names.len() > MOST { ", …" } else { "" };
    names.truncate(MOST);
    let of = format!(
        "{} of {} that carry the mark",
        verdict.parts.len(),
        verdict.marked_parts
    );
    match verdict.parts.is_empty() {
        true => of,
        false => format!("{of}: {}{more}", names.join(", ")),
    }
}

/// Whose key, which scheme, what was signed, for whom.
fn tell_who(lines: &mut Lines, verdict: &Verdict, claim: &Claim) {
    let statement = claim.certificate.statement();
    let whose = match verdict.outcome.is_found() {
        true => "signed by",
        false => "looked for",
    };
    let fingerprint = statement.public_key.fingerprint();
    let key = match claim.own_key {
        true => format!("key {fingerprint}, the certificate's own: whose it is, it can't say"),
        false => format!("key {fingerprint}"),
    };
    let signed = match verdict.binds_original {
        true => "over key, original, mark and message",
        false => {
            "over the message alone: whoever has this model could subtract a mark of his own and call the rest his original, \
             so it does not say whose the model is"
        }
    };
    lines.field(whose, key);
    lines.field("signature", format!("{}, {signed}", statement.scheme));
    if statement.payload == PayloadKind::Tag {
        let bits = statement.payload.bits(statement.scheme);
        lines.field(
            "in the shape",
            format!("a tag of {bits} bits that stands for this signature alone"),
        );
    }
    for (name, text) in [
        ("message", &statement.message),
        ("recipient", &statement.recipient),
    ] {
        if !text.is_empty() {
            lines.field(name, text);
        }
    }
}

/// What the probability says, and to whom.
fn tell_how_sure(lines: &mut Lines, verdict: &Verdict) {
    let chance = format!(
        "a model without this mark agrees this well with probability {} at most",
        probability(verdict.p_value)
    );
    if !verdict.outcome.is_found() {
        lines.field("chance", chance);
        return;
    }
    let owner = format!("{chance}; that holds for a claim that was there before the suspect");
    let stranger = match (verdict.binds_original, verdict.is_evidence()) {
        (false, _) => "no evidence: claims of this profile can be made up afterwards".to_string(),
        _ if verdict.compared_with != Compared::Original => {
            "no evidence: the signature is over another file than the one that was compared".to_string()
        }
        (_, true) => format!(
            "evidence: who made up 2^80 claims after seeing the suspect would come this far with probability {} at most",
            probability(verdict.p_dispute())
        ),
        (_, false) => {
            "no evidence against one: a claim that was made up after seeing the suspect is not ruled out \
                       (that takes a probability of 2^-120)"
                .to_string()
        }
    };
    lines.field("owner", owner);
    lines.field("stranger", stranger);
}

/// What an original is that is not the very file.
pub(crate) fn another_file(residual: f64) -> String {
    format!(
        "not the very file that was signed, but the same geometry ({residual:.0e} of the diagonal apart): this is for the owner's \
         information, and a claim needs that file"
    )
}

/// Why the suspect is another shape.
pub(crate) fn remark(mismatch: Mismatch) -> String {
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

/// What a suspect was recognised by.
pub(crate) fn recognised_by(by: MatchedBy) -> &'static str {
    match by {
        MatchedBy::Connectivity => "by its vertices",
        MatchedBy::Surroundings => "by the vertices that are left",
        MatchedBy::Parts => "by its parts, each put back by itself",
        MatchedBy::Rig => {
            "by its vertices, brought back from its pose by the original's joints and morph targets"
        }
        MatchedBy::RigSurface => "by its surface, brought back from its pose by the original's joints",
        MatchedBy::LocalFrames => {
            "by its vertices, each seen from its own surroundings: it was bent or posed"
        }
        MatchedBy::BentSurface => {
            "by its surface, each place seen from its own surroundings: it was bent or posed"
        }
        _ => "by its surface",
    }
}

/// What is not said of a mark that was read of a suspect in another pose.
pub(crate) fn caveat(by: MatchedBy) -> Option<&'static str> {
    const OF_A_BEND: &str = "it does not say that the mark was there before the suspect was bent or posed: who has a signed copy can put its mark on another mesh of the same triangles, \
        such as another figure that was shaped from one template; ask where the suspect comes from";
    by.is_bent().then_some(OF_A_BEND)
}

/// What a suspect was recognised by, in how many ways it could lie there, and how much of the original it is.
pub(crate) fn registered(by: MatchedBy, poses: usize, overlap: f64, missing: f64) -> String {
    let poses = match poses {
        0 | 1 => String::new(),
        poses => format!("; it could lie there in {poses} ways, which the probability allows for"),
    };
    format!(
        "{}: {:.1} % of the suspect lies on the original, {:.1} % of the original's vertices were seen{poses}",
        recognised_by(by),
        100.0 * overlap,
        100.0 * (1.0 - missing)
    )
}

/// A probability as people read it; tiny ones as a power of ten.
pub(crate) fn probability(p: f64) -> String {
    if p >= 1e-3 {
        format!("{p:.3}")
    } else if p > 0.0 {
        format!("10^{}", p.log10().ceil())
    } else {
        "10^-300".into()
    }
}
