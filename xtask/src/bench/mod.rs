//! Ours beside the peers, on the same inputs in one run.

mod chart;
mod eigen;
mod measure;
mod partition;
mod peers;

use std::path::PathBuf;

use anyhow::Result;
use clap::Subcommand;

#[derive(Subcommand)]
pub(crate) enum Bench {
    /// Partitioner beside METIS 5.1 and KaFFPa-strong: cut, balance, volume, connection, time, fill
    ///
    /// Needs gpmetis and ndmetis (Debian: apt-get install metis). Finished peer cells are kept in .cache/bench.
    Partition {
        /// METIS graph files, .graph or .graph.gz
        #[arg(long, value_name = "DIR")]
        graphs: PathBuf,
        /// Mesh files; their edges are graphs too
        #[arg(long, value_name = "DIR")]
        meshes: PathBuf,
        /// Times are medians over so many rounds
        #[arg(long, default_value_t = 3)]
        rounds: usize,
        /// Leave KaFFPa-strong out: it takes a hundred times as long as the others
        #[arg(long)]
        no_kaffpa: bool,
    },
    /// Eigen-solver beside ARPACK, Spectra, LOBPCG and faer's Lanczos; at loose tolerances; on many patches, for many pairs
    ///
    /// Makes a Python environment in bench-harness/.venv, and compiles bench-harness/peers/spectra.cpp. What is missing is left out, and
    /// said. Finished peer cells are kept in .cache/bench/eigen, so that a run that was interrupted goes on; remove that folder to
    /// measure all anew.
    Eigen(eigen::Options),
    /// Solve one problem in a process of its own, for `eigen`
    #[command(hide = true)]
    Solve(eigen::Alone),
}

pub(crate) fn run(bench: Bench) -> Result<()> {
    match bench {
        Bench::Partition {
            graphs,
            meshes,
            rounds,
            no_kaffpa,
        } => partition::run(&graphs, &meshes, rounds.max(1), !no_kaffpa),
        Bench::Eigen(options) => eigen::run(&options),
        Bench::Solve(alone) => eigen::solve_alone(&alone),
    }
}
