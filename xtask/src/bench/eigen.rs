//! `cargo xtask bench eigen`, and its helper `solve`

use std::path::PathBuf;

use anyhow::Result;
use bench_harness::eigen::{EigenBench, EigenPart, LoneSolve, MESHES};
use clap::{Args, ValueEnum};
use evaluation::process::root;

#[derive(Args)]
pub(crate) struct Eigen {
    /// Mesh files; of one with more than 60 000 vertices, the largest patch is taken
    #[arg(long, value_name = "DIR")]
    meshes: PathBuf,
    /// Files whose name begins so, in this order; may be given again
    #[arg(long, value_name = "NAME", default_values = MESHES)]
    only: Vec<String>,
    /// Numbers of pairs; the first to 1e-6 and 1e-8, the others to 1e-6, and by the peers on the first mesh alone
    #[arg(long, value_delimiter = ',', default_value = "325,513")]
    counts: Vec<usize>,
    /// Our times are medians over so many rounds
    #[arg(long, value_name = "N", default_value_t = 3)]
    rounds: usize,
    /// And the peers' over so many
    #[arg(long, value_name = "N", default_value_t = 1)]
    peer_rounds: usize,
    /// A peer is stopped after so many CPU seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 900)]
    limit: u64,
    /// What to measure; all unless said
    #[arg(long, value_delimiter = ',', default_value = "comparison,loose,scaling")]
    parts: Vec<Part>,
    /// The mesh that is cut into patches for the scaling
    #[arg(long, value_name = "NAME", default_value = "ct_skull_1081k_closed")]
    scaling: String,
    /// Into so many
    #[arg(long, value_name = "N", default_value_t = 33)]
    patches: usize,
    /// Where the tables and the chart go; results/ without it
    #[arg(long, value_name = "DIR")]
    output: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Part {
    /// Ours beside the peers
    Comparison,
    /// Ours at HSIM's tolerances
    Loose,
    /// Many patches; many pairs
    Scaling,
}

impl Eigen {
    pub(crate) fn run(self) -> Result<()> {
        let part = |part| match part {
            Part::Comparison => EigenPart::Comparison,
            Part::Loose => EigenPart::Loose,
            Part::Scaling => EigenPart::Scaling,
        };
        EigenBench {
            meshes: self.meshes,
            only: self.only,
            counts: self.counts,
            rounds: self.rounds,
            peer_rounds: self.peer_rounds,
            limit: self.limit,
            parts: self.parts.into_iter().map(part).collect(),
            scaling: self.scaling,
            patches: self.patches,
            output: self.output.unwrap_or_else(|| root().join("results")),
        }
        .run()
    }
}

#[derive(Args)]
pub(crate) struct Solve {
    /// ours or faer
    solver: String,
    /// Folder with the matrices
    matrices: PathBuf,
    /// How many pairs
    count: usize,
    /// How accurate
    tolerance: f64,
}

impl Solve {
    pub(crate) fn run(self) -> Result<()> {
        LoneSolve {
            solver: self.solver,
            matrices: self.matrices,
            count: self.count,
            tolerance: self.tolerance,
        }
        .run()
    }
}
