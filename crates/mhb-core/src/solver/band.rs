//! The eigenpairs of one band, by a block Krylov space of the shifted inverse.
//!
//! T = (A − σ I)⁻¹ maps eigenvalues λ to θ = 1/(λ − σ), so those near σ become the extreme ones. The space
//! span(V₁, T V₁, T² V₁, …) is kept orthonormal in full; the projected problem Vᵀ T V gives Ritz pairs (θ, V s).
//! With r = T y − θ y, the vector T y / θ = y + r / θ costs no solve and has the residual
//! ‖(A − λ) (y + r/θ)‖ = ‖r‖ / θ² exactly: that is what is compared with the tolerance.

use faer::reborrow::{Reborrow, ReborrowMut};
use faer::{Mat, MatMut, MatRef};

use super::factor::Factor;
use crate::canonical::Noise;
use crate::{SpectrumError, dense};

/// A part of the spectrum, with the number of eigenvalues that inertia proves to be in it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Band {
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    pub(crate) count: usize,
}

/// Converged pairs, ascending.
pub(crate) struct Pairs {
    pub(crate) values: Vec<f64>,
    pub(crate) vectors: Mat<f64>,
}

/// Restarts before a band is given up.
const ROUNDS: u64 = 12;

/// All pairs of `band` orthogonal to `deflated`, an orthonormal set of known eigenvectors.
pub(crate) fn solve(
    factor: &Factor<'_>,
    band: Band,
    deflated: MatRef<'_, f64>,
    block: usize,
    tolerance: f64,
) -> Result<Pairs, SpectrumError> {
    let n = deflated.nrows();
    let known = deflated.ncols();
    let mut locked = Mat::zeros(n, known + band.count);
    locked.as_mut().subcols_mut(0, known).copy_from(deflated);
    let mut values = Vec::new();
    for round in 0..ROUNDS {
        if values.len() == band.count {
            break;
        }
        let missing = band.count - values.len();
        let taken = known + values.len();
        let width = block.min(n - taken).max(1);
        let search = Search {
            factor,
            band,
            missing,
            tolerance,
            locked: locked.as_ref().subcols(0, taken),
        };
        let found = search.run(width, round)?;
        // More pairs than exist mean that the count or a Ritz value at the band's edge is not to be trusted.
        if found.values.len() > missing {
            return Err(incomplete(band, values.len() + found.values.len()));
        }
        locked
            .as_mut()
            .subcols_mut(taken, found.values.len())
            .copy_from(found.vectors.as_ref());
        values.extend(found.values);
    }
    if values.len() != band.count {
        return Err(incomplete(band, values.len()));
    }
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let vectors = Mat::from_fn(n, values.len(), |i, k| locked[(i, known + order[k])]);
    Ok(Pairs {
        values: order.iter().map(|&k| values[k]).collect(),
        vectors,
    })
}

fn incomplete(band: Band, found: usize) -> SpectrumError {
    SpectrumError::Incomplete {
        lower: band.lower,
        upper: band.upper,
        found,
        expected: band.count,
    }
}

/// One Krylov space, from a random start orthogonal to what is locked.
struct Search<'a> {
    factor: &'a Factor<'a>,
    band: Band,
    missing: usize,
    tolerance: f64,
    locked: MatRef<'a, f64>,
}

/// Ritz pairs of the shifted inverse in a Krylov space of dimension d.
struct Ritz {
    theta: Vec<f64>,
    /// Coordinates of the vectors in the basis, d by d.
    coordinates: Mat<f64>,
    /// r of each pair in the last, still unused block of the basis, `width` by d.
    remainder: Mat<f64>,
    /// Which pairs lie in the band and have converged.
    converged: Vec<usize>,
}

impl Search<'_> {
    fn run(&self, width: usize, round: u64) -> Result<Pairs, SpectrumError> {
        let n = self.locked.nrows();
        let room = n - self.locked.ncols();
        let limit = (3 * self.missing + 24 * width).min(room);
        let mut basis = Mat::zeros(n, limit + width);
        let mut projected = Mat::zeros(limit + width, limit + width);
        self.start(basis.as_mut().subcols_mut(0, width), round);
        let mut size = 0;
        loop {
            let (done, rest) = basis.as_mut().split_at_col_mut(size + width);
            let mut next = rest.subcols_mut(0, width);
            next.copy_from(done.rb().subcols(size, width));
            self.factor.solve(next.rb_mut());
            let mut coefficients = orthogonalise(next.rb_mut(), done.rb());
            coefficients += orthogonalise(next.rb_mut(), done.rb());
            orthogonalise(next.rb_mut(), self.locked);
            let remainder = orthonormalise(next.rb_mut(), &[done.rb(), self.locked]);
            let previous = size;
            size += width;
            projected
                .as_mut()
                .submatrix_mut(0, previous, size, width)
                .copy_from(coefficients.as_ref());
            projected
                .as_mut()
                .submatrix_mut(size, previous, width, width)
                .copy_from(remainder.as_ref());
            let full = size + width > limit;
            if size >= self.missing || full {
                let ritz = self.ritz(projected.as_ref(), size, width)?;
                if ritz.converged.len() >= self.missing || full {
                    return Ok(self.extract(&ritz, basis.as_ref(), size, width));
                }
            }
        }
    }

    /// Noise, smoothed by one solve, orthogonal to the locked vectors.
    fn start(&self, mut x: MatMut<'_, f64>, round: u64) {
        let mut noise = Noise::new(START_SEED, round);
        for j in 0..x.ncols() {
            for i in 0..x.nrows() {
                x[(i, j)] = noise.next();
            }
        }
        self.factor.solve(x.rb_mut());
        orthogonalise(x.rb_mut(), self.locked);
        orthogonalise(x.rb_mut(), self.locked);
        orthonormalise(x, &[self.locked]);
    }

    fn ritz(&self, projected: MatRef<'_, f64>, size: usize, width: usize) -> Result<Ritz, SpectrumError> {
        // The upper half holds coefficients against the whole basis; the lower half only those of the last block.
        let symmetric = Mat::from_fn(size, size, |i, j| projected[(i.min(j), i.max(j))]);
        let (theta, coordinates) = dense::symmetric_eigen(symmetric.as_ref())?;
        let last = projected.submatrix(size, size - width, width, width);
        let remainder = dense::product(last, coordinates.as_ref().subrows(size - width, width));
        let converged = (0..size)
            .filter(|&k| {
                let lambda = self.factor.shift() + 1.0 / theta[k];
                let residual = remainder.col(k).norm_l2() / (theta[k] * theta[k]);
                lambda >= self.band.lower
                    && lambda < self.band.upper
                    && residual <= self.tolerance * lambda.abs().max(1.0)
            })
            .collect();
        Ok(Ritz {
            theta,
            coordinates,
            remainder,
            converged,
        })
    }

    /// The vectors y + r/θ of the converged pairs.
    fn extract(&self, ritz: &Ritz, basis: MatRef<'_, f64>, size: usize, width: usize) -> Pairs {
        let count = ritz.converged.len();
        let coordinates = Mat::from_fn(size + width, count, |i, c| {
            let k = ritz.converged[c];
            if i < size {
                ritz.coordinates[(i, k)]
            } else {
                ritz.remainder[(i - size, k)] / ritz.theta[k]
            }
        });
        let mut vectors = dense::product(basis.subcols(0, size + width), coordinates.as_ref());
        orthonormalise(vectors.as_mut(), &[]);
        let values = ritz
            .converged
            .iter()
            .map(|&k| self.factor.shift() + 1.0 / ritz.theta[k])
            .collect();
        Pairs { values, vectors }
    }
}

const START_SEED: u64 = 0x6b72_796c_6f76;

/// X ← X − V Vᵀ X; returns Vᵀ X.
fn orthogonalise(x: MatMut<'_, f64>, v: MatRef<'_, f64>) -> Mat<f64> {
    if v.ncols() == 0 {
        return Mat::zeros(0, x.ncols());
    }
    let coefficients = dense::product(v.transpose(), x.rb());
    dense::add_product(x, -1.0, v, coefficients.as_ref());
    coefficients
}

/// Orthonormalises the columns of X, which are orthogonal to the `others`, among themselves: X = Q R, returns R.
///
/// Gram–Schmidt, column by column, each twice. A column that depends on those before it is replaced by noise orthogonal
/// to all, with a zero on R's diagonal: the Krylov space has closed, and goes on in a new direction.
fn orthonormalise(mut x: MatMut<'_, f64>, others: &[MatRef<'_, f64>]) -> Mat<f64> {
    let width = x.ncols();
    let mut r = Mat::zeros(width, width);
    for k in 0..width {
        let (done, mut column) = x.rb_mut().subcols_mut(0, k + 1).split_at_col_mut(k);
        let before = column.norm_l2();
        for _ in 0..2 {
            let c = orthogonalise(column.rb_mut(), done.rb());
            for i in 0..k {
                r[(i, k)] += c[(i, 0)];
            }
        }
        let mut norm = column.norm_l2();
        r[(k, k)] = norm;
        if norm <= 1e-13 * before {
            r[(k, k)] = 0.0;
            let mut noise = Noise::new(FRESH_SEED, k as u64);
            for i in 0..column.nrows() {
                column[(i, 0)] = noise.next();
            }
        }
        // After cancellation, what is left may have lost its orthogonality to the others.
        if norm <= 1e-3 * before {
            for _ in 0..2 {
                for other in others.iter().chain([&done.rb()]) {
                    orthogonalise(column.rb_mut(), *other);
                }
            }
            norm = column.norm_l2();
        }
        faer::zip!(column).for_each(|faer::unzip!(entry)| *entry /= norm);
    }
    r
}

const FRESH_SEED: u64 = 0x6672_6573_68;
