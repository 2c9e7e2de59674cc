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
mod suspects;
mod tables;
mod trial;

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use anyhow::{Context, Result, bail};
use evaluation::{
    inputs::{mesh_files, name_of},
    python::Python,
    sources,
};
use mesh_io::Asset;

use self::{runs::MeshRuns, trial::PoseTrial};
use crate::{kept, selection::is_chosen};

/// What to measure.
pub struct RegistrationBench {
    /// Folder with mesh files.
    pub meshes: PathBuf,
    /// Beginnings of the names of those that are taken; all if empty.
    pub only: Vec<String>,
    /// Beginnings of the names of trials; all if empty.
    pub attacks: Vec<String>,
    /// Random poses of each mesh after each attack.
    pub draws: u64,
    /// Larger meshes are passed over.
    pub most_vertices: usize,
    /// Whether peers are timed, and a million vertices.
    pub with_peers: bool,
    /// No draw begins later after the start.
    pub time: Option<Duration>,
}

impl RegistrationBench {
    /// Draws from the smallest mesh to the largest, and writes `results/registration.md` and `registration.csv`.
    ///
    /// # Errors
    /// When there is no Python for the attacks, a file can't be read or written, or there are no draws.
    pub fn run(&self) -> Result<()> {
        let attacks = Python::prepare()?;
        let begin = Instant::now();
        let code = digest_of_code()?;
        let folder = kept::folder(&format!("registration/{code}"))?;
        let files = by_size(mesh_files(&self.meshes)?)?;
        let trials: Vec<PoseTrial> = PoseTrial::all()
            .filter(|trial| is_chosen(trial.name(), &self.attacks))
            .collect();
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
                stranger: &files[(i + 4) % files.len()],
                attacks: &attacks,
                folder: folder.clone(),
                prepared: None,
                may_begin: &|| self.time.is_none_or(|time| begin.elapsed() < time),
            };
            draws.extend(runs.all(&trials, self.draws)?);
        }
        if draws.is_empty() {
            bail!("{}: no draws of meshes of such names", self.meshes.display());
        }
        let peers = if self.with_peers {
            large::run(&files, &attacks)? + &peers::run(&files, &attacks)?
        } else {
            String::new()
        };
        page::write(&draws, &attacks, &peers, &code)
    }
}

/// The digest of what finished draws depend on.
fn digest_of_code() -> Result<String> {
    sources::digest_of(
        &["mesh", "partition", "mhb-core", "registration", "sigmark"],
        &["bench-harness/src/registration/runs.rs"],
    )
}

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
