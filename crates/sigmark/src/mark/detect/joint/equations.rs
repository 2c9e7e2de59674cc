//! The normal equations, and what solves them.

use std::ops::RangeInclusive;

use faer::{
    Accum, Mat, Par, Side,
    linalg::{
        matmul::triangular::{BlockStructure, matmul},
        solvers::{Llt, Solve},
        triangular_inverse::invert_lower_triangular,
    },
};

use super::{
    design::{Design, View},
    fields::{BENDING_DEGREES, BENDING_FIELDS, FIELDS},
    observations::Observation,
    patch::PatchEquations,
};
use crate::mark::MarkError;

/// The Gram matrix of all columns X, G and d, by its lower triangle.
#[derive(Clone)]
pub(super) struct NormalEquations {
    pub(super) bits: usize,
    pub(super) gram: Mat<f64>,
    pub(super) observations: usize,
    /// Observations to an independent one.
    redundancy: f64,
}

/// Rows of the design matrix that are multiplied at a time.
pub(super) const BLOCK: usize = 512;

/// A start for the noise, and its refinements, which converge at once.
const ROUNDS: usize = 6;

/// A noise that changes by less, relatively, is settled.
const SETTLED: f64 = 1e-3;

/// How often noise grows at most until the squares of bits are as expected, and by how little these may be off.
const NOISE_STEPS: usize = 4;
const NOISE_SETTLED: f64 = 0.02;

/// How often weights follow from residuals; they are all but settled then.
pub(super) const REWEIGHTINGS: usize = 2;

/// With fewer observations, residuals say little about noise; more change weights by little.
pub(super) const OBSERVATIONS_AN_UNKNOWN: usize = 8;

/// Where less than one in so many observations waits for weights, as at the edge of what is left of a large model, it keeps a plain one.
const WORTH_WEIGHING: usize = 10;

/// Added to the diagonal, relative to it: what the observations do not determine, such as a turn of a sphere, stays zero.
pub(super) const RIDGE: f64 = 1e-12;

/// The same for bending, so that what a similarity explains as well is one: on a sphere a cubic field can be a scale.
const BENDING_RIDGE: f64 = 1e-6;

impl NormalEquations {
    /// Those of no observations.
    pub(super) fn empty(bits: usize, redundancy: f64) -> Self {
        let columns = bits + FIELDS + 1;
        Self {
            bits,
            gram: Mat::zeros(columns, columns),
            observations: 0,
            redundancy,
        }
    }

    /// Whether there are enough observations for their residuals to say something about noise, and so many of them wait for their weights that
    /// it is worth to compute bases again.
    pub(super) fn can_weigh(&self, waiting: usize) -> bool {
        let is_enough = self.observations >= OBSERVATIONS_AN_UNKNOWN * self.unknowns();
        is_enough && WORTH_WEIGHING * waiting > self.observations
    }

    /// The same equations with so many bending fields; the coefficients of the others will be zero.
    pub(super) fn with_bending(mut self, count: usize) -> Self {
        let last = self.unknowns();
        for column in last - BENDING_FIELDS + count..last {
            for i in 0..=last {
                self.gram[(i.max(column), i.min(column))] = 0.0;
            }
        }
        self
    }

    /// How many bending fields there are to be, from at least to at most so many: a higher degree is taken where, all bits unknown, it explains more squares beside the other fields than the mark has.
    pub(super) fn bending(&self, bounds: &RangeInclusive<usize>) -> usize {
        let first = self.bits;
        let explained = |bending: usize| {
            let count = self.unknowns() - BENDING_FIELDS + bending - first;
            let system = Mat::from_fn(count, count, |i, j| {
                let entry = self.entry(first + i, first + j);
                entry
                    + if i == j {
                        RIDGE * entry + f64::MIN_POSITIVE
                    } else {
                        0.0
                    }
            });
            let right = Mat::from_fn(count, 1, |i, _| self.entry(self.unknowns(), first + i));
            let solution = system.llt(Side::Lower).ok()?.solve(&right);
            Some((0..count).map(|i| solution[(i, 0)] * right[(i, 0)]).sum::<f64>())
        };
        let mark: f64 = (0..self.bits).map(|t| self.entry(t, t)).sum();
        let is_worth = |degree: usize, than: usize| matches!((explained(degree), explained(than)), (Some(more), Some(less)) if more - less > mark);
        let mut taken = *bounds.start();
        for degree in BENDING_DEGREES {
            if degree > taken && degree <= *bounds.end() && is_worth(degree, taken) {
                taken = degree;
            }
        }
        taken
    }

    /// Those of a patch's observations with the weights that these have.
    pub(super) fn weighted(
        design: &Design<'_>,
        view: &View<'_>,
        observations: &[Observation],
        redundancy: f64,
    ) -> Self {
        let mut equations = Self::empty(view.bits().len(), redundancy);
        equations.observations = observations.len();
        for block in observations.chunks(BLOCK) {
            let mut rows = design.rows(view, block);
            let roots: Vec<f64> = block.iter().map(|o| (o.mass * o.robust_weight).sqrt()).collect();
            for j in 0..rows.ncols() {
                let column = rows.col_as_slice_mut(j).iter_mut();
                column.zip(&roots).for_each(|(entry, root)| *entry *= root);
            }
            matmul(
                equations.gram.as_mut(),
                BlockStructure::TriangularLower,
                Accum::Add,
                rows.transpose(),
                BlockStructure::Rectangular,
                rows.as_ref(),
                BlockStructure::Rectangular,
                1.0,
                Par::Seq,
            );
        }
        equations
    }

    /// Takes in the observations of a patch.
    pub(super) fn add(&mut self, patch: &PatchEquations) {
        let Self {
            gram, observations, ..
        } = &patch.equations;
        let place = |i: usize| match patch.bits.get(i) {
            Some(&bit) => bit,
            None => self.bits + i - patch.bits.len(),
        };
        let gain = |i: usize| patch.gains.get(i).copied().unwrap_or(1.0);
        for j in 0..gram.ncols() {
            let weight = patch.weight * gain(j);
            for i in j..gram.nrows() {
                self.gram[(place(i), place(j))] += weight * gain(i) * gram[(i, j)];
            }
        }
        self.observations += observations;
    }

    /// The unknowns that leave least, and the noise that is estimated with them, from a guess of it.
    pub(super) fn solved(&self, guess: Option<f64>) -> Result<Solved, MarkError> {
        // σ² for the mean weight; the weights hold masses.
        let noise_left = |solution: &Mat<f64>| {
            self.redundancy * self.squares_left(solution) / self.observations.max(1) as f64
        };
        let nothing = Mat::zeros(self.unknowns(), 1);
        let mut solved = self.solved_for(guess.unwrap_or_else(|| noise_left(&nothing)))?;
        for _ in 1..ROUNDS {
            let noise = noise_left(&solved.solution);
            if (noise - solved.noise).abs() <= SETTLED * solved.noise {
                break;
            }
            solved = self.solved_for(noise)?;
        }
        Ok(solved)
    }

    /// The unknowns that leave least, with so much noise.
    fn solved_for(&self, noise: f64) -> Result<Solved, MarkError> {
        let unknowns = self.unknowns();
        let right = Mat::from_fn(unknowns, 1, |i, _| self.entry(unknowns, i));
        let mut system = self.gram.get(..unknowns, ..unknowns).to_owned();
        for i in 0..unknowns {
            let prior = if i < self.bits { noise } else { 0.0 };
            let bending = i >= unknowns - BENDING_FIELDS;
            let ridge = if bending { BENDING_RIDGE } else { RIDGE };
            system[(i, i)] += ridge * self.entry(i, i) + prior + f64::MIN_POSITIVE;
        }
        let factor = system.llt(Side::Lower).map_err(|_| MarkError::Alignment)?;
        Ok(Solved {
            solution: factor.solve(&right),
            factor,
            noise,
        })
    }

    /// The solution with the variances that are left to bits, whose prior variance is 1, and as much noise as their squares ask for: the mean of b² is that of 1 − v.
    ///
    /// With information A of each bit and true noise σ², Σ b² / Σ (1 − v) is (A + σ²) / (A + N) where N is assumed, and v is N / (A + N).
    pub(super) fn posterior(&self, guess: Option<f64>) -> Result<(Solved, Vec<f64>), MarkError> {
        let mut solved = self.solved(guess)?;
        let mut variances = solved.variances(self.bits);
        for _ in 0..NOISE_STEPS {
            let left = variances.iter().sum::<f64>();
            let known = (self.bits as f64 - left).max(f64::MIN_POSITIVE);
            let squares: f64 = (0..self.bits).map(|t| solved.solution[(t, 0)].powi(2)).sum();
            let excess = squares / known - 1.0;
            let growth = 1.0 + excess * self.bits as f64 / left.max(f64::MIN_POSITIVE);
            if excess < NOISE_SETTLED || !growth.is_finite() {
                break;
            }
            solved = self.solved_for(solved.noise * growth)?;
            variances = solved.variances(self.bits);
        }
        Ok((solved, variances))
    }

    /// Σ w e² of a solution.
    pub(super) fn squares_left(&self, solution: &Mat<f64>) -> f64 {
        let unknowns = self.unknowns();
        let fitted: f64 = (0..unknowns)
            .map(|i| solution[(i, 0)] * self.entry(unknowns, i))
            .sum();
        let theta = &solution.col_as_slice(0)[..unknowns];
        let quadratic: f64 = (0..unknowns)
            .map(|j| {
                let below = self.gram.col_as_slice(j)[j..unknowns].iter().zip(&theta[j..]);
                let sum: f64 = below.map(|(entry, x)| entry * x).sum();
                theta[j] * (2.0 * sum - self.entry(j, j) * theta[j])
            })
            .sum();
        (self.entry(unknowns, unknowns) - 2.0 * fitted + quadratic).max(0.0)
    }

    /// The share of Σ w (u·d)² that some unknowns explain: Σ θᵢ ⟨Gᵢ, u·d⟩ over all squares. Shares of all unknowns and of the
    /// rest add up to 1; one is negative where it cancels another.
    pub(super) fn explained(&self, solution: &Mat<f64>, unknowns: std::ops::Range<usize>) -> f64 {
        let last = self.unknowns();
        let squares = self.entry(last, last);
        let explained: f64 = unknowns.map(|i| solution[(i, 0)] * self.entry(last, i)).sum();
        if squares > 0.0 { explained / squares } else { 0.0 }
    }

    /// Entry (i, j) of the Gram matrix.
    pub(super) fn entry(&self, i: usize, j: usize) -> f64 {
        self.gram[(i.max(j), i.min(j))]
    }

    pub(super) fn unknowns(&self) -> usize {
        self.gram.nrows() - 1
    }
}

/// What solves the equations.
pub(super) struct Solved {
    pub(super) solution: Mat<f64>,
    /// σ², with the redundancy of the observations.
    pub(super) noise: f64,
    /// Of the matrix with the prior.
    pub(super) factor: Llt<f64>,
}

impl Solved {
    /// The variances that are left to the first unknowns, the bits, whose prior variance is 1.
    pub(super) fn variances(&self, bits: usize) -> Vec<f64> {
        let unknowns = self.solution.nrows();
        let mut inverse = Mat::zeros(unknowns, unknowns);
        invert_lower_triangular(inverse.as_mut(), self.factor.L(), Par::Seq);
        // A = L Lᵀ, so that (A⁻¹)ₜₜ is the square of column t of L⁻¹.
        let variance = |t: usize| {
            let column = &inverse.col_as_slice(t)[t..];
            self.noise * column.iter().map(|x| x * x).sum::<f64>()
        };
        (0..bits).map(variance).collect()
    }
}
