//! Our solver, in this process or in one of its own.

use std::{path::PathBuf, process::Command};

use anyhow::{Context, Result, bail};
use clap::Args;
use evaluation::{machine::peak_memory, process::output};
use job::Job;
use mhb_core::{Laplacian, Spectrum, SpectrumOptions};
use serde::{Deserialize, Serialize};

use super::{
    lanczos::faer_lanczos,
    matrices::read_matrices,
    problem::EigenProblem,
    residual::worst_residual,
    task::{EigenTask, SolveOutcome},
};
use crate::measure::{Cost, timed};

/// Ours, in this process.
pub(crate) fn ours(laplacian: &Laplacian, task: EigenTask, threads: usize) -> Result<SolveOutcome> {
    let options = SpectrumOptions {
        count: task.count,
        tolerance: task.tolerance,
        ..Default::default()
    };
    let (spectrum, Cost { cpu, wall }) =
        timed(|| Spectrum::of_laplacian(laplacian, &options, &Job::new(threads)));
    let spectrum = spectrum?;
    let residual = worst_residual(laplacian, spectrum.eigenvalues(), |k| spectrum.eigenfunction(k));
    Ok(SolveOutcome::Done { cpu, wall, residual })
}

/// One problem for a process of its own, which can be stopped, and whose memory can be told from others'.
#[derive(Args)]
pub struct LoneSolve {
    /// `ours` or `faer`
    pub solver: String,
    /// Folder with the matrices
    pub matrices: PathBuf,
    /// How many pairs
    pub count: usize,
    /// How accurate
    pub tolerance: f64,
}

/// What [`LoneSolve::run`] prints, as JSON.
#[derive(Serialize, Deserialize)]
struct LoneReport {
    #[serde(flatten)]
    outcome: SolveOutcome,
    /// The most memory that the process held, in bytes.
    peak: Option<u64>,
}

impl LoneSolve {
    /// Solves on one thread and prints what it cost, in seconds and bytes, and the worst residual, as JSON.
    pub fn run(&self) -> Result<()> {
        let laplacian = read_matrices(&self.matrices)?;
        let &Self { count, tolerance, .. } = self;
        let outcome = match self.solver.as_str() {
            "ours" => ours(&laplacian, EigenTask { count, tolerance }, 1)?,
            "faer" => {
                let (pairs, Cost { cpu, wall }) = timed(|| faer_lanczos(&laplacian, count, tolerance));
                let (eigenvalues, functions) = pairs?;
                let residual = worst_residual(&laplacian, &eigenvalues, |k| functions.col_as_slice(k));
                SolveOutcome::Done { cpu, wall, residual }
            }
            other => bail!("{other}: no such solver"),
        };
        let peak = peak_memory();
        println!("{}", serde_json::to_string(&LoneReport { outcome, peak })?);
        Ok(())
    }
}

/// [`LoneSolve::run`] by ours: what it cost, and the most memory that the process held, in bytes.
pub(crate) fn ours_alone(problem: &EigenProblem, task: EigenTask) -> Result<(SolveOutcome, Option<u64>)> {
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["bench", "solve", "ours"]).arg(&problem.matrices);
    command.args([task.count.to_string(), task.tolerance.to_string()]);
    let report: LoneReport = serde_json::from_str(&output(&mut command)?).context("our own report")?;
    Ok((report.outcome, report.peak))
}
