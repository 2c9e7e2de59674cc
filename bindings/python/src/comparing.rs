//! How far two meshes differ.

use job::{Job, Stage};
use mesh::TriMesh;
use pyo3::{exceptions::PyValueError, prelude::*};
use quality::{
    DameMetric, DistanceMetric, DistanceOptions, Measurement, Metric, Msdm2Metric, Needs, ShapeDnaMetric,
    ShapeDnaOptions,
};
use registration::match_connectivity;
use serde_json::{Map, Value, json};

use crate::{
    errors::Failure,
    input::Input,
    objects::plain,
    running::{Running, run},
};

/// What was measured of two meshes. What `compare` returns.
#[pyclass(frozen, module = "sigmark")]
pub(crate) struct Comparison {
    diagonal: f64,
    /// In the order in which they were asked for.
    measured: Vec<(&'static str, Measurement)>,
}

/// Measures how far a mesh is from a reference. Both are compared as they lie: `align` brings them together.
///
/// Parameters
/// ----------
/// reference, other : Mesh, Asset, path, or an object of trimesh, open3d, meshio or pymeshlab
/// metrics : sequence of str, default ("distance",)
///     "distance": between the surfaces, as fractions of the reference's diagonal (d_rmse, mean, hausdorff, mrms, …); "shape_dna": of the Laplace-Beltrami eigenvalues;
///     "msdm2": what people notice, by curvature; "dame": what people notice, by the angles at edges, of the same triangles in any order.
/// interval : float, default 5e-4
///     Largest distance between samples of a surface, as a fraction of its diagonal.
/// eigenvalues : int, default 50
///     m of Shape-DNA.
/// threads, progress
///     As `spectrum` has them.
///
/// Returns
/// -------
/// Comparison
///
/// Raises
/// ------
/// QualityError, RegistrationError
///     A metric can't be computed of these meshes.
///
/// Examples
/// --------
/// >>> import sigmark, sigmark.shapes
/// >>> sphere = sigmark.shapes.sphere(3)
/// >>> larger = sigmark.Mesh(1.01 * sphere.vertices, sphere.faces)
/// >>> compared = sigmark.compare(sphere, larger, interval=0.02)
/// >>> round(compared["distance"]["d_rmse"] * compared.diagonal, 3)
/// 0.01
#[pyfunction]
#[pyo3(signature = (reference, other, *, metrics = None, interval = 5e-4, eigenvalues = 50, threads = None, progress = None))]
#[allow(clippy::too_many_arguments)] // as Python's functions have
pub(crate) fn compare(
    py: Python<'_>,
    reference: Input,
    other: Input,
    metrics: Option<Vec<String>>,
    interval: f64,
    eigenvalues: usize,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Comparison> {
    let names = metrics.unwrap_or_else(|| vec!["distance".into()]);
    let metrics = names.iter().map(|name| metric(name, interval, eigenvalues));
    let metrics = metrics.collect::<PyResult<Vec<_>>>()?;
    run(py, Running::new(threads, progress), move |job| {
        let (reference, other) = (reference.surface(), other.surface());
        let mut measured = Vec::new();
        for metric in &metrics {
            job.begin(Measuring(metric.name()))?;
            measured.push((metric.name(), measure(&**metric, &reference, &other, job)?));
        }
        let diagonal = reference.bounding_box().diagonal();
        Ok(Comparison { diagonal, measured })
    })
}

/// What is being measured.
#[derive(Clone, Copy, Debug)]
struct Measuring(&'static str);

impl Stage for Measuring {
    fn name(&self) -> &'static str {
        self.0
    }
}

fn metric(name: &str, interval: f64, eigenvalues: usize) -> PyResult<Box<dyn Metric>> {
    Ok(match name {
        "distance" => Box::new(DistanceMetric {
            options: DistanceOptions { interval },
            ..Default::default()
        }),
        "shape_dna" => Box::new(ShapeDnaMetric {
            options: ShapeDnaOptions {
                count: eigenvalues,
                ..Default::default()
            },
            ..Default::default()
        }),
        "msdm2" => Box::new(Msdm2Metric),
        "dame" => Box::new(DameMetric::default()),
        _ => {
            return Err(PyValueError::new_err(format!(
                "no metric {name:?}; there are \"distance\", \"shape_dna\", \"msdm2\" and \"dame\""
            )));
        }
    })
}

/// With the vertices in the reference's order where a metric needs that.
fn measure(
    metric: &dyn Metric,
    reference: &TriMesh,
    other: &TriMesh,
    job: &Job,
) -> Result<Measurement, Failure> {
    if metric.needs() != Needs::SameConnectivity {
        return Ok(metric.measure(reference, other, job)?);
    }
    let matched = match_connectivity(reference, other, &job.quiet())?;
    // A vertex that no triangle uses has no counterpart; its place does not count.
    let places = matched.carry(other).into_iter().zip(reference.positions());
    let positions = places.map(|(place, &own)| place.unwrap_or(own)).collect();
    Ok(metric.measure(reference, &reference.with_positions(positions)?, job)?)
}

#[pymethods]
impl Comparison {
    /// The length of the diagonal of the reference's bounding box, in its unit; distances are fractions of it.
    #[getter]
    fn diagonal(&self) -> f64 {
        self.diagonal
    }

    /// The figures of a metric by their names.
    fn __getitem__<'py>(&self, py: Python<'py>, metric: &str) -> PyResult<Bound<'py, PyAny>> {
        let found = self.measured.iter().find(|(name, _)| *name == metric);
        let (_, measurement) =
            found.ok_or_else(|| pyo3::exceptions::PyKeyError::new_err(format!("{metric}: not measured")))?;
        plain(py, &json!(measurement))
    }

    /// What `sigmark compare --json` prints, but for files and the time; what was not asked for is null.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut members = Map::new();
        members.insert("diagonal".into(), json!(self.diagonal));
        for name in ["distance", "shape_dna", "msdm2", "dame"] {
            let found = self.measured.iter().find(|(own, _)| *own == name);
            members.insert(name.into(), json!(found.map(|(_, measurement)| measurement)));
        }
        plain(py, &Value::Object(members))
    }

    fn __repr__(&self) -> String {
        const FIRST: [(&str, &str); 4] = [
            ("distance", "d_rmse"),
            ("shape_dna", "distance"),
            ("msdm2", "symmetric"),
            ("dame", "error"),
        ];
        let named = self.measured.iter().filter_map(|(name, measurement)| {
            let (_, figure) = FIRST.iter().find(|(metric, _)| metric == name)?;
            Some(format!("{name} {figure} {:.3e}", measurement.number(figure)))
        });
        format!("Comparison({})", named.collect::<Vec<_>>().join(", "))
    }
}
