//! First guesses at the similarity, from cheap to dear.

use crate::sampled::Sampled;
use crate::vector::{Mat3, Vec3, apply, determinant, product, scaled, sub, svd, transposed};
use mesh::Similarity;

/// Principal axes onto principal axes, with all eight choices of their directions: four turn, four mirror.
/// Scale and place come from the second and first moments of area, so these guesses are good when nothing is
/// missing.
pub(crate) fn principal_axes(original: &Sampled, suspect: &Sampled) -> Vec<Similarity> {
    let (to, from) = (svd(&original.covariance).right, svd(&suspect.covariance).right);
    let mut guesses = Vec::with_capacity(8);
    for hand in [1.0, -1.0] {
        for signs in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
            let third = hand * signs[0] * signs[1] * determinant(&to) * determinant(&from);
            let turned = [
                scaled(from[0], signs[0]),
                scaled(from[1], signs[1]),
                scaled(from[2], third),
            ];
            guesses.push(by_moments(original, suspect, product(&transposed(&to), &turned)));
        }
    }
    guesses
}

/// Whether the moments along the principal axes differ: then no other motion than those of [`principal_axes`] takes the mesh onto
/// itself.
pub(crate) fn axes_are_distinct(mesh: &Sampled) -> bool {
    let [first, second, third] = svd(&mesh.covariance).values;
    second < DISTINCT * first && third < DISTINCT * second
}

/// Moments of area are distinct when their ratio is below this.
const DISTINCT: f64 = 0.95;

/// `count` rotations spread evenly over all rotations, each also mirrored; scale and place as in
/// [`principal_axes`].
///
/// The rotations are Alexa's super-Fibonacci spiral (CVPR 2022).
pub(crate) fn all_rotations(original: &Sampled, suspect: &Sampled, count: usize) -> Vec<Similarity> {
    let mut guesses = Vec::with_capacity(2 * count);
    for i in 0..count {
        let Similarity { rotation, .. } = Similarity::from_quaternion(spiral(i, count));
        guesses.push(by_moments(original, suspect, rotation));
        guesses.push(by_moments(
            original,
            suspect,
            rotation.map(|[x, y, z]| [-x, y, z]),
        ));
    }
    guesses
}

fn spiral(i: usize, count: usize) -> [f64; 4] {
    const PHI: f64 = std::f64::consts::SQRT_2;
    const PSI: f64 = 1.533_751_168_755_204_3;
    let s = i as f64 + 0.5;
    let (t, d) = (s / count as f64, std::f64::consts::TAU * s);
    let (r, q) = (t.sqrt(), (1.0 - t).sqrt());
    let (alpha, beta) = (d / PHI, d / PSI);
    [r * alpha.sin(), r * alpha.cos(), q * beta.sin(), q * beta.cos()]
}

/// The similarity with a given rotation that carries the suspect's centroid and spread to the original's.
fn by_moments(original: &Sampled, suspect: &Sampled, rotation: Mat3) -> Similarity {
    let spread = |s: &Sampled| (s.covariance[0][0] + s.covariance[1][1] + s.covariance[2][2]).sqrt();
    let scale = spread(original) / spread(suspect);
    let translation: Vec3 = sub(
        original.centroid,
        scaled(apply(&rotation, suspect.centroid), scale),
    );
    Similarity {
        scale,
        rotation,
        translation,
    }
}
