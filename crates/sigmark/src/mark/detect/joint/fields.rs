//! The fields G of the equations: what moves a surface besides the mark, known from the original but for a factor each.

use job::{Job, JobError};
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

/// The normal, of length 1, and L x, L² x, … in diagonals, at each vertex: #V by [`SURFACE_FIELDS`].
pub(super) fn surface_fields(mesh: &TriMesh, job: &Job) -> Result<Vec<[Vec3; SURFACE_FIELDS]>, JobError> {
    let diagonal = mesh.bounding_box().diagonal();
    let vertices = 0..mesh.vertex_count();
    let mut field: Vec<Vec3> = vertices.map(|v| mesh.point(v) * (1.0 / diagonal)).collect();
    let normals = mesh.vertex_normals();
    let with_normal = |normal| {
        let mut fields = [Vec3::ZERO; SURFACE_FIELDS];
        fields[0] = Vec3(normal);
        fields
    };
    let mut all: Vec<[Vec3; SURFACE_FIELDS]> = normals.into_iter().map(with_normal).collect();
    let stars = mesh.vertex_triangles();
    for k in OFFSET_FIELDS..SURFACE_FIELDS {
        job.go_on()?;
        field = to_neighbours(mesh, &stars, &field, job)?;
        job.for_chunks(&mut all, CHUNK, |i, all| {
            for (fields, &value) in all.iter_mut().zip(&field[i * CHUNK..]) {
                fields[k] = value;
            }
        })?;
    }
    Ok(all)
}

/// Vertices that a thread takes at a time.
const CHUNK: usize = 4096;

/// L applied to a field: from its value at each vertex to the mean of those at the neighbours; neighbours across two triangles, as
/// most are, count twice.
fn to_neighbours(
    mesh: &TriMesh,
    stars: &VertexStars,
    field: &[Vec3],
    job: &Job,
) -> Result<Vec<Vec3>, JobError> {
    job.map(field.len(), CHUNK, |v| {
        let (mut sum, mut count) = (Vec3::ZERO, 0.0_f64);
        for &t in stars.of(v) {
            let corners = mesh.triangles()[t as usize];
            // Around the triangle from here: how a suspect without noise is read hangs on how these sums are rounded.
            let here = corners.iter().position(|&w| w as usize == v).unwrap_or(0);
            for w in [corners[(here + 1) % 3], corners[(here + 2) % 3]] {
                sum += field[w as usize] - field[v];
                count += 1.0;
            }
        }
        sum * (1.0 / count.max(1.0))
    })
}
