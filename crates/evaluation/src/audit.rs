//! Whether the figures can be right: what must hold whatever the meshes are.

use anyhow::{Result, bail};
use baselines::DetectorId;

use crate::{
    plan,
    results::{Column, Outcome, Results, Trial},
    study::{Mark, Rated, product::VERIFIER, steps::READERS},
};

/// How far the agreement with a signature that is not in a mesh may lie from a half: more than five standard deviations of 324 coins.
const CHANCE: f64 = 0.15;

/// How far the distortion of a mark may lie from what was asked for, as a share of it: signatures differ.
const DISTORTION: f64 = 0.1;

/// Chance that a run can't have: no unmarked mesh has a smaller p, and no mark is verified with a greater one.
const IMPOSSIBLE: f64 = 1e-6;

/// Fails with everything that is missing or can't be right. The results are written by then.
pub(crate) fn check(results: &Results) -> Result<()> {
    let mut faults: Vec<String> = results.failures.clone();
    for (outcome, column) in results.columns() {
        let name = format!("{}, {}", outcome.model.name, column.name);
        let found = faults_of(outcome, column, results.signatures).into_iter();
        faults.extend(found.map(|fault| format!("{name}: {fault}")));
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
    let signatures = plan::signatures(&column.algorithm, signatures);
    let expected = signatures * plan::attacks_on(&column.algorithm, &outcome.model).len();
    let finished = column.marked().count();
    if finished != expected {
        faults.push(format!("{finished} cells of {expected} are finished"));
    }
    if column.strength.is_some_and(|strength| strength.reached) {
        let near = |d_rmse: &f64| (d_rmse / column.distortion - 1.0).abs() <= DISTORTION;
        let far = column.marks.iter().map(Mark::d_rmse).filter(|d| !near(d));
        faults.extend(far.map(|d_rmse| format!("d_rmse is {d_rmse:.4} %, not {} %", column.distortion)));
    }
    let rated = || {
        let trials = column.trials.iter();
        trials.flat_map(|trial| trial.cell.readings.iter().map(move |rated| (trial, rated)))
    };
    let alone = rated().filter(|(_, rated)| rated.strangers.is_empty()).count();
    if alone > 0 {
        faults.push(format!(
            "{alone} readings were compared with no signature but their own"
        ));
    }
    faults.extend(faults_of_steps(outcome, column));
    let is_printed = outcome.printed(column).is_some();
    faults.extend(rated().flat_map(|(trial, rated)| faults_of_reading(trial, rated, is_printed)));
    faults
}

/// `is_printed`: the paper has figures of this algorithm, which then has to read what was only moved.
fn faults_of_reading(trial: &Trial, rated: &Rated, is_printed: bool) -> Vec<String> {
    let mut faults = Vec::new();
    let (attack, detector, rate) = (&trial.attack.name, rated.detector.name(), 100.0 * rated.rate);
    if let Some(strange) = rated.strangers.iter().find(|rate| (*rate - 0.5).abs() > CHANCE) {
        let strange = 100.0 * strange;
        faults.push(format!(
            "after {attack}, {detector} reads {strange:.1} % of a signature that is not there"
        ));
    }
    if !trial.target.is_marked && (rated.rate - 0.5).abs() > CHANCE {
        faults.push(format!(
            "after {attack}, {detector} reads {rate:.1} % from an unmarked mesh"
        ));
    }
    let moved = trial.attack.moves() && trial.target.is_marked;
    if moved && is_printed && rated.detector == DetectorId::PAPER && rated.rate < 1.0 {
        faults.push(format!("{rate:.1} % are read from a mesh that was only moved"));
    }
    if rated.detector == VERIFIER {
        faults.extend(faults_of_verdict(trial, rated));
    } else if rated.verified != (rated.rate >= 1.0) {
        faults.push("a signature checks with wrong bits, or does not with right ones".into());
    }
    faults
}

/// Sigmark's verdicts: a code mends bits, so that they need not all be right.
fn faults_of_verdict(trial: &Trial, rated: &Rated) -> Vec<String> {
    let (attack, p) = (&trial.attack.name, rated.p_value);
    let mut faults = Vec::new();
    if !trial.target.is_marked && (rated.verified || p < IMPOSSIBLE) {
        faults.push(format!("after {attack}, an unmarked mesh has p = {p:.1e}"));
    }
    if rated.verified && p > IMPOSSIBLE {
        faults.push(format!("after {attack}, a mark is verified with p = {p:.1e}"));
    }
    // So small is p only where more bits are right than any payload has.
    if !rated.verified && rated.rate >= 1.0 && p == 0.0 {
        faults.push(format!(
            "after {attack}, a mark with all bits right is not verified"
        ));
    }
    if !rated.verified && trial.target.is_marked && trial.attack.moves() {
        faults.push("a mark is not verified in a mesh that was only moved".into());
    }
    faults
}

/// What is missing of the plainer readers.
fn faults_of_steps(outcome: &Outcome, column: &Column) -> Option<String> {
    let is_read =
        |trial: &&Trial| plan::reads_by_steps(&column.algorithm, &outcome.model, trial.target, trial.attack);
    let short = |trial: &&Trial| trial.cell.steps.len() != READERS.len();
    let count = column.trials.iter().filter(is_read).filter(short).count();
    (count > 0).then(|| format!("{count} cells were not read by all plainer readers"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        attacks::Attack,
        paper::{Model, ModelId},
        study::{Cell, Step, Strength, Target, metrics::D_RMSE, product::SIGMARK, steps::Reader},
    };
    use baselines::AlgorithmId;

    fn trial(target: Target, attack: &'static Attack, rate: f64) -> Trial {
        let rated = Rated {
            detector: DetectorId::PAPER,
            rate,
            margin: Some(10.0),
            p_value: 1e-9,
            tries: 1,
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
            steps: Vec::new(),
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
        let bunny = Model::of(ModelId::Bunny);
        let marked = (0..2).flat_map(|number| {
            let rate = |spec: &str| if spec == "similarity" { 1.0 } else { 0.9 };
            plan::all_attacks(bunny)
                .map(move |attack| trial(Target::marked(number, 1.0), attack, rate(&attack.spec)))
        });
        let unmarked = bunny
            .attacks()
            .map(|attack| trial(Target::unmarked(1.0), attack, 0.53));
        let mark = Mark {
            alpha: 1.0,
            figures: [(D_RMSE.into(), 0.0205)].into(),
            measuring_seconds: 0.0,
            seconds: 0.1,
        };
        let column = Column {
            algorithm: AlgorithmId::MHB,
            name: "MHBs".into(),
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
                model: bunny.clone(),
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

    /// The same by Sigmark, whose verifier mends bits.
    fn as_sigmark(column: &mut Column) {
        column.algorithm = SIGMARK;
        let bunny = Model::of(ModelId::Bunny);
        for trial in &mut column.trials {
            let is_marked = trial.target.is_marked;
            let rated = &mut trial.cell.readings[0];
            rated.detector = VERIFIER;
            rated.verified = is_marked;
            rated.p_value = if is_marked { 1e-90 } else { 0.3 };
            if plan::reads_by_steps(&SIGMARK, bunny, trial.target, trial.attack) {
                let step = |reader: &Reader| Step {
                    reader: reader.id.clone(),
                    rate: 0.9,
                    margin: 20.0,
                };
                trial.cell.steps = READERS.iter().map(step).collect();
            }
        }
    }

    /// What is said of Sigmark's results that were spoilt in one cell.
    fn said_of(is_meant: impl Fn(&Trial) -> bool, spoil: impl FnOnce(&mut Trial)) -> String {
        said(|column| {
            as_sigmark(column);
            let trial = column.trials.iter_mut().find(|trial| is_meant(trial));
            spoil(trial.unwrap());
        })
    }

    #[test]
    fn sigmark_is_verified_where_the_code_mends_bits() {
        let mut results = results();
        as_sigmark(&mut results.outcomes[0].columns[0]);
        check(&results).unwrap();
    }

    #[test]
    fn verdicts_that_cannot_be_are_told() {
        let unmarked = |trial: &Trial| !trial.target.is_marked;
        let small = said_of(unmarked, |trial| trial.cell.readings[0].p_value = 1e-7);
        assert!(small.contains("an unmarked mesh has p = 1.0e-7"));
        let verified = said_of(unmarked, |trial| trial.cell.readings[0].verified = true);
        assert!(verified.contains("is verified with p"));
        let moved = |trial: &Trial| trial.target.is_marked && trial.attack.moves();
        let lost = said_of(moved, |trial| trial.cell.readings[0].verified = false);
        assert!(lost.contains("only moved"));
        let steps = said_of(moved, |trial| drop(trial.cell.steps.pop()));
        assert!(steps.contains("plainer readers"));
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
        let spoil = |column: &mut Column| {
            column.marks[1].figures.insert(D_RMSE.into(), 0.03);
        };
        assert!(said(spoil).contains("d_rmse is 0.0300 %"));
        assert!(said(|column| column.marks[1].figures.clear()).contains("d_rmse is NaN %"));
    }

    #[test]
    fn a_mesh_that_was_only_moved_must_be_read() {
        let spoil = |column: &mut Column| {
            column.trials[0].cell.readings[0].rate = 0.99;
            column.trials[0].cell.readings[0].verified = false;
        };
        assert!(said(spoil).contains("only moved"));
    }

    #[test]
    fn an_audit_without_strangers_is_none() {
        let spoil = |column: &mut Column| {
            for trial in &mut column.trials {
                trial.cell.readings[0].strangers.clear();
            }
        };
        assert!(said(spoil).contains("compared with no signature but their own"));
    }
}
