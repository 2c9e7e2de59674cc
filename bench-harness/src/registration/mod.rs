//! How often marked suspects come back onto their originals, how exactly, and in what time; beside peers.
//!
//! A *trial* is a kind of suspect (`trial.rs`), a *draw* one suspect of it in one random pose (`draw.rs`). `runs.rs` draws, `reading.rs` reads the
//! mark in the pose that was found and in the true one, `tables.rs` and `page.rs` write. `large.rs` takes the time of a million vertices,
//! `peers.rs` that of other programs.

mod draw;
mod large;
mod page;
mod peers;
mod reading;
mod runs;
mod tables;
mod trial;

use std::{
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::{Context, Result, bail};
use clap::Args;
use evaluation::{
    inputs::{is_chosen, mesh_files, name_of},
    python::Python,
    sources,
};
use mesh_io::Asset;

use self::{runs::MeshRuns, trial::PoseTrial};
use crate::{kept, suspects::another};

/// What to measure, and on what.
#[derive(Args)]
pub struct RegistrationBench {
    /// Mesh files
    #[arg(long, value_name = "DIR")]
    pub meshes: PathBuf,
    /// Only files whose name begins so; may be given again
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Only attacks whose name begins so; may be given again
    #[arg(long, value_name = "NAME")]
    pub attack: Vec<String>,
    /// Random poses of each mesh after each attack
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub draws: u64,
    /// Meshes with more vertices are passed over
    #[arg(long, value_name = "N", default_value_t = usize::MAX, hide_default_value = true)]
    pub most_vertices: usize,
    /// Begin no draw after so many minutes, and write what there is; 0: what is finished
    #[arg(long, value_name = "MINUTES")]
    pub minutes: Option<f64>,
    /// Leave out the peers, and the times of a million vertices
    #[arg(long)]
    pub no_peers: bool,
}

impl RegistrationBench {
    /// Draws from the smallest mesh to the largest, and writes `results/registration.md` and `registration.csv`.
    pub fn run(&self) -> Result<()> {
        let attacks = Python::prepare()?;
        let begin = Instant::now();
        let seconds = self.minutes.map_or(f64::INFINITY, |minutes| 60.0 * minutes);
        let may_begin = || begin.elapsed().as_secs_f64() < seconds;
        let code = sources::digest_of_all_but(&NO_PART_IN_DRAWS)?;
        let folder = kept::folder(&format!("registration/{code}"))?;
        let files = by_size(mesh_files(&self.meshes)?)?;
        let trials = PoseTrial::all().filter(|trial| is_chosen(trial.name(), &self.attack));
        let trials: Vec<PoseTrial> = trials
            .filter(|trial| !trial.is_stranger() || files.len() > 1)
            .collect();
        if files.len() == 1 {
            println!("One model alone: left out, as there is no other that may not align.");
        }
        let mut draws = Vec::new();
        for (i, path) in files.iter().enumerate() {
            if !is_chosen(&name_of(path), &self.only) {
                continue;
            }
            let original = Asset::open(path)?.mesh().clone();
            if original.vertex_count() > self.most_vertices {
                continue;
            }
            let mut runs = MeshRuns {
                name: name_of(path),
                original: &original,
                // Not a neighbour: those by size may be versions of one model.
                stranger: another(i, 4, files.len()).map(|other| files[other].as_path()),
                attacks: &attacks,
                folder: folder.clone(),
                prepared: None,
                may_begin: &may_begin,
            };
            draws.extend(runs.all(&trials, self.draws)?);
        }
        if draws.is_empty() {
            bail!("{}: no draws of meshes of such names", self.meshes.display());
        }
        let peers = if self.no_peers {
            String::new()
        } else {
            large::run(&files, &attacks)? + &peers::run(&files, &attacks)?
        };
        page::write(&draws, &attacks, &peers, &code)
    }
}

/// What has no part in a draw. All else of the sources has, so that nothing is forgotten that comes.
const NO_PART_IN_DRAWS: [&str; 12] = [
    "crates/baselines",
    "crates/cli",
    "crates/evaluation/src/pages",
    "bench-harness/src/eigen",
    "bench-harness/src/partition",
    "bench-harness/src/quality",
    "bench-harness/src/registration/large.rs",
    "bench-harness/src/registration/page.rs",
    "bench-harness/src/registration/peers.rs",
    "bench-harness/src/registration/tables.rs",
    "bench-harness/src/seconds",
    "bench-harness/src/security",
];

/// The smallest file first.
fn by_size(files: Vec<PathBuf>) -> Result<Vec<PathBuf>> {
    let size = |path: &Path| fs::metadata(path).with_context(|| path.display().to_string());
    let mut sized = Vec::new();
    for path in files {
        sized.push((size(&path)?.len(), path));
    }
    sized.sort();
    Ok(sized.into_iter().map(|(_, path)| path).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_part_in_draws_is_there() {
        for path in NO_PART_IN_DRAWS {
            assert!(evaluation::process::root().join(path).exists(), "{path}");
        }
    }
}
