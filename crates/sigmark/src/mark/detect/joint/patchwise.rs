//! Solved for what the mark adds to every coefficient, whatever its bits are.
//!
//! Coefficients belong to one patch each, so the equations are those of single patches, (Aₚ + σ²) uₚ + Cₚ θ = rₚ, and the few of the fields,
//! Σ Cₚᵀ uₚ + F θ = f. Eliminating uₚ leaves (F − Σ Cₚᵀ (Aₚ + σ²)⁻¹ Cₚ) θ = f − Σ Cₚᵀ (Aₚ + σ²)⁻¹ rₚ: ten thousand coefficients cost as little as their patches do.

use std::{collections::BTreeMap, ops::RangeInclusive};

use faer::Mat;

use super::{
    equations::{OPTIONAL_RIDGE, RIDGE},
    factor::Factor,
    fields::{FIELDS, OPTIONAL_FIELDS},
    patch::PatchEquations,
    system::{System, is_worth_weighing, optional_worth},
};
use crate::mark::MarkError;

/// The equations of all patches, and of the fields.
pub(super) struct PatchwiseEquations {
    blocks: BTreeMap<usize, Block>,
    /// F, f and Σ w (u·d)², by the lower triangle.
    fields: Mat<f64>,
    optional: usize,
    observations: usize,
    redundancy: f64,
}

/// Those of one patch.
struct Block {
    /// Aₚ, by its lower triangle.
    own: Mat<f64>,
    /// Cₚ, and rₚ as the last column.
    beside: Mat<f64>,
    gains: Vec<f64>,
}

/// A solution.
pub(super) struct PatchwiseSolution {
    theta: Mat<f64>,
    blocks: BTreeMap<usize, SolvedBlock>,
    noise: f64,
}

struct SolvedBlock {
    u: Vec<f64>,
    variances: Vec<f64>,
}

impl PatchwiseEquations {
    /// Whether a field takes part: all do but optional ones that explain too little.
    fn takes_part(&self, field: usize) -> bool {
        field < FIELDS - OPTIONAL_FIELDS + self.optional
    }

    fn unknowns(&self) -> usize {
        let own = self.blocks.values().map(|block| block.own.nrows());
        own.sum::<usize>() + FIELDS
    }
}

impl System for PatchwiseEquations {
    type Solution = PatchwiseSolution;

    const IS_OF_BITS: bool = false;

    fn of(
        patches: &BTreeMap<usize, PatchEquations>,
        _: usize,
        redundancy: f64,
        bounds: &RangeInclusive<usize>,
    ) -> Self {
        let mut equations = Self {
            blocks: BTreeMap::new(),
            fields: Mat::zeros(FIELDS + 1, FIELDS + 1),
            optional: 0,
            observations: 0,
            redundancy,
        };
        let mut mark = 0.0;
        for (&index, patch) in patches {
            let (gram, count) = (patch.gram_of_unknowns(), patch.bits().len());
            mark += (0..count).map(|i| gram[(i, i)]).sum::<f64>();
            for j in 0..=FIELDS {
                for i in j..=FIELDS {
                    equations.fields[(i, j)] += gram[(count + i, count + j)];
                }
            }
            equations.observations += patch.equations.observations;
            let block = Block {
                own: gram.get(..count, ..count).to_owned(),
                beside: Mat::from_fn(count, FIELDS + 1, |i, j| gram[(count + j, i)]),
                gains: patch.gains().to_vec(),
            };
            equations.blocks.insert(index, block);
        }
        for j in 0..=FIELDS {
            for i in 0..j {
                equations.fields[(i, j)] = equations.fields[(j, i)];
            }
        }
        equations.optional = optional_worth(&equations.fields, mark, bounds);
        equations
    }

    fn independent(&self) -> f64 {
        self.observations.max(1) as f64 / self.redundancy
    }

    fn can_weigh(&self, waiting: usize) -> bool {
        is_worth_weighing(self.observations, waiting, self.unknowns())
    }

    fn solved_for(&self, noise: f64, _: Option<PatchwiseSolution>) -> Result<PatchwiseSolution, MarkError> {
        let mut fields = self.fields.clone();
        let mut solved: Vec<(Mat<f64>, Vec<f64>)> = Vec::with_capacity(self.blocks.len());
        let mut spent = None;
        for block in self.blocks.values() {
            let added = |i: usize| RIDGE * block.own[(i, i)] + noise + f64::MIN_POSITIVE;
            let factor = Factor::of(block.own.as_ref(), added, spent.take())?;
            let beside = factor.solve(block.beside.clone());
            fields -= block.beside.transpose() * &beside;
            let inverse = factor.first_of_inverse(block.own.nrows()).into_iter();
            solved.push((beside, inverse.map(|entry| noise * entry).collect()));
            spent = Some(factor);
        }
        for i in 0..FIELDS {
            let ridge = if i < FIELDS - OPTIONAL_FIELDS {
                RIDGE
            } else {
                OPTIONAL_RIDGE
            };
            fields[(i, i)] += ridge * self.fields[(i, i)] + f64::MIN_POSITIVE;
        }
        for left_out in (0..FIELDS).filter(|&field| !self.takes_part(field)) {
            for i in 0..=FIELDS {
                (fields[(left_out, i)], fields[(i, left_out)]) = (0.0, 0.0);
            }
            fields[(left_out, left_out)] = 1.0;
        }
        let right = fields.get(..FIELDS, FIELDS..).to_owned();
        let theta = Factor::of(fields.get(..FIELDS, ..FIELDS), |_| 0.0, None)?.solve(right);
        let of_block = |(beside, variances): (Mat<f64>, Vec<f64>)| {
            let taken = beside.get(.., ..FIELDS) * &theta;
            let u = (0..variances.len()).map(|i| beside[(i, FIELDS)] - taken[(i, 0)]);
            let u = u.collect();
            SolvedBlock { u, variances }
        };
        Ok(PatchwiseSolution {
            blocks: self
                .blocks
                .keys()
                .copied()
                .zip(solved.into_iter().map(of_block))
                .collect(),
            theta,
            noise,
        })
    }

    fn squares(&self) -> f64 {
        self.fields[(FIELDS, FIELDS)]
    }

    /// The normal equations make it Σ w (u·d)² − ⟨x, right-hand side⟩ − σ² Σ u².
    fn squares_left(&self, solution: &PatchwiseSolution) -> f64 {
        let fields: f64 = (0..FIELDS)
            .map(|j| solution.theta[(j, 0)] * self.fields[(FIELDS, j)])
            .sum();
        let squares: f64 = self.means(solution).iter().map(|u| u * u).sum();
        (self.squares() - self.mark_explains(solution) - fields - solution.noise * squares).max(0.0)
    }

    fn means(&self, solution: &PatchwiseSolution) -> Vec<f64> {
        solution
            .blocks
            .values()
            .flat_map(|block| block.u.iter().copied())
            .collect()
    }

    fn variances(&self, solution: &PatchwiseSolution) -> Vec<f64> {
        let blocks = solution.blocks.values();
        blocks.flat_map(|block| block.variances.iter().copied()).collect()
    }

    fn own(&self, index: usize, _: &PatchEquations, solution: &PatchwiseSolution) -> Mat<f64> {
        let (u, gains) = (&solution.blocks[&index].u, &self.blocks[&index].gains);
        let own = u.iter().zip(gains).map(|(u, gain)| gain * u);
        let own: Vec<f64> = own
            .chain(solution.theta.col_as_slice(0).iter().copied())
            .collect();
        Mat::from_fn(own.len(), 1, |i, _| own[i])
    }

    fn mark_explains(&self, solution: &PatchwiseSolution) -> f64 {
        let pairs = self.blocks.values().zip(solution.blocks.values());
        pairs
            .flat_map(|(block, solved)| solved.u.iter().zip(block.beside.col_as_slice(FIELDS)))
            .map(|(u, right)| u * right)
            .sum()
    }

    fn theta(&self, solution: &PatchwiseSolution) -> Vec<f64> {
        solution.theta.col_as_slice(0).to_vec()
    }

    fn fields(&self) -> Mat<f64> {
        self.fields.clone()
    }
}
