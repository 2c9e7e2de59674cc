//! The solver's steps one by one, for benchmarks alone: behind the feature `bench-internals`, and without any promise.

use faer::Mat;

use super::factor::{Analysis, Factor};
use super::tall::{LANES, add, inner};
use crate::operator::Operator;
use crate::{Laplacian, SpectrumError, dense};

/// A = D^-½ S D^-½, ordered and analysed.
pub struct Ordered(Analysis);

/// L E Lᵀ = A − σ M.
pub struct Factorised<'a>(Factor<'a>);

impl Ordered {
    /// Fill-reducing ordering and structure of the factors.
    ///
    /// # Errors
    /// See [`SpectrumError`].
    pub fn new(laplacian: &Laplacian) -> Result<Self, SpectrumError> {
        Ok(Self(Analysis::new(&Operator::new(laplacian))?))
    }

    /// The numbers of the factors at shift σ, for a surface of unit area.
    ///
    /// # Errors
    /// See [`SpectrumError`].
    pub fn factorise(&self, shift: f64) -> Result<Factorised<'_>, SpectrumError> {
        Ok(Factorised(self.0.factorise(shift)?))
    }
}

impl Factorised<'_> {
    /// How many right-hand sides stand side by side in a row.
    pub const LANES: usize = LANES;

    /// X ← (A − σ M)⁻¹ X; X is #V by [`LANES`](Self::LANES), row-major.
    pub fn solve(&self, x: &mut [f64]) {
        self.0.solve(x);
    }
}

/// Rayleigh–Ritz: VᵀW, its eigenvectors, and the first `kept` linear combinations of V's columns by them. V and W are #V = `rows`
/// high, in blocks of [`LANES`](Factorised::LANES) columns, each row-major.
///
/// # Errors
/// See [`SpectrumError`].
pub fn rayleigh_ritz(rows: usize, v: &[f64], w: &[f64], kept: usize) -> Result<Vec<f64>, SpectrumError> {
    let (_, vectors) = dense::symmetric_eigen(inner(rows, v, w).as_ref())?;
    let kept = kept.next_multiple_of(LANES);
    let combinations = Mat::from_fn(vectors.nrows(), kept, |i, j| vectors[(i, j)]);
    let mut result = vec![0.0; rows * kept];
    add(rows, &mut result, v, combinations.as_ref());
    Ok(result)
}
