//! `cargo xtask pictures`

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

#[derive(Args)]
pub(crate) struct Pictures {
    /// The folder with igea_134k.ply.gz, ct_skull_1081k_closed.ply.gz and armadillo_43k.ply.gz; what is missing is left out
    #[arg(long, value_name = "DIR")]
    meshes: PathBuf,
}

impl Pictures {
    pub(crate) fn run(&self) -> Result<()> {
        evaluation::pictures::run(&self.meshes)
    }
}
