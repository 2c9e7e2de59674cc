//! Ours beside the peers, on the same inputs in one run.

mod chart;
mod eigen;
mod measure;
mod partition;
mod peers;
mod quality;

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
    /// Eigen-solver beside ARPACK (with SuperLU, with CHOLMOD) and LOBPCG, through scipy
    ///
    /// Makes a Python environment in bench-harness/.venv. Finished peer cells are kept in .cache/bench.
    Eigen {
        /// Mesh files; of one with more than 60 000 vertices, the largest patch is taken
        #[arg(long, value_name = "DIR")]
        meshes: PathBuf,
        /// Only files whose name begins so; may be repeated
        #[arg(long, value_name = "NAME")]
        only: Vec<String>,
        /// Numbers of pairs
        #[arg(long, value_delimiter = ',', default_value = "325,513")]
        counts: Vec<usize>,
        /// LOBPCG too: every step solves a dense problem of three times the pairs
        #[arg(long)]
        lobpcg: bool,
        /// Times are medians over so many rounds
        #[arg(long, default_value_t = 3)]
        rounds: usize,
    },
    /// Distances beside MeshLab's filter, Shape-DNA beside scipy and LaPy: figures and time
    ///
    /// Makes a Python environment in bench-harness/.venv. Finished peer cells are kept in .cache/bench.
    Quality {
        /// Mesh files; those with more than 140 000 vertices are passed over
        #[arg(long, value_name = "DIR")]
        meshes: PathBuf,
        /// Only files whose name begins so; may be repeated
        #[arg(long, value_name = "NAME")]
        only: Vec<String>,
        /// Times are medians over so many rounds
        #[arg(long, default_value_t = 3)]
        rounds: usize,
    },
}

pub(crate) fn run(bench: Bench) -> Result<()> {
    match bench {
        Bench::Partition {
            graphs,
            meshes,
            rounds,
            no_kaffpa,
        } => partition::run(&graphs, &meshes, rounds.max(1), !no_kaffpa),
        Bench::Eigen {
            meshes,
            only,
            counts,
            lobpcg,
            rounds,
        } => eigen::run(&meshes, &only, &counts, rounds.max(1), lobpcg),
        Bench::Quality { meshes, only, rounds } => quality::run(&meshes, &only, rounds.max(1)),
    }
}
