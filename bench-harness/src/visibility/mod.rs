//! What one sees of a mark, and what is read of it: layouts beside each other on the same models.
//!
//! `layouts.rs` has the layouts, `trial.rs` what is measured of one on a model; `page.rs` writes.

mod layouts;
mod page;
mod trial;

use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::Args;
use evaluation::{
    inputs::{is_chosen, mesh_files, name_of},
    python::Python,
    sources,
};
use mesh_io::Asset;

pub use layouts::TriedLayout;

use crate::kept;

/// Which models, layouts and attacks.
#[derive(Args)]
pub struct VisibilityBench {
    /// A folder of mesh files; may be given again
    #[arg(long, value_name = "DIR", required = true)]
    pub meshes: Vec<PathBuf>,
    /// Only files whose name begins so; may be given again
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Meshes with more vertices are not attacked
    #[arg(long, value_name = "N", default_value_t = 200_000)]
    pub most_vertices: usize,
    /// A layout as KIND:PATCHES:CHIP_RATE:RMS, such as free:2:3:4e-4, or pooled:auto:auto:4e-4; may be given again [default: those of the page]
    #[arg(long, value_name = "LAYOUT")]
    pub layout: Vec<TriedLayout>,
    /// Only what is seen, without attacks
    #[arg(long)]
    pub no_attacks: bool,
}

impl VisibilityBench {
    /// Measures, and writes `results/visibility.md` and `visibility.csv`.
    pub fn run(&self) -> Result<()> {
        let attacks = if self.no_attacks {
            None
        } else {
            Some(Python::prepare()?)
        };
        let code = sources::digest_of_all_but(&NO_PART)?;
        let folder = kept::folder(&format!("visibility/{code}"))?;
        let layouts = match &self.layout[..] {
            [] => layouts::PAGE.to_vec(),
            given => given.to_vec(),
        };
        let mut trials = Vec::new();
        let mut files = Vec::new();
        for folder in &self.meshes {
            files.extend(mesh_files(folder)?);
        }
        files.retain(|file| self.only.is_empty() || is_chosen(&name_of(file), &self.only));
        ensure!(!files.is_empty(), "no such mesh file there");
        for file in files {
            let (name, asset) = (name_of(&file), Asset::open(&file)?);
            let few = asset.mesh().vertex_count() <= self.most_vertices;
            let attacks = attacks.as_ref().filter(|_| few);
            for layout in &layouts {
                let shown = layout.to_string().replace(':', "-");
                let kept = format!("{name}-{shown}-{}", attacks.is_some());
                trials.push(kept::figures(&folder, &kept, || {
                    trial::of(&name, asset.mesh(), layout, attacks)
                })?);
            }
        }
        page::write(&trials, attacks.as_ref(), &code)
    }
}

/// What has no part in the figures.
const NO_PART: [&str; 11] = [
    "crates/baselines",
    "crates/cli",
    "crates/evaluation/src/pages",
    "crates/sigmark/tests",
    "bench-harness/src/eigen",
    "bench-harness/src/partition",
    "bench-harness/src/quality",
    "bench-harness/src/registration",
    "bench-harness/src/seconds",
    "bench-harness/src/security",
    "bench-harness/src/visibility/page.rs",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_part_is_there() {
        kept::assert_is_there(&NO_PART);
    }
}
