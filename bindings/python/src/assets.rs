//! Files of meshes.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use mesh_io::Format;
use pyo3::{exceptions::PyValueError, prelude::*, types::PyBytes};

use crate::{
    arrays,
    errors::Failure,
    meshes::Mesh,
    objects::counted,
    running::{Running, run},
};

/// A mesh file that keeps its bytes: written back, only vertex positions differ, and materials, textures, skins and whatever else it holds stay byte for byte.
///
/// `sigmark.read(path)` and `Asset.from_bytes(data)` make one.
#[pyclass(frozen, module = "sigmark")]
#[derive(Clone)]
pub(crate) struct Asset(Arc<mesh_io::Asset>);

impl Asset {
    pub(crate) fn new(asset: mesh_io::Asset) -> Self {
        Self(Arc::new(asset))
    }

    pub(crate) fn inner(&self) -> &Arc<mesh_io::Asset> {
        &self.0
    }

    /// A large file takes seconds.
    pub(crate) fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        run(py, Running::new(Some(1), None), move |_| {
            Ok(Self::new(mesh_io::Asset::open(path)?))
        })
    }

    /// The file's name without its folder.
    pub(crate) fn name(&self) -> &str {
        let name = self.0.path().file_name().and_then(|name| name.to_str());
        name.unwrap_or_default()
    }
}

/// Reads a mesh file: GLB, glTF, OBJ, PLY, STL or OFF, each also gzipped; 3MF; the one mesh of a zip archive.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
///
/// Returns
/// -------
/// Asset
///     The file; `read(path).mesh` is what it shows.
///
/// Raises
/// ------
/// AssetError
///     The file is missing, damaged, or of no format that is read; the message says where.
#[pyfunction]
pub(crate) fn read(py: Python<'_>, path: PathBuf) -> PyResult<Asset> {
    Asset::open(py, path)
}

#[pymethods]
impl Asset {
    /// The file that these bytes are.
    ///
    /// Parameters
    /// ----------
    /// data : bytes
    /// format : str, optional
    ///     "obj", "ply", "stl", "off", "gltf", "glb" or "3mf"; by default what the bytes look like.
    #[staticmethod]
    #[pyo3(signature = (data, format = None))]
    fn from_bytes(py: Python<'_>, data: &[u8], format: Option<&str>) -> PyResult<Self> {
        let known = |name: &str| {
            let known = Format::of_path(Path::new(&format!("mesh.{name}")));
            known.ok_or_else(|| {
                PyValueError::new_err(format!(
                    "no format {name:?}; one of obj, ply, stl, off, gltf, glb, 3mf"
                ))
            })
        };
        // A packed one shows its format only once it is unpacked.
        let format = format.map(known).transpose()?;
        let data = data.to_vec();
        run(py, Running::new(Some(1), None), move |_| {
            Ok(Self::new(mesh_io::Asset::from_bytes(data, format)?))
        })
    }

    /// What the file holds; vertices at equal positions are one. A mesh that a scene places several times is there once.
    #[getter]
    fn mesh(&self) -> Mesh {
        Mesh::plain(self.0.mesh().clone())
    }

    /// "obj", "ply", "stl", "off", "gltf", "glb" or "3mf".
    #[getter]
    fn format(&self) -> &'static str {
        self.0.format().extension()
    }

    /// Whether the file is gzipped.
    #[getter]
    fn is_gzipped(&self) -> bool {
        self.0.is_gzipped()
    }

    /// Where the file was read; empty for bytes in memory.
    #[getter]
    fn path(&self) -> &Path {
        self.0.path()
    }

    /// The same file with other positions, one a vertex of `mesh`, (n, 3), rounded to the file's precision.
    fn with_vertices(&self, py: Python<'_>, vertices: &Bound<'_, PyAny>) -> PyResult<Self> {
        let positions = arrays::points(vertices, "vertices")?;
        let moved = py.detach(|| self.0.with_positions(&positions));
        Ok(Self::new(moved.map_err(Failure::from)?))
    }

    /// The names of the files that this one refers to, such as buffers and textures of glTF, from its folder: `save` writes them beside it.
    #[getter]
    fn companions(&self) -> Vec<&str> {
        self.0.companions().map(|(name, _)| name).collect()
    }

    /// The bytes of the file itself. Where it has `companions` they are not all of it, and a mark may lie in one of those: `save` writes all.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        let bytes = py.detach(|| self.0.to_bytes());
        PyBytes::new(py, &bytes)
    }

    /// Whether `save` accepts a name.
    ///
    /// Raises
    /// ------
    /// AssetError
    ///     It does not end as the format demands; the message says how it should.
    fn check_name(&self, path: PathBuf) -> PyResult<()> {
        Ok(self.0.check_name(path).map_err(Failure::from)?)
    }

    /// Writes the file, and beside it what it refers to by name. A failure leaves nothing half-written.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     Ends as the format demands.
    /// overwrite : bool, default False
    ///     Whether a file that is there may be replaced.
    #[pyo3(signature = (path, *, overwrite = false))]
    fn save(&self, py: Python<'_>, path: PathBuf, overwrite: bool) -> PyResult<()> {
        let saved = py.detach(|| self.0.save(path, overwrite));
        Ok(saved.map_err(Failure::from)?)
    }

    fn __repr__(&self) -> String {
        let mesh = self.0.mesh();
        let vertices = counted(mesh.vertex_count(), "vertex", "vertices");
        let faces = counted(mesh.triangle_count(), "face", "faces");
        let gzipped = if self.is_gzipped() { ", gzipped" } else { "" };
        let name = if self.name().is_empty() {
            "in memory"
        } else {
            self.name()
        };
        format!("Asset({name}: {}{gzipped}; {vertices}, {faces})", self.format())
    }
}
