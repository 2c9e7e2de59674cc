//! What the page says of a verdict, in words that need no other page.

use mesh::{Similarity, Vec3};
use registration::MatchedBy;
use sigmark::{Compared, Mismatch, Outcome, PayloadKind, Verdict};

use super::html::Html;
use crate::{args::Verify, claims::Claim, commands::verify::remark, report};

/// What was found, in a word.
pub(super) fn word(verdict: &Verdict, arguments: &Verify) -> &'static str {
    let lacks_evidence = arguments.dispute && !verdict.is_evidence();
    match verdict.outcome {
        Outcome::Verified if !verdict.binds_original => "Verified, by the paper's profile",
        Outcome::Verified if verdict.is_for_owner_alone() => "Verified, for the owner alone",
        Outcome::Verified | Outcome::Detected { .. } if lacks_evidence => "No evidence",
        Outcome::Verified => "Verified",
        Outcome::Detected { .. } if verdict.is_for_owner_alone() => "Detected, for the owner alone",
        Outcome::Detected { .. } => "Detected",
        _ => "Not found",
    }
}

/// The colour of the word: `yes` or `no`, or `weak` where a yes does not say what was asked for.
pub(super) fn class(verdict: &Verdict, arguments: &Verify) -> &'static str {
    let yes = crate::commands::verify::is_answered_with_yes(arguments, verdict);
    let is_bound = verdict.binds_original && !verdict.is_for_owner_alone();
    match (verdict.outcome.is_found(), yes && is_bound) {
        (true, true) => "yes",
        (true, false) => "weak",
        _ => "no",
    }
}

/// What was found, in sentences.
pub(super) fn sentences(verdict: &Verdict, arguments: &Verify, claim: &Claim) -> String {
    let statement = claim.certificate.statement();
    let (bits, all) = (verdict.bits, statement.payload.bits(statement.scheme));
    let agreeing = bits - verdict.bit_errors.unwrap_or(bits);
    match verdict.outcome {
        Outcome::Verified if !verdict.binds_original => format!(
            "All {all} bits of a digital signature were read back from the suspect\u{2019}s shape, and the signature is valid. But it is \
             over a message alone, and over no model: whoever has this model could have made such a claim. It does not say whose the \
             model is."
        ),
        Outcome::Verified if verdict.compared_with != Compared::Original => format!(
            "The suspect carries the signature that was written into a model with the geometry of the original: {} \
             read back from the suspect\u{2019}s shape. But the original that was given is not the very file that the signature is over: \
             this informs the owner, and a claim needs that file.",
            what_was_read(verdict, all)
        ),
        Outcome::Verified if arguments.dispute && !verdict.is_evidence() => format!(
            "The suspect carries what was written into the original: {} read back from the suspect\u{2019}s shape. But only {agreeing} of \
             the {bits} bits that stand for them there agree, the code mends the others, and so a claim is not ruled out which somebody \
             made up after he had seen the suspect; and this was asked.",
            what_was_read(verdict, all)
        ),
        Outcome::Verified if verdict.matched_by.is_by_rig() => format!(
            "The suspect carries the signature that was written into the original: {} read back from the suspect\u{2019}s shape, after its pose had been undone by the \
             original\u{2019}s joints and morph targets. The signature is valid, by the key named below, over this very original, with all that poses it, mark and message.",
            what_was_read(verdict, all)
        ),
        Outcome::Verified => format!(
            "The suspect carries the signature that was written into the original: {} read back from the \
             suspect\u{2019}s shape. The signature is valid, by the key named below, over this very original, mark and \
             message.",
            what_was_read(verdict, all)
        ),
        Outcome::Detected { .. } if arguments.dispute && !verdict.is_evidence() => format!(
            "The suspect agrees with the original\u{2019}s mark in {agreeing} of {bits} bits. That is more than chance explains, \
                 but not so \
             much that a claim is ruled out which somebody made up after he had seen the suspect; and this was asked."
        ),
        Outcome::Detected { .. } => format!(
            "The suspect carries the mark of the original. {agreeing} of its {bits} bits were read back rightly: too few to \
             read the signature, but a model without this mark does not agree with it so well by chance.{}",
            match verdict.is_evidence() {
                true => " That holds against a claim of a stranger, too.",
                false => "",
            }
        ),
        _ => why_not_found(verdict, claim, agreeing),
    }
}

/// Another shape, or the same without the mark, of which so many bits agree.
fn why_not_found(verdict: &Verdict, claim: &Claim, agreeing: usize) -> String {
    let bits = verdict.bits;
    match verdict.mismatch {
        Some(Mismatch::Shape { in_place, least }) => format!(
            "The suspect has the original\u{2019}s triangles, but another shape: {:.1} % of its vertices lie where those of \
                 the original \
             do, and {:.0} % are needed. A mark can be copied onto any model with these triangles, so what was read of one counts for \
             nothing.",
            100.0 * in_place,
            100.0 * least
        ),
        Some(mismatch) => format!(
            "The suspect is not the original, nor a copy or a part of it, as far as its shape tells: it {}. So no mark could be looked \
             for.",
            remark(mismatch)
        ),
        None => format!(
            "The suspect has the shape of the original, but nothing of its mark was found: {agreeing} of {bits} bits agree, \
                 about as many \
             as agree by chance. Either it was never marked{}, or the mark was damaged beyond recognition.",
            match claim.certificate.statement().recipient.is_empty() {
                true => "",
                false => " for this recipient",
            }
        ),
    }
}

/// All bits of the signature, or of what stands for it.
fn what_was_read(verdict: &Verdict, bits: usize) -> String {
    match verdict.payload {
        PayloadKind::Tag => format!("all {bits} bits of a tag that stands for this signature alone were"),
        _ => format!("all {bits} bits of it were"),
    }
}

/// A probability, or that it is no more than a power of ten.
pub(super) fn probability(p: f64) -> Html {
    match p {
        p if p >= 1.0 => Html::text("1"),
        p if p >= 1e-3 => Html::text(format!("{p:.3}")),
        p if p > 0.0 => Html::power_of_ten(p.log10().ceil() as i32),
        _ => Html::power_of_ten(-300),
    }
}

/// What stands below the owner's probability.
pub(super) fn for_owner(verdict: &Verdict, arguments: &Verify) -> Html {
    let (before, after) = match (verdict.outcome.is_found(), verdict.mismatch) {
        (true, _) => (
            "so unlikely would this agreement be without the mark; at most ",
            " was asked for",
        ),
        (false, None) => (
            "so likely is this agreement without any mark; at most ",
            " would count as detected",
        ),
        (false, Some(_)) => return Html::markup("a mark on another shape counts for nothing"),
    };
    Html::markup(before)
        .and(bound(arguments.p_bound))
        .and(Html::markup(after))
}

/// A bound that somebody chose: mostly a power of ten.
fn bound(p: f64) -> Html {
    let exponent = p.log10();
    match (exponent - exponent.round()).abs() < 1e-9 && p < 0.01 {
        true => Html::power_of_ten(exponent.round() as i32),
        false => Html::text(format!("{p:e}")),
    }
}

/// What stands below the probability of a stranger's claim.
pub(super) fn for_stranger(verdict: &Verdict) -> &'static str {
    match (verdict.binds_original, verdict.is_evidence()) {
        (false, _) => "marks of this profile can be made up afterwards: they are evidence for nobody",
        _ if verdict.compared_with != Compared::Original => {
            "no evidence: the signature is over another file than the one that was compared"
        }
        (_, true) => "evidence: even a claim made up after seeing the suspect would not come this far",
        (_, false) => "no evidence: a claim made up after seeing the suspect is not ruled out",
    }
}

/// How the suspect was laid onto the original.
pub(super) fn registration(verdict: &Verdict) -> String {
    let by = match verdict.matched_by {
        MatchedBy::Connectivity => "by its vertices: it still has the original\u{2019}s triangles",
        MatchedBy::Surroundings => "by the vertices that are left of the original\u{2019}s",
        MatchedBy::Rig => {
            "by its vertices, after its pose had been undone by the original\u{2019}s joints and morph targets"
        }
        MatchedBy::RigSurface => {
            "by its surface, after its pose had been undone by the original\u{2019}s joints"
        }
        MatchedBy::LocalFrames => {
            "by its vertices, each seen from its own surroundings: something had bent, dragged or posed it"
        }
        MatchedBy::BentSurface => {
            "by its surface, each place seen from its own surroundings: something had bent or posed it"
        }
        MatchedBy::Parts => {
            "by its parts, each of which was put back by itself; pictures and transform are those of the largest"
        }
        _ => "by its surface: it no longer has the original\u{2019}s triangles",
    };
    match verdict.poses {
        0 | 1 => by.into(),
        poses => format!("{by}; it could lie there in {poses} ways, which the probability allows for"),
    }
}

/// Shares of what moved the suspect's surface.
pub(super) fn attack(verdict: &Verdict) -> Option<String> {
    // Where there is no mark, what agrees with one is chance.
    let model = verdict.attack_model.filter(|_| verdict.outcome.is_found())?;
    let shares = [
        ("the mark", model.mark),
        ("an imperfect alignment", model.misalignment),
        ("a constant offset", model.offset),
        ("smoothing or sharpening", model.smoothing),
        ("other triangles", model.tessellation_bias),
        ("bending", model.bending),
        ("noise", model.noise),
    ];
    let shown = shares.iter().filter(|(_, share)| share.abs() >= 0.005);
    let shown: Vec<String> = shown
        .map(|(what, share)| format!("{what} {:.0} %", 100.0 * share))
        .collect();
    Some(shown.join(", "))
}

/// What takes the suspect to the original.
pub(super) fn transform(transform: &Similarity) -> String {
    let mut steps = Vec::new();
    let rotation = match transform.mirrors() {
        true => {
            steps.push("mirrored at the zero point of its coordinates".to_string());
            transform.rotation.map(|row| row.map(|x| -x))
        }
        false => transform.rotation,
    };
    let (angle, axis) = turn(rotation);
    // Without the sign of what is nothing.
    let [x, y, z] = axis.map(|x| if x.abs() < 5e-4 { 0.0 } else { x });
    steps.push(match angle.to_degrees() {
        degrees if degrees < 0.005 => "not turned".into(),
        degrees => format!("turned by {degrees:.2}\u{b0} about the axis ({x:.3}, {y:.3}, {z:.3})"),
    });
    steps.push(match transform.scale {
        scale if (scale - 1.0).abs() < 5e-6 => "not scaled".into(),
        scale => format!("scaled by {}", digits(scale)),
    });
    let [x, y, z] = transform.translation.map(digits);
    steps.push(format!("shifted by ({x}, {y}, {z})"));
    format!(
        "To lie on the original, the suspect is {}, in units of the original.",
        report::listed(&steps)
    )
}

/// Six significant digits.
fn digits(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    match x.abs() {
        size if (1e-4..1e7).contains(&size) => {
            let behind = (5.0 - size.log10().floor()).clamp(0.0, 9.0) as usize;
            let text = format!("{x:.behind$}");
            match text.contains('.') {
                true => text.trim_end_matches('0').trim_end_matches('.').into(),
                false => text,
            }
        }
        _ => format!("{x:.5e}"),
    }
}

/// Angle and axis of a rotation. From the half turn's matrix the axis is read otherwise than from others.
fn turn(r: [[f64; 3]; 3]) -> (f64, [f64; 3]) {
    let skew = Vec3([r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]);
    let trace = r[0][0] + r[1][1] + r[2][2];
    let angle = skew.norm().atan2(trace - 1.0);
    if angle < 3.0 {
        return (angle, skew.unit().into());
    }
    // R + 1 = 2 a aᵀ at the half turn: its longest column is along the axis.
    let columns = [0, 1, 2].map(|j| Vec3([0, 1, 2].map(|i| 0.5 * (r[i][j] + r[j][i]) + f64::from(i == j))));
    let longest = columns.into_iter().max_by(|a, b| a.norm().total_cmp(&b.norm()));
    let axis = longest.unwrap_or(skew).unit();
    let along = if axis.dot(skew) < 0.0 { -axis } else { axis };
    (angle, along.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_told_by_angle_and_axis_up_to_the_half_turn() {
        let axis = Vec3([1.0, -2.0, 0.5]).unit();
        for angle in [0.3f64, 1.5, 2.9, 3.1, std::f64::consts::PI - 1e-6] {
            let [x, y, z]: [f64; 3] = (axis * (0.5 * angle).sin()).into();
            let rotation = Similarity::from_quaternion([(0.5 * angle).cos(), x, y, z]).rotation;
            let (found, along) = turn(rotation);
            assert!((found - angle).abs() < 1e-6, "{angle} {found}");
            assert!(Vec3(along).dot(axis) > 1.0 - 1e-6, "{angle} {along:?}");
        }
    }

    #[test]
    fn transforms_are_sentences() {
        let quarter = Similarity {
            scale: 25.4,
            rotation: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
            translation: [0.0, -70.5, 1e-9],
        };
        assert_eq!(
            transform(&quarter),
            "To lie on the original, the suspect is turned by 90.00\u{b0} about the axis (0.000, 0.000, 1.000), scaled by 25.4 and \
             shifted by (0, -70.5, 1.00000e-9), in units of the original."
        );
        let mirrored = Similarity {
            rotation: [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]],
            ..Similarity::IDENTITY
        };
        let words = transform(&mirrored);
        assert!(
            words.contains("mirrored at the zero point") && words.contains("not turned, not scaled"),
            "{words}"
        );
    }

    #[test]
    fn probabilities_are_rounded_up() {
        assert_eq!(probability(0.43).to_string(), "0.430");
        assert_eq!(probability(2e-146).to_string(), "10<sup>\u{2212}145</sup>");
        assert_eq!(probability(0.0).to_string(), "10<sup>\u{2212}300</sup>");
    }
}
