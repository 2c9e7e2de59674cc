//! `cargo xtask bench partition`, and its helper `divide`

use std::path::PathBuf;

use anyhow::Result;
use bench_harness::partition::{LoneDivision, PartitionBench};
use clap::Args;

#[derive(Args)]
pub(crate) struct Partition {
    /// METIS graph files, .graph or .graph.gz
    #[arg(long, value_name = "DIR")]
    graphs: PathBuf,
    /// Mesh files; their edges are graphs too
    #[arg(long, value_name = "DIR")]
    meshes: PathBuf,
    /// Times are medians over so many rounds
    #[arg(long, value_name = "N", default_value_t = 3)]
    rounds: usize,
    /// Leave KaFFPa-strong out: it takes a hundred times as long as the others
    #[arg(long)]
    no_kaffpa: bool,
}

impl Partition {
    pub(crate) fn run(self) -> Result<()> {
        PartitionBench {
            graphs: self.graphs,
            meshes: self.meshes,
            rounds: self.rounds,
            with_kaffpa: !self.no_kaffpa,
        }
        .run()
    }
}

#[derive(Args)]
pub(crate) struct Divide {
    /// METIS graph file
    file: PathBuf,
    /// Into so many
    parts: usize,
}

impl Divide {
    pub(crate) fn run(self) -> Result<()> {
        LoneDivision {
            file: self.file,
            parts: self.parts,
        }
        .run()
    }
}
