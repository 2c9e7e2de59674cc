//! The equations of all patches together, whatever they are solved for: what noise there is, and what is worth to be a field.

use std::{collections::BTreeMap, ops::RangeInclusive};

use faer::{Mat, Side, linalg::solvers::Solve};

use super::{
    equations::{OBSERVATIONS_AN_UNKNOWN, RIDGE},
    fields::{FIELDS, OFFSET_FIELDS, OPTIONAL_FIELDS, OPTIONAL_LEVELS},
    patch::PatchEquations,
};
use crate::mark::MarkError;

/// A start for the noise, and its refinements at most.
const ROUNDS: usize = 6;

/// A noise that changes by less, relatively, is settled.
const SETTLED: f64 = 1e-3;

/// How often noise grows at most until the squares of what the mark says are as expected, by how much it does so by a secant, and by how little these may be off.
const NOISE_STEPS: usize = 4;
const MOST_GROWTH: f64 = 2.0;
const NOISE_SETTLED: f64 = 0.02;

/// How much of the mark's squares an offset has to explain: where a scale explains most of it, what is left is little, and still as large as the mark in places.
const WORTH_AN_OFFSET: f64 = 0.02;

/// Where less than one in so many observations waits for weights, as at the edge of what is left of a large model, it keeps a plain one.
const WORTH_WEIGHING: usize = 10;

/// Equations whose first unknowns are the mark's, of prior variance 1, and whose last are the fields that all patches share.
pub(super) trait System: Sized + Sync {
    /// The unknowns that leave least with some noise, and what variances follow from.
    type Solution: Sync;

    /// Whether the mark's unknowns are bits, ±1, rather than coefficients.
    const IS_OF_BITS: bool;

    /// Those of some patches, with as many optional fields, from at least to at most so many, as [are worth it](optional_worth).
    fn of(
        patches: &BTreeMap<usize, PatchEquations>,
        bits: usize,
        redundancy: f64,
        optional: &RangeInclusive<usize>,
    ) -> Self;

    /// How many independent observations there are.
    fn independent(&self) -> f64;

    /// See [`is_worth_weighing`].
    fn can_weigh(&self, waiting: usize) -> bool;

    /// The unknowns that leave least, with so much noise, in the memory of a solution that is no longer needed.
    fn solved_for(&self, noise: f64, spent: Option<Self::Solution>) -> Result<Self::Solution, MarkError>;

    /// Σ w (u·d)².
    fn squares(&self) -> f64;

    /// Σ w e² of a solution.
    fn squares_left(&self, solution: &Self::Solution) -> f64;

    /// The mark's unknowns, in the order of their numbers.
    fn means(&self, solution: &Self::Solution) -> Vec<f64>;

    /// The variances that are left to them.
    fn variances(&self, solution: &Self::Solution) -> Vec<f64>;

    /// What a solution says of a patch's own unknowns, given its number.
    fn own(&self, index: usize, patch: &PatchEquations, solution: &Self::Solution) -> Mat<f64>;

    /// Σ w (u·d) X b, over the mark's unknowns.
    fn mark_explains(&self, solution: &Self::Solution) -> f64;

    /// The coefficients of the fields.
    fn theta(&self, solution: &Self::Solution) -> Vec<f64>;

    /// The Gram matrix of the fields and of u·d.
    fn fields(&self) -> Mat<f64>;

    /// The unknowns that leave least, and the noise that is estimated with them, from a guess of it: secants lead to the noise that is left where it was expected.
    fn solved(&self, guess: Option<f64>) -> Result<(Self::Solution, f64), MarkError> {
        // σ² for the mean weight; the weights hold masses.
        let mut noise = guess.unwrap_or_else(|| self.squares() / self.independent());
        let mut solution = self.solved_for(noise, None)?;
        let mut before = None;
        for _ in 1..ROUNDS {
            let left = self.squares_left(&solution) / self.independent();
            if (left - noise).abs() <= SETTLED * noise {
                break;
            }
            let by_secant = before.and_then(|before| unchanged(before, (noise, left)));
            before = Some((noise, left));
            noise = by_secant.unwrap_or(left);
            solution = self.solved_for(noise, Some(solution))?;
        }
        Ok((solution, noise))
    }

    /// The solution with the variances that are left to the mark's unknowns, and as much noise as their squares ask for: the mean of b² is that of 1 − v.
    ///
    /// With information A of each and true noise σ², Σ b² / Σ (1 − v) is (A + σ²) / (A + N) where N is assumed, and v is N / (A + N).
    fn posterior(&self, guess: Option<f64>) -> Result<(Self::Solution, Vec<f64>), MarkError> {
        let (mut solution, mut noise) = self.solved(guess)?;
        let mut variances = self.variances(&solution);
        let mut before: Option<(f64, f64)> = None;
        for _ in 0..NOISE_STEPS {
            let (count, left) = (variances.len() as f64, variances.iter().sum::<f64>());
            let known = (count - left).max(f64::MIN_POSITIVE);
            let squares: f64 = self.means(&solution).iter().map(|mean| mean * mean).sum();
            let excess = squares / known - 1.0;
            let growth = 1.0 + excess * count / left.max(f64::MIN_POSITIVE);
            if excess < NOISE_SETTLED || !growth.is_finite() {
                break;
            }
            // A secant over the logarithm of the noise, once there are two points.
            let growth = match before {
                Some((growth, larger)) if larger > excess => {
                    growth.powf(excess / (larger - excess)).min(MOST_GROWTH)
                }
                _ => growth,
            };
            before = Some((growth, excess));
            noise *= growth;
            solution = self.solved_for(noise, Some(solution))?;
            variances = self.variances(&solution);
        }
        Ok((solution, variances))
    }
}

/// The noise that would be left where it was expected, on the line through two noises with what was left with them; none where no such line is one of noise.
fn unchanged((noise_a, left_a): (f64, f64), (noise_b, left_b): (f64, f64)) -> Option<f64> {
    let slope = (left_b - left_a) / (noise_b - noise_a);
    let without = left_b - slope * noise_b;
    ((0.0..1.0).contains(&slope) && without > 0.0).then(|| without / (1.0 - slope))
}

/// Whether there are enough observations for their residuals to say something about noise, and so many of them wait for their weights that
/// it is worth to compute bases again.
pub(super) fn is_worth_weighing(observations: usize, waiting: usize, unknowns: usize) -> bool {
    observations >= OBSERVATIONS_AN_UNKNOWN * unknowns && WORTH_WEIGHING * waiting > observations
}

/// How many optional fields there are to be, from at least to at most so many, given the Gram matrix of the fields: a higher level is taken where, with the mark unknown, it explains more squares beside the other
/// fields than the mark has; the offset, a single one of which chance explains little, where it explains a fiftieth of these.
pub(super) fn optional_worth(fields: &Mat<f64>, mark: f64, bounds: &RangeInclusive<usize>) -> usize {
    let explained = |optional: usize| {
        let count = FIELDS - OPTIONAL_FIELDS + optional;
        let mut system = fields.get(..count, ..count).to_owned();
        for i in 0..count {
            system[(i, i)] += RIDGE * fields[(i, i)] + f64::MIN_POSITIVE;
        }
        let right = Mat::from_fn(count, 1, |i, _| fields[(FIELDS, i)]);
        let solution = system.llt(Side::Lower).ok()?.solve(&right);
        Some((0..count).map(|i| solution[(i, 0)] * right[(i, 0)]).sum::<f64>())
    };
    let mut taken = *bounds.start();
    for level in OPTIONAL_LEVELS {
        let asked = if level == OFFSET_FIELDS {
            WORTH_AN_OFFSET
        } else {
            1.0
        };
        let is_worth = |than: usize| matches!((explained(level), explained(than)), (Some(more), Some(less)) if more - less > asked * mark);
        if level > taken && level <= *bounds.end() && is_worth(taken) {
            taken = level;
        }
    }
    taken
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_secant_leads_to_the_noise_that_is_left_where_it_was_expected() {
        let left = |noise: f64| 0.3 + 0.25 * noise;
        let at = |noise: f64| (noise, left(noise));
        let noise = unchanged(at(2.0), at(0.8)).unwrap();
        assert!((left(noise) - noise).abs() < 1e-15 && (noise - 0.4).abs() < 1e-15);
        // No noise, or less than none, or as much more as was expected.
        for (a, b) in [
            ((1.0, 2.0), (1.0, 3.0)),
            ((2.0, 1.9), (1.0, 0.9)),
            ((2.0, 1.0), (1.0, 0.5)),
            ((2.0, 0.5), (1.0, 0.6)),
        ] {
            assert_eq!(unchanged(a, b), None, "{a:?}, {b:?}");
        }
    }
}
