//! The meshes that are measured, where the peers read them.

use std::{
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use evaluation::python::Python;
use mesh::{TriMesh, shapes};
use serde::{Serialize, de::DeserializeOwned};

use crate::{
    kept::{self, Key},
    results,
};

/// A mesh that lies in a folder for the peers, too: `positions.f64`, `triangles.u32`, little-endian, without headers.
pub(crate) struct SharedMesh {
    /// As it stands in the tables.
    pub(crate) name: String,
    pub(crate) mesh: TriMesh,
    pub(crate) folder: PathBuf,
}

/// How the distorted meshes are made, by name.
type Distortion = (&'static str, fn(&TriMesh) -> TriMesh);

const DISTORTIONS: [Distortion; 2] = [
    // A mark's size: waves of up to 0.1 % of the model.
    ("waves", |mesh| shapes::bumped(mesh, 1e-3, 1)),
    ("noise", |mesh| shapes::jittered(mesh, 0.3, 1)),
];

impl SharedMesh {
    /// Writes the mesh into a folder of its own within `parent`. What was asked of it lies beside it, and so belongs to it alone.
    pub(crate) fn new(name: String, mesh: TriMesh, parent: &Path) -> Result<Self> {
        let folder = parent.join(Key::new(name.replace(", ", "-")).of_mesh(&mesh).to_string());
        fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        let positions = mesh.positions().as_flattened().iter();
        let positions: Vec<u8> = positions.flat_map(|x| x.to_le_bytes()).collect();
        let triangles = mesh.triangles().as_flattened().iter();
        let triangles: Vec<u8> = triangles.flat_map(|v| v.to_le_bytes()).collect();
        results::write(&folder.join("positions.f64"), positions)?;
        results::write(&folder.join("triangles.u32"), triangles)?;
        Ok(Self { name, mesh, folder })
    }

    /// What `peers/quality.py` says of this mesh, once: kept by this key.
    pub(crate) fn asked<T: Serialize + DeserializeOwned>(
        &self,
        python: &Python,
        key: &Key,
        arguments: &[&OsStr],
    ) -> Result<T> {
        kept::figures(&self.folder, key, || {
            let report = python.run("quality.py", arguments)?;
            serde_json::from_str(&report).context("the report of quality.py")
        })
    }

    /// The distorted copies.
    pub(crate) fn distorted(&self, parent: &Path) -> impl Iterator<Item = Result<Self>> {
        DISTORTIONS.iter().map(move |(kind, distort)| {
            Self::new(format!("{}, {kind}", self.name), distort(&self.mesh), parent)
        })
    }
}
