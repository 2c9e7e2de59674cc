//! What marks look like in numbers: at the strength of the tables, and at others (Fig. 2).

use super::table;
use crate::{
    attacks::Attack,
    output::table::{Entry, Measured, Table},
    paper::Printed,
    plan,
    results::{Column, Results},
    study::metrics::{self, Figure},
};

/// A figure of the marks at the strength of the tables.
pub(super) fn measured(figure: &Figure, column: &Column, printed: Option<&Printed>) -> Entry {
    let values = column.marks.iter().filter_map(|mark| mark.figures.get(figure.id));
    let printed = printed.zip(figure.printed).map(|(row, of)| of(row));
    Measured::new(values.copied().collect(), printed, figure.digits[0]).into()
}

pub(super) fn distortion(results: &Results) -> Table {
    let note = "α is the algorithm's own: in the mesh's unit for MHBs, without a unit for the others. The paper's was taken where it distorts within a tenth as in the paper, else \
                one that does; where unmarked truncation already distorts more, the paper's again. d_rmse is right in the mean over the signatures. Hausdorff: the greatest distance from the marked surface to the original. \
                MSDM2: of the first signature.";
    let mut header = vec!["model", "algorithm", "α"];
    header.extend(metrics::figures().map(|figure| figure.header));
    let mut table = table("Distortion of the marks", note, &header);
    for (outcome, column) in results.columns() {
        let printed = outcome.printed(column);
        let Some(strength) = column.strength else { continue };
        let by_paper = if strength.printed { " (paper's)" } else { "" };
        let first = [
            outcome.title().into(),
            column.name.as_str().into(),
            format!("{:.4e}{by_paper}", strength.alpha).into(),
        ];
        let figures = metrics::figures().map(|figure| measured(figure, column, printed));
        table.row(first.into_iter().chain(figures));
    }
    table
}

/// Fig. 2 as numbers.
pub(super) fn sweep(results: &Results) -> Table {
    let attacks: Vec<&Attack> = plan::swept_attacks().collect();
    let mut header = vec!["model", "α / α of Table 4"];
    header.extend(metrics::figures().map(|figure| figure.header));
    header.extend(attacks.iter().map(|attack| attack.name.as_str()));
    let note = "MHBs, one signature. A stronger mark survives more and shows more.";
    let mut table = table("Fig. 2: the strength of the mark", note, &header);
    for (outcome, column) in results.columns() {
        for (factor, (mark, trials)) in plan::SWEEP.iter().zip(&column.sweep) {
            let rates = attacks.iter().map(|attack| {
                let trial = trials.iter().filter(|trial| trial.attack == *attack);
                let rates = trial.map(|trial| 100.0 * trial.cell.readings[0].rate);
                Measured::new(rates.collect(), None, 1)
            });
            let figures = metrics::figures().map(|figure| {
                let value = mark.figures.get(figure.id).copied();
                Measured::new(value.into_iter().collect(), None, figure.digits[1])
            });
            let words = [outcome.title(), factor.to_string()].map(Entry::from).into_iter();
            table.row(words.chain(figures.chain(rates).map(Entry::from)));
        }
    }
    table
}
