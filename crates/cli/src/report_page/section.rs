//! What the page says of one suspect.

use registration::MatchedBy;
use sigmark::{Outcome, PayloadKind, Verdict};

use super::{
    html::{Facts, Html},
    pictures::{Pictures, Sides},
    words,
};
use crate::{
    args::Verify,
    claims::Claim,
    commands::verify::{caveat, found_parts},
    report,
};

/// Verdict, probabilities, pictures, and what was measured.
pub(super) fn section(verdict: &Verdict, arguments: &Verify, claim: &Claim, pictures: &Pictures) -> Html {
    answer(verdict, arguments, claim)
        .and(chances(verdict, arguments))
        .and(gallery(pictures, verdict.registration()))
        .and(measured(verdict, claim))
}

/// The answer on a suspect that could not be judged.
pub(super) const NOT_JUDGED: &str = "Not judged";

/// Why it could not.
pub(super) fn not_judged(error: &str) -> Html {
    let what = Html::markup("This file could not be judged, so nothing is said of it: ");
    Html::markup(NOT_JUDGED)
        .within("strong", None)
        .and(what.and(Html::foreign(error)).within("p", None))
        .within("div", Some("verdict weak"))
}

/// A bound, as tables have it.
pub(super) fn at_most(p: f64) -> Html {
    Html::markup("\u{2264}\u{a0}").and(words::probability(p))
}

fn answer(verdict: &Verdict, arguments: &Verify, claim: &Claim) -> Html {
    let class = match words::class(verdict, arguments) {
        "yes" => "verdict yes",
        "weak" => "verdict weak",
        _ => "verdict no",
    };
    let word = Html::markup(words::word(verdict, arguments)).within("strong", None);
    let sentences = Html::text(words::sentences(verdict, arguments, claim)).within("p", None);
    word.and(sentences).within("div", Some(class))
}

/// Both probabilities, and what they mean.
fn chances(verdict: &Verdict, arguments: &Verify) -> Html {
    let card = |head: &'static str, p: f64, below: Html| {
        let number = at_most(p).within("div", Some("number"));
        Html::markup(head)
            .within("div", Some("head"))
            .and(number)
            .and(below.within("div", Some("note")))
            .within("div", Some("card"))
    };
    let owner = card(
        "p, for a claim that was there before the suspect",
        verdict.p_value,
        words::for_owner(verdict, arguments),
    );
    let stranger = card(
        "p<sub>dispute</sub>, for a stranger\u{2019}s claim",
        verdict.p_dispute(),
        Html::markup(words::for_stranger(verdict)),
    );
    let meaning = "<b>p</b> is an upper bound on the probability that a model which does not bear this mark agrees with it as well as this \
                   suspect does, whatever was done to it; it holds for a claim that existed before the suspect turned up, such as one with a time \
                   stamp. Whoever may have made up his claim afterwards could have tried many until one fitted: \
                   <b>p<sub>dispute</sub></b> = 2<sup>80</sup> p bounds the probability that any of 2<sup>80</sup> tries comes so far, and \
                   counts as evidence from 2<sup>\u{2212}40</sup> (about 10<sup>\u{2212}12</sup>) down.";
    let of_tags = match verdict.payload {
        PayloadKind::Tag => {
            " For a tag it is 2<sup>\u{2212}48</sup> at least, since there are only 2<sup>128</sup> tags."
        }
        _ => "",
    };
    owner
        .and(stranger)
        .within("div", Some("cards"))
        .and(Html::markup(meaning).and(Html::markup(of_tags)).within("p", None))
}

/// Original, suspect, and where they differ.
pub(super) fn gallery(pictures: &Pictures, registration: Option<MatchedBy>) -> Html {
    let mut figures = figure(&pictures.original, "The original", "The original");
    let suspect = match (&pictures.difference, registration) {
        (Some(_), _) => "The suspect, laid onto the original",
        (None, Some(by)) if by.is_by_rig() => {
            "The suspect, as its file has it: its pose was undone by the original\u{2019}s joints before it was read"
        }
        (None, Some(_)) => {
            "The suspect, as its file has it: it was bent or posed, and read in the surroundings of each vertex"
        }
        (None, None) => {
            "The suspect, as its file has it: no position was found in which it lies on the original"
        }
    };
    figures.push(&figure(&pictures.suspect, suspect, "The suspect"));
    if let Some(difference) = &pictures.difference {
        figures.push(&figure(
            &difference.sides,
            "Where the two differ",
            "The difference in colours",
        ));
    }
    let class = match pictures.difference {
        Some(_) => "gallery three",
        None => "gallery two",
    };
    let gallery = figures.within("div", Some(class));
    let note = match &pictures.difference {
        None => return gallery,
        Some(difference) => {
            let bar = Html::picture(
                &difference.scale,
                "bar",
                "Colours from blue, no difference, to red",
            );
            let ticks: Html = [0.0, 0.25, 0.5, 0.75, 1.0]
                .map(|part| Html::text(percent(part * difference.greatest)).within("span", None))
                .into_iter()
                .collect();
            bar.and(ticks.within("div", Some("ticks"))).within("div", None)
                .and(Html::markup("Distance between the suspect\u{2019}s surface and the original\u{2019}s, in per cent of the \
                     original\u{2019}s diagonal. What is farther off is red, too: 1 vertex of 100 or fewer. All pictures have the \
                     same camera and the same light; the lower row is seen from the other side.").within("p", Some("note")))
                .within("div", Some("scale"))
        }
    };
    gallery.and(note)
}

/// One mesh from its two sides.
fn figure(sides: &Sides, caption: &'static str, what: &str) -> Html {
    let pictures: Html = sides
        .iter()
        .zip(["from one side", "from the other side"])
        .map(|(png, side)| Html::picture(png, "view", &format!("{what}, {side}")))
        .collect();
    let caption = Html::markup(caption).within("figcaption", None);
    caption.and(pictures).within("figure", None)
}

/// Per cent of a fraction, three digits of it.
fn percent(fraction: f64) -> String {
    let cent = 100.0 * fraction;
    match cent {
        0.0 => "0".into(),
        cent if cent >= 1e-4 => {
            let digits = (2.0 - cent.log10().floor()).clamp(0.0, 7.0) as usize;
            let text = format!("{cent:.digits$}");
            match text.contains('.') {
                true => format!("{} %", text.trim_end_matches('0').trim_end_matches('.')),
                false => format!("{text} %"),
            }
        }
        cent => format!("{cent:.1e} %"),
    }
}

/// Bits, coverage, transform.
fn measured(verdict: &Verdict, claim: &Claim) -> Html {
    let mut facts = Facts::default();
    let share = |fraction: f64| format!("{:.1} %", 100.0 * fraction);
    if let (Some(rate), Some(errors)) = (verdict.extraction_rate, verdict.bit_errors) {
        let patches = claim.certificate.statement().alphas.len();
        let mended = match verdict.outcome {
            Outcome::Verified if errors > 0 => ", and the code mends the others",
            _ => "",
        };
        let text = format!(
            "{} of {} agree ({:.2} %){mended}, read from {} of {patches} patches of the surface; by chance, about half would agree",
            verdict.bits - errors,
            verdict.bits,
            100.0 * rate,
            verdict.patches_read
        );
        facts.add("Bits read", Html::text(text));
        facts.add(
            "Correlation",
            Html::text(format!("T = {:.2}", verdict.correlation)),
        );
    }
    facts.add(
        "Suspect\u{2019}s surface",
        Html::text(format!("{} of it lies on the original", share(verdict.overlap))),
    );
    facts.add(
        "Original\u{2019}s surface",
        Html::text(format!("{} of it lies on the suspect", share(verdict.coverage))),
    );
    if verdict.registration().is_some() {
        facts.add("Recognised", Html::text(words::registration(verdict)));
        if let Some(caveat) = verdict
            .registration()
            .and_then(caveat)
            .filter(|_| verdict.outcome.is_found())
        {
            facts.add("Mind", Html::text(format!("{caveat}.")));
        }
        facts.add(
            "Vertices seen",
            Html::text(format!(
                "{} of the original\u{2019}s",
                share(1.0 - verdict.missing)
            )),
        );
        if verdict.outcome.is_found() && verdict.marked_parts > 1 {
            facts.add("Parts found", Html::text(found_parts(verdict, claim)));
        }
        if let Some(residual) = verdict.residual {
            let text = format!(
                "{} of the diagonal (root mean square) between corresponding points",
                percent(residual)
            );
            facts.add("Left apart", Html::text(text));
        }
        if let Some(attack) = words::attack(verdict) {
            facts.add(
                "What moved the surface",
                Html::text(format!("{attack} (shares of the squared displacements)")),
            );
        }
    }
    if let Some(transform) = &verdict.transform {
        facts.add("Transform found", Html::text(words::transform(transform)));
        let rows: Vec<String> = transform
            .to_matrix()
            .iter()
            .map(|row| row.map(|x| format!("{x:>18.9e}")).concat())
            .collect();
        let matrix = Html::text(rows.join("\n")).within("pre", None);
        facts.add(
            "As a matrix",
            matrix.and(
                Html::markup("for column vectors (x, y, z, 1) of the suspect").within("p", Some("note")),
            ),
        );
    }
    let all = report::counted(
        claim.certificate.statement().original.vertices,
        "vertex",
        "vertices",
    );
    let head = Html::text(format!("Measured, of an original of {all}")).within("h3", None);
    head.and(facts.table())
}
