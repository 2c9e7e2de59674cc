//! The inner product xᵀ M y, in which eigenvectors are orthonormal, for blocks of columns as [`Tall`] has them.
//!
//! For lumped mass M is the identity, and costs nothing.

use faer::Mat;

use super::tall::{LANES, Tall, add, inner};
use crate::operator::Operator;

/// Vᵀ M X.
pub(crate) fn overlaps(operator: &Operator, v: &[f64], x: &[f64]) -> Mat<f64> {
    inner(operator.size(), v, &operator.mass_times::<LANES>(x))
}

/// X ← X − V Vᵀ M X; returns Vᵀ M X.
pub(crate) fn orthogonalise(operator: &Operator, x: &mut [f64], v: &[f64]) -> Mat<f64> {
    let coefficients = overlaps(operator, v, x);
    add(operator.size(), x, v, (-1.0 * &coefficients).as_ref());
    coefficients
}

/// √(xᵀ M x) of column k.
pub(crate) fn length(operator: &Operator, x: &Tall, k: usize) -> f64 {
    let first = k / LANES * LANES;
    let block = x.blocks(first, first + LANES);
    let weighted = operator.mass_times::<LANES>(block);
    let pairs = block.iter().zip(&*weighted).skip(k % LANES).step_by(LANES);
    pairs.map(|(x, y)| x * y).sum::<f64>().sqrt()
}
