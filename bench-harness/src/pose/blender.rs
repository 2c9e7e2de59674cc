//! Blender, as a Python package, in a process of its own.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use evaluation::{
    process::{output_within, root},
    python::Python,
    sources::digest,
};
use serde_json::json;

use super::models::{By, Pose};
use crate::results;

/// Seconds that a model's poses may take together.
const LIMIT: u64 = 3600;

/// Blender, and where what it made is kept.
pub(super) struct Blender {
    python: Python,
    folder: PathBuf,
}

impl Blender {
    pub(super) fn prepare(folder: &Path) -> Result<Self> {
        let scripts = root().join("bench-harness/peers/pose");
        let python = Python::prepare_in(scripts, folder.join("venv"))
            .context("Blender's package (bpy 5.0) is built for Python 3.11 alone")?;
        let folder = folder.join("suspects");
        fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        Ok(Self { python, folder })
    }

    /// Keeps a signed file's bytes under the name of its model, what they are, and the original's ending.
    pub(super) fn keep(&self, name: &str, original: &Path, bytes: &[u8]) -> Result<PathBuf> {
        let ending = original.extension().unwrap_or_default().to_string_lossy();
        let name = format!("{}-{}.{ending}", file_name(name), digest(bytes));
        let path = self.folder.join(name);
        results::write(&path, bytes)?;
        Ok(path)
    }

    /// A scan, given as a PLY file, with a skeleton.
    pub(super) fn rigged(&self, name: &str, ply: &[u8]) -> Result<PathBuf> {
        let script = fs::read(self.python.scripts().join("rig.py"))?;
        let inputs = digest(&[ply, &script].concat());
        let named = |ending: &str| self.folder.join(format!("{}-{inputs}.{ending}", file_name(name)));
        let (source, partial, target) = (named("ply"), named("partial.glb"), named("glb"));
        if !target.is_file() {
            results::write(&source, ply)?;
            self.python.run("rig.py", [&source, &partial])?;
            fs::rename(&partial, &target).with_context(|| target.display().to_string())?;
        }
        Ok(target)
    }

    /// The first and the last frame of each animation of a file.
    pub(super) fn animations(&self, model: &Path) -> Result<Vec<[i64; 2]>> {
        let printed = self
            .python
            .run("pose.py", [model.as_os_str(), "--animations".as_ref()])?;
        let line = printed.lines().find_map(|line| line.strip_prefix("animations "));
        let line =
            line.with_context(|| format!("{}: Blender says nothing of animations", model.display()))?;
        Ok(serde_json::from_str(line)?)
    }

    /// A model in those poses that Blender makes; none where it is not asked, or failed. What it made before is taken as it is.
    pub(super) fn pose(&self, model: &Path, poses: &[Pose]) -> Result<Vec<Option<PathBuf>>> {
        let script = fs::read(self.python.scripts().join("pose.py"))?;
        let of_model = fs::read(model).with_context(|| model.display().to_string())?;
        let inputs = digest(&[of_model, script].concat());
        let file_of = |pose: &Pose| match &pose.by {
            By::Blender { format, .. } => {
                let name = digest(format!("{inputs} {}", pose.key()).as_bytes());
                Some(self.folder.join(format!("{name}.{format}")))
            }
            By::Own { .. } | By::Handles { .. } => None,
        };
        let files: Vec<Option<PathBuf>> = poses.iter().map(file_of).collect();
        let asked = poses
            .iter()
            .zip(&files)
            .filter_map(|(pose, file)| match (&pose.by, file) {
                (By::Blender { pose, after, .. }, Some(file)) if !file.is_file() => {
                    Some(json!({"output": file, "pose": pose, "after": after}))
                }
                _ => None,
            });
        let asked: Vec<_> = asked.collect();
        if !asked.is_empty() {
            let list = self.folder.join(format!("{inputs}.json"));
            results::write(&list, serde_json::to_string(&asked)?)?;
            let command = self.python.command("pose.py", [model, &list]);
            match output_within(LIMIT, &command) {
                Ok(Some(_)) => {}
                Ok(None) => eprintln!("{}: Blender took more than {LIMIT} s", model.display()),
                Err(error) => eprintln!("{}: {error:#}", model.display()),
            }
        }
        Ok(files
            .into_iter()
            .map(|file| file.filter(|file| file.is_file()))
            .collect())
    }

    pub(super) fn versions(&self) -> Result<String> {
        self.python.versions()
    }
}

fn file_name(model: &str) -> String {
    model.replace(' ', "-")
}
