//! Whether the figures can be right: what must hold whatever the meshes are.

use crate::study::PAPER_DETECTOR;
use anyhow::{Result, bail};

use crate::{
    paper::Model,
    results::{Column, Outcome, Results},
};

/// How far the agreement with a signature that is not in a mesh may lie from a half: more than five standard deviations of 324 coins.
const CHANCE: f64 = 0.15;

/// Fails with everything that is missing or can't be right. The results are written by then.
pub(crate) fn check(results: &Results) -> Result<()> {
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
    let expected = signatures * outcome.model.all_attacks().count();
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
            if !trial.is_marked() && (rated.rate - 0.5).abs() > CHANCE {
                let (attack, rate) = (trial.attack.name, 100.0 * rated.rate);
                faults.push(format!(
                    "after {attack}, {} reads {rate:.1} % from an unmarked mesh",
                    rated.detector
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        paper::{Attack, BUNNY},
        results::Trial,
        study::{Cell, Mark, Rated, Strength, Target},
    };

    fn trial(target: Target, attack: &'static Attack, rate: f64) -> Trial {
        let rated = Rated {
            detector: PAPER_DETECTOR.into(),
            rate,
            rate_in_true_pose: None,
            strangers: vec![0.52, 0.47],
            verified: rate >= 1.0,
        };
        let cell = Cell {
            attack: serde_json::Value::Null,
            vertices: 1000,
            aligned: true,
            basis: "surface".into(),
            overlap: 1.0,
            missing: 0.0,
            readings: vec![rated],
            attack_seconds: 0.0,
            reference_seconds: 0.0,
            registration_seconds: 0.0,
            reading_seconds: 0.0,
        };
        Trial {
            target,
            attack,
            cell,
            picture: None,
        }
    }

    /// Two signatures of the bunny by MHBs, as they should come out.
    fn results() -> Results {
        let marked = (0..2).flat_map(|number| {
            let rate = |spec: &str| if spec == "similarity" { 1.0 } else { 0.9 };
            BUNNY
                .all_attacks()
                .map(move |attack| trial(Target::Marked(number), attack, rate(attack.spec)))
        });
        let unmarked = BUNNY
            .attacks()
            .map(|attack| trial(Target::Unmarked, attack, 0.53));
        let mark = Mark {
            alpha: 1.0,
            d_rmse: 0.0205,
            hausdorff: 0.1,
            d_2_50: 0.2,
            msdm2: Some(0.05),
            measuring_seconds: 0.0,
            seconds: 0.1,
        };
        let column = Column {
            algorithm: "MHBs".into(),
            distortion: 0.02,
            preparation: None,
            strength: Some(Strength {
                alpha: 1.0,
                printed: false,
                reached: true,
            }),
            marks: vec![mark; 2],
            trials: marked.chain(unmarked).collect(),
            sweep: Vec::new(),
        };
        Results {
            outcomes: vec![Outcome {
                model: BUNNY,
                file: "bunny".into(),
                digest: String::new(),
                vertices: 1000,
                columns: vec![column],
            }],
            failures: Vec::new(),
            signatures: 2,
            pictures: Vec::new(),
            foot: String::new(),
        }
    }

    /// What is said of results that were spoilt.
    fn said(spoil: impl FnOnce(&mut Column)) -> String {
        let mut results = results();
        spoil(&mut results.outcomes[0].columns[0]);
        check(&results).unwrap_err().to_string()
    }

    #[test]
    fn what_is_complete_and_plausible_passes() {
        check(&results()).unwrap();
    }

    #[test]
    fn a_cell_that_is_missing_is_told() {
        assert!(said(|column| drop(column.trials.remove(3))).contains("cells of"));
    }

    #[test]
    fn an_algorithm_that_remembers_its_bits_is_found_out() {
        // It answers with what it wrote last, whatever it is shown.
        let cheat = |column: &mut Column| {
            for trial in &mut column.trials {
                trial.cell.readings[0].rate = 1.0;
                trial.cell.readings[0].verified = true;
            }
        };
        assert!(said(cheat).contains("from an unmarked mesh"));
        let stranger = |column: &mut Column| column.trials[0].cell.readings[0].strangers[1] = 0.9;
        assert!(said(stranger).contains("of a signature that is not there"));
    }

    #[test]
    fn robustness_is_not_bought_with_distortion() {
        assert!(said(|column| column.marks[1].d_rmse = 0.03).contains("d_rmse is 0.0300 %"));
    }

    #[test]
    fn a_mesh_that_was_only_moved_must_be_read() {
        let spoil = |column: &mut Column| {
            column.trials[0].cell.readings[0].rate = 0.99;
            column.trials[0].cell.readings[0].verified = false;
        };
        assert!(said(spoil).contains("only moved"));
    }
}
