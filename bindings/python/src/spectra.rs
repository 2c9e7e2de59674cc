//! Spectra of meshes.

use std::sync::Arc;

use mhb_core::{LaplacianKind, Mass, SpectrumOptions};
use numpy::{
    PyArray1, PyArray2,
    ndarray::{ArrayView, ArrayView1, Ix1, Ix2},
};
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::{
    arrays,
    errors::Failure,
    input::Input,
    matrices::{self, Matrices},
    meshes::Mesh,
    running::{Running, run},
};

/// Eigenfunctions that take more memory than this are refused; a machine that has it would need weeks for them.
const LARGEST_BASIS: usize = 16 << 30;

/// The k lowest eigenpairs of S h = λ M h, with the proof that none is missing. What `spectrum` returns.
///
/// Arrays are read-only views of one result, and not copied.
#[pyclass(frozen, module = "sigmark")]
pub(crate) struct Spectrum {
    spectrum: mhb_core::Spectrum,
    laplacian: Arc<mhb_core::Laplacian>,
}

/// The lower Laplace-Beltrami spectrum of a triangle mesh: S h = λ M h, λ_0 = 0 ≤ λ_1 ≤ …, Hᵀ M H = I.
///
/// S is the cotangent stiffness matrix, positive semidefinite; M is the mass matrix of linear finite elements. That no pair is missing is proved: each
/// factorisation's negative pivots count the eigenvalues below its shift (Sylvester's law of inertia), and a spectrum that lacks one is an error. Columns of H are
/// the same, to the tolerance, on every machine and any number of threads: signs, and rotations inside clusters of close eigenvalues, are canonical.
///
/// Parameters
/// ----------
/// vertices : array_like, (n, 3), float64; or a mesh
///     Positions. A mesh (`Mesh`, `Asset`, a file's path, or an object of trimesh, open3d, meshio or pymeshlab) stands for both arrays; of a `Mesh` and of a file
///     rows are the vertices of its surface.
/// faces : array_like, (m, 3), int32 or int64
///     The vertices of each triangle, from 0. Vertices that no triangle uses are refused; `Mesh(vertices, faces)` sets them aside.
/// k : int, default 50
///     How many of the lowest pairs.
/// laplacian : {"cotangent", "intrinsic"}
///     Cotangent weights of the mesh's own triangles; or of the intrinsic Delaunay triangulation of its tufted cover (Sharp and Crane 2020), for slivers and
///     non-manifold edges.
/// mass : {"lumped", "full"}
///     The diagonal mass matrix, or the consistent one.
/// tolerance : float, default 1e-10
///     The largest relative residual ‖S h − λ M h‖ / λ, in the norm of the inverse lumped mass.
/// threads : int, optional
///     By default as many as there are processors. The result does not depend on it.
/// progress : callable, optional
///     Is called as `progress(stage, fraction)` about fifty times a second; what it raises ends the work, and so does Ctrl-C.
///
/// Returns
/// -------
/// Spectrum
///
/// Raises
/// ------
/// SpectrumError
///     There are not k pairs, a vertex has no triangle, or extreme triangles defeat the factorisation.
/// MeshError
///     The arrays are no mesh.
///
/// Notes
/// -----
/// Eigenvalues are in 1/unit². Time grows a little faster than n k: 325 pairs of 35 000 vertices take two to three seconds on one core.
///
/// Examples
/// --------
/// A sphere has l (l + 1), 2 l + 1 times:
///
/// >>> import sigmark, sigmark.shapes
/// >>> sphere = sigmark.shapes.sphere(5)
/// >>> spectrum = sigmark.spectrum(sphere.vertices, sphere.faces, k=9)
/// >>> spectrum.eigenvalues.round(1) + 0
/// array([0., 2., 2., 2., 6., 6., 6., 6., 6.])
/// >>> spectrum.eigenfunctions.shape
/// (10242, 9)
#[pyfunction]
#[pyo3(signature = (vertices, faces = None, k = 50, *, laplacian = "cotangent", mass = "lumped", tolerance = 1e-10, threads = None, progress = None))]
#[allow(clippy::too_many_arguments)] // as Python's functions have
pub(crate) fn spectrum(
    py: Python<'_>,
    vertices: &Bound<'_, PyAny>,
    faces: Option<&Bound<'_, PyAny>>,
    k: usize,
    laplacian: &str,
    mass: &str,
    tolerance: f64,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Spectrum> {
    let input = match faces {
        Some(faces) => Input::Mesh(Mesh::of_arrays(vertices, faces, false)?),
        None => Input::of(vertices, false)?,
    };
    let options = SpectrumOptions {
        count: k,
        laplacian: kind(laplacian)?,
        mass: mass_kind(mass)?,
        tolerance,
        ..Default::default()
    };
    let surface = input.surface();
    check_size(surface.vertex_count(), k)?;
    run(py, Running::new(threads, progress), move |job| {
        let laplacian = mhb_core::Laplacian::of(&surface, options.laplacian, options.mass)?;
        Spectrum::of(laplacian.into(), &options, job)
    })
}

impl Spectrum {
    pub(crate) fn of(
        laplacian: Arc<mhb_core::Laplacian>,
        options: &SpectrumOptions,
        job: &job::Job,
    ) -> Result<Self, Failure> {
        Ok(Self {
            spectrum: mhb_core::Spectrum::of_laplacian(&laplacian, options, job)?,
            laplacian,
        })
    }
}

#[pymethods]
impl Spectrum {
    /// λ_0 ≤ λ_1 ≤ …, (k,), float64, in 1/unit².
    #[getter]
    fn eigenvalues<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        arrays::view(slf, eigenvalues)
    }

    /// H, (n, k), float64, column after column in memory: column j belongs to eigenvalue j, and Hᵀ M H = I. Column 0 is a positive constant.
    #[getter]
    fn eigenfunctions<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray2<f64>> {
        arrays::view(slf, eigenfunctions)
    }

    /// The lumped mass of each vertex, (n,), float64, in unit²: a third of the area around it. M where the mass is lumped.
    #[getter]
    fn mass<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        arrays::view(slf, mass)
    }

    /// The relative residual of each pair, (k,), float64, computed anew from the final vectors.
    #[getter]
    fn residuals<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        arrays::view(slf, residuals)
    }

    /// The greatest of the residuals.
    #[getter]
    fn max_residual(&self) -> f64 {
        self.spectrum.residuals().iter().copied().fold(0.0, f64::max)
    }

    /// The proof that no pair is missing: shifts, ascending, each with the number of eigenvalues below it, which is how many were found there. The last shift may lie beyond the last
    /// pair.
    #[getter]
    fn inertia(&self) -> Vec<(f64, usize)> {
        let counts = self.spectrum.inertia().iter();
        counts.map(|count| (count.shift, count.below)).collect()
    }

    /// S and M of this spectrum as sparse matrices of scipy, (n, n): what `sigmark.laplacian` gives.
    fn laplacian<'py>(&self, py: Python<'py>) -> PyResult<Matrices<'py>> {
        matrices::to_scipy(py, &self.laplacian)
    }

    fn __len__(&self) -> usize {
        self.spectrum.eigenvalues().len()
    }

    fn __repr__(&self) -> String {
        let eigenvalues = self.spectrum.eigenvalues();
        format!(
            "Spectrum({} pairs of {} vertices, eigenvalues up to {:.6e}, residuals up to {:.1e}, none is missing)",
            eigenvalues.len(),
            self.spectrum.mass().len(),
            eigenvalues.last().copied().unwrap_or(0.0),
            self.max_residual()
        )
    }
}

fn eigenvalues(spectrum: &Spectrum) -> ArrayView<'_, f64, Ix1> {
    ArrayView1::from(spectrum.spectrum.eigenvalues())
}

fn eigenfunctions(spectrum: &Spectrum) -> ArrayView<'_, f64, Ix2> {
    arrays::columns(spectrum.spectrum.eigenfunctions())
}

fn mass(spectrum: &Spectrum) -> ArrayView<'_, f64, Ix1> {
    ArrayView1::from(spectrum.spectrum.mass())
}

fn residuals(spectrum: &Spectrum) -> ArrayView<'_, f64, Ix1> {
    ArrayView1::from(spectrum.spectrum.residuals())
}

pub(crate) fn check_size(vertices: usize, k: usize) -> PyResult<()> {
    let bytes = vertices.saturating_mul(k).saturating_mul(size_of::<f64>());
    // More pairs than vertices are refused by the solver, in its own words.
    if k <= vertices && bytes > LARGEST_BASIS {
        let most = LARGEST_BASIS / size_of::<f64>() / vertices;
        let size = bytes >> 30;
        return Err(PyValueError::new_err(format!(
            "{k} eigenfunctions of {vertices} vertices take {size} GiB; ask for {most} at most"
        )));
    }
    Ok(())
}

pub(crate) fn kind(name: &str) -> PyResult<LaplacianKind> {
    match name {
        "cotangent" => Ok(LaplacianKind::Cotangent),
        "intrinsic" => Ok(LaplacianKind::Intrinsic),
        _ => Err(PyValueError::new_err(format!(
            "laplacian is {name:?}; it is \"cotangent\" or \"intrinsic\""
        ))),
    }
}

pub(crate) fn mass_kind(name: &str) -> PyResult<Mass> {
    match name {
        "lumped" => Ok(Mass::Lumped),
        "full" => Ok(Mass::Full),
        _ => Err(PyValueError::new_err(format!(
            "mass is {name:?}; it is \"lumped\" or \"full\""
        ))),
    }
}
