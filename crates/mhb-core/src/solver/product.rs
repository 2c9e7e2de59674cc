//! The inner product xᵀ M y, in which eigenvectors are orthonormal, for blocks of columns as [`Tall`](super::tall::Tall) has them.
//!
//! For lumped mass M is the identity, and costs nothing.

use faer::Mat;

use super::tall::{LANES, add, inner};
use crate::operator::Operator;

/// Vᵀ M X.
pub(crate) fn overlaps(operator: &Operator, v: &[f64], x: &[f64]) -> Mat<f64> {
    if v.is_empty() {
        return Mat::zeros(0, x.len() / operator.size());
    }
    inner(operator.size(), v, &operator.mass_times::<LANES>(x))
}

/// X ← X − V Vᵀ M X; returns Vᵀ M X.
pub(crate) fn orthogonalise(operator: &Operator, x: &mut [f64], v: &[f64]) -> Mat<f64> {
    let coefficients = overlaps(operator, v, x);
    add(operator.size(), x, v, (-1.0 * &coefficients).as_ref());
    coefficients
}

/// √(xᵀ M x) of each column of a block.
pub(crate) fn lengths(operator: &Operator, block: &[f64]) -> [f64; LANES] {
    let weighted = operator.mass_times::<LANES>(block);
    let (rows, _) = block.as_chunks::<LANES>();
    let (weighted, _) = weighted.as_chunks::<LANES>();
    let mut squares = [0.0; LANES];
    for (x, y) in rows.iter().zip(weighted) {
        (0..LANES).for_each(|lane| squares[lane] += x[lane] * y[lane]);
    }
    squares.map(f64::sqrt)
}
