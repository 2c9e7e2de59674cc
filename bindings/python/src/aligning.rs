//! Bringing suspects back.

use mesh::Similarity;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use registration::{AlignOptions, PointPair};
use serde_json::{Value, json};

use crate::{
    arrays,
    input::Input,
    objects::plain,
    running::{Running, run},
};

/// Where a suspect belongs, and how well it fits there. What `align` returns. True where it lies on the original.
#[pyclass(frozen, module = "sigmark")]
pub(crate) struct Alignment(registration::Alignment);

/// Finds the similarity that takes a suspect to its original, p ↦ s R p + t, mirrored if need be, without a first guess.
///
/// Parameters
/// ----------
/// suspect, original : Mesh, Asset, path, or an object of trimesh, open3d, meshio or pymeshlab
/// points : array_like, (q, 2, 3), float64, optional
///     At least three pairs of points, of the suspect and of the original, no better than a few hundredths of the diagonal, for suspects that do not come back without.
/// tolerance : float, default 0.01
///     How near the surfaces must be to count as overlapping, as a fraction of the smaller diagonal.
/// least_overlap : float, default 0.8
///     The share of the suspect's area that must overlap for it to count as aligned.
/// threads, progress
///     As `spectrum` has them.
///
/// Returns
/// -------
/// Alignment
///
/// Raises
/// ------
/// RegistrationError
///     A mesh has no area, or an option is out of range.
///
/// Examples
/// --------
/// >>> import sigmark, sigmark.shapes
/// >>> torus = sigmark.shapes.bumpy_torus()
/// >>> found = sigmark.align(sigmark.Mesh(2 * torus.vertices + 1, torus.faces), torus)
/// >>> found.aligned, round(found.scale, 9)
/// (True, 0.5)
#[pyfunction]
#[pyo3(signature = (suspect, original, *, points = None, tolerance = 0.01, least_overlap = 0.8, threads = None, progress = None))]
#[allow(clippy::too_many_arguments)] // as Python's functions have
pub(crate) fn align(
    py: Python<'_>,
    suspect: Input,
    original: Input,
    points: Option<Vec<[[f64; 3]; 2]>>,
    tolerance: f64,
    least_overlap: f64,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Alignment> {
    let options = AlignOptions {
        tolerance,
        least_overlap,
    };
    run(py, Running::new(threads, progress), move |job| {
        let (from, onto) = (suspect.surface(), original.surface());
        let found = match points {
            None => registration::align(onto, from, &options, job),
            Some(points) => {
                let pair = |[suspect, original]: [[f64; 3]; 2]| PointPair { suspect, original };
                let pairs: Vec<PointPair> = points.into_iter().map(pair).collect();
                registration::align_points(onto, from, &pairs, &options, job)
            }
        };
        Ok(Alignment(found?))
    })
}

#[pymethods]
impl Alignment {
    /// Whether enough of the suspect lies on the original.
    #[getter]
    fn aligned(&self) -> bool {
        self.0.aligned
    }

    /// The similarity as a matrix, (4, 4), float64: takes suspects' points (x, y, z, 1) to the original.
    #[getter]
    fn transform<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::owned_rows(py, self.0.transform.to_matrix().to_vec())
    }

    /// s.
    #[getter]
    fn scale(&self) -> f64 {
        self.0.transform.scale
    }

    /// R, (3, 3), float64; of determinant −1 where the suspect is mirrored.
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::owned_rows(py, self.0.transform.rotation.to_vec())
    }

    /// t, (3,), float64, in the original's unit.
    #[getter]
    fn translation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.transform.translation.to_vec().into_pyarray(py)
    }

    /// Whether the suspect is a mirror image.
    #[getter]
    fn mirrored(&self) -> bool {
        self.0.mirrored()
    }

    /// Share of the suspect's surface that lies on the original, from 0 to 1.
    #[getter]
    fn overlap(&self) -> f64 {
        self.0.overlap
    }

    /// Share of the original's surface that lies on the suspect, from 0 to 1.
    #[getter]
    fn coverage(&self) -> f64 {
        self.0.coverage
    }

    /// Root mean square distance of the overlapping surface, as a fraction of the original's diagonal.
    #[getter]
    fn residual(&self) -> f64 {
        self.0.residual
    }

    /// Whether the suspect could lie there in other ways.
    #[getter]
    fn ambiguous(&self) -> bool {
        self.0.ambiguous()
    }

    /// Points of the suspect, (n, 3), as they lie on the original.
    fn apply<'py>(&self, py: Python<'py>, points: &Bound<'_, PyAny>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let moved = self.0.transform.apply_all(&arrays::points(points, "points")?);
        arrays::owned_rows(py, moved)
    }

    /// What `sigmark align --json` prints, but for files and the time.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.described())
    }

    fn __bool__(&self) -> bool {
        self.0.aligned
    }

    fn __repr__(&self) -> String {
        let registration::Alignment {
            aligned,
            overlap,
            residual,
            ..
        } = &self.0;
        let aligned = if *aligned { "aligned" } else { "not aligned" };
        let (overlap, scale) = (100.0 * overlap, self.scale());
        format!(
            "Alignment({aligned}, {overlap:.1} % overlap, {residual:.1e} of the diagonal apart, scale {scale:.6})"
        )
    }
}

impl Alignment {
    fn described(&self) -> Value {
        let found = &self.0;
        json!({
            "aligned": found.aligned,
            "transform": found.transform.to_matrix(),
            "scale": found.transform.scale,
            "rotation": found.transform.rotation,
            "translation": found.transform.translation,
            "mirrored": found.mirrored(),
            "registration": found.matched_by,
            "overlap": found.overlap,
            "coverage": found.coverage,
            "residual": found.residual,
            "ambiguous": found.ambiguous(),
            "alternatives": found.alternatives.iter().map(Similarity::to_matrix).collect::<Vec<_>>(),
            "free_directions": found.free_directions,
        })
    }
}
