//! The fields G of the equations: what moves a surface besides the mark, known from the original but for a factor each.

use std::{collections::HashMap, sync::Arc};

use mesh::{TriMesh, Vec3, VertexStars};

/// Scale, three of rotation, three of translation.
pub(super) const SIMILARITY_FIELDS: usize = 7;

/// Degree of the polynomial of L. Ten steps of Laplacian smoothing are known well with 8, thirty are not: there T₀ of the bunny is 24 with 8 and 42 with 14.
pub(super) const SMOOTHING_FIELDS: usize = 14;

/// What flat triangles do, and what harmonics that carry chips hold of it; what they do where quadrics put their corners, by two kinds of these.
pub(super) const TESSELLATION_FIELDS: usize = 4;

/// A surface that grew or shrank by a constant along its normals: a wall that was given a thickness, or what a printer adds.
pub(super) const OFFSET_FIELDS: usize = 1;

/// Stretches and shears that are no similarity, and all vector fields of degree 2 and 3.
pub(super) const BENDING_FIELDS: usize = 5 + 3 * (6 + 10);

/// Those that are there for all suspects.
pub(super) const RIGID_FIELDS: usize = SIMILARITY_FIELDS + SMOOTHING_FIELDS + TESSELLATION_FIELDS;

/// Those that have much in common with the former, or with the lowest harmonics of a small model, and must be [worth it](super::system::optional_worth).
pub(super) const OPTIONAL_FIELDS: usize = OFFSET_FIELDS + BENDING_FIELDS;

/// How many of those there may be: the offset, bending up to degree 2, and up to 3.
pub(super) const OPTIONAL_LEVELS: [usize; 3] = [OFFSET_FIELDS, OFFSET_FIELDS + 5 + 3 * 6, OPTIONAL_FIELDS];

/// All fields, in this order.
pub(super) const FIELDS: usize = RIGID_FIELDS + OPTIONAL_FIELDS;

/// Those that a vertex has of the original's surface around it: the offset and smoothing.
pub(super) const SURFACE_FIELDS: usize = OFFSET_FIELDS + SMOOTHING_FIELDS;

/// u·p, u·(eᵢ × p) and u·eᵢ: how a point p moves along u with each parameter of a small similarity.
pub(super) fn similarity_fields(Vec3([x, y, z]): Vec3, Vec3([u, v, w]): Vec3) -> [f64; SIMILARITY_FIELDS] {
    [
        u * x + v * y + w * z,
        w * y - v * z,
        u * z - w * x,
        v * x - u * y,
        u,
        v,
        w,
    ]
}

/// u·f(p) for the fields f of a mild bending of space.
pub(super) fn bending_fields(p: Vec3, u: Vec3) -> [f64; BENDING_FIELDS] {
    let Vec3([x, y, z]) = p;
    let Vec3([a, b, c]) = u;
    let linear = [
        a * x - b * y,
        a * x + b * y - 2.0 * c * z,
        a * y + b * x,
        a * z + c * x,
        b * z + c * y,
    ];
    let squares = [x * x, y * y, z * z, x * y, y * z, z * x];
    let cubes = [
        x * x * x,
        y * y * y,
        z * z * z,
        x * x * y,
        y * y * z,
        z * z * x,
        x * y * y,
        y * z * z,
        z * x * x,
        x * y * z,
    ];
    let mut fields = [0.0; BENDING_FIELDS];
    fields[..5].copy_from_slice(&linear);
    let monomials = squares.into_iter().chain(cubes);
    for (field, monomial) in fields[5..].chunks_exact_mut(3).zip(monomials) {
        field.copy_from_slice(&[a * monomial, b * monomial, c * monomial]);
    }
    fields
}

/// The surface of an original. Its fields are computed for each patch when they are asked for: those of all vertices would be most of what reading holds in memory.
#[derive(Debug)]
pub(super) struct OriginalSurface {
    mesh: Arc<TriMesh>,
    diagonal: f64,
    normals: Vec<[f64; 3]>,
    stars: VertexStars,
}

impl OriginalSurface {
    pub(super) fn of(mesh: &Arc<TriMesh>) -> Self {
        Self {
            mesh: Arc::clone(mesh),
            diagonal: mesh.bounding_box().diagonal(),
            normals: mesh.vertex_normals(),
            stars: mesh.vertex_triangles(),
        }
    }

    /// The normal, of length 1, and L x, L² x, …, in diagonals, at each of some vertices, no two of which are the same: #V by [`SURFACE_FIELDS`].
    pub(super) fn fields(&self, vertices: &[u32]) -> Vec<[Vec3; SURFACE_FIELDS]> {
        let with_normal = |&v: &u32| {
            let mut fields = [Vec3::ZERO; SURFACE_FIELDS];
            fields[0] = Vec3(self.normals[v as usize]);
            fields
        };
        let mut all: Vec<[Vec3; SURFACE_FIELDS]> = vertices.iter().map(with_normal).collect();
        let around = self.around(vertices);
        let place = |&v: &u32| self.mesh.point(v as usize) * (1.0 / self.diagonal);
        let mut field: Vec<Vec3> = around.vertices.iter().map(place).collect();
        for k in 0..SMOOTHING_FIELDS {
            field = around.to_neighbours(&field, SMOOTHING_FIELDS - 1 - k);
            for (fields, &value) in all.iter_mut().zip(&field) {
                fields[OFFSET_FIELDS + k] = value;
            }
        }
        all
    }

    /// Some vertices and those around them, as far as the last of the powers of L reaches.
    fn around(&self, vertices: &[u32]) -> Around {
        let mut around = Around {
            vertices: vertices.to_vec(),
            within: vec![vertices.len()],
            offsets: vec![0],
            neighbours: Vec::new(),
        };
        let mut numbers: HashMap<u32, u32> = vertices.iter().copied().zip(0..).collect();
        let mut first = 0;
        for _ in 0..SMOOTHING_FIELDS {
            let last = around.vertices.len();
            for i in first..last {
                let v = around.vertices[i];
                for &t in self.stars.of(v as usize) {
                    let corners = self.mesh.triangles()[t as usize];
                    // Around the triangle from here: how a suspect without noise is read hangs on how sums are rounded.
                    let here = corners.iter().position(|&w| w == v).unwrap_or(0);
                    for w in [corners[(here + 1) % 3], corners[(here + 2) % 3]] {
                        let number = *numbers.entry(w).or_insert(around.vertices.len() as u32);
                        if number as usize == around.vertices.len() {
                            around.vertices.push(w);
                        }
                        around.neighbours.push(number);
                    }
                }
                around.offsets.push(around.neighbours.len());
            }
            around.within.push(around.vertices.len());
            first = last;
        }
        around
    }
}

/// Some vertices and those around them, ring after ring.
struct Around {
    vertices: Vec<u32>,
    /// How many lie within each number of rings, from 0.
    within: Vec<usize>,
    /// Where the neighbours of each vertex begin that lies within all rings but the last, and where the last end.
    offsets: Vec<usize>,
    /// By their places among the vertices; those across two triangles, as most are, twice.
    neighbours: Vec<u32>,
}

impl Around {
    /// L applied to a field, within so many rings: from its value at each vertex to the mean of those at the neighbours.
    fn to_neighbours(&self, field: &[Vec3], rings: usize) -> Vec<Vec3> {
        let of = |v: usize| {
            let neighbours = &self.neighbours[self.offsets[v]..self.offsets[v + 1]];
            let steps = neighbours.iter().map(|&w| field[w as usize] - field[v]);
            steps.sum::<Vec3>() * (1.0 / neighbours.len().max(1) as f64)
        };
        (0..self.within[rings]).map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    #[test]
    fn fields_are_the_same_whichever_vertices_are_asked_for() {
        let mesh = Arc::new(shapes::bumpy_torus(60, 40, 1));
        let surface = OriginalSurface::of(&mesh);
        let all: Vec<u32> = (0..mesh.vertex_count() as u32).collect();
        let everywhere = surface.fields(&all);
        let some: Vec<u32> = all.iter().copied().filter(|v| v % 97 < 5).rev().collect();
        for (&v, fields) in some.iter().zip(surface.fields(&some)) {
            assert_eq!(fields, everywhere[v as usize]);
        }
        assert!(surface.fields(&[]).is_empty());
    }

    #[test]
    fn the_first_power_is_the_way_to_the_mean_of_the_neighbours_in_diagonals() {
        let mesh = Arc::new(shapes::bumpy_sphere(3, 1));
        let neighbours = mesh.neighbours();
        let diagonal = mesh.bounding_box().diagonal();
        let all: Vec<u32> = (0..mesh.vertex_count() as u32).collect();
        for (v, fields) in OriginalSurface::of(&mesh).fields(&all).into_iter().enumerate() {
            let around = neighbours.of(v);
            let sum: Vec3 = around.iter().map(|&w| mesh.point(w as usize)).sum();
            let way = (sum * (1.0 / around.len() as f64) - mesh.point(v)) / diagonal;
            assert!((fields[OFFSET_FIELDS] - way).norm() < 1e-15);
            assert!((fields[0].norm() - 1.0).abs() < 1e-15);
        }
    }
}
