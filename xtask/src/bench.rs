//! Ours beside the peers, on the same inputs in one run.

use std::{path::PathBuf, time::Duration};

use anyhow::Result;
use bench_harness::{eigen, partition, quality, registration};
use clap::Subcommand;

#[derive(Subcommand)]
pub(crate) enum Bench {
    /// Partitioner beside METIS 5.1 and KaFFPa-strong: cut, balance, volume, connection, time, memory, fill
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
    /// Divide one graph in a process of its own, for `partition`
    #[command(hide = true)]
    Divide(partition::Alone),
    /// Registration: how often, how exactly and how fast attacked and moved meshes come back; beside its peers
    ///
    /// Makes Python environments in attacks/.venv and bench-harness/.venv. Goes from the smallest mesh to the largest. Finished
    /// draws are kept in .cache/bench/registration, so that a run that was interrupted goes on; delete it after a change of the program.
    Registration {
        /// Mesh files
        #[arg(long, value_name = "DIR")]
        meshes: PathBuf,
        /// Only files whose name begins so; may be repeated
        #[arg(long, value_name = "NAME")]
        only: Vec<String>,
        /// Only attacks whose name begins so; may be repeated
        #[arg(long, value_name = "NAME")]
        attack: Vec<String>,
        /// Random poses of each mesh after each attack
        #[arg(long, default_value_t = 20)]
        draws: u64,
        /// Meshes with more vertices are passed over
        #[arg(long, default_value_t = usize::MAX, hide_default_value = true)]
        most_vertices: usize,
        /// Begin no draw after so many minutes, and write what there is; 0: what is finished
        #[arg(long, value_name = "MINUTES")]
        minutes: Option<f64>,
        /// Leave out the peers, and the times of a million vertices
        #[arg(long)]
        no_peers: bool,
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
        Bench::Eigen(options) => eigen::run(&options),
        Bench::Solve(alone) => eigen::solve_alone(&alone),
        Bench::Divide(alone) => partition::divide_alone(&alone),
        Bench::Registration {
            meshes,
            only,
            attack,
            draws,
            most_vertices,
            minutes,
            no_peers,
        } => {
            let bench = registration::RegistrationBench {
                meshes,
                only,
                attacks: attack,
                draws,
                most_vertices,
                with_peers: !no_peers,
                time: minutes
                    .map(|minutes| Duration::try_from_secs_f64(60.0 * minutes))
                    .transpose()?,
            };
            bench.run()
        }
        Bench::Quality { meshes, only, rounds } => quality::run(&meshes, &only, rounds.max(1)),
    }
}
