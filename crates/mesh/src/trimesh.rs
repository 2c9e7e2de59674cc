use crate::normals::vertex_normals;
use crate::vector::{cross, dot, norm, sub};
use crate::{Adjacency, Edges, MeshError};

/// A triangle mesh: #V positions in the unit of the model, and #F triangles of vertex indices from 0.
///
/// Always valid: at least one triangle, every coordinate finite, every index in range, no triangle with a repeated
/// vertex. Unused vertices, non-manifold places, boundaries and triangles of area zero are allowed.
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
        check_finite(&positions)?;
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
    /// When the count differs or a coordinate is not finite.
    pub fn with_positions(&self, positions: Vec<[f64; 3]>) -> Result<Self, MeshError> {
        if positions.len() != self.positions.len() {
            return Err(MeshError::PositionCount {
                given: positions.len(),
                expected: self.positions.len(),
            });
        }
        check_finite(&positions)?;
        Ok(Self {
            positions,
            triangles: self.triangles.clone(),
        })
    }

    /// Vertex positions, #V by 3.
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.positions
    }

    /// Vertex indices of each triangle, #F by 3.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// #V.
    pub fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// #F.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// The positions of a triangle's three corners.
    pub fn corners(&self, triangle: usize) -> [[f64; 3]; 3] {
        self.triangles[triangle].map(|v| self.positions[v as usize])
    }

    /// Area of a triangle, ½ |(b − a) × (c − a)|.
    pub fn triangle_area(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.corners(triangle);
        0.5 * norm(cross(sub(b, a), sub(c, a)))
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
        let centre = self.bounding_box().centre();
        let tetrahedron = |t: usize| {
            let [a, b, c] = self.corners(t).map(|p| sub(p, centre));
            dot(a, cross(b, c)) / 6.0
        };
        (0..self.triangle_count()).map(tetrahedron).sum()
    }

    /// Unit normals of the vertices, #V by 3: the normals of the triangles around, weighted by their angles there.
    ///
    /// They do not depend on how flat regions are triangulated (Thürmer and Wüthrich 1998). Zero where undefined: at
    /// vertices that have no triangle of non-zero area, or whose weighted normals cancel.
    pub fn vertex_normals(&self) -> Vec<[f64; 3]> {
        vertex_normals(self)
    }

    /// Which vertices share an edge with which.
    pub fn neighbours(&self) -> Adjacency {
        Edges::of(self).neighbours(self.vertex_count())
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

fn check_finite(positions: &[[f64; 3]]) -> Result<(), MeshError> {
    match positions.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        Some(vertex) => Err(MeshError::NotFinite {
            vertex,
            position: positions[vertex],
        }),
        None => Ok(()),
    }
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct BoundingBox {
    /// Least x, y and z.
    pub min: [f64; 3],
    /// Greatest x, y and z.
    pub max: [f64; 3],
}

impl BoundingBox {
    /// The box of a set of points. Of no points: `min` is +∞ and `max` −∞.
    pub fn of(points: &[[f64; 3]]) -> Self {
        let mut bounds = Self {
            min: [f64::INFINITY; 3],
            max: [f64::NEG_INFINITY; 3],
        };
        for p in points {
            for axis in 0..3 {
                bounds.min[axis] = bounds.min[axis].min(p[axis]);
                bounds.max[axis] = bounds.max[axis].max(p[axis]);
            }
        }
        bounds
    }

    /// Edge lengths (φ of eq. 12).
    pub fn size(&self) -> [f64; 3] {
        std::array::from_fn(|axis| self.max[axis] - self.min[axis])
    }

    /// The point in the middle.
    pub fn centre(&self) -> [f64; 3] {
        std::array::from_fn(|axis| 0.5 * self.min[axis] + 0.5 * self.max[axis])
    }

    /// Length of the diagonal, the yardstick of every relative distance in this project.
    pub fn diagonal(&self) -> f64 {
        self.size().iter().map(|s| s * s).sum::<f64>().sqrt()
    }
}
