//! Pose hypotheses from moments of area and from rotations all around; those of [`congruent`](crate::congruent) are for
//! suspects that are cut.

use mesh::{Similarity, Vec3};

use crate::{
    matrix::{Mat3, svd},
    sampled::Sampled,
};

/// Principal axes onto principal axes, with all eight choices of their directions: four turn, four mirror.
/// Scale and place come from the second and first moments of area, so these are good when nothing is missing.
pub(crate) fn principal_axes(original: &Sampled, suspect: &Sampled) -> Vec<Similarity> {
    let (to, from) = (svd(&original.covariance).right, svd(&suspect.covariance).right);
    let mut hypotheses = Vec::with_capacity(8);
    for hand in [1.0, -1.0] {
        for signs in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
            let third = hand * signs[0] * signs[1] * to.determinant() * from.determinant();
            let turned = Mat3([from.0[0] * signs[0], from.0[1] * signs[1], from.0[2] * third]);
            hypotheses.push(by_moments(original, suspect, to.transposed() * turned));
        }
    }
    hypotheses
}

/// Whether the moments along the principal axes differ: then no other motion than those of [`principal_axes`] takes the
/// mesh onto itself.
pub(crate) fn axes_are_distinct(mesh: &Sampled) -> bool {
    let [first, second, third] = svd(&mesh.covariance).values;
    second < DISTINCT * first && third < DISTINCT * second
}

/// Moments of area are distinct when their ratio is below this: 20 000 samples tell moments to less than a hundredth. With 0.9 or
/// 0.99 all poses of ten symmetric and other shapes are found; 0.9 takes 1.2 times as long.
const DISTINCT: f64 = 0.95;

/// `count` rotations spread evenly over all rotations, each also mirrored; scale and place as in [`principal_axes`].
///
/// The rotations are Alexa's super-Fibonacci spiral (CVPR 2022).
pub(crate) fn all_rotations(original: &Sampled, suspect: &Sampled, count: usize) -> Vec<Similarity> {
    let mut hypotheses = Vec::with_capacity(2 * count);
    for i in 0..count {
        let Similarity { rotation, .. } = Similarity::from_quaternion(spiral(i, count));
        let mirrored = rotation.map(|[x, y, z]| [-x, y, z]);
        for rotation in [rotation, mirrored] {
            hypotheses.push(by_moments(original, suspect, rotation.into()));
        }
    }
    hypotheses
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
    let spread = |s: &Sampled| s.covariance.trace().sqrt();
    let scale = spread(original) / spread(suspect);
    let translation: Vec3 = original.centroid - rotation * suspect.centroid * scale;
    Similarity {
        scale,
        rotation: rotation.rows(),
        translation: translation.0,
    }
}
