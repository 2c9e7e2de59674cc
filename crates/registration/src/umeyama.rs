//! The least-squares similarity between two sets of corresponding points (Umeyama, PAMI 13(4), 1991).

use mesh::{Similarity, Vec3};

use crate::{
    RegistrationError,
    matrix::{Mat3, svd},
};

/// A similarity fitted to pairs of points, with the residuals of this fit and of the mirrored one.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Takes source points to target points.
    pub transform: Similarity,
    /// Weighted root mean square of |target − transform(source)|, in the target's unit.
    pub residual: f64,
    /// The residual that the best similarity of the other handedness leaves.
    pub mirrored_residual: f64,
}

/// Which similarities a fit may choose from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Handedness {
    /// Rotations alone (determinant +1).
    #[default]
    Proper,
    /// Rotations with a reflection alone (determinant −1).
    Mirrored,
    /// Whichever leaves the smaller residual; rotations if it is a draw.
    Either,
}

/// Fits the similarity y = s R x + t of a [`Handedness`] that minimises Σ wᵢ |yᵢ − (s R xᵢ + t)|² (Umeyama's eqs. 40 to
/// 43).
///
/// `source` and `target` are #P by 3, pair by pair; without `weights` every pair counts alike. Both sets are
/// centred first, so a small model far from the origin loses no more digits than its coordinates have already
/// lost. O(#P).
///
/// # Errors
/// When the slices differ in length, a number is not finite, a weight is negative, or the pairs do not
/// determine a similarity: fewer than three, or all on one line.
///
/// ```
/// let source = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// let target = source.map(|[x, y, z]| [5.0 - 2.0 * y, 2.0 * x, 2.0 * z]);   // a quarter turn, doubled, moved
/// let fit = registration::fit_similarity(&source, &target, None, Default::default())?;
/// assert!((fit.transform.scale - 2.0).abs() < 1e-12 && fit.residual < 1e-12);
/// # Ok::<(), registration::RegistrationError>(())
/// ```
pub fn fit_similarity(
    source: &[[f64; 3]],
    target: &[[f64; 3]],
    weights: Option<&[f64]>,
    handedness: Handedness,
) -> Result<Fit, RegistrationError> {
    let moments = Moments::of(source, target, weights)?;
    let [proper, mirrored] = [1.0, -1.0].map(|sign| moments.similarity(sign));
    let [proper_residual, mirrored_residual] =
        [&proper, &mirrored].map(|candidate| moments.residual(candidate, source, target, weights));
    let mirror = match handedness {
        Handedness::Proper => false,
        Handedness::Mirrored => true,
        Handedness::Either => 2.0 * mirrored_residual < proper_residual,
    };
    let (chosen, residual, mirrored_residual) = if mirror {
        (mirrored, mirrored_residual, proper_residual)
    } else {
        (proper, proper_residual, mirrored_residual)
    };
    if !(chosen.scale > 0.0 && chosen.scale.is_finite()) {
        return Err(RegistrationError::Uncorrelated);
    }
    Ok(Fit {
        transform: moments.about_origin(&chosen),
        residual,
        mirrored_residual,
    })
}

/// s R, about the centroids.
struct Centred {
    scale: f64,
    rotation: Mat3,
}

/// Weighted first and second moments of pairs of points.
struct Moments {
    source_mean: Vec3,
    target_mean: Vec3,
    /// Σ w |x|² / Σ w of the centred source.
    variance: f64,
    /// Σ w y xᵀ / Σ w of the centred pairs (Umeyama's Σ_xy).
    covariance: Mat3,
}

impl Moments {
    fn of(
        source: &[[f64; 3]],
        target: &[[f64; 3]],
        weights: Option<&[f64]>,
    ) -> Result<Self, RegistrationError> {
        check(source, target, weights)?;
        let weight = |i: usize| weights.map_or(1.0, |w| w[i]);
        let total: f64 = (0..source.len()).map(weight).sum();
        let source_mean = mean(source, weight, total);
        let target_mean = mean(target, weight, total);
        let [mut covariance, mut scatter, mut target_scatter] = [Mat3::ZERO; 3];
        for (i, (&x, &y)) in source.iter().zip(target).enumerate() {
            let (x, y, w) = (Vec3(x) - source_mean, Vec3(y) - target_mean, weight(i) / total);
            covariance += Mat3::outer(y * w, x);
            scatter += Mat3::outer(x * w, x);
            target_scatter += Mat3::outer(y * w, y);
        }
        for (cloud, scatter, mean) in [
            ("source", &scatter, source_mean),
            ("target", &target_scatter, target_mean),
        ] {
            if is_collinear(scatter, mean) {
                return Err(RegistrationError::Collinear { cloud });
            }
        }
        Ok(Self {
            source_mean,
            target_mean,
            variance: scatter.trace(),
            covariance,
        })
    }

    /// With Σ_xy = U D Vᵀ: R = U S Vᵀ and s = tr(D S) / σ_x², S = diag(1, 1, ±1) so that det R = `sign`.
    fn similarity(&self, sign: f64) -> Centred {
        let factors = svd(&self.covariance);
        let hand = sign * factors.left.determinant() * factors.right.determinant();
        let hand = if hand < 0.0 { -1.0 } else { 1.0 };
        let Mat3([first, second, third]) = factors.left;
        let rotation = Mat3([first, second, third * hand]).transposed() * factors.right;
        let [a, b, c] = factors.values;
        Centred {
            scale: (a + b + hand * c) / self.variance,
            rotation,
        }
    }

    fn residual(
        &self,
        candidate: &Centred,
        source: &[[f64; 3]],
        target: &[[f64; 3]],
        weights: Option<&[f64]>,
    ) -> f64 {
        let mut sum = 0.0;
        let mut total = 0.0;
        for (i, (&x, &y)) in source.iter().zip(target).enumerate() {
            let image = candidate.rotation * (Vec3(x) - self.source_mean) * candidate.scale;
            let w = weights.map_or(1.0, |w| w[i]);
            sum += w * (Vec3(y) - self.target_mean - image).squared();
            total += w;
        }
        (sum / total).sqrt()
    }

    fn about_origin(&self, centred: &Centred) -> Similarity {
        let &Centred { scale, rotation } = centred;
        let translation = self.target_mean - rotation * self.source_mean * scale;
        Similarity {
            scale,
            rotation: rotation.rows(),
            translation: translation.0,
        }
    }
}

fn check(source: &[[f64; 3]], target: &[[f64; 3]], weights: Option<&[f64]>) -> Result<(), RegistrationError> {
    if source.len() != target.len() {
        let (source_count, target_count) = (source.len(), target.len());
        return Err(RegistrationError::PointCount {
            source_count,
            target_count,
        });
    }
    if let Some(weights) = weights {
        if weights.len() != source.len() {
            return Err(RegistrationError::WeightCount {
                given: weights.len(),
                expected: source.len(),
            });
        }
        if let Some(index) = weights.iter().position(|w| !(w.is_finite() && *w >= 0.0)) {
            return Err(RegistrationError::BadWeight {
                index,
                weight: weights[index],
            });
        }
    }
    let finite = |p: &[f64; 3]| p.iter().all(|x| x.is_finite());
    if let Some(index) = source
        .iter()
        .zip(target)
        .position(|(x, y)| !(finite(x) && finite(y)))
    {
        return Err(RegistrationError::NotFinite { index });
    }
    let given = weights.map_or(source.len(), |w| w.iter().filter(|&&w| w > 0.0).count());
    if given < 3 {
        return Err(RegistrationError::TooFewPoints { given });
    }
    Ok(())
}

/// The weighted mean, taken about the first point so that a far-off cloud keeps its digits.
fn mean(points: &[[f64; 3]], weight: impl Fn(usize) -> f64, total: f64) -> Vec3 {
    let first = Vec3(points[0]);
    let offsets = points.iter().enumerate();
    let sum: Vec3 = offsets
        .map(|(i, &p)| (Vec3(p) - first) * (weight(i) / total))
        .sum();
    first + sum
}

/// Whether all points of a cloud with this scatter matrix lie on one line, up to the rounding of their
/// coordinates.
fn is_collinear(scatter: &Mat3, mean: Vec3) -> bool {
    let [largest, second, _] = svd(scatter).values;
    let rounding = 4.0 * f64::EPSILON * mean.0.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    second.sqrt() <= (1e-7 * largest.sqrt()).max(rounding)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const POINTS: [[f64; 3]; 5] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.2, 0.0],
        [0.0, 0.7, 0.1],
        [0.3, 0.0, 0.9],
        [-0.5, 0.4, 0.2],
    ];

    fn umeyama(
        source: &[[f64; 3]],
        target: &[[f64; 3]],
        weights: Option<&[f64]>,
    ) -> Result<Fit, RegistrationError> {
        fit_similarity(source, target, weights, Handedness::Proper)
    }

    fn mirror_fits_better(fit: &Fit) -> bool {
        2.0 * fit.mirrored_residual < fit.residual
    }

    fn turned() -> Similarity {
        Similarity {
            scale: 0.5,
            translation: [1.0, -2.0, 3.0],
            ..Similarity::from_quaternion([1.0, 0.4, -0.3, 2.0])
        }
    }

    fn sum_of_squares(
        transform: &Similarity,
        source: &[[f64; 3]],
        target: &[[f64; 3]],
        weights: &[f64],
    ) -> f64 {
        let pairs = source.iter().zip(target).zip(weights);
        pairs
            .map(|((&x, &y), w)| w * (Vec3(y) - transform.apply(Vec3(x))).squared())
            .sum()
    }

    #[test]
    fn a_small_model_far_from_the_origin_is_fitted_to_the_rounding_of_its_coordinates() {
        let far = POINTS.map(|p| (Vec3(p) + Vec3([1e6, -2e6, 3e6])).0);
        let target = turned().apply_all(&POINTS);
        let fit = umeyama(&far, &target, None).unwrap();
        assert!(fit.residual < 1e-9, "residual {}", fit.residual);
        assert!((fit.transform.scale - 0.5).abs() < 1e-9);
        for (&x, &y) in far.iter().zip(&target) {
            assert!((fit.transform.apply(Vec3(x)) - Vec3(y)).norm() < 4e-9);
        }
    }

    #[test]
    fn pairs_without_weight_do_not_count() {
        let mut target = turned().apply_all(&POINTS);
        target[4] = [100.0, 0.0, 0.0];
        let fit = umeyama(&POINTS, &target, Some(&[1.0, 2.0, 0.5, 1.0, 0.0])).unwrap();
        assert!(fit.residual < 1e-14);
    }

    #[test]
    fn a_mirrored_target_is_fitted_by_a_reflection_and_a_plane_by_a_rotation() {
        let target = POINTS.map(|[x, y, z]| [-x, y, z]);
        let proper = umeyama(&POINTS, &target, None).unwrap();
        assert!(!proper.transform.mirrors() && mirror_fits_better(&proper));
        let mirrored = fit_similarity(&POINTS, &target, None, Handedness::Either).unwrap();
        assert!(mirrored.transform.mirrors() && mirrored.residual < 1e-14 && !mirror_fits_better(&mirrored));
        let (flat, flat_target) = (
            POINTS.map(|[x, y, _]| [x, y, 0.0]),
            target.map(|[x, y, _]| [x, y, 0.0]),
        );
        let either = fit_similarity(&flat, &flat_target, None, Handedness::Either).unwrap();
        assert!(!either.transform.mirrors() && either.residual < 1e-14);
    }

    #[test]
    fn pairs_that_determine_no_similarity_are_refused() {
        let line = [
            [0.0, 0.0, 0.0],
            [1.0, 1.0, 1.0],
            [2.0, 2.0, 2.0],
            [3.0, 3.0, 3.0],
            [5.0, 5.0, 5.0],
        ];
        let place = [[7.0, 1e5, 0.1]; 5];
        for degenerate in [line, place] {
            let source = umeyama(&degenerate, &POINTS, None);
            assert_eq!(source, Err(RegistrationError::Collinear { cloud: "source" }));
            let target = umeyama(&POINTS, &degenerate, None);
            assert_eq!(target, Err(RegistrationError::Collinear { cloud: "target" }));
        }
        let few = umeyama(&POINTS, &POINTS, Some(&[1.0, 0.0, 2.0, 0.0, 0.0]));
        assert_eq!(few, Err(RegistrationError::TooFewPoints { given: 2 }));
        assert_eq!(
            umeyama(&[], &[], None),
            Err(RegistrationError::TooFewPoints { given: 0 })
        );
    }

    #[test]
    fn bad_input_is_named() {
        let points = |source_count, target_count| {
            Err(RegistrationError::PointCount {
                source_count,
                target_count,
            })
        };
        assert_eq!(umeyama(&POINTS, &POINTS[..4], None), points(5, 4));
        let weights = umeyama(&POINTS, &POINTS, Some(&[1.0]));
        assert_eq!(
            weights,
            Err(RegistrationError::WeightCount {
                given: 1,
                expected: 5
            })
        );
        let negative = umeyama(&POINTS, &POINTS, Some(&[1.0, 1.0, -1.0, 1.0, 1.0]));
        assert_eq!(
            negative,
            Err(RegistrationError::BadWeight {
                index: 2,
                weight: -1.0
            })
        );
        let mut infinite = POINTS;
        infinite[3][1] = f64::INFINITY;
        assert_eq!(
            umeyama(&POINTS, &infinite, None),
            Err(RegistrationError::NotFinite { index: 3 })
        );
    }

    proptest! {
        #[test]
        fn no_nearby_similarity_fits_better(
            target in prop::array::uniform5(prop::array::uniform3(-1.0..1.0_f64)),
            weights in prop::array::uniform5(0.1..2.0_f64),
            turn in prop::array::uniform3(-1.0..1.0_f64), stretch in -1.0..1.0_f64,
        ) {
            let Ok(fit) = umeyama(&POINTS, &target, Some(&weights)) else { return Ok(()) };
            let least = sum_of_squares(&fit.transform, &POINTS, &target, &weights);
            prop_assert!((fit.residual.powi(2) * weights.iter().sum::<f64>() - least).abs() < 1e-12);
            let small = Similarity { scale: 1.0 + 1e-3 * stretch, ..Similarity::from_quaternion([1e3, turn[0], turn[1], turn[2]]) };
            for other in [small.then(&fit.transform), fit.transform.then(&small)] {
                prop_assert!(sum_of_squares(&other, &POINTS, &target, &weights) >= least - 1e-12);
            }
        }
    }
}
