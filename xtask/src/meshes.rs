//! `cargo xtask meshes`

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

#[derive(Args)]
pub(crate) struct Meshes {
    /// The folder; files in it that are no meshes are passed over
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Meshes with more vertices are passed over
    #[arg(long, value_name = "N", default_value_t = 50_000)]
    most_vertices: usize,
    /// Only cut them into patches, whatever their size, and look at these
    #[arg(long, conflicts_with = "most_vertices")]
    patches_only: bool,
}

impl Meshes {
    pub(crate) fn run(&self) -> Result<()> {
        if self.patches_only {
            evaluation::patches::run(&self.folder)
        } else {
            evaluation::meshes::run(&self.folder, self.most_vertices)
        }
    }
}
