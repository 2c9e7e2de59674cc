//! The lowest eigenpairs of the same matrices by ours and by the peers; ours at loose tolerances, on many patches, for many pairs.
//!
//! `problem.rs` is what is solved, `task.rs` what is asked and what comes back, `ours.rs` and `peers.rs` are those who solve, `residual.rs`
//! is the judge. `measurement.rs` makes the tables of the comparison, `loose.rs` and `scaling.rs` measure and tabulate theirs,
//! `page.rs` writes.

mod lanczos;
mod loose;
mod matrices;
mod measurement;
mod ours;
mod page;
mod peers;
mod problem;
mod residual;
mod scaling;
mod spectra;
mod task;

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use evaluation::process::root;

use self::{
    measurement::{OURS, OURS_ON_TWO, SolveMeasurement},
    ours::ours,
    page::EigenPage,
    peers::{EigenPeer, EigenPeers},
    problem::EigenProblem,
    task::{EigenTask, SolveOutcome},
};
pub use self::{ours::LoneSolve, residual::worst_residual};
use crate::kept;

/// The meshes that are compared on unless others are asked for, the one of the chart first.
const MESHES: [&str; 4] = [
    "stanford_bunny_closed_35k",
    "horse_48k",
    "elephant_refined_44k",
    "igea_134k",
];

/// The first number of pairs is solved to both, the others to the first: peers take minutes.
const TOLERANCES: [f64; 2] = [1e-6, 1e-8];

/// What to measure, and on what.
#[derive(Args)]
pub struct EigenBench {
    /// Mesh files; of one with more than 60 000 vertices, the largest patch is taken
    #[arg(long, value_name = "DIR")]
    pub meshes: PathBuf,
    /// Files whose name begins so, in this order; may be given again
    #[arg(long, value_name = "NAME", default_values = MESHES)]
    pub only: Vec<String>,
    /// Numbers of pairs; the first to 1e-6 and 1e-8, the others to 1e-6, and by the peers on the first mesh alone
    #[arg(long, value_delimiter = ',', default_value = "325,513")]
    pub counts: Vec<usize>,
    /// Our times are medians over so many rounds
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub rounds: usize,
    /// And the peers' over so many
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub peer_rounds: usize,
    /// A peer is stopped after so many CPU seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 900)]
    pub limit: u64,
    /// What to measure; all unless said
    #[arg(long, value_delimiter = ',', default_value = "comparison,loose,scaling")]
    pub parts: Vec<EigenPart>,
    /// The mesh that is cut into patches for the scaling
    #[arg(long, value_name = "NAME", default_value = "ct_skull_1081k_closed")]
    pub scaling: String,
    /// Into so many
    #[arg(long, value_name = "N", default_value_t = 33)]
    pub patches: usize,
    /// Where the tables and the chart go
    #[arg(long, value_name = "DIR", default_value_os_t = root().join("results"))]
    pub output: PathBuf,
}

/// A part of the benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EigenPart {
    /// Ours beside the peers
    Comparison,
    /// Ours at HSIM's tolerances
    Loose,
    /// Many patches; many pairs
    Scaling,
}

impl EigenBench {
    /// Measures, and writes `eigen.md` with its chart and tables.
    /// Peers that can't run are left out, and said.
    pub fn run(&self) -> Result<()> {
        fs::create_dir_all(&self.output).with_context(|| self.output.display().to_string())?;
        let folder = kept::folder("eigen")?;
        let mut page = EigenPage {
            options: self,
            comparison: Vec::new(),
            loose: None,
            scaling: Vec::new(),
            versions: String::new(),
        };
        if self.parts.contains(&EigenPart::Scaling) {
            page.scaling = scaling::tables(&self.meshes, &self.scaling, self.patches, &folder)?.into();
            page.write()?;
        }
        if self.parts.contains(&EigenPart::Loose) {
            page.loose = Some(loose::table(&self.meshes, &folder)?);
            page.write()?;
        }
        if self.parts.contains(&EigenPart::Comparison) {
            self.compare(&folder, &mut page)?;
        }
        println!("written: {}", self.output.join("eigen.md").display());
        Ok(())
    }

    /// Ours and the peers on all problems.
    fn compare(&self, folder: &Path, page: &mut EigenPage<'_>) -> Result<()> {
        let files = problem::files(&self.meshes, &self.only)?;
        let problems = files.iter().map(|path| EigenProblem::of_file(path, folder));
        let problems: Vec<EigenProblem> = problems.collect::<Result<_>>()?;
        let peers = EigenPeers::prepare(folder, self.limit);
        page.versions = peers.versions()?;
        for task in tasks(&self.counts) {
            for (i, problem) in problems.iter().enumerate() {
                // More pairs cost the peers minutes each: one mesh has to do.
                let with_peers = i == 0 || self.counts.first() == Some(&task.count);
                let all_peers = page.comparison.is_empty();
                page.comparison.extend(self.ours(problem, task)?);
                let wanted = |peer: &&EigenPeer| all_peers || with_peers && peer.everywhere;
                for peer in peers.all().filter(wanted) {
                    let rounds = 0..self.peer_rounds.max(1);
                    let outcomes = rounds.map(|round| peers.solve(peer, problem, task, round));
                    let outcomes: Vec<SolveOutcome> = outcomes.collect::<Result<_>>()?;
                    page.comparison
                        .push(measurement(problem, task, peer.name, &outcomes));
                }
                page.write()?;
            }
        }
        Ok(())
    }

    /// Ours on one thread and on two.
    fn ours(&self, problem: &EigenProblem, task: EigenTask) -> Result<[SolveMeasurement; 2]> {
        let on = |solver, threads| {
            let outcomes = (0..self.rounds.max(1)).map(|_| ours(&problem.laplacian, task, threads));
            let outcomes: Vec<SolveOutcome> =
                outcomes.collect::<Result<_>>().context(problem.name.clone())?;
            anyhow::Ok(measurement(problem, task, solver, &outcomes))
        };
        Ok([on(OURS, 1)?, on(OURS_ON_TWO, 2)?])
    }
}

/// What the rounds of a solver say; told, too.
fn measurement(
    problem: &EigenProblem,
    task: EigenTask,
    solver: &'static str,
    rounds: &[SolveOutcome],
) -> SolveMeasurement {
    let outcome = SolveOutcome::median(rounds);
    println!(
        "{}: {} pairs, {:e}, {solver}: {outcome}",
        problem.name, task.count, task.tolerance
    );
    SolveMeasurement {
        mesh: problem.name.clone(),
        vertices: problem.size(),
        task,
        solver,
        outcome,
    }
}

/// Those that take least first.
fn tasks(counts: &[usize]) -> Vec<EigenTask> {
    let to = |tolerance| move |&count: &usize| EigenTask { count, tolerance };
    let [coarse, fine] = TOLERANCES;
    let mut tasks: Vec<EigenTask> = counts.iter().map(to(coarse)).collect();
    tasks.extend(counts.first().map(to(fine)));
    tasks.sort_by_key(|task| task.count);
    tasks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_pairs_come_first_and_only_they_are_solved_to_both_tolerances() {
        let tasks: Vec<_> = tasks(&[325, 513])
            .iter()
            .map(|task| (task.count, task.tolerance))
            .collect();
        assert_eq!(tasks, [(325, 1e-6), (325, 1e-8), (513, 1e-6)]);
    }
}
