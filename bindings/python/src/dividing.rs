//! Cutting meshes and graphs into parts.

use ::partition::{Effort, Graph, Options};
use mesh::Edges;
use numpy::PyArray1;
use pyo3::{exceptions::PyValueError, prelude::*, types::PyDict};

use crate::{
    arrays,
    input::Input,
    objects::counted,
    running::{Running, run},
};

/// A division of vertices into parts. What `partition` returns.
#[pyclass(frozen, module = "sigmark")]
pub(crate) struct Partition {
    result: ::partition::Partition,
    parts: usize,
}

/// What is divided.
enum Whole {
    Mesh(Input),
    /// Vertices, and edges with their weights.
    Graph(usize, Vec<(u32, u32, i32)>),
}

/// Cuts a mesh or a graph into parts of equal size with short borders.
///
/// Parameters
/// ----------
/// mesh : Mesh, Asset, path, an object of another library; or a sparse matrix of scipy, (n, n)
///     A mesh, whose vertices are divided (of a `Mesh` those of its surface); or a graph by its symmetric adjacency matrix, whose entries off the diagonal are positive integer weights.
/// parts : int
/// imbalance : float, default 0.03
///     By how much the heaviest part may exceed the mean.
/// seed : int, default 0
///     Another one gives another division.
/// high_effort : bool, default False
///     Takes several times as long for a shorter border.
/// threads, progress
///     As `spectrum` has them. The result does not depend on the number of threads.
///
/// Returns
/// -------
/// Partition
///
/// Raises
/// ------
/// PartitionError
///     There are fewer vertices than parts, or the graph is none.
///
/// Examples
/// --------
/// >>> import numpy, sigmark, sigmark.shapes
/// >>> parts = sigmark.partition(sigmark.shapes.sphere(4), 4)
/// >>> numpy.bincount(parts.labels).sum(), parts.imbalance <= 0.03
/// (np.int64(2562), True)
#[pyfunction]
#[pyo3(signature = (mesh, parts, *, imbalance = 0.03, seed = 0, high_effort = false, threads = None, progress = None))]
#[allow(clippy::too_many_arguments)] // as Python's functions have
pub(crate) fn partition(
    py: Python<'_>,
    mesh: &Bound<'_, PyAny>,
    parts: usize,
    imbalance: f64,
    seed: u64,
    high_effort: bool,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Partition> {
    let whole = match mesh.hasattr("tocoo")? {
        true => graph(mesh)?,
        false => Whole::Mesh(Input::of(mesh, false)?),
    };
    let options = Options {
        parts,
        imbalance,
        seed,
        contiguous: true,
        effort: if high_effort {
            Effort::High
        } else {
            Effort::Default
        },
        ..Options::default()
    };
    run(py, Running::new(threads, progress), move |job| {
        let graph = match whole {
            Whole::Graph(vertices, edges) => Graph::from_edges(vertices, &edges)?,
            Whole::Mesh(input) => {
                let surface = input.surface();
                let edges = Edges::of(&surface);
                let edges: Vec<_> = edges.vertices().iter().map(|&[a, b]| (a, b, 1)).collect();
                Graph::from_edges(surface.vertex_count(), &edges)?
            }
        };
        let result = ::partition::partition(&graph, &options, job)?;
        Ok(Partition { result, parts })
    })
}

/// The upper half of an adjacency matrix.
fn graph(matrix: &Bound<'_, PyAny>) -> PyResult<Whole> {
    let options = PyDict::new(matrix.py());
    options.set_item("copy", true)?;
    let entries = matrix.call_method("tocoo", (), Some(&options))?;
    entries.call_method0("sum_duplicates")?;
    let (rows, columns): (usize, usize) = entries.getattr("shape")?.extract()?;
    if rows != columns || rows > u32::MAX as usize {
        return Err(PyValueError::new_err(format!(
            "the adjacency matrix is {rows} by {columns}; it is square"
        )));
    }
    let [row, column] = ["row", "col"].map(|name| arrays::counts(&entries.getattr(name)?));
    let weights = arrays::numbers(&entries.getattr("data")?, "weights")?;
    let mut edges = Vec::with_capacity(weights.len() / 2);
    for ((row, column), weight) in row?.into_iter().zip(column?).zip(weights) {
        let fits = weight.fract() == 0.0 && weight >= 1.0 && weight <= f64::from(i32::MAX);
        if row < column && !fits {
            return Err(PyValueError::new_err(format!(
                "the weight at ({row}, {column}) is {weight}; weights are positive integers of 32 bits"
            )));
        }
        if row < column {
            edges.push((row as u32, column as u32, weight as i32));
        }
    }
    Ok(Whole::Graph(rows, edges))
}

#[pymethods]
impl Partition {
    /// The part of each vertex, from 0, (n,), int64; a new array each time.
    #[getter]
    fn labels<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        arrays::owned(py, self.result.part_of.iter().map(|&part| part.into()).collect())
    }

    /// How many parts there are.
    #[getter]
    fn parts(&self) -> usize {
        self.parts
    }

    /// Total weight of the edges between parts.
    #[getter]
    fn cut(&self) -> i64 {
        self.result.cut
    }

    /// The heaviest part over the mean, less 1.
    #[getter]
    fn imbalance(&self) -> f64 {
        self.result.imbalance
    }

    /// Connected pieces of each part.
    #[getter]
    fn components(&self) -> Vec<usize> {
        self.result.components.clone()
    }

    fn __len__(&self) -> usize {
        self.parts
    }

    fn __repr__(&self) -> String {
        let imbalance = 100.0 * self.result.imbalance;
        let parts = counted(self.parts, "part", "parts");
        format!(
            "Partition({parts}, cut {}, imbalance {imbalance:.1} %)",
            self.result.cut
        )
    }
}
