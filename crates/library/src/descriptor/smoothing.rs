//! What smoothing leaves of a coarse surface.

use mesh::{Edges, TriMesh, Vec3};

/// Surfaces of more triangles are hardly changed.
const COARSE: usize = 60_000;
/// Every vertex moves so far to the mean of its neighbours, so often.
const STEP: f64 = 0.9;
const STEPS: usize = 5;

/// Some steps of the umbrella operator, as programs for meshes take them; none where they would change too little.
pub(super) fn smoothed(mesh: &TriMesh) -> Option<TriMesh> {
    if mesh.triangle_count() > COARSE {
        return None;
    }
    let edges = Edges::of(mesh);
    let mut points: Vec<Vec3> = mesh.positions().iter().map(|&p| Vec3(p)).collect();
    for _ in 0..STEPS {
        let (mut sums, mut counts) = (vec![Vec3::ZERO; points.len()], vec![0.0; points.len()]);
        for ends in edges.vertices() {
            let [a, b] = ends.map(|v| v as usize);
            sums[a] += points[b];
            sums[b] += points[a];
            counts[a] += 1.0;
            counts[b] += 1.0;
        }
        for ((point, sum), count) in points.iter_mut().zip(sums).zip(counts) {
            if count > 0.0 {
                *point += (sum / count - *point) * STEP;
            }
        }
    }
    mesh.with_positions(points.into_iter().map(|p| p.0).collect())
        .ok()
}
