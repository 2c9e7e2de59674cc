//! Every cell, a line for each way to read it: CSV alone.

use baselines::DetectorId;
use sigmark::claim::statistics::binomial_tail;

use crate::{
    output::table::Table,
    results::{Column, Outcome, Results, Trial},
    study::{Rated, SCHEME},
};

pub(in crate::pages) fn cells(results: &Results) -> Table {
    let header = "model | file | digest | algorithm | detector | signature | attack | alpha | rate | printed | rate_in_true_pose | \
        verified | p_value | tries | aligned | basis | overlap | missing | vertices | attack_seconds | reference_seconds | \
        registration_seconds | reading_seconds";
    let mut table = Table::new("Cells", header.split(" | "));
    for (outcome, column) in results.columns() {
        for trial in column.all_trials() {
            for rated in &trial.cell.readings {
                table.row(line(outcome, column, trial, rated));
            }
        }
    }
    table
}

fn line(outcome: &Outcome, column: &Column, trial: &Trial, rated: &Rated) -> [String; 23] {
    let printed = outcome.model.printed_rate(&column.algorithm, trial.attack);
    let comparable = rated.detector == DetectorId::PAPER && trial.target.is_marked;
    let printed = printed.filter(|_| comparable);
    let signature = match trial.target.is_marked {
        true => (trial.target.signature + 1).to_string(),
        false => "none".into(),
    };
    let right = (rated.rate * SCHEME.bits() as f64).round() as usize;
    let chance = binomial_tail(SCHEME.bits(), right) * rated.tries as f64;
    let cell = &trial.cell;
    [
        outcome.model.name.clone(),
        outcome.file.clone(),
        outcome.digest.clone(),
        column.name.clone(),
        rated.detector.name(),
        signature,
        trial.attack.spec.clone(),
        trial.target.alpha.to_string(),
        rated.rate.to_string(),
        printed.map_or(String::new(), |rate| (rate / 100.0).to_string()),
        rated
            .rate_in_true_pose
            .map_or(String::new(), |rate| rate.to_string()),
        rated.verified.to_string(),
        format!("{:.3e}", chance.min(1.0)),
        rated.tries.to_string(),
        cell.aligned.to_string(),
        cell.basis.clone(),
        format!("{:.6}", cell.overlap),
        format!("{:.6}", cell.missing),
        cell.vertices.to_string(),
        format!("{:.3}", cell.attack_seconds),
        format!("{:.3}", cell.reference_seconds),
        format!("{:.3}", cell.registration_seconds),
        format!("{:.3}", cell.reading_seconds),
    ]
}
