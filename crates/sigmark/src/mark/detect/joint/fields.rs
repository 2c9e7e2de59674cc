//! The fields G of the equations: what moves a surface besides the mark, known from the original but for a factor each.

use mesh::{
    TriMesh,
    vector::{add, scaled, sub},
};

/// Scale, three of rotation, three of translation.
pub(super) const SIMILARITY_FIELDS: usize = 7;

/// Degree of the polynomial of L. Ten steps of Laplacian smoothing are known well with 8, and no better with 10.
pub(super) const SMOOTHING_FIELDS: usize = 8;

/// What flat triangles do, and what harmonics that carry chips hold of it.
pub(super) const TESSELLATION_FIELDS: usize = 2;

/// All fields, in this order.
pub(super) const FIELDS: usize = SIMILARITY_FIELDS + SMOOTHING_FIELDS + TESSELLATION_FIELDS;

/// u·p, u·(eᵢ × p) and u·eᵢ: how a point p moves along u with each parameter of a small similarity.
pub(super) fn similarity_fields([x, y, z]: [f64; 3], [u, v, w]: [f64; 3]) -> [f64; SIMILARITY_FIELDS] {
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

/// L x, L² x, … at each vertex, in diagonals: #V by [`SMOOTHING_FIELDS`].
pub(super) fn smoothing_fields(mesh: &TriMesh) -> Vec<[[f64; 3]; SMOOTHING_FIELDS]> {
    let diagonal = mesh.bounding_box().diagonal();
    let mut field: Vec<[f64; 3]> = mesh
        .positions()
        .iter()
        .map(|&p| scaled(p, 1.0 / diagonal))
        .collect();
    let mut all = vec![[[0.0; 3]; SMOOTHING_FIELDS]; mesh.vertex_count()];
    for k in 0..SMOOTHING_FIELDS {
        field = to_neighbours(mesh, &field);
        for (powers, &value) in all.iter_mut().zip(&field) {
            powers[k] = value;
        }
    }
    all
}

/// L applied to a field: from its value at each vertex to the mean of those at the neighbours; neighbours across two triangles, as
/// most are, count twice.
fn to_neighbours(mesh: &TriMesh, field: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut sums = vec![([0.0; 3], 0.0); field.len()];
    for &[a, b, c] in mesh.triangles() {
        for [v, next, last] in [[a, b, c], [b, c, a], [c, a, b]] {
            let (sum, count) = &mut sums[v as usize];
            for w in [next, last] {
                *sum = add(*sum, sub(field[w as usize], field[v as usize]));
                *count += 1.0;
            }
        }
    }
    sums.into_iter()
        .map(|(sum, count): ([f64; 3], f64)| scaled(sum, 1.0 / count.max(1.0)))
        .collect()
}
