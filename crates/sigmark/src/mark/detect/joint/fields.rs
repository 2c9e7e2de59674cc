//! The fields G of the equations: what moves a surface besides the mark, known from the original but for a factor each.

use mesh::{TriMesh, Vec3};

/// Scale, three of rotation, three of translation.
pub(super) const SIMILARITY_FIELDS: usize = 7;

/// Degree of the polynomial of L. Ten steps of Laplacian smoothing are known well with 8, thirty are not: there T₀ of the bunny is 24 with 8 and 42 with 14.
pub(super) const SMOOTHING_FIELDS: usize = 14;

/// What flat triangles do, and what harmonics that carry chips hold of it; what they do where quadrics put their corners, by two kinds of these.
pub(super) const TESSELLATION_FIELDS: usize = 4;

/// Stretches and shears that are no similarity, and all vector fields of degree 2 and 3.
pub(super) const BENDING_FIELDS: usize = BENDING_DEGREES[1];

/// How many of those there are up to degree 2, and up to 3.
pub(super) const BENDING_DEGREES: [usize; 2] = [5 + 3 * 6, 5 + 3 * (6 + 10)];

/// All fields but the bending ones, in this order.
pub(super) const RIGID_FIELDS: usize = SIMILARITY_FIELDS + SMOOTHING_FIELDS + TESSELLATION_FIELDS;

/// All fields, in this order.
pub(super) const FIELDS: usize = RIGID_FIELDS + BENDING_FIELDS;

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

/// L x, L² x, … at each vertex, in diagonals: #V by [`SMOOTHING_FIELDS`].
pub(super) fn smoothing_fields(mesh: &TriMesh) -> Vec<[Vec3; SMOOTHING_FIELDS]> {
    let diagonal = mesh.bounding_box().diagonal();
    let vertices = 0..mesh.vertex_count();
    let mut field: Vec<Vec3> = vertices.map(|v| mesh.point(v) * (1.0 / diagonal)).collect();
    let mut all = vec![[Vec3::ZERO; SMOOTHING_FIELDS]; mesh.vertex_count()];
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
fn to_neighbours(mesh: &TriMesh, field: &[Vec3]) -> Vec<Vec3> {
    let mut sums = vec![(Vec3::ZERO, 0.0_f64); field.len()];
    for &[a, b, c] in mesh.triangles() {
        for [v, next, last] in [[a, b, c], [b, c, a], [c, a, b]] {
            let (sum, count) = &mut sums[v as usize];
            for w in [next, last] {
                *sum += field[w as usize] - field[v as usize];
                *count += 1.0;
            }
        }
    }
    sums.into_iter()
        .map(|(sum, count)| sum * (1.0 / count.max(1.0)))
        .collect()
}
