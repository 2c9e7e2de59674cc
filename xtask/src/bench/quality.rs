//! `cargo xtask bench quality`

use std::path::PathBuf;

use anyhow::Result;
use bench_harness::quality::QualityBench;
use clap::Args;

#[derive(Args)]
pub(crate) struct Quality {
    /// Mesh files; those with more than 140 000 vertices are passed over
    #[arg(long, value_name = "DIR")]
    meshes: PathBuf,
    /// Only files whose name begins so; may be given again
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Times are medians over so many rounds
    #[arg(long, value_name = "N", default_value_t = 3)]
    rounds: usize,
}

impl Quality {
    pub(crate) fn run(self) -> Result<()> {
        QualityBench {
            meshes: self.meshes,
            only: self.only,
            rounds: self.rounds,
        }
        .run()
    }
}
