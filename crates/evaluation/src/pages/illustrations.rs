//! All that is seen beside tables: the curve of strengths (Fig. 2), heat maps (Figs. 4, 5), attacked meshes (Figs. 6–10), ROC curves (Fig. 11).

use baselines::{AlgorithmId, DetectorId};

use super::{roc::Roc, verdicts::Verdicts};
use crate::{
    attacks,
    output::{
        chart::{Panel, page},
        markup::OURS,
    },
    plan,
    results::{Column, Illustration, Outcome, Results, Trial},
    study::{
        SCHEME,
        product::{SIGMARK, VERIFIER},
    },
};

/// The threshold that the paper chooses.
const PAPER_THRESHOLD: f64 = 0.561;

/// Thresholds between no bit and all, for Sigmark: the bits of its code.
const STEPS: usize = 2048;

pub(super) fn all(results: &Results) -> Vec<Illustration> {
    let mut shown = Vec::new();
    shown.extend(strengths(results));
    shown.extend(results.pictures.iter().cloned());
    shown.extend(attacked(results));
    let first = of(results, AlgorithmId::MHB).find(|(_, column)| !column.trials.is_empty());
    let detectors = first.map_or_else(|| vec![DetectorId::PAPER], |(_, column)| column.detectors());
    let rates = detectors
        .iter()
        .filter_map(|detector| error_rates(results, detector));
    shown.extend(rates);
    shown.extend(error_rates_of_sigmark(results));
    shown
}

/// One algorithm on every model.
fn of(results: &Results, algorithm: AlgorithmId) -> impl Iterator<Item = (&Outcome, &Column)> {
    let columns = results.columns();
    columns.filter(move |(_, column)| column.algorithm == algorithm)
}

/// Fig. 2: extraction rate over distortion; none without a sweep.
fn strengths(results: &Results) -> Option<Illustration> {
    const COLOURS: [&str; 4] = [OURS, "#1c7ed6", "#2b8a3e", "#862e9c"];
    let (_, column) = results.columns().find(|(_, column)| !column.sweep.is_empty())?;
    let x = "d_rmse (% of the diagonal), logarithmic";
    let mut panel = Panel::new([70.0, 50.0, 500.0, 270.0], x, "extraction rate (%)");
    let distortions: Vec<f64> = column.sweep.iter().map(|(mark, _)| mark.d_rmse()).collect();
    let (least, greatest) = (distortions.first()?.ln(), distortions.last()?.ln());
    let across = |d: f64| 0.03 + 0.94 * (d.ln() - least) / (greatest - least).max(f64::MIN_POSITIVE);
    let up = |rate: f64| (rate - 45.0) / 58.0;
    for &d in &distortions {
        panel.tick_x(across(d), &format!("{d:.4}"));
    }
    for rate in [50, 60, 70, 80, 90, 100] {
        panel.tick_y(up(rate.into()), &rate.to_string());
    }
    for (i, attack) in plan::swept_attacks().enumerate() {
        let places = column.sweep.iter().filter_map(|(mark, trials)| {
            let trial = trials.iter().find(|trial| trial.attack == attack)?;
            let rate = trial.cell.readings.first()?.rate;
            Some((across(mark.d_rmse()), up(100.0 * rate)))
        });
        let colour = COLOURS[i % COLOURS.len()];
        panel.curve(places, colour);
        panel.legend(1.04, i, &attack.name, colour);
    }
    Some(Illustration {
        file: "fig2.svg".into(),
        title: "Fig. 2: the strength of the mark".into(),
        caption: "Extraction rate of MHBs by the paper's rule, over the distortion of the mark.".into(),
        bytes: page(720.0, 380.0, panel.drawn()).into_bytes(),
    })
}

/// Figs. 6–10: what there is of them.
fn attacked(results: &Results) -> Vec<Illustration> {
    let mut shown = Vec::new();
    for (figure, model, attacks) in plan::SERIES {
        let is_shown = |outcome: &Outcome| outcome.model.id == model && !outcome.model.again;
        for (outcome, column) in of(results, AlgorithmId::MHB).filter(|(outcome, _)| is_shown(outcome)) {
            let wanted =
                |trial: &&Trial| attacks.contains(&trial.attack.spec.as_str()) && trial.target.is_first();
            let wanted = column.trials.iter().filter(wanted);
            shown.extend(wanted.filter_map(|trial| suspect(figure, outcome, column, trial)));
        }
    }
    shown
}

/// An attacked mesh, if there is a picture of it.
fn suspect(figure: &str, outcome: &Outcome, column: &Column, trial: &Trial) -> Option<Illustration> {
    let printed = outcome.model.printed_rate(&column.algorithm, trial.attack);
    let printed = printed.map_or(String::new(), |rate| format!(", printed {rate} %"));
    let tables = attacks::tables();
    let mut known = tables.table4.iter().chain(&tables.table5);
    let number = known
        .position(|attack| attack == trial.attack)
        .unwrap_or_default();
    Some(Illustration {
        file: format!("{}_{number}.png", figure.to_lowercase().replace(". ", "")),
        title: format!("{figure}: {}, {}", outcome.file, trial.attack.name),
        caption: format!(
            "{} vertices. Extraction rate {}{printed}.",
            trial.cell.vertices,
            trial.cell.rates_in_words()
        ),
        bytes: trial.picture.clone()?,
    })
}

/// Fig. 11 for a detector: how often a threshold errs; none without both kinds of meshes.
fn error_rates(results: &Results, detector: &DetectorId) -> Option<Illustration> {
    let roc = roc(results, AlgorithmId::MHB, detector)?;
    let (marked, unmarked) = roc.counts();
    let (equal, paper) = (roc.equal_error(SCHEME.bits()), roc.at(PAPER_THRESHOLD));
    let name = detector.name();
    let (file, title) = if *detector == DetectorId::PAPER {
        ("fig11.svg".into(), "Fig. 11: MHBs, the paper's extraction".into())
    } else {
        let file = format!("fig11_{}.svg", name.replace(' ', "_"));
        (file, format!("As Fig. 11: MHBs, {name}"))
    };
    Some(Illustration {
        file,
        title,
        caption: format!(
            "{marked} marked and {unmarked} unmarked meshes. Area under the curve {:.4}. Errors are equal at {} ({} false positives, {} false negatives); at the paper's threshold of 56.1 % there are {} and {}.",
            roc.area(),
            per_cent(equal.threshold),
            per_cent(equal.false_positives),
            per_cent(equal.false_negatives),
            per_cent(paper.false_positives),
            per_cent(paper.false_negatives),
        ),
        bytes: roc.svg(SCHEME.bits()).into_bytes(),
    })
}

/// The same for Sigmark, whose verifier says more than a threshold of rates: what it says of these meshes, in words.
fn error_rates_of_sigmark(results: &Results) -> Option<Illustration> {
    let roc = roc(results, SIGMARK, &VERIFIER)?;
    let (marked, unmarked) = roc.counts();
    let equal = roc.equal_error(STEPS);
    Some(Illustration {
        file: "fig11_sigmark.svg".into(),
        title: "As Fig. 11: Sigmark".into(),
        caption: format!(
            "{marked} marked and {unmarked} unmarked meshes, by the share of right bits of the code. Area under the curve {:.4}. Errors are equal at {} ({} false positives, {} false negatives). {}",
            roc.area(),
            per_cent(equal.threshold),
            per_cent(equal.false_positives),
            per_cent(equal.false_negatives),
            Verdicts::of(results).in_words(),
        ),
        bytes: roc.svg(STEPS).into_bytes(),
    })
}

fn per_cent(rate: f64) -> String {
    format!("{:.2} %", 100.0 * rate)
}

/// As in the paper, one marked and one unmarked mesh for each model and attack of Tables 4 and 5: the first signature's. None without both kinds.
fn roc(results: &Results, algorithm: AlgorithmId, detector: &DetectorId) -> Option<Roc> {
    let (mut marked, mut unmarked) = (Vec::new(), Vec::new());
    for (outcome, column) in of(results, algorithm).filter(|(outcome, _)| !outcome.model.again) {
        let printed = |trial: &&Trial| outcome.model.attacks().any(|attack| attack == trial.attack);
        for trial in column.trials.iter().filter(printed) {
            let rates = trial.rated(detector).map(|rated| rated.rate);
            if trial.target.is_first() {
                marked.extend(rates);
            } else if !trial.target.is_marked {
                unmarked.extend(rates);
            }
        }
    }
    let is_there = !marked.is_empty() && !unmarked.is_empty();
    is_there.then(|| Roc::new(marked, unmarked))
}
