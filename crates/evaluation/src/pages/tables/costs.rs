//! Tables 1–3, and where the time goes.

use baselines::AlgorithmId;

use super::table;
use crate::{
    output::table::{Entry, Measured, Table},
    paper::Seconds,
    results::{Column, Results, Trial},
};

pub(super) const TIMES: &str = "Ours (paper's). basis: wall time of everything that does not depend on the signature, on all threads; Emb.: writing one signature, while meshes are attacked beside it; Ext.: alignment, resampling and reading on one \
                thread while others work beside it, mean over all attacks, without the basis as in the paper. The paper had a Core i7-920 at 2.67 GHz.";

/// Tables 1–3: what one algorithm costs.
pub(super) fn times(results: &Results, title: &str, note: &str, algorithm: &AlgorithmId) -> Table {
    let header = "model | n | n_p | m | basis (s) | Emb. (s) | Ext. (s)";
    let mut table = table(title, note, header.split(" | "));
    let columns = results.columns();
    for (outcome, column) in columns.filter(|(_, column)| column.algorithm == *algorithm) {
        let Some(preparation) = column.preparation else {
            continue;
        };
        let printed = outcome.printed(column).map(|printed| printed.seconds);
        let beside = |values: Vec<f64>, seconds: fn(Seconds) -> f64, digits| {
            Measured::new(values, printed.map(seconds), digits)
        };
        let cells = column.marked().map(|trial| &trial.cell);
        let extractions: Vec<f64> = cells
            .map(|cell| cell.reference_seconds + cell.registration_seconds + cell.reading_seconds)
            .collect();
        let mean = extractions.iter().sum::<f64>() / extractions.len().max(1) as f64;
        let embeddings = column.marks.iter().map(|mark| mark.seconds).collect();
        table.row([
            outcome.title().into(),
            outcome.vertices.to_string().into(),
            preparation.patches.to_string().into(),
            preparation.functions.to_string().into(),
            beside(vec![preparation.seconds], |printed| printed.basis, 2).into(),
            beside(embeddings, |printed| printed.embedding, 3).into(),
            Entry::from(beside(vec![mean], |printed| printed.extraction, 2)),
        ]);
    }
    table
}

/// Where the time goes, in seconds of one thread but for the bases, which have all threads.
pub(super) fn costs(results: &Results) -> Table {
    let note = "Seconds, whenever they were spent. Bases and the marks' metrics: wall time with all threads; the rest: of one thread, as many side by side as there are cores. \
                Re-meshing is part of the attacks. Search structures of what suspects are aligned with, which cells share, are left out.";
    let header = "model | cells | bases | metrics | attacks | of these re-meshing | alignment | resampling and reading";
    let mut table = table("Where the time goes", note, header.split(" | "));
    for outcome in &results.outcomes {
        let trials: Vec<&Trial> = outcome.columns.iter().flat_map(Column::all_trials).collect();
        if trials.is_empty() {
            continue;
        }
        let preparations = outcome.columns.iter().filter_map(|column| column.preparation);
        let bases: f64 = preparations.map(|preparation| preparation.seconds).sum();
        let marks = outcome.columns.iter().flat_map(Column::all_marks);
        let metrics: f64 = marks.map(|mark| mark.measuring_seconds).sum();
        let sum = |seconds: fn(&Trial) -> f64| trials.iter().map(|trial| seconds(trial)).sum::<f64>();
        let remeshing = trials.iter().filter(|trial| trial.attack.spec == "remesh");
        let remeshing = remeshing.map(|trial| trial.cell.attack_seconds).sum();
        let seconds = [
            bases,
            metrics,
            sum(|trial| trial.cell.attack_seconds),
            remeshing,
            sum(|trial| trial.cell.registration_seconds),
            sum(|trial| trial.cell.reading_seconds),
        ];
        let counted = [outcome.title(), trials.len().to_string()].into_iter();
        // The sum of no numbers is -0.
        table.row(counted.chain(seconds.map(|seconds| format!("{:.0}", seconds.abs()))));
    }
    table
}
