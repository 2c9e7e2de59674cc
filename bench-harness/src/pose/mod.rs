//! Models in another pose: what is read of them by the paper's rule, by least squares and by `sigmark verify`; and by chance, where nobody marked them.
//!
//! `models.rs` says which models, with which skeletons, in which poses; `blender.rs`, `skinning.rs` and `handles.rs` pose them; `reading.rs` reads; `null.rs` asks unmarked copies; `page.rs` writes.

mod blender;
mod handles;
mod models;
mod null;
mod page;
mod reading;
mod skinning;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args;
use evaluation::{
    inputs::{is_chosen, mesh_files, name_of},
    python::Python,
    sources,
};
use mesh_io::Asset;
use serde::{Deserialize, Serialize};

use crate::kept::{self, Key};
use blender::Blender;
use models::{Model, Pose};
use null::NullCopy;
use reading::{Read, Signed};

/// What to pose, and how much of it.
#[derive(Args)]
pub struct PoseBench {
    /// Scans, which are given a skeleton
    #[arg(long, value_name = "DIR")]
    pub meshes: PathBuf,
    /// Models with skeletons and morph targets of their own
    #[arg(long, value_name = "DIR")]
    pub assets: PathBuf,
    /// Only models whose name begins so; may be given again [default: all of the page]
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Of each animation every so manieth frame
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub every: usize,
    /// Random words that are asked of each unmarked copy
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    pub trials: usize,
}

/// A suspect in a pose, by each of [`reading::ALGORITHMS`].
#[derive(Serialize, Deserialize)]
struct Row {
    pose: Pose,
    vertices: usize,
    /// None where the suspect could not be made.
    read: Option<Vec<Read>>,
}

/// What was found of one model.
#[derive(Serialize, Deserialize)]
struct Found {
    name: String,
    vertices: usize,
    joints: usize,
    targets: usize,
    payload: String,
    rows: Vec<Row>,
    null: Vec<NullCopy>,
    /// Whether no suspect failed.
    is_whole: bool,
}

/// A model's file, and where what was found of it is kept.
struct Original<'a> {
    model: &'a Model,
    asset: Asset,
    path: &'a Path,
    finished: &'a Path,
}

impl Original<'_> {
    fn key(&self, what: &str) -> Key {
        Key::new(format!("{}-{what}", self.model.name)).of_asset(&self.asset)
    }
}

impl PoseBench {
    /// Signs, poses, verifies, and writes `results/pose.md`, its CSV and its pictures.
    pub fn run(&self) -> Result<()> {
        ensure!(self.every > 0, "--every takes a number from 1 on");
        let attacks = Python::prepare()?;
        let code = sources::digest_of_all_but(&NO_PART)?;
        let folder = kept::folder("pose")?;
        let blender = Blender::prepare(&folder)?;
        let finished = kept::folder(&format!("pose/{code}"))?;
        let mut found = Vec::new();
        for model in models::all().filter(|model| is_chosen(model.name, &self.only)) {
            let original = model.make(&self.file_of(&model)?, &blender, &attacks)?;
            let original = Original {
                model: &model,
                asset: Asset::open(&original)?,
                path: &original,
                finished: &finished,
            };
            let key = original.key(&format!("{}-{}", self.every, self.trials));
            let figures = || self.of_model(&original, &blender, &attacks);
            found.push(kept::figures_if(
                &finished,
                &key,
                |found| found.is_whole,
                figures,
            )?);
            if let Some(pose) = model.drawn {
                page::picture(&original, pose, &blender)?;
            }
        }
        ensure!(!found.is_empty(), "no model has a name that was asked for");
        page::write(&found, self, &blender, &code)
    }

    /// The file that a model is made of.
    fn file_of(&self, model: &Model) -> Result<PathBuf> {
        let folder = match model.is_asset {
            true => &self.assets,
            false => &self.meshes,
        };
        let files = mesh_files(folder)?;
        let found = files
            .into_iter()
            .find(|path| name_of(path).starts_with(model.file));
        found.with_context(|| format!("{}: no file there begins with {}", folder.display(), model.file))
    }

    /// Signs a model, poses it, and reads each suspect that no earlier run has read.
    fn of_model(&self, original: &Original<'_>, blender: &Blender, attacks: &Python) -> Result<Found> {
        let Original { model, asset, .. } = original;
        let signed = Signed::new(asset)?;
        let marked = blender.keep(model.name, original.path, &signed.file(asset)?)?;
        let animations = match model.is_animated {
            true => blender.animations(original.path)?,
            false => Vec::new(),
        };
        let poses: Vec<Pose> = model.poses(&animations, self.every).collect();
        let posed = blender.pose(&marked, &poses)?;
        let mut rows = Vec::new();
        for (pose, file) in poses.into_iter().zip(posed) {
            let key = original.key("pose").of(pose.key().as_bytes());
            let is_read = |row: &Row| row.read.is_some();
            let read = || Ok(read(model, pose, file.as_deref(), &signed, attacks));
            rows.push(kept::figures_if(original.finished, &key, is_read, read)?);
        }
        let key = original.key(&format!("null-{}", self.trials));
        let none_failed = |null: &Vec<NullCopy>| null.len() == null::count(model, &signed);
        let null = || null::of(model, original.path, &signed, blender, self.trials);
        let null = kept::figures_if(original.finished, &key, none_failed, null)?;
        Ok(Found {
            name: model.name.into(),
            vertices: asset.mesh().vertex_count(),
            joints: signed.rig().map_or(0, mesh::Rig::joints),
            targets: signed.rig().map_or(0, |rig| rig.targets().len()),
            payload: signed.payload(),
            is_whole: rows.iter().all(|row| row.read.is_some()) && none_failed(&null),
            rows,
            null,
        })
    }
}

/// Reads a suspect, and says what comes of it.
fn read(model: &Model, pose: Pose, file: Option<&Path>, signed: &Signed, attacks: &Python) -> Row {
    let suspect = pose.suspect(signed, file);
    let suspect = suspect.and_then(|suspect| pose.attacked(suspect, attacks, model.name));
    let read = suspect.and_then(|suspect| Ok((suspect.vertex_count(), signed.read(&suspect)?)));
    let (vertices, read) = match read {
        Ok((vertices, read)) => (vertices, Some(read)),
        Err(error) => {
            eprintln!("{}: {pose}: {error:#}", model.name);
            (0, None)
        }
    };
    let ours = read.as_ref().and_then(|read: &Vec<Read>| read.last());
    let ours = ours.map_or("-".into(), ToString::to_string);
    println!("{}: {pose}: {ours}", model.name);
    Row { pose, vertices, read }
}

/// What has no part in the figures.
const NO_PART: [&str; 14] = [
    "crates/baselines",
    "crates/cli",
    "crates/evaluation/src/pages",
    "crates/library",
    "crates/sigmark/tests",
    "bench-harness/src/code",
    "bench-harness/src/eigen",
    "bench-harness/src/formats",
    "bench-harness/src/library",
    "bench-harness/src/partition",
    "bench-harness/src/pose/page.rs",
    "bench-harness/src/registration",
    "bench-harness/src/robustness",
    "bench-harness/src/security",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_part_is_there() {
        kept::assert_is_there(&NO_PART);
    }

    #[test]
    fn no_model_has_a_pose_twice() {
        for model in models::all() {
            let mut poses: Vec<String> = model.poses(&[[1, 9]], 1).map(|pose| pose.key()).collect();
            let count = poses.len();
            poses.sort();
            poses.dedup();
            assert_eq!(poses.len(), count, "{}", model.name);
        }
    }
}
