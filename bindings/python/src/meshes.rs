//! Meshes in memory.

use std::sync::Arc;

use mesh::{TriMesh, Welded};
use numpy::{
    PyArray1, PyArray2,
    ndarray::{ArrayView, Ix2},
};
use pyo3::prelude::*;

use crate::{
    arrays,
    errors::Failure,
    objects::counted,
    running::{Running, run},
};

/// A triangle mesh: vertices and faces as they were given, and the surface that they make.
///
/// Parameters
/// ----------
/// vertices : array_like, (n, 3), float64
///     Positions, in any unit.
/// faces : array_like, (m, 3), int32 or int64
///     The vertices of each triangle, from 0.
/// weld : bool, default True
///     Whether vertices at exactly equal positions are one vertex of the surface, as they are when files are read: texture seams and hard edges
///     split vertices, and a mark must not tear them apart. Vertices that no triangle uses are no part of the surface, nor are triangles with two corners at
///     one point. With False the arrays are the surface as they stand.
///
/// Raises
/// ------
/// ValueError, TypeError
///     The arrays have another shape, or hold something else.
/// MeshError
///     An index is out of range, a coordinate is not finite, or there are no triangles.
///
/// Examples
/// --------
/// >>> import sigmark
/// >>> sigmark.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
/// Mesh(3 vertices, 1 face)
#[pyclass(frozen, module = "sigmark")]
#[derive(Clone)]
pub(crate) struct Mesh {
    surface: Arc<TriMesh>,
    /// Where they are not the surface.
    given: Option<Arc<Given>>,
}

/// Vertices and triangles as they were given.
struct Given {
    positions: Vec<[f64; 3]>,
    triangles: Arc<Vec<[u32; 3]>>,
    /// The surface's vertex of each; none for those that no triangle uses.
    vertex_of: Arc<[Option<u32>]>,
}

impl Mesh {
    /// A mesh whose vertices and triangles are the surface.
    pub(crate) fn plain(surface: impl Into<Arc<TriMesh>>) -> Self {
        Self {
            surface: surface.into(),
            given: None,
        }
    }

    /// Of arrays; see the class.
    pub(crate) fn of_arrays(
        vertices: &Bound<'_, PyAny>,
        faces: &Bound<'_, PyAny>,
        weld: bool,
    ) -> PyResult<Self> {
        let positions = arrays::points(vertices, "vertices")?;
        let triangles = arrays::triangles(faces, "faces", positions.len())?;
        run(vertices.py(), Running::new(Some(1), None), move |_| match weld {
            true => Self::welded(positions, triangles),
            false => Ok(Self::plain(TriMesh::new(positions, triangles)?)),
        })
    }

    fn welded(positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Result<Self, Failure> {
        let welded = Welded::new(&positions, &triangles)?;
        let summary = welded.summary();
        if (
            summary.merged_vertices,
            summary.unused_vertices,
            summary.dropped_triangles,
        ) == (0, 0, 0)
        {
            return Ok(Self::plain(welded.into_mesh()));
        }
        let given = Given {
            positions,
            triangles: Arc::new(triangles),
            vertex_of: welded.vertex_of().into(),
        };
        Ok(Self {
            surface: Arc::new(welded.into_mesh()),
            given: Some(Arc::new(given)),
        })
    }

    pub(crate) fn surface(&self) -> &Arc<TriMesh> {
        &self.surface
    }

    /// The same mesh with its surface elsewhere; what is no part of it stays.
    pub(crate) fn moved(&self, surface: Arc<TriMesh>) -> Self {
        let given = self.given.as_ref().map(|given| {
            let place = |(&own, vertex): (&[f64; 3], &Option<u32>)| {
                vertex.map_or(own, |v| surface.positions()[v as usize])
            };
            let positions = given.positions.iter().zip(given.vertex_of.iter());
            Arc::new(Given {
                positions: positions.map(place).collect(),
                triangles: Arc::clone(&given.triangles),
                vertex_of: Arc::clone(&given.vertex_of),
            })
        });
        Self { surface, given }
    }

    fn positions(&self) -> &[[f64; 3]] {
        let given = self.given.as_ref().map(|given| &given.positions[..]);
        given.unwrap_or_else(|| self.surface.positions())
    }

    fn triangles(&self) -> &[[u32; 3]] {
        let given = self.given.as_ref().map(|given| &given.triangles[..]);
        given.unwrap_or_else(|| self.surface.triangles())
    }
}

#[pymethods]
impl Mesh {
    #[new]
    #[pyo3(signature = (vertices, faces, *, weld = true))]
    fn new(vertices: &Bound<'_, PyAny>, faces: &Bound<'_, PyAny>, weld: bool) -> PyResult<Self> {
        Self::of_arrays(vertices, faces, weld)
    }

    /// Positions, (n, 3), float64: a read-only view, no copy.
    #[getter]
    fn vertices<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray2<f64>> {
        arrays::view(slf, kept_positions)
    }

    /// The vertices of each triangle, (m, 3), int64; a new array each time.
    #[getter]
    fn faces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i64>>> {
        let faces = self.triangles().iter().map(|t| t.map(i64::from));
        arrays::owned_rows(py, faces.collect())
    }

    /// The surface alone, without what was merged or is not used: the mesh that is signed and compared, and whose vertices the rows of a spectrum are.
    #[getter]
    #[pyo3(name = "surface")]
    fn surface_alone(&self) -> Self {
        Self::plain(Arc::clone(&self.surface))
    }

    /// For each vertex that of the surface, (n,), int64; −1 for those that no triangle uses. `eigenfunctions[mesh.vertex_of]` has a row for each vertex where
    /// none is −1.
    #[getter]
    fn vertex_of<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let numbers = match &self.given {
            Some(given) => given.vertex_of.iter().map(|v| v.map_or(-1, i64::from)).collect(),
            None => (0..self.surface.vertex_count() as i64).collect(),
        };
        arrays::owned(py, numbers)
    }

    /// The same mesh with other positions, one a vertex, (n, 3). Vertices that are one on the surface must stay so.
    ///
    /// Raises
    /// ------
    /// MeshError
    ///     There are more or fewer of them, or one is not finite.
    fn with_vertices(&self, vertices: &Bound<'_, PyAny>) -> PyResult<Self> {
        let positions = arrays::points(vertices, "vertices")?;
        match &self.given {
            None => {
                let surface = self.surface.with_positions(positions).map_err(Failure::from)?;
                Ok(Self::plain(surface))
            }
            Some(given) if positions.len() == given.positions.len() => {
                Ok(Self::welded(positions, given.triangles.to_vec())?)
            }
            Some(given) => Err(Failure::from(mesh::MeshError::PositionCount {
                given: positions.len(),
                expected: given.positions.len(),
            })
            .into()),
        }
    }

    /// The area of the surface, in the square of the unit.
    #[getter]
    fn area(&self) -> f64 {
        self.surface.area()
    }

    /// The length of the bounding box's diagonal, in the unit of the vertices.
    #[getter]
    fn diagonal(&self) -> f64 {
        self.surface.bounding_box().diagonal()
    }

    fn __repr__(&self) -> String {
        let vertices = counted(self.positions().len(), "vertex", "vertices");
        let faces = counted(self.triangles().len(), "face", "faces");
        let surface = self.given.as_ref().map_or_else(String::new, |_| {
            format!(
                "; a surface of {}",
                counted(self.surface.vertex_count(), "vertex", "vertices")
            )
        });
        format!("Mesh({vertices}, {faces}{surface})")
    }
}

fn kept_positions(mesh: &Mesh) -> ArrayView<'_, f64, Ix2> {
    arrays::rows(mesh.positions())
}
