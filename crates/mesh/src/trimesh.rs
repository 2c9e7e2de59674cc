use crate::MeshError;

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
        for (what, count) in [("vertices", positions.len()), ("triangles", triangles.len())] {
            if count >= u32::MAX as usize {
                return Err(MeshError::TooLarge { what, count });
            }
        }
        if triangles.is_empty() {
            return Err(MeshError::NoTriangles);
        }
        check_finite(&positions)?;
        for (triangle, &[a, b, c]) in triangles.iter().enumerate() {
            if let Some(&v) = [a, b, c].iter().find(|&&v| v as usize >= positions.len()) {
                return Err(MeshError::IndexOutOfRange { triangle, vertex: v.into(), count: positions.len() });
            }
            if a == b || b == c || c == a {
                return Err(MeshError::RepeatedVertex { triangle, vertex: if b == c { b } else { a } });
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
            return Err(MeshError::PositionCount { given: positions.len(), expected: self.positions.len() });
        }
        check_finite(&positions)?;
        Ok(Self { positions, triangles: self.triangles.clone() })
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

    /// The smallest axis-aligned box around the vertices.
    pub fn bounding_box(&self) -> BoundingBox {
        BoundingBox::of(&self.positions)
    }
}

fn check_finite(positions: &[[f64; 3]]) -> Result<(), MeshError> {
    match positions.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        Some(vertex) => Err(MeshError::NotFinite { vertex, position: positions[vertex] }),
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
        let mut bounds = Self { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };
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

    /// Length of the diagonal, the yardstick of every relative distance in this project.
    pub fn diagonal(&self) -> f64 {
        self.size().iter().map(|s| s * s).sum::<f64>().sqrt()
    }
}
