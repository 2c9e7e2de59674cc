//! What can stand for a mesh: ours, a file, or an object of another library.

use std::{borrow::Cow, path::PathBuf, sync::Arc};

use mesh::{Rig, TriMesh};
use pyo3::{Borrowed, prelude::*};

use crate::{assets::Asset, errors::Failure, meshes::Mesh};

/// A mesh, whatever it was given as.
#[derive(Clone)]
pub(crate) enum Input {
    Mesh(Mesh),
    Asset(Asset),
}

impl Input {
    /// The surface as it is signed and measured.
    pub(crate) fn surface(&self) -> Arc<TriMesh> {
        match self {
            Self::Mesh(mesh) => Arc::clone(mesh.surface()),
            Self::Asset(asset) => Arc::new(asset.inner().mesh().clone()),
        }
    }

    /// The surface as it is shown: what a scene places several times is there each time.
    pub(crate) fn shown(&self) -> Result<Arc<TriMesh>, Failure> {
        match self {
            Self::Mesh(mesh) => Ok(Arc::clone(mesh.surface())),
            Self::Asset(asset) => Ok(Arc::new(match asset.inner().scene()? {
                Cow::Borrowed(mesh) => mesh.clone(),
                Cow::Owned(mesh) => mesh,
            })),
        }
    }

    /// What poses it, if a file says so; a damaged rig costs nobody a claim.
    pub(crate) fn rig(&self) -> Option<Rig> {
        match self {
            Self::Mesh(_) => None,
            Self::Asset(asset) => asset.inner().rig().unwrap_or_default(),
        }
    }

    /// Bytes of the file and of those that it refers to, as they are kept.
    pub(crate) fn file_bytes(&self) -> usize {
        match self {
            Self::Mesh(_) => 0,
            Self::Asset(asset) => {
                let companions = asset.inner().companions();
                asset.inner().content().len() + companions.map(|(_, bytes)| bytes.len()).sum::<usize>()
            }
        }
    }

    /// What is given, with the vertices of other libraries' objects welded or as they are.
    pub(crate) fn of(object: &Bound<'_, PyAny>, weld: bool) -> PyResult<Self> {
        if let Ok(mesh) = object.cast::<Mesh>() {
            return Ok(Self::Mesh(mesh.get().clone()));
        }
        if let Ok(asset) = object.cast::<Asset>() {
            return Ok(Self::Asset(asset.get().clone()));
        }
        let py = object.py();
        if let Ok(path) = object.extract::<PathBuf>() {
            return Ok(Self::Asset(Asset::open(py, path)?));
        }
        let arrays = py
            .import("sigmark._peers")?
            .call_method1("arrays_of", (object,))?;
        let (vertices, faces): (Bound<'_, PyAny>, Bound<'_, PyAny>) = arrays.extract()?;
        Ok(Self::Mesh(Mesh::of_arrays(&vertices, &faces, weld)?))
    }
}

impl<'py> FromPyObject<'_, 'py> for Input {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        Self::of(&object, true)
    }
}
