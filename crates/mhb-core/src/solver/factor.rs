//! Sparse factors of A − σ I: the structure once, the numbers for each shift.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, Mat, MatMut, Par, Side};

use crate::SpectrumError;
use crate::canonical::Noise;
use crate::operator::Operator;

/// Largest componentwise backward error of a probe solve that is let pass.
const ACCURACY: f64 = 1e-9;

/// Fill-reducing ordering and structure of the factors of A − σ I, the same for every σ.
pub(crate) struct Analysis<'a> {
    operator: &'a Operator,
    symbolic: SymbolicCholesky<u32>,
}

impl<'a> Analysis<'a> {
    pub(crate) fn new(operator: &'a Operator) -> Result<Self, SpectrumError> {
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let structure = structure(operator);
        factorize_symbolic_cholesky(structure, Side::Lower, SymmetricOrdering::Amd, params)
            .map(|symbolic| Self { operator, symbolic })
            .map_err(|_| SpectrumError::Memory {
                size: operator.size(),
            })
    }

    pub(crate) fn operator(&self) -> &'a Operator {
        self.operator
    }

    /// L E Lᵀ = A − σ I with unit lower triangular L and diagonal E, checked by a probe solve.
    pub(crate) fn factorise(&self, shift: f64) -> Result<Factor<'_>, SpectrumError> {
        let mut values = vec![0.0; self.symbolic.len_val()];
        let scratch = self
            .symbolic
            .factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
        let outcome = self.symbolic.factorize_numeric_ldlt(
            &mut values,
            SparseColMatRef::new(structure(self.operator), &self.operator.shifted(shift)),
            Side::Lower,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            Default::default(),
        );
        let failed = SpectrumError::Factorisation {
            shift,
            backward_error: f64::INFINITY,
        };
        if outcome.is_err() {
            return Err(failed);
        }
        let mut factor = Factor {
            analysis: self,
            shift,
            values,
            below: 0,
        };
        factor.below = factor.negative_pivots().ok_or(failed)?;
        let backward_error = factor.probe();
        if backward_error < ACCURACY {
            Ok(factor)
        } else {
            Err(SpectrumError::Factorisation {
                shift,
                backward_error,
            })
        }
    }

    /// Factorises at `shift`, or, where that fails because it hits an eigenvalue of a leading block, a little beside it.
    pub(crate) fn factorise_near(&self, shift: f64, step: f64) -> Result<Factor<'_>, SpectrumError> {
        let mut outcome = self.factorise(shift);
        for attempt in 1..=4 {
            if outcome.is_ok() {
                break;
            }
            outcome = self.factorise(shift + step * f64::from(attempt));
        }
        outcome
    }
}

fn structure(operator: &Operator) -> SymbolicSparseColMatRef<'_, u32> {
    SymbolicSparseColMatRef::new_checked(
        operator.size(),
        operator.size(),
        operator.column_starts(),
        None,
        operator.rows(),
    )
}

/// A factorisation of A − σ I.
pub(crate) struct Factor<'a> {
    analysis: &'a Analysis<'a>,
    shift: f64,
    values: Vec<f64>,
    below: usize,
}

impl Factor<'_> {
    pub(crate) fn shift(&self) -> f64 {
        self.shift
    }

    /// How many eigenvalues of A lie below σ: the negative pivots, by Sylvester's law of inertia.
    pub(crate) fn below(&self) -> usize {
        self.below
    }

    /// X ← (A − σ I)⁻¹ X.
    pub(crate) fn solve(&self, x: MatMut<'_, f64>) {
        let symbolic = &self.analysis.symbolic;
        let scratch = symbolic.solve_in_place_scratch::<f64>(x.ncols(), Par::Seq);
        LdltRef::new(symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            x,
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
        );
    }

    /// `None` if a pivot is zero or not finite.
    fn negative_pivots(&self) -> Option<usize> {
        let SymbolicCholeskyRaw::Supernodal(structure) = self.analysis.symbolic.raw() else {
            return None;
        };
        let (starts, offsets) = (structure.supernode_begin(), structure.col_ptr_for_val());
        let mut negative = 0;
        for s in 0..structure.n_supernodes() {
            let (first, width) = (
                offsets[s] as usize,
                (structure.supernode_end()[s] - starts[s]) as usize,
            );
            let height = (offsets[s + 1] as usize - first) / width.max(1);
            for k in 0..width {
                let pivot = self.values[first + k * (height + 1)];
                if pivot == 0.0 || !pivot.is_finite() {
                    return None;
                }
                negative += usize::from(pivot < 0.0);
            }
        }
        Some(negative)
    }

    /// Solves for a fixed right-hand side b, and returns the componentwise backward error of the solution.
    fn probe(&self) -> f64 {
        let operator = self.analysis.operator;
        let mut noise = Noise::new(PROBE_SEED, 0);
        let b = Mat::from_fn(operator.size(), 1, |_, _| noise.next());
        let mut x = b.clone();
        self.solve(x.as_mut());
        let backward_error = |j: usize| {
            let (mut residual, mut size) = (-b[(j, 0)] - self.shift * x[(j, 0)], b[(j, 0)].abs());
            size += (self.shift * x[(j, 0)]).abs();
            for (i, value) in operator.column(j) {
                residual += value * x[(i, 0)];
                size += (value * x[(i, 0)]).abs();
            }
            residual.abs() / size
        };
        // NaN must fail the check, so it may not be lost in a maximum.
        (0..operator.size())
            .map(backward_error)
            .fold(0.0, |a, e| if e.is_nan() { f64::INFINITY } else { a.max(e) })
    }
}

const PROBE_SEED: u64 = 0x7072_6f62_65;
