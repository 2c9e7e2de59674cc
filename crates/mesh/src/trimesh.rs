use crate::{BoundingBox, MeshError, Vec3, VertexStars};

/// No coordinate may be greater: squares of areas, and squares of those, are to stay numbers. What single precision holds is within it.
pub const LARGEST_COORDINATE: f64 = f32::MAX as f64;

/// No model that is not a single point may have a bounding box whose longest edge is shorter, for the same reason.
pub const SMALLEST_EXTENT: f64 = f32::MIN_POSITIVE as f64;

/// A triangle mesh: #V positions in the unit of the model, and #F triangles of vertex indices from 0.
///
/// Always valid: at least one triangle, every coordinate finite and at most [`LARGEST_COORDINATE`], all of them more than
/// [`SMALLEST_EXTENT`] apart or one point, every index in range, no triangle with a repeated vertex. Unused vertices, non-manifold places, boundaries and triangles of area zero are allowed.
///
/// ```
/// let positions = vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]];
/// let mesh = mesh::TriMesh::new(positions, vec![[0, 1, 2]])?;
/// assert_eq!(mesh.area(), 6.0);
/// assert_eq!(mesh.bounding_box().diagonal(), 5.0);
/// assert_eq!(mesh.vertex_normals(), [[0.0, 0.0, 1.0]; 3]);
/// # Ok::<(), mesh::MeshError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct TriMesh {
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl TriMesh {
    /// Checks and takes `positions` (#V by 3) and `triangles` (#F by 3).
    ///
    /// # Errors
    /// Says which vertex or triangle breaks which of the invariants above.
    pub fn new(positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        check_counts(positions.len(), triangles.len())?;
        if triangles.is_empty() {
            return Err(MeshError::NoTriangles);
        }
        check_positions(&positions, |_| true)?;
        for (triangle, &[a, b, c]) in triangles.iter().enumerate() {
            if let Some(&v) = [a, b, c].iter().find(|&&v| v as usize >= positions.len()) {
                return Err(MeshError::IndexOutOfRange {
                    triangle,
                    vertex: v.into(),
                    count: positions.len(),
                });
            }
            if a == b || b == c || c == a {
                return Err(MeshError::RepeatedVertex {
                    triangle,
                    vertex: if b == c { b } else { a },
                });
            }
        }
        Ok(Self { positions, triangles })
    }

    /// The same triangles over other positions, one a vertex.
    ///
    /// # Errors
    /// When the count differs, or positions are not as they must be.
    pub fn with_positions(&self, positions: Vec<[f64; 3]>) -> Result<Self, MeshError> {
        if positions.len() != self.positions.len() {
            return Err(MeshError::PositionCount {
                given: positions.len(),
                expected: self.positions.len(),
            });
        }
        check_positions(&positions, |_| true)?;
        Ok(Self {
            positions,
            triangles: self.triangles.clone(),
        })
    }

    /// Vertex positions, #V by 3.
    #[inline]
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.positions
    }

    /// Vertex indices of each triangle, #F by 3.
    #[inline]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// #V.
    #[inline]
    pub fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// #F.
    #[inline]
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// The position of a vertex.
    #[inline]
    pub fn point(&self, vertex: usize) -> Vec3 {
        Vec3(self.positions[vertex])
    }

    /// The positions of a triangle's three corners.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|v| self.point(v as usize))
    }

    /// Area of a triangle, ½ |(b − a) × (c − a)|.
    pub fn triangle_area(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(c - a).norm()
    }

    /// Sum of the areas of all triangles.
    pub fn area(&self) -> f64 {
        (0..self.triangle_count()).map(|t| self.triangle_area(t)).sum()
    }

    /// Sum of the signed volumes of the tetrahedra between the triangles and the centre of the bounding box.
    ///
    /// The enclosed volume of a closed, consistently oriented surface: positive when its triangles face outward
    /// (counter-clockwise seen from outside). Of any other surface it depends on the centre and means little.
    pub fn signed_volume(&self) -> f64 {
        let centre = Vec3(self.bounding_box().centre());
        let tetrahedron = |t: usize| {
            let [a, b, c] = self.corners(t).map(|p| p - centre);
            a.dot(b.cross(c)) / 6.0
        };
        (0..self.triangle_count()).map(tetrahedron).sum()
    }

    /// The triangles at each vertex.
    pub fn vertex_triangles(&self) -> VertexStars {
        let corners = self.triangles.iter().enumerate();
        let pairs = corners.flat_map(|(t, corners)| corners.map(|v| (v, t as u32)));
        VertexStars::gather(self.vertex_count(), pairs)
    }

    /// Whether each vertex has a triangle, #V.
    pub fn used_vertices(&self) -> Vec<bool> {
        let mut used = vec![false; self.vertex_count()];
        for &v in self.triangles.as_flattened() {
            used[v as usize] = true;
        }
        used
    }

    /// The smallest axis-aligned box around the vertices.
    pub fn bounding_box(&self) -> BoundingBox {
        BoundingBox::of(&self.positions)
    }
}

/// Refuses more vertices or triangles than the 32-bit indices of vertices and of (triangle, corner) pairs can name.
pub(crate) fn check_counts(vertices: usize, triangles: usize) -> Result<(), MeshError> {
    let limit = u32::MAX as usize - 1;
    for (what, count, limit) in [("vertices", vertices, limit), ("triangles", triangles, limit / 3)] {
        if count > limit {
            return Err(MeshError::TooLarge { what, count, limit });
        }
    }
    Ok(())
}

/// That those positions which count are numbers that can be computed with.
pub(crate) fn check_positions(
    positions: &[[f64; 3]],
    counts: impl Fn(usize) -> bool,
) -> Result<(), MeshError> {
    let counted = || positions.iter().enumerate().filter(|&(vertex, _)| counts(vertex));
    for (vertex, &position) in counted() {
        if !position.iter().all(|x| x.is_finite()) {
            return Err(MeshError::NotFinite { vertex, position });
        }
        if position.iter().any(|x| x.abs() > LARGEST_COORDINATE) {
            return Err(MeshError::TooFar { vertex, position });
        }
    }
    let mut bounds = BoundingBox::EMPTY;
    counted().for_each(|(_, &position)| bounds.include_point(position.into()));
    let extent = bounds.size().into_iter().fold(0.0, f64::max);
    match extent > 0.0 && extent < SMALLEST_EXTENT {
        true => Err(MeshError::TooSmall { extent }),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    const POSITIONS: [[f64; 3]; 3] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]];

    fn mesh(triangles: &[[u32; 3]]) -> Result<TriMesh, MeshError> {
        TriMesh::new(POSITIONS.to_vec(), triangles.to_vec())
    }

    #[test]
    fn what_is_not_a_surface_is_refused_with_its_place() {
        assert_eq!(mesh(&[]), Err(MeshError::NoTriangles));
        let out_of_range = MeshError::IndexOutOfRange {
            triangle: 1,
            vertex: 3,
            count: 3,
        };
        assert_eq!(mesh(&[[0, 1, 2], [0, 1, 3]]), Err(out_of_range));
        for (triangle, vertex) in [([2, 2, 1], 2), ([1, 0, 0], 0), ([1, 2, 1], 1)] {
            assert_eq!(
                mesh(&[triangle]),
                Err(MeshError::RepeatedVertex { triangle: 0, vertex })
            );
        }
        let mut positions = POSITIONS.to_vec();
        positions[1][2] = f64::INFINITY;
        let refused = TriMesh::new(positions.clone(), vec![[0, 1, 2]]);
        assert_eq!(
            refused,
            Err(MeshError::NotFinite {
                vertex: 1,
                position: [1.0, 0.0, f64::INFINITY]
            })
        );
        let valid = mesh(&[[0, 1, 2]]).unwrap();
        assert!(matches!(
            valid.with_positions(positions),
            Err(MeshError::NotFinite { vertex: 1, .. })
        ));
        for (scale, far, small) in [
            (3.4e38, false, false),
            (3.5e38, true, false),
            (1.2e-38, false, false),
            (1.1e-38, false, true),
            (0.0, false, false),
        ] {
            let scaled = valid.with_positions(POSITIONS.map(|position| position.map(|x| scale * x)).to_vec());
            assert_eq!(
                matches!(scaled, Err(MeshError::TooFar { vertex: 1, .. })),
                far,
                "{scale}"
            );
            assert_eq!(
                matches!(scaled, Err(MeshError::TooSmall { .. })),
                small,
                "{scale}"
            );
            assert_eq!(scaled.is_ok(), !far && !small, "{scale}");
        }
        let too_few = MeshError::PositionCount {
            given: 2,
            expected: 3,
        };
        assert_eq!(valid.with_positions(POSITIONS[..2].to_vec()), Err(too_few));
    }

    #[test]
    fn more_than_32_bits_can_count_is_refused() {
        assert!(check_counts(u32::MAX as usize - 1, (u32::MAX as usize - 1) / 3).is_ok());
        assert!(matches!(
            check_counts(u32::MAX as usize, 1),
            Err(MeshError::TooLarge { what: "vertices", .. })
        ));
        assert!(matches!(
            check_counts(3, 1 << 31),
            Err(MeshError::TooLarge {
                what: "triangles",
                ..
            })
        ));
    }

    #[test]
    fn area_and_volume_of_a_cube_are_those_of_the_formula() {
        let cube = shapes::translated(&shapes::cube(3.0), [100.0, 200.0, 300.0]);
        assert!((cube.area() - 54.0).abs() < 1e-11);
        assert!((cube.signed_volume() - 27.0).abs() < 1e-11);
        assert!((shapes::inside_out(&cube).signed_volume() + 27.0).abs() < 1e-11);
        assert_eq!(
            cube.bounding_box(),
            BoundingBox {
                min: [100., 200., 300.],
                max: [103., 203., 303.]
            }
        );
        assert_eq!(cube.bounding_box().centre(), [101.5, 201.5, 301.5]);
        assert_eq!(cube.triangle_area(0), 4.5);
    }
}
