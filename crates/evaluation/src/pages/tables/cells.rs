//! Every cell, a line for each way to read it: CSV alone.

use baselines::DetectorId;

use crate::{
    output::table::Table,
    results::{Column, Outcome, Results, Trial},
    study::{Rated, Step},
};

pub(in crate::pages) fn cells(results: &Results) -> Table {
    let header = "model | file | digest | algorithm | detector | signature | attack | alpha | rate | margin | printed | \
        rate_in_true_pose | verified | p_value | tries | aligned | basis | overlap | missing | vertices | attack_seconds | \
        reference_seconds | registration_seconds | reading_seconds";
    let mut table = Table::new("Cells", header.split(" | "));
    for (outcome, column) in results.columns() {
        for trial in column.all_trials() {
            for rated in &trial.cell.readings {
                let read = read(outcome, column, trial, rated);
                table.row(line(outcome, column, trial, &rated.detector, read));
            }
            for step in &trial.cell.steps {
                table.row(line(outcome, column, trial, &step.reader, read_by_step(step)));
            }
        }
    }
    table
}

/// From the rate to the number of tries.
fn read(outcome: &Outcome, column: &Column, trial: &Trial, rated: &Rated) -> [String; 7] {
    let printed = outcome.model.printed_rate(&column.algorithm, trial.attack);
    let comparable = rated.detector == DetectorId::PAPER && trial.target.is_marked;
    let printed = printed.filter(|_| comparable).map(|rate| rate / 100.0);
    let number = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
    [
        rated.rate.to_string(),
        number(rated.margin),
        number(printed),
        number(rated.rate_in_true_pose),
        rated.verified.to_string(),
        format!("{:.3e}", rated.p_value),
        rated.tries.to_string(),
    ]
}

/// The same; plainer readers are only to compare T₀ of.
fn read_by_step(step: &Step) -> [String; 7] {
    let mut fields: [String; 7] = Default::default();
    fields[0] = step.rate.to_string();
    fields[1] = step.margin.to_string();
    fields
}

fn line(
    outcome: &Outcome,
    column: &Column,
    trial: &Trial,
    detector: &DetectorId,
    read: [String; 7],
) -> impl Iterator<Item = String> {
    let signature = match trial.target.is_marked {
        true => (trial.target.signature + 1).to_string(),
        false => "none".into(),
    };
    let cell = &trial.cell;
    let first = [
        outcome.model.name.clone(),
        outcome.file.clone(),
        outcome.digest.clone(),
        column.name.clone(),
        detector.name(),
        signature,
        trial.attack.spec.clone(),
        trial.target.alpha.to_string(),
    ];
    let last = [
        cell.aligned.to_string(),
        cell.basis.clone(),
        format!("{:.6}", cell.overlap),
        format!("{:.6}", cell.missing),
        cell.vertices.to_string(),
        format!("{:.3}", cell.attack_seconds),
        format!("{:.3}", cell.reference_seconds),
        format!("{:.3}", cell.registration_seconds),
        format!("{:.3}", cell.reading_seconds),
    ];
    first.into_iter().chain(read).chain(last)
}
