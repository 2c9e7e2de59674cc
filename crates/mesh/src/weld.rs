use crate::trimesh::{check_counts, check_positions};
use crate::{MeshError, TriMesh};

/// The surface in a file's vertices and triangles: vertices at exactly equal positions are one vertex.
///
/// Files repeat a vertex wherever a texture seam or a hard edge passes. Here such copies are merged (−0 equals +0),
/// triangles that lose a corner by it are dropped, and vertices that no remaining triangle uses are set aside.
/// [`Self::vertex_of`] leads back to the file. Vertices keep the order of their first used copies, triangles their order.
/// Triangles that occur twice are kept; [`TopologyReport`](crate::TopologyReport) counts them.
///
/// ```
/// // Two triangles that do not share indices, and a stray vertex.
/// let positions = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [9., 9., 9.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
/// let welded = mesh::Welded::new(&positions, &[[0, 1, 2], [4, 5, 6]])?;
/// assert_eq!(welded.mesh().vertex_count(), 4);
/// assert_eq!(welded.vertex_of(), [Some(0), Some(1), Some(2), None, Some(1), Some(3), Some(2)]);
/// # Ok::<(), mesh::MeshError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Welded {
    mesh: TriMesh,
    vertex_of: Vec<Option<u32>>,
    summary: WeldSummary,
}

/// What welding did to a file's geometry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct WeldSummary {
    /// Vertices in the file.
    pub file_vertices: usize,
    /// Triangles in the file (polygons count as the triangles they were split into).
    pub file_triangles: usize,
    /// File vertices that became one with an earlier one at the same position.
    pub merged_vertices: usize,
    /// File vertices that are set aside, because no triangle of the surface uses them.
    pub unused_vertices: usize,
    /// File triangles that are dropped, because two of their corners lie at one point.
    pub dropped_triangles: usize,
}

impl Welded {
    /// Welds `positions` (file vertices by 3) under `triangles` (file triangles by 3).
    ///
    /// O(n log n) time in the number of file vertices.
    ///
    /// # Errors
    /// When an index is out of range, a used vertex is not as a [`TriMesh`](crate::TriMesh) wants it (unused ones may be anything), or no triangle remains.
    /// Indices in errors are the file's.
    pub fn new(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<Self, MeshError> {
        check_counts(positions.len(), triangles.len())?;
        let referenced = referenced_vertices(positions, triangles)?;
        let first_copy = first_copies(positions, &referenced);

        let merged = triangles.iter().map(|t| t.map(|v| first_copy[v as usize]));
        let kept: Vec<[u32; 3]> = merged.filter(|[a, b, c]| a != b && b != c && c != a).collect();
        if kept.is_empty() {
            let count = triangles.len();
            return Err(if count == 0 {
                MeshError::NoTriangles
            } else {
                MeshError::OnlyRepeatedVertices { count }
            });
        }

        let number_of = consecutive_numbers(&kept, positions.len());
        let vertex_of: Vec<Option<u32>> = first_copy.iter().map(|&v| number_of[v as usize]).collect();
        let used = positions
            .iter()
            .zip(&number_of)
            .filter(|(_, number)| number.is_some());
        let surface: Vec<[f64; 3]> = used.map(|(&p, _)| p).collect();
        let numbered = kept
            .iter()
            .map(|t| t.map(|v| number_of[v as usize].unwrap_or_default()))
            .collect();

        let unused = vertex_of.iter().filter(|v| v.is_none()).count();
        let summary = WeldSummary {
            file_vertices: positions.len(),
            file_triangles: triangles.len(),
            merged_vertices: positions.len() - unused - surface.len(),
            unused_vertices: unused,
            dropped_triangles: triangles.len() - kept.len(),
        };
        Ok(Self {
            mesh: TriMesh::new(surface, numbered)?,
            vertex_of,
            summary,
        })
    }

    /// The surface.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// The surface alone.
    pub fn into_mesh(self) -> TriMesh {
        self.mesh
    }

    /// The surface vertex of each file vertex; `None` for those set aside.
    pub fn vertex_of(&self) -> &[Option<u32>] {
        &self.vertex_of
    }

    /// What was merged, set aside and dropped.
    pub fn summary(&self) -> WeldSummary {
        self.summary
    }
}

/// Marks the vertices that triangles refer to; all of them must exist and be as a [`TriMesh`](crate::TriMesh) wants them.
fn referenced_vertices(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<Vec<bool>, MeshError> {
    let mut referenced = vec![false; positions.len()];
    for (triangle, corners) in triangles.iter().enumerate() {
        for &v in corners {
            match referenced.get_mut(v as usize) {
                Some(mark) => *mark = true,
                None => {
                    return Err(MeshError::IndexOutOfRange {
                        triangle,
                        vertex: v.into(),
                        count: positions.len(),
                    });
                }
            }
        }
    }
    check_positions(positions, |vertex| referenced[vertex])?;
    Ok(referenced)
}

/// The smallest referenced vertex at the same position, for each referenced vertex; itself for the others.
fn first_copies(positions: &[[f64; 3]], referenced: &[bool]) -> Vec<u32> {
    // Adding zero turns −0 into +0; after that, equal numbers have equal bits.
    let key = |v: u32| positions[v as usize].map(|x| (x + 0.0).to_bits());
    let mut sorted: Vec<([u64; 3], u32)> = (0..positions.len() as u32)
        .filter(|&v| referenced[v as usize])
        .map(|v| (key(v), v))
        .collect();
    sorted.sort_unstable();
    let mut first_copy: Vec<u32> = (0..positions.len() as u32).collect();
    for copies in sorted.chunk_by(|x, y| x.0 == y.0) {
        for &(_, v) in copies {
            first_copy[v as usize] = copies[0].1;
        }
    }
    first_copy
}

/// Numbers the vertices that occur in `triangles` from 0, in ascending order.
fn consecutive_numbers(triangles: &[[u32; 3]], vertex_count: usize) -> Vec<Option<u32>> {
    let mut numbers = vec![None; vertex_count];
    for &v in triangles.as_flattened() {
        numbers[v as usize] = Some(0);
    }
    for (number, used) in (0..).zip(numbers.iter_mut().flatten()) {
        *used = number;
    }
    numbers
}
