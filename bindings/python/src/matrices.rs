//! Sparse matrices of scipy, out and in. scipy is imported when one is asked for, and not before.

use std::sync::Arc;

use mhb_core::{Laplacian, SpectrumOptions};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyDict};
use sprs::CsMat;

use crate::{
    arrays,
    input::Input,
    meshes::Mesh,
    running::{Running, run},
    spectra::{self, Spectrum},
};

/// S and M.
pub(crate) type Matrices<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>);

/// Stiffness and mass of a mesh as sparse matrices of scipy.
///
/// Parameters
/// ----------
/// vertices, faces, laplacian, mass
///     As `spectrum` has them.
///
/// Returns
/// -------
/// S : scipy.sparse.csr_matrix, (n, n), float64
///     Cotangent stiffness, positive semidefinite; rows sum to zero.
/// M : scipy.sparse.csr_matrix, (n, n), float64
///     Mass, in unit²: diagonal, or where it is full with an entry for each edge.
///
/// Examples
/// --------
/// >>> import sigmark, sigmark.shapes
/// >>> S, M = sigmark.laplacian(sigmark.shapes.sphere(3))
/// >>> round(float(M.sum()), 1)  # the area, nearly 4 π
/// 12.5
#[pyfunction]
#[pyo3(signature = (vertices, faces = None, *, laplacian = "cotangent", mass = "lumped"))]
pub(crate) fn laplacian<'py>(
    py: Python<'py>,
    vertices: &Bound<'py, PyAny>,
    faces: Option<&Bound<'py, PyAny>>,
    laplacian: &str,
    mass: &str,
) -> PyResult<Matrices<'py>> {
    let input = match faces {
        Some(faces) => Input::Mesh(Mesh::of_arrays(vertices, faces, false)?),
        None => Input::of(vertices, false)?,
    };
    let (kind, mass, surface) = (
        spectra::kind(laplacian)?,
        spectra::mass_kind(mass)?,
        input.surface(),
    );
    let assembled = run(py, Running::new(Some(1), None), move |_| {
        Ok(Laplacian::of(&surface, kind, mass)?)
    })?;
    to_scipy(py, &assembled)
}

/// The k lowest eigenpairs of S h = λ M h for any symmetric, positive semidefinite S whose rows sum to zero, such as a graph's Laplacian or what robust_laplacian
/// returns, and any positive diagonal M.
///
/// Parameters
/// ----------
/// stiffness : sparse matrix of scipy, (n, n)
/// mass : array_like, (n,), float64; or a diagonal sparse matrix of scipy, (n, n)
/// k, tolerance, threads, progress
///     As `spectrum` has them.
///
/// Returns
/// -------
/// Spectrum
///
/// Raises
/// ------
/// SpectrumError
///     S is not symmetric, a row does not sum to zero, or a mass is not positive.
///
/// Examples
/// --------
/// >>> import numpy, scipy.sparse, sigmark
/// >>> path = scipy.sparse.diags([-1.0, [1, 2, 2, 2, 1], -1.0], [-1, 0, 1], shape=(5, 5))
/// >>> sigmark.spectrum_of_matrices(path, numpy.ones(5), k=3).eigenvalues.round(3) + 0
/// array([0.   , 0.382, 1.382])
#[pyfunction]
#[pyo3(signature = (stiffness, mass, k = 50, *, tolerance = 1e-10, threads = None, progress = None))]
pub(crate) fn spectrum_of_matrices(
    py: Python<'_>,
    stiffness: &Bound<'_, PyAny>,
    mass: &Bound<'_, PyAny>,
    k: usize,
    tolerance: f64,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Spectrum> {
    let stiffness = from_scipy(stiffness, "stiffness")?;
    let mass = masses(mass)?;
    spectra::check_size(mass.len(), k)?;
    let options = SpectrumOptions {
        count: k,
        tolerance,
        ..Default::default()
    };
    run(py, Running::new(threads, progress), move |job| {
        let laplacian = Arc::new(Laplacian::new(stiffness, mass)?);
        Spectrum::of(laplacian, &options, job)
    })
}

/// The matrices of a Laplacian.
pub(crate) fn to_scipy<'py>(py: Python<'py>, laplacian: &Laplacian) -> PyResult<Matrices<'py>> {
    let stiffness = matrix(py, laplacian.stiffness())?;
    let mass = match laplacian.full_mass() {
        Some(full) => matrix(py, full)?,
        None => {
            let options = PyDict::new(py);
            options.set_item("format", "csr")?;
            let diagonal = arrays::owned(py, laplacian.mass().to_vec());
            let sparse = py.import("scipy.sparse")?;
            let diagonal = sparse.call_method("diags", (diagonal,), Some(&options))?;
            sparse.call_method1("csr_matrix", (diagonal,))?
        }
    };
    Ok((stiffness, mass))
}

/// A symmetric matrix, so that rows and columns are the same.
fn matrix<'py>(py: Python<'py>, matrix: &CsMat<f64>) -> PyResult<Bound<'py, PyAny>> {
    let signed = |numbers: &[usize]| numbers.iter().map(|&i| i as i64).collect::<Vec<_>>();
    let data = arrays::owned(py, matrix.data().to_vec());
    let indices = arrays::owned(py, signed(matrix.indices()));
    let starts = arrays::owned(py, signed(matrix.proper_indptr().as_ref()));
    let sparse = py.import("scipy.sparse")?;
    sparse.call_method1("csr_matrix", ((data, indices, starts), matrix.shape()))
}

fn from_scipy(object: &Bound<'_, PyAny>, name: &str) -> PyResult<CsMat<f64>> {
    if !object.hasattr("tocsr")? {
        let found = object.get_type().name()?;
        return Err(pyo3::exceptions::PyTypeError::new_err(format!(
            "{name} is of type {found}; a sparse matrix of scipy is needed"
        )));
    }
    let options = PyDict::new(object.py());
    options.set_item("copy", true)?;
    let rows = object.call_method("tocsr", (), Some(&options))?;
    // Sorts entries, too.
    rows.call_method0("sum_duplicates")?;
    let shape: (usize, usize) = rows.getattr("shape")?.extract()?;
    let starts = arrays::counts(&rows.getattr("indptr")?)?;
    let indices = arrays::counts(&rows.getattr("indices")?)?;
    let data = arrays::numbers(&rows.getattr("data")?, name)?;
    CsMat::try_new(shape, starts, indices, data)
        .map_err(|(.., error)| PyValueError::new_err(format!("{name} is no sparse matrix: {error}")))
}

/// A diagonal, as a matrix or as an array.
fn masses(object: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    if !object.hasattr("tocsr")? {
        return arrays::numbers(object, "mass");
    }
    let matrix = from_scipy(object, "mass")?;
    let mut masses = vec![0.0; matrix.rows()];
    for (&value, (row, column)) in &matrix {
        if row == column {
            masses[row] = value;
        } else if value != 0.0 {
            return Err(PyValueError::new_err(format!(
                "mass has an entry at ({row}, {column}), off its diagonal; lump it, as in M.sum(axis=1)"
            )));
        }
    }
    Ok(masses)
}
