//! The meshes that stand for the paper's models.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use bench_harness::{mesh_files, name_of};
use mesh::{Asset, TriMesh};
use quality::picture::View;

use super::{
    paper::{self, Model},
    store::digest,
};

/// A mesh, and the model of the paper whose place it takes.
pub(crate) struct Standin {
    pub(crate) model: Model,
    /// The file's name up to its first point.
    pub(crate) file: String,
    /// Of the file's bytes.
    pub(crate) digest: String,
    pub(crate) mesh: TriMesh,
    /// For pictures.
    pub(crate) view: View,
}

const UP_Y: View = View {
    eye: [0.3, 0.1, 1.0],
    up: [0.0, 1.0, 0.0],
};

/// Which file of the folder stands for which model, and how it is looked at.
const CAST: [(Model, &str, View); 6] = [
    (paper::BUNNY, "stanford_bunny_bun_zipper_36k", UP_Y),
    (
        paper::TEDDY,
        "horse_48k",
        View {
            eye: [-1.0, 0.3, 0.2],
            up: [0.0, 0.0, 1.0],
        },
    ),
    (paper::LION, "igea_134k", UP_Y),
    (
        paper::ARMADILLO,
        "ct_skull_179k_boundary",
        View {
            eye: [0.55, -1.0, 0.3],
            up: [0.0, 0.0, 1.0],
        },
    ),
    (paper::EROS, "dragon_vrip_438k", UP_Y),
    (
        paper::DRAGON,
        "ct_skull_1081k_closed",
        View {
            eye: [0.55, 1.0, 0.3],
            up: [0.0, 0.0, 1.0],
        },
    ),
];

/// A model whose mesh has not been read yet.
pub(crate) struct Candidate {
    pub(crate) model: Model,
    path: PathBuf,
    view: View,
}

/// The bunny of the quick set.
pub(crate) fn bunny(path: PathBuf) -> Candidate {
    Candidate {
        model: paper::BUNNY,
        path,
        view: UP_Y,
    }
}

/// Those of the six that lie in a folder, the smallest first, and the names of the files that are missing.
pub(crate) fn in_folder(folder: &Path, only: &[String]) -> Result<(Vec<Candidate>, Vec<&'static str>)> {
    let files = mesh_files(folder)?;
    let (mut found, mut missing) = (Vec::new(), Vec::new());
    for (model, name, view) in CAST {
        if !only.is_empty()
            && !only
                .iter()
                .any(|wanted| model.name == wanted || name.starts_with(wanted.as_str()))
        {
            continue;
        }
        match files.iter().find(|path| name_of(path) == name) {
            Some(path) => found.push(Candidate {
                model,
                path: path.clone(),
                view,
            }),
            None => missing.push(name),
        }
    }
    if found.is_empty() {
        let names: Vec<&str> = CAST.iter().map(|(_, name, _)| *name).collect();
        bail!(
            "{}: none of the meshes is there; wanted are {} (.ply, .obj, .off, .stl, each also with .gz)",
            folder.display(),
            names.join(", ")
        );
    }
    Ok((found, missing))
}

impl Candidate {
    /// Reads the mesh.
    pub(crate) fn open(self) -> Result<Standin> {
        let bytes = fs::read(&self.path).with_context(|| self.path.display().to_string())?;
        Ok(Standin {
            model: self.model,
            file: name_of(&self.path),
            digest: digest(&bytes),
            mesh: Asset::open(&self.path)?.mesh().clone(),
            view: self.view,
        })
    }

    /// The file, for messages.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }
}
