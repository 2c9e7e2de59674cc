//! What marks look like in numbers: at the strength of the tables, and at others (Fig. 2).

use super::table;
use crate::{
    attacks::Attack,
    output::table::{Entry, Measured, Table},
    plan,
    results::Results,
    study::Mark,
};

pub(super) fn distortion(results: &Results) -> Table {
    let note = "α is the algorithm's own: in the mesh's unit for MHBs, without a unit for the others. The paper's was taken where it distorts within a tenth as in the paper, else \
                one that does; where unmarked truncation already distorts more, the paper's again. d_rmse is right in the mean over the signatures. Hausdorff: the greatest distance from the marked surface to the original. \
                MSDM2: of the first signature.";
    let header = [
        "model",
        "algorithm",
        "α",
        "d_rmse (%)",
        "Hausdorff (%)",
        "d_2,50",
        "MSDM2",
    ];
    let mut table = table("Distortion of the marks", note, &header);
    for (outcome, column) in results.columns() {
        let printed = outcome.printed(column);
        let Some(strength) = column.strength else { continue };
        let by_paper = if strength.printed { " (paper's)" } else { "" };
        let of = |value: fn(&Mark) -> Option<f64>, printed, digits| {
            let values = column.marks.iter().filter_map(value);
            Entry::from(Measured::new(values.collect(), printed, digits))
        };
        table.row([
            outcome.title().into(),
            column.name.as_str().into(),
            format!("{:.4e}{by_paper}", strength.alpha).into(),
            of(|mark| Some(mark.d_rmse), printed.map(|row| row.d_rmse), 4),
            of(|mark| Some(mark.hausdorff), None, 3),
            of(|mark| Some(mark.d_2_50), printed.map(|row| row.d_2_50), 3),
            of(|mark| mark.msdm2, None, 3),
        ]);
    }
    table
}

/// Fig. 2 as numbers.
pub(super) fn sweep(results: &Results) -> Table {
    let attacks: Vec<&Attack> = plan::swept_attacks().collect();
    let mut header = vec![
        "model",
        "α / α of Table 4",
        "d_rmse (%)",
        "Hausdorff (%)",
        "d_2,50",
        "MSDM2",
    ];
    header.extend(attacks.iter().map(|attack| attack.name.as_str()));
    let mut table = table(
        "Fig. 2: the strength of the mark",
        "MHBs, one signature. A stronger mark survives more and shows more.",
        &header,
    );
    for (outcome, column) in results.columns() {
        for (factor, (mark, trials)) in plan::SWEEP.iter().zip(&column.sweep) {
            let one = |value: Option<f64>, digits| Measured::new(value.into_iter().collect(), None, digits);
            let rates = attacks.iter().map(|attack| {
                let trial = trials.iter().filter(|trial| trial.attack == *attack);
                let rates = trial.map(|trial| 100.0 * trial.cell.readings[0].rate);
                Measured::new(rates.collect(), None, 1)
            });
            let metrics = [
                one(Some(mark.d_rmse), 4),
                one(Some(mark.hausdorff), 4),
                one(Some(mark.d_2_50), 3),
                one(mark.msdm2, 3),
            ];
            let words = [outcome.title(), factor.to_string()].map(Entry::from).into_iter();
            table.row(words.chain(metrics.into_iter().chain(rates).map(Entry::from)));
        }
    }
    table
}
