//! The normal equations, and what solves them.

use std::{collections::BTreeMap, ops::RangeInclusive};

use faer::{
    Accum, Mat, Par,
    linalg::matmul::triangular::{BlockStructure, matmul},
};

use super::{
    design::{Design, View},
    factor::Factor,
    fields::{FIELDS, OPTIONAL_FIELDS},
    observations::Observation,
    patch::PatchEquations,
    system::{System, is_worth_weighing, optional_worth},
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

/// How often weights follow from residuals; they are all but settled then.
pub(super) const REWEIGHTINGS: usize = 2;

/// With fewer observations, residuals say little about noise; more change weights by little.
pub(super) const OBSERVATIONS_AN_UNKNOWN: usize = 8;

/// Added to the diagonal, relative to it: what the observations do not determine, such as a turn of a sphere, stays zero.
pub(super) const RIDGE: f64 = 1e-12;

/// The same for optional fields, so that what a similarity explains as well is one: on a sphere a cubic field can be a scale.
pub(super) const OPTIONAL_RIDGE: f64 = 1e-6;

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

    /// The same equations with so many optional fields; the coefficients of the others will be zero.
    pub(super) fn with_optional(mut self, count: usize) -> Self {
        let last = self.unknowns();
        for column in last - OPTIONAL_FIELDS + count..last {
            for i in 0..=last {
                self.gram[(i.max(column), i.min(column))] = 0.0;
            }
        }
        self
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
        let gram = patch.gram_of_bits();
        let bits = self.bits;
        let place = |i: usize| match patch.bits.get(i) {
            Some(&bit) => bit,
            None => bits + i - patch.bits.len(),
        };
        for j in 0..gram.ncols() {
            for i in j..gram.nrows() {
                let (a, b) = (place(i), place(j));
                // Two chips of one bit stand on both sides of the diagonal.
                let times = if a == b && i > j { 2.0 } else { 1.0 };
                self.gram[(a.max(b), a.min(b))] += times * gram[(i, j)];
            }
        }
        self.observations += patch.equations.observations;
    }

    /// Σ w e² of a solution.
    pub(super) fn squares_left_by(&self, solution: &Mat<f64>) -> f64 {
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

    /// Entry (i, j) of the Gram matrix.
    pub(super) fn entry(&self, i: usize, j: usize) -> f64 {
        self.gram[(i.max(j), i.min(j))]
    }

    pub(super) fn unknowns(&self) -> usize {
        self.gram.nrows() - 1
    }
}

impl System for NormalEquations {
    type Solution = Solved;

    const IS_OF_BITS: bool = true;

    fn of(
        patches: &BTreeMap<usize, PatchEquations>,
        bits: usize,
        redundancy: f64,
        optional: &RangeInclusive<usize>,
    ) -> Self {
        let mut equations = Self::empty(bits, redundancy);
        patches.values().for_each(|patch| equations.add(patch));
        let fields = equations.fields();
        let mark = (0..bits).map(|t| equations.entry(t, t)).sum();
        equations.with_optional(optional_worth(&fields, mark, optional))
    }

    fn independent(&self) -> f64 {
        self.observations.max(1) as f64 / self.redundancy
    }

    fn can_weigh(&self, waiting: usize) -> bool {
        is_worth_weighing(self.observations, waiting, self.unknowns())
    }

    fn solved_for(&self, noise: f64, spent: Option<Solved>) -> Result<Solved, MarkError> {
        let unknowns = self.unknowns();
        let gram = self.gram.get(..unknowns, ..unknowns);
        let added = |i: usize| {
            let prior = if i < self.bits { noise } else { 0.0 };
            let is_optional = i >= unknowns - OPTIONAL_FIELDS;
            let ridge = if is_optional { OPTIONAL_RIDGE } else { RIDGE };
            ridge * self.entry(i, i) + prior + f64::MIN_POSITIVE
        };
        let factor = Factor::of(gram, added, spent.map(|spent| spent.factor))?;
        let right = Mat::from_fn(unknowns, 1, |i, _| self.entry(unknowns, i));
        Ok(Solved {
            solution: factor.solve(right),
            factor,
            noise,
        })
    }

    fn squares(&self) -> f64 {
        self.entry(self.unknowns(), self.unknowns())
    }

    fn squares_left(&self, solved: &Solved) -> f64 {
        self.squares_left_by(&solved.solution)
    }

    fn means(&self, solved: &Solved) -> Vec<f64> {
        (0..self.bits).map(|t| solved.solution[(t, 0)]).collect()
    }

    fn variances(&self, solved: &Solved) -> Vec<f64> {
        solved.variances(self.bits)
    }

    fn own(&self, _: usize, patch: &PatchEquations, solved: &Solved) -> Mat<f64> {
        patch.own(&solved.solution)
    }

    fn mark_explains(&self, solved: &Solved) -> f64 {
        let last = self.unknowns();
        (0..self.bits)
            .map(|t| solved.solution[(t, 0)] * self.entry(last, t))
            .sum()
    }

    fn theta(&self, solved: &Solved) -> Vec<f64> {
        (self.bits..self.unknowns())
            .map(|j| solved.solution[(j, 0)])
            .collect()
    }

    fn fields(&self) -> Mat<f64> {
        Mat::from_fn(FIELDS + 1, FIELDS + 1, |i, j| {
            self.entry(self.bits + i, self.bits + j)
        })
    }
}

/// What solves the equations.
pub(super) struct Solved {
    pub(super) solution: Mat<f64>,
    /// σ², with the redundancy of the observations.
    pub(super) noise: f64,
    /// Of the matrix with the prior.
    pub(super) factor: Factor,
}

impl Solved {
    /// The variances that are left to the first unknowns, the bits, whose prior variance is 1.
    pub(super) fn variances(&self, bits: usize) -> Vec<f64> {
        let inverse = self.factor.first_of_inverse(bits).into_iter();
        inverse.map(|entry| self.noise * entry).collect()
    }
}
