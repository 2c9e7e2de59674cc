//! Sparse factors of A − σ M: the structure once, the numbers for each shift.

use std::borrow::Cow;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, SymbolicSupernodalParams};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Par, Side};

use super::packed::Packed;
use super::tall::LANES;
use crate::noise::Noise;
use crate::operator::Operator;
use crate::{InertiaCount, SpectrumError};

/// Largest componentwise backward error of a probe solve that is let pass.
const ACCURACY: f64 = 1e-9;

/// Supernodes of at most so many columns are merged where at most that share of their entries is zero. Less than faer's
/// default: our solves read every entry twice a block, and gain nothing from wide supernodes.
const RELAXATION: [(usize, f64); 3] = [(4, 0.5), (16, 0.2), (48, 0.05)];

/// Shifts that are tried, each a step further, where a factorisation fails.
const ATTEMPTS: u32 = 5;

/// Fill-reducing ordering and structure of the factors of A − σ M, the same for every σ.
///
/// Everything after it works in that ordering, so that no solve has to permute.
pub(crate) struct Analysis {
    /// A and M, in the fill-reducing ordering.
    operator: Operator,
    /// Vertex i of that ordering is vertex `forward[i]` of the mesh.
    forward: Vec<u32>,
    inverse: Vec<u32>,
    norm_bound: f64,
    symbolic: SymbolicCholesky<u32>,
}

impl Analysis {
    pub(crate) fn new(operator: &Operator) -> Result<Self, SpectrumError> {
        let memory = SpectrumError::Memory {
            size: operator.size(),
        };
        let ordering = analyse(operator, SymmetricOrdering::Amd).ok_or(memory.clone())?;
        let (forward, inverse) = ordering.perm().map(PermRef::arrays).ok_or(memory.clone())?;
        let permuted = operator.permuted(forward, inverse);
        let symbolic = analyse(&permuted, SymmetricOrdering::Identity).ok_or(memory)?;
        Ok(Self {
            norm_bound: operator.norm_bound(),
            operator: permuted,
            forward: forward.to_vec(),
            inverse: inverse.to_vec(),
            symbolic,
        })
    }

    /// A and M, in the fill-reducing ordering.
    pub(crate) fn operator(&self) -> &Operator {
        &self.operator
    }

    /// Vertex i of the ordering is vertex `forward()[i]` of the mesh.
    pub(crate) fn forward(&self) -> &[u32] {
        &self.forward
    }

    /// Vertex v of the mesh is vertex `inverse()[v]` of the ordering.
    pub(crate) fn inverse(&self) -> &[u32] {
        &self.inverse
    }

    /// L E Lᵀ = A − σ M with unit lower triangular L and diagonal E, checked by a probe solve.
    pub(crate) fn factorise(&self, shift: f64) -> Result<Factor<'_>, SpectrumError> {
        let failed = SpectrumError::Factorisation {
            shift,
            backward_error: f64::INFINITY,
        };
        let SymbolicCholeskyRaw::Supernodal(structure) = self.symbolic.raw() else {
            return Err(failed);
        };
        let mut values = vec![0.0; self.symbolic.len_val()];
        let scratch = self
            .symbolic
            .factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
        self.symbolic
            .factorize_numeric_ldlt(
                &mut values,
                SparseColMatRef::new(self.operator.structure(), &self.operator.shifted(shift)),
                Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut MemBuffer::new(scratch)),
                Default::default(),
            )
            .map_err(|_| failed)?;
        let packed = Packed::new(structure, values);
        let below = packed.inverse_pivots().iter().filter(|e| **e < 0.0).count();
        let factor = Factor {
            operator: &self.operator,
            shift,
            packed,
            below,
            norm_bound: self.norm_bound,
        };
        let backward_error = self.probe(&factor);
        if backward_error < ACCURACY {
            Ok(factor)
        } else {
            Err(SpectrumError::Factorisation {
                shift,
                backward_error,
            })
        }
    }

    /// Factorises at `shift`, or, where that fails because it hits an eigenvalue of a leading block, a little above.
    pub(crate) fn factorise_near(&self, shift: f64, step: f64) -> Result<Factor<'_>, SpectrumError> {
        let mut outcome = self.factorise(shift);
        for attempt in 1..ATTEMPTS {
            if outcome.is_ok() {
                break;
            }
            outcome = self.factorise(shift + step * f64::from(attempt));
        }
        outcome
    }

    /// Solves for a fixed right-hand side b; returns the largest componentwise backward error of the solution.
    fn probe(&self, factor: &Factor<'_>) -> f64 {
        let n = self.operator.size();
        let mut noise = Noise::new(PROBE_SEED, 0);
        let b: Vec<f64> = (0..n).map(|_| noise.next()).collect();
        let mut x = vec![0.0; n * LANES];
        for (group, &b) in x.chunks_exact_mut(LANES).zip(&b) {
            group[0] = b;
        }
        factor.packed.solve(&mut x);
        let weighted = self.operator.mass_times::<LANES>(&x);
        let backward_error = |j: usize| {
            let own = factor.shift * weighted[j * LANES];
            let (mut residual, mut size) = (-b[j] - own, b[j].abs() + own.abs());
            for (i, value) in self.operator.column(j) {
                let term = value * x[i * LANES];
                residual += term;
                size += term.abs();
            }
            residual.abs() / size
        };
        // NaN must fail the check, so it may not be lost in a maximum.
        (0..n)
            .map(backward_error)
            .fold(0.0, |a, e| if e.is_nan() { f64::INFINITY } else { a.max(e) })
    }
}

fn analyse(operator: &Operator, ordering: SymmetricOrdering<'_, u32>) -> Option<SymbolicCholesky<u32>> {
    let params = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
        supernodal_params: SymbolicSupernodalParams {
            relax: Some(&RELAXATION),
        },
        ..Default::default()
    };
    factorize_symbolic_cholesky(operator.structure(), Side::Lower, ordering, params).ok()
}

impl Operator {
    fn structure(&self) -> SymbolicSparseColMatRef<'_, u32> {
        SymbolicSparseColMatRef::new_checked(
            self.size(),
            self.size(),
            self.column_starts(),
            None,
            self.rows(),
        )
    }
}

/// A factorisation of A − σ M.
pub(crate) struct Factor<'a> {
    operator: &'a Operator,
    shift: f64,
    packed: Packed,
    below: usize,
    norm_bound: f64,
}

impl Factor<'_> {
    /// A and M, in the fill-reducing ordering.
    pub(crate) fn operator(&self) -> &Operator {
        self.operator
    }

    pub(crate) fn shift(&self) -> f64 {
        self.shift
    }

    /// An upper bound of the eigenvalues.
    pub(crate) fn norm_bound(&self) -> f64 {
        self.norm_bound
    }

    /// How many eigenvalues lie below σ: as many as there are negative pivots.
    pub(crate) fn inertia(&self) -> InertiaCount {
        InertiaCount {
            shift: self.shift,
            below: self.below,
        }
    }

    /// X ← (A − σ M)⁻¹ X, for blocks of columns as [`Tall`](super::tall::Tall) has them.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        self.packed.solve(x);
    }

    /// X ← T X with T = (A − σ M)⁻¹ M.
    pub(crate) fn apply(&self, x: &mut [f64]) {
        if let Cow::Owned(weighted) = self.operator.mass_times::<LANES>(x) {
            x.copy_from_slice(&weighted);
        }
        self.packed.solve(x);
    }
}

const PROBE_SEED: u64 = 0x0070_726f_6265;
