//! What removes a mark, and how often chance alone is taken for one.
//!
//! `marked.rs` has a model with its owner's mark and those who read it, `removal.rs` what an opponent does to it, `null.rs` the suspects that don't
//! bear it, `bounds.rs` what counts say of probabilities; `page.rs` writes.

mod bounds;
mod marked;
mod null;
mod page;
mod removal;

use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use clap::Args;
use evaluation::{
    inputs::{is_chosen, mesh_files, name_of},
    python::Python,
    sources,
};
use mesh::TriMesh;
use mesh_io::Asset;

use self::{marked::MarkedModel, null::NullPair, removal::Removal};
use crate::{
    kept::{self, Key},
    suspects::another,
};

/// The models of the page.
const MODELS: [&str; 4] = [
    "stanford_bunny_bun_zipper_36k",
    "stanford_bunny_closed_35k",
    "rocker_arm_10k",
    "horse_48k",
];

/// What to attack, and how long to try by chance.
#[derive(Args)]
pub struct SecurityBench {
    /// Mesh files
    #[arg(long, value_name = "DIR")]
    pub meshes: PathBuf,
    /// Only files whose name begins so; may be given again [default: two bunnies, the rocker arm, the horse]
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Random signatures that every suspect without the mark is asked for
    #[arg(long, value_name = "N", default_value_t = 2500)]
    pub trials: usize,
}

impl SecurityBench {
    /// Removes marks, looks for marks that are not there, and writes `results/security.md`, `security_removal.csv` and `security_null.csv`.
    pub fn run(&self) -> Result<()> {
        let attacks = Python::prepare()?;
        let code = sources::digest_of_all_but(&NO_PART)?;
        let folder = kept::folder(&format!("security/{code}"))?;
        let models = self.models()?;
        let mut removals: Vec<Removal> = Vec::new();
        let mut pairs: Vec<NullPair> = Vec::new();
        for (i, (name, mesh)) in models.iter().enumerate() {
            let marked = MarkedModel::new(name, mesh);
            let key = Key::new(format!("{name}-removal")).of_mesh(mesh);
            removals.extend(kept::figures(&folder, &key, || {
                removal::of(marked.get()?, &attacks)
            })?);
            let stranger = another(i, 1, models.len()).map(|other| &models[other].1);
            if stranger.is_none() {
                println!("{name}: the only model, so that no other is looked into for its mark");
            }
            pairs.extend(self.pairs(&marked, stranger, &folder, &attacks)?);
        }
        for (name, mesh, stranger) in null::shapes() {
            let marked = MarkedModel::new(name, &mesh);
            pairs.extend(self.pairs(&marked, Some(&stranger), &folder, &attacks)?);
        }
        page::write(&removals, &pairs, &attacks, &code)
    }

    /// All that a model's mark is looked for in without being there.
    fn pairs(
        &self,
        marked: &MarkedModel<'_>,
        stranger: Option<&TriMesh>,
        folder: &Path,
        attacks: &Python,
    ) -> Result<Vec<NullPair>> {
        let key = Key::new(format!("{}-null-{}", marked.name(), self.trials)).of_mesh(marked.mesh());
        let key = stranger.into_iter().fold(key, Key::of_mesh);
        kept::figures(folder, &key, || {
            null::of(marked.get()?, stranger, attacks, self.trials)
        })
    }

    fn models(&self) -> Result<Vec<(String, TriMesh)>> {
        let mut models = Vec::new();
        for path in mesh_files(&self.meshes)? {
            let name = name_of(&path);
            let chosen = match self.only[..] {
                [] => MODELS.contains(&name.as_str()),
                _ => is_chosen(&name, &self.only),
            };
            if chosen {
                models.push((name, Asset::open(&path)?.mesh().clone()));
            }
        }
        let shown = self.meshes.display();
        ensure!(
            !models.is_empty(),
            "{shown}: no mesh file there has a name that was asked for"
        );
        Ok(models)
    }
}

/// What has no part in the figures.
const NO_PART: [&str; 10] = [
    "crates/baselines",
    "crates/cli",
    "crates/evaluation/src/pages",
    "crates/sigmark/tests",
    "bench-harness/src/eigen",
    "bench-harness/src/partition",
    "bench-harness/src/quality",
    "bench-harness/src/registration",
    "bench-harness/src/seconds",
    "bench-harness/src/security/page.rs",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_part_is_there() {
        kept::assert_is_there(&NO_PART);
    }
}
