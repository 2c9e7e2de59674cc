//! Tessellation bias: a suspect's triangles are flat and the original is not, so samples between the suspect's vertices are off even
//! where these lie on the original; after decimation, by more than a mark. By how much is known but for a factor: it is what is left
//! when the suspect's vertices are put onto the original.

use job::Job;
use mesh::{
    Similarity, TriMesh,
    vector::{add, cross, dot, scaled, sub},
};
use registration::{PreparedMesh, Resampled};

use crate::mark::{MarkError, Registered};

/// At each vertex that was sampled: the offset, had the suspect's vertices been on the original; zero elsewhere.
pub(super) fn bias(
    original: &PreparedMesh,
    suspect: &TriMesh,
    registered: &Registered,
    sampled: &Resampled,
    pose: &Similarity,
    job: &Job,
) -> Result<Vec<f64>, MarkError> {
    let placed: Vec<[f64; 3]> = suspect.positions().iter().map(|&p| pose.apply(p)).collect();
    let nearest = original.surface().nearest_of(&placed, job)?;
    let at_vertex = |v: usize| {
        let (along, seen) = (registered.along[v]?, registered.positions[v]?);
        let corners = suspect.triangles()[sampled.triangles[v]? as usize].map(|w| w as usize);
        let weights = barycentric(corners.map(|w| placed[w]), seen);
        let moved = corners.iter().zip(weights).fold([0.0; 3], |sum, (&w, weight)| {
            add(sum, scaled(sub(nearest[w].point, placed[w]), weight))
        });
        Some(sampled.offsets[v]? + dot(along, moved))
    };
    let vertices = 0..registered.along.len();
    Ok(vertices.map(|v| at_vertex(v).unwrap_or(0.0)).collect())
}

/// The normal of a triangle, of any length.
pub(super) fn normal(mesh: &TriMesh, triangle: usize) -> [f64; 3] {
    let [a, b, c] = mesh.corners(triangle);
    cross(sub(b, a), sub(c, a))
}

/// Weights of a triangle's corners, with sum 1, for a point of its plane; a third each where it has no area.
fn barycentric([a, b, c]: [[f64; 3]; 3], p: [f64; 3]) -> [f64; 3] {
    let normal = cross(sub(b, a), sub(c, a));
    let square = dot(normal, normal);
    if square == 0.0 {
        return [1.0 / 3.0; 3];
    }
    let of = |from: [f64; 3], to: [f64; 3]| dot(cross(sub(to, from), sub(p, from)), normal) / square;
    [of(b, c), of(c, a), of(a, b)]
}
