//! Whether the figures can be right: what must hold whatever the meshes are.

use anyhow::{Result, bail};
use baselines::PAPER_DETECTOR;

use super::{Column, Outcome, Results, paper::Model};

/// How far the agreement with a stranger's signature may lie from a half: more than five standard deviations of 324 coins.
const CHANCE: f64 = 0.15;

/// Fails with everything that is missing or can't be right. The results are written by then.
pub(super) fn check(results: &Results) -> Result<()> {
    let mut faults: Vec<String> = results.failures.clone();
    for outcome in &results.outcomes {
        for column in &outcome.columns {
            let name = format!("{}, {}", outcome.model.name, column.algorithm);
            faults.extend(
                faults_of(outcome, column, results.signatures)
                    .into_iter()
                    .map(|fault| format!("{name}: {fault}")),
            );
        }
    }
    if faults.is_empty() {
        return Ok(());
    }
    bail!(
        "{} thing(s) are missing or can't be right:\n{}",
        faults.len(),
        faults.join("\n")
    )
}

fn faults_of(outcome: &Outcome, column: &Column, signatures: usize) -> Vec<String> {
    let mut faults = Vec::new();
    let expected = signatures * outcome.model.attacks().count();
    let finished = column.trials.iter().filter(|trial| trial.is_marked()).count();
    if finished != expected {
        faults.push(format!("{finished} cells of {expected} are finished"));
    }
    if column.strength.is_some_and(|strength| strength.reached) {
        for mark in &column.marks {
            if (mark.d_rmse / column.distortion - 1.0).abs() > 0.1 {
                faults.push(format!(
                    "d_rmse is {:.4} %, not {} %",
                    mark.d_rmse, column.distortion
                ));
            }
        }
    }
    for trial in &column.trials {
        for rated in &trial.cell.readings {
            let strange = rated.strangers.iter().find(|rate| (*rate - 0.5).abs() > CHANCE);
            if let Some(rate) = strange {
                let attack = trial.attack.name;
                faults.push(format!(
                    "after {attack}, {} reads {:.1} % of a signature that is not there",
                    rated.detector,
                    100.0 * rate
                ));
            }
            let moved = trial.attack.spec == "similarity"
                && trial.is_marked()
                && is_of_the_paper(&outcome.model, column);
            if moved && rated.detector == PAPER_DETECTOR && rated.rate < 1.0 {
                faults.push(format!(
                    "{:.1} % are read from a mesh that was only moved",
                    100.0 * rated.rate
                ));
            }
            if rated.verified != (rated.rate >= 1.0) {
                faults.push("a signature checks with wrong bits, or does not with right ones".into());
            }
        }
    }
    faults
}

fn is_of_the_paper(model: &Model, column: &Column) -> bool {
    model.printed(&column.algorithm).is_some()
}
