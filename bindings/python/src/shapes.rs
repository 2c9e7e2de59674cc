//! Shapes for examples and tests.

use mesh::shapes;
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::meshes::Mesh;

/// A sphere of radius 1: an icosahedron whose triangles were divided in four `level` times, with 10 · 4^level + 2 vertices.
#[pyfunction]
pub(crate) fn sphere(py: Python<'_>, level: u32) -> PyResult<Mesh> {
    match level {
        0..=9 => Ok(Mesh::plain(py.detach(|| shapes::icosphere(level as _)))),
        _ => Err(PyValueError::new_err(format!("level is {level}; it is 0 to 9"))),
    }
}

/// A torus with bumps, so that it has no symmetry, of rows · columns vertices; another `seed` is another shape.
#[pyfunction]
#[pyo3(signature = (rows = 48, columns = 32, seed = 1))]
pub(crate) fn bumpy_torus(py: Python<'_>, rows: u32, columns: u32, seed: u64) -> PyResult<Mesh> {
    match (rows, columns) {
        (3..=4096, 3..=4096) => {
            let torus = || shapes::bumpy_torus(rows as _, columns as _, seed);
            Ok(Mesh::plain(py.detach(torus)))
        }
        _ => Err(PyValueError::new_err("rows and columns are 3 to 4096")),
    }
}
