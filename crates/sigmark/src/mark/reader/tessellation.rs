//! Tessellation bias: a suspect's triangles are flat and the original is not, so samples between the suspect's vertices are off even
//! where these lie on the original; after decimation, by more than a mark. By how much is known but for a factor: it is what is left
//! when the suspect's vertices are put onto the original.

use job::Job;
use mesh::{Similarity, TriMesh, Vec3};
use registration::{PreparedMesh, Resampled};

use crate::mark::{MarkError, Registered, settling::barycentric};

/// At each vertex that was sampled: the offset, had the suspect's vertices been on the original; zero elsewhere.
pub(super) fn bias(
    original: &PreparedMesh,
    suspect: &TriMesh,
    registered: &Registered,
    sampled: &Resampled,
    pose: &Similarity,
    job: &Job,
) -> Result<Vec<f64>, MarkError> {
    let placed = pose.apply_all(suspect.positions());
    let nearest = original.surface().nearest_of(&placed, job)?;
    let at_vertex = |v: usize| {
        let (along, seen) = (Vec3(registered.along[v]?), Vec3(registered.positions[v]?));
        let corners = suspect.triangles()[sampled.triangles[v]? as usize].map(|w| w as usize);
        let weights = barycentric(corners.map(|w| Vec3(placed[w])), seen);
        let moved = corners.iter().zip(weights).fold(Vec3::ZERO, |sum, (&w, weight)| {
            sum + (Vec3(nearest[w].point) - Vec3(placed[w])) * weight
        });
        Some(sampled.offsets[v]? + along.dot(moved))
    };
    let vertices = 0..registered.along.len();
    Ok(vertices.map(|v| at_vertex(v).unwrap_or(0.0)).collect())
}

/// The normal of a triangle, of any length.
pub(super) fn normal(mesh: &TriMesh, triangle: usize) -> Vec3 {
    let [a, b, c] = mesh.corners(triangle);
    (b - a).cross(c - a)
}
