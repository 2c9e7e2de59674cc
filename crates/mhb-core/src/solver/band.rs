//! The eigenpairs of one band, by a block Krylov space of the shifted inverse.
//!
//! T = (A − σ I)⁻¹ maps eigenvalues λ to θ = 1/(λ − σ), so those near σ become the extreme ones. The space
//! span(V₁, T V₁, T² V₁, …) is kept orthonormal in full; the projected problem Vᵀ T V gives Ritz pairs (θ, V s).
//! With r = T y − θ y, the vector T y / θ = y + r / θ costs no solve and has the residual
//! ‖(A − λ) (y + r/θ)‖ = ‖r‖ / θ² exactly: that is what is compared with the tolerance.

use std::sync::{Mutex, PoisonError};

use faer::{Mat, MatRef};

use super::factor::Factor;
use super::tall::{LANES, Tall, add, inner, multiply};
use crate::canonical::Noise;
use crate::{SpectrumError, dense};

/// A part of the spectrum around a shift.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Band {
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    /// How many eigenvalues are in it: as inertia proves, or about.
    pub(crate) count: Count,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Count {
    /// Proven: the search goes on until all are found.
    Exactly(usize),
    /// Expected: the search ends when no more show up, and the caller checks.
    About(usize),
}

/// Converged pairs, in any order.
pub(crate) struct Pairs {
    pub(crate) values: Vec<f64>,
    /// #V by count, of unit length, orthogonal within the tolerance.
    pub(crate) vectors: Tall,
    /// Residual ‖A y − λ y‖ of each.
    pub(crate) residuals: Vec<f64>,
}

/// Memory that one search after another uses again.
///
/// A Krylov basis is large, and its first use costs as much as a pass over it: the system has to find and clear the pages.
#[derive(Default)]
pub(crate) struct Workspaces(Mutex<Vec<Tall>>);

impl Workspaces {
    /// Calls `f` with a matrix of `rows` rows and at least `columns` columns, of any content.
    fn with<T>(&self, rows: usize, columns: usize, f: impl FnOnce(&mut Tall) -> T) -> T {
        let spare = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut basis = spare
            .filter(|basis| basis.rows() == rows && basis.columns() >= columns)
            .unwrap_or_else(|| Tall::zeros(rows, columns));
        let result = f(&mut basis);
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(basis);
        result
    }
}

/// Overlaps with the basis below this, relative to what T made of a unit vector, are rounding, and left alone.
const NEGLIGIBLE: f64 = 1e-13;

/// Residual that rounding may leave in a combination of basis vectors, relative to the norm of A.
const ROUNDING: f64 = 4e-14;

/// Restarts before a band is given up.
const ROUNDS: u64 = 12;

/// A pair beyond the band's end that has converged to this residual shows that the search has gone past the end.
const WITNESS: f64 = 1e-3;

/// The pairs of `band` orthogonal to `deflated`, an orthonormal set of known eigenvectors.
pub(crate) fn solve(
    factor: &Factor,
    band: Band,
    deflated: &Tall,
    block: usize,
    tolerance: f64,
    workspaces: &Workspaces,
) -> Result<Pairs, SpectrumError> {
    let mut search = Search {
        factor,
        band,
        expected: 0,
        exact: false,
        tolerance,
        locked: deflated,
    };
    let exactly = match band.count {
        Count::About(expected) => {
            search.expected = expected;
            return search.run(block, 0, workspaces);
        }
        Count::Exactly(count) => count,
    };
    search.exact = true;
    let mut locked = deflated.clone();
    let mut found = Pairs::none(deflated.rows());
    for round in 0..ROUNDS {
        if found.values.len() >= exactly {
            break;
        }
        let missing = exactly - found.values.len();
        let mut new = Search {
            expected: missing,
            locked: &locked,
            ..search
        }
        .run(block, round, workspaces)?;
        let count = new.values.len();
        orthogonalise(locked.rows(), new.vectors.all_mut(), locked.all());
        orthonormalise_one_by_one(&mut new.vectors, count, &[locked.all()], 0.0);
        locked.append(&new.vectors);
        found.take(&new);
    }
    // More pairs than exist mean that the count or a Ritz value at the band's edge is not to be trusted.
    if found.values.len() != exactly {
        let (lower, upper) = (band.lower, band.upper);
        return Err(SpectrumError::Incomplete {
            lower,
            upper,
            found: found.values.len(),
            expected: exactly,
        });
    }
    Ok(found)
}

impl Pairs {
    fn none(rows: usize) -> Self {
        Self {
            values: Vec::new(),
            vectors: Tall::zeros(rows, 0),
            residuals: Vec::new(),
        }
    }

    /// Adds others.
    fn take(&mut self, others: &Pairs) {
        for (k, (&value, &residual)) in others.values.iter().zip(&others.residuals).enumerate() {
            if self.values.len() == self.vectors.columns() {
                self.vectors.append(&Tall::zeros(others.vectors.rows(), 1));
            }
            let target = self.vectors.column_mut(self.values.len());
            target.zip(others.vectors.column(k)).for_each(|(t, s)| *t = s);
            self.values.push(value);
            self.residuals.push(residual);
        }
    }
}

/// One Krylov space, from a random start orthogonal to what is locked.
#[derive(Clone, Copy)]
struct Search<'a> {
    factor: &'a Factor,
    band: Band,
    expected: usize,
    exact: bool,
    tolerance: f64,
    locked: &'a Tall,
}

/// Ritz pairs of the shifted inverse in a Krylov space of dimension d.
struct Ritz {
    theta: Vec<f64>,
    /// Coordinates of the vectors in the basis, d by d.
    coordinates: Mat<f64>,
    /// r of each pair in the last, still unused block of the basis, `width` by d.
    remainder: Mat<f64>,
    /// ‖r‖ / θ².
    residuals: Vec<f64>,
}

impl Search<'_> {
    /// Grows the space until the band's pairs have converged, or to its limit.
    fn run(&self, block: usize, round: u64, workspaces: &Workspaces) -> Result<Pairs, SpectrumError> {
        let rows = self.locked.rows();
        let width = block.next_multiple_of(LANES);
        let room = rows.saturating_sub(self.locked.columns() + width);
        let limit = (4 * self.expected + 24 * width).min(room) / width * width;
        workspaces.with(rows, limit + width, |basis| self.grow(width, limit, round, basis))
    }

    /// [`run`](Self::run) with blocks of `width` columns, up to `limit` of them, in the memory of `basis`.
    fn grow(&self, width: usize, limit: usize, round: u64, basis: &mut Tall) -> Result<Pairs, SpectrumError> {
        let rows = basis.rows();
        let mut projected = Mat::zeros(limit + width, limit + width);
        self.start(&mut basis.all_mut()[..rows * width], round);
        let (mut size, mut next_check) = (0, 5 * self.expected / 2);
        loop {
            let (done, next) = basis.split_at_mut(size + width);
            let next = &mut next[..rows * width];
            next.copy_from_slice(&done[rows * size..]);
            self.factor.solve(next);
            let scale = mean_length(rows, next);
            // T is symmetric, so in exact arithmetic only the last two blocks overlap with the new one: they go first,
            // and what rounding leaves is removed against all.
            let near = size.saturating_sub(width);
            let leading = orthogonalise(rows, next, &done[rows * near..]);
            let mut coefficients = inner(rows, done, next);
            subtract(rows, next, done, coefficients.as_ref(), NEGLIGIBLE * scale);
            let mut recent = coefficients.as_mut().subrows_mut(near, size + width - near);
            recent += &leading;
            orthogonalise(rows, next, self.locked.all());
            let remainder = orthonormalise(rows, next, &[done, self.locked.all()], scale);
            projected
                .as_mut()
                .submatrix_mut(0, size, size + width, width)
                .copy_from(coefficients.as_ref());
            size += width;
            let full = size + width > limit;
            if size >= next_check || full {
                let ritz = Ritz::new(projected.as_ref().submatrix(0, 0, size, size), remainder.as_ref())?;
                let open = self.open(&ritz);
                if open == 0 || full {
                    return Ok(self.extract(&ritz, rows, basis.blocks(0, size + width)));
                }
                next_check = size + (3 * open / 2).max(width);
            }
        }
    }

    /// Noise, smoothed by one solve, orthogonal to the locked vectors.
    fn start(&self, x: &mut [f64], round: u64) {
        let rows = self.locked.rows();
        let mut noise = Noise::new(START_SEED, round);
        x.iter_mut().for_each(|entry| *entry = noise.next());
        self.factor.solve(x);
        let scale = mean_length(rows, x);
        orthogonalise(rows, x, self.locked.all());
        orthogonalise(rows, x, self.locked.all());
        orthonormalise(rows, x, &[self.locked.all()], scale);
    }

    fn lambda(&self, theta: f64) -> f64 {
        self.factor.shift() + 1.0 / theta
    }

    fn inside(&self, lambda: f64) -> bool {
        lambda >= self.band.lower && lambda < self.band.upper
    }

    fn converged(&self, ritz: &Ritz, k: usize) -> bool {
        ritz.residuals[k] <= self.tolerance * self.lambda(ritz.theta[k]).max(1.0)
    }

    /// How many pairs of the band are known to be still missing or inaccurate: 0 ends the search.
    fn open(&self, ritz: &Ritz) -> usize {
        let lambda = |k: usize| self.lambda(ritz.theta[k]);
        let inside = || (0..ritz.theta.len()).filter(|&k| self.inside(lambda(k)));
        let converged = inside().filter(|&k| self.converged(ritz, k)).count();
        if self.exact {
            return self.expected.saturating_sub(converged);
        }
        let witness = |beyond: &dyn Fn(f64) -> bool| {
            (0..ritz.theta.len())
                .any(|k| beyond(lambda(k)) && ritz.residuals[k] <= WITNESS * lambda(k).max(1.0))
        };
        let passed_below = self.band.lower < 0.0 || witness(&|l| l < self.band.lower && l > 0.0);
        let passed_above = witness(&|l| l >= self.band.upper);
        let pending = inside().count() - converged;
        if passed_below && passed_above {
            pending
        } else {
            pending.max(1)
        }
    }

    /// The vectors y + r/θ of the pairs in the band that have converged.
    fn extract(&self, ritz: &Ritz, rows: usize, basis: &[f64]) -> Pairs {
        let size = ritz.theta.len();
        let chosen: Vec<usize> = (0..size)
            .filter(|&k| self.inside(self.lambda(ritz.theta[k])) && self.converged(ritz, k))
            .collect();
        let mut vectors = Tall::zeros(rows, chosen.len());
        let mut coordinates = Mat::from_fn(basis.len() / rows, vectors.columns(), |i, c| {
            let Some(&k) = chosen.get(c) else { return 0.0 };
            if i < size {
                ritz.coordinates[(i, k)]
            } else {
                ritz.remainder[(i - size, k)] / ritz.theta[k]
            }
        });
        for c in 0..chosen.len() {
            let norm = coordinates.col(c).norm_l2();
            coordinates
                .col_as_slice_mut(c)
                .iter_mut()
                .for_each(|x| *x /= norm);
        }
        add(rows, vectors.all_mut(), basis, coordinates.as_ref());
        let values: Vec<f64> = chosen.iter().map(|&k| self.lambda(ritz.theta[k])).collect();
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        if self.tolerance * least.max(1.0) < ROUNDING * self.factor.norm_bound() {
            self.smooth(&mut vectors, chosen.len());
        }
        Pairs {
            values,
            vectors,
            residuals: chosen.iter().map(|&k| ritz.residuals[k]).collect(),
        }
    }
}

impl Search<'_> {
    /// y ← T y / ‖T y‖. Sums of many vectors leave rounding errors of all frequencies, which A amplifies and T damps.
    fn smooth(&self, vectors: &mut Tall, count: usize) {
        self.factor.solve(vectors.all_mut());
        for k in 0..count {
            let norm = vectors.column(k).map(|y| y * y).sum::<f64>().sqrt();
            vectors.column_mut(k).for_each(|y| *y /= norm);
        }
    }
}

impl Ritz {
    /// Of `projected` = Vᵀ T V, whose upper half is read, with T V = V Vᵀ T V + Q R in the last columns, R = `last`.
    fn new(projected: MatRef<'_, f64>, last: MatRef<'_, f64>) -> Result<Self, SpectrumError> {
        let (size, width) = (projected.nrows(), last.ncols());
        let symmetric = Mat::from_fn(size, size, |i, j| projected[(i.min(j), i.max(j))]);
        let (theta, coordinates) = dense::symmetric_eigen(symmetric.as_ref())?;
        let remainder = dense::product(last, coordinates.as_ref().subrows(size - width, width));
        let residuals = (0..size)
            .map(|k| remainder.col(k).norm_l2() / (theta[k] * theta[k]))
            .collect();
        Ok(Self {
            theta,
            coordinates,
            remainder,
            residuals,
        })
    }
}

const START_SEED: u64 = 0x6b72_796c_6f76;

/// X ← X − V Vᵀ X; returns Vᵀ X.
fn orthogonalise(rows: usize, x: &mut [f64], v: &[f64]) -> Mat<f64> {
    let coefficients = inner(rows, v, x);
    add(rows, x, v, (-1.0 * &coefficients).as_ref());
    coefficients
}

/// X ← X − V C, without the blocks of V whose coefficients are all at most `negligible`.
fn subtract(rows: usize, x: &mut [f64], v: &[f64], c: MatRef<'_, f64>, negligible: f64) {
    for (k, block) in v.chunks_exact(rows * LANES).enumerate() {
        let c = c.subrows(k * LANES, LANES);
        if c.norm_max() > negligible {
            add(rows, x, block, (-1.0 * c).as_ref());
        }
    }
}

/// Root of the mean squared length of the columns.
fn mean_length(rows: usize, x: &[f64]) -> f64 {
    (x.iter().map(|entry| entry * entry).sum::<f64>() * rows as f64 / x.len() as f64).sqrt()
}

/// Orthonormalises the columns of X, which are orthogonal to the `others`, among themselves: X = Q R, returns R.
///
/// From the eigenvectors U and eigenvalues Λ of XᵀX: Q = X U Λ^-1/2, R = Λ^1/2 Uᵀ, twice. Where X is too close to
/// dependent for that, column by column. `scale` is the size that X had before the others were taken out of it.
fn orthonormalise(rows: usize, x: &mut [f64], others: &[&[f64]], scale: f64) -> Mat<f64> {
    let width = x.len() / rows;
    let mut r = Mat::identity(width, width);
    for floor in [(1e-6 * scale).powi(2), 0.0] {
        let eigen = dense::symmetric_eigen(inner(rows, x, x).as_ref());
        let Some((values, vectors)) = eigen.ok().filter(|(values, _)| well_conditioned(values, floor)) else {
            let mut columns = Tall::zeros(rows, width);
            columns.all_mut().copy_from_slice(x);
            let last = orthonormalise_one_by_one(&mut columns, width, others, scale);
            x.copy_from_slice(columns.all());
            return dense::product(last.as_ref(), r.as_ref());
        };
        let scaled = Mat::from_fn(width, width, |i, j| vectors[(i, j)] / values[j].sqrt());
        let factor = Mat::from_fn(width, width, |i, j| values[i].sqrt() * vectors[(j, i)]);
        multiply(rows, x, scaled.as_ref());
        r = dense::product(factor.as_ref(), r.as_ref());
    }
    r
}

/// Whether a Gram matrix with these ascending eigenvalues leaves half of the digits.
fn well_conditioned(values: &[f64], floor: f64) -> bool {
    values
        .first()
        .zip(values.last())
        .is_some_and(|(least, largest)| *least > floor.max(1e-8 * largest))
}

/// [`orthonormalise`] by Gram–Schmidt, column by column, each twice; R is upper triangular. A column that depends on
/// those before it is replaced by noise orthogonal to all, with a zero on R's diagonal: the Krylov space has closed, and
/// goes on in a new direction.
fn orthonormalise_one_by_one(x: &mut Tall, count: usize, others: &[&[f64]], scale: f64) -> Mat<f64> {
    let rows = x.rows();
    let mut r = Mat::zeros(x.columns(), x.columns());
    for k in 0..count {
        let mut column = Tall::zeros(rows, 1);
        column.column_mut(0).zip(x.column(k)).for_each(|(t, s)| *t = s);
        x.column_mut(k).for_each(|entry| *entry = 0.0);
        let before = norm(&column).max(scale);
        for _ in 0..2 {
            let c = orthogonalise(rows, column.all_mut(), x.all());
            for i in 0..k {
                r[(i, k)] += c[(i, 0)];
            }
        }
        r[(k, k)] = norm(&column);
        let left = r[(k, k)];
        if left <= 1e-13 * before {
            r[(k, k)] = 0.0;
            let mut noise = Noise::new(FRESH_SEED, k as u64);
            column.column_mut(0).for_each(|entry| *entry = noise.next());
        }
        // After cancellation, what is left may have lost its orthogonality to the others.
        if left <= 1e-3 * before {
            for _ in 0..2 {
                for other in others {
                    orthogonalise(rows, column.all_mut(), other);
                }
                orthogonalise(rows, column.all_mut(), x.all());
            }
        }
        let norm = norm(&column);
        x.column_mut(k)
            .zip(column.column(0))
            .for_each(|(t, s)| *t = s / norm);
    }
    r
}

fn norm(column: &Tall) -> f64 {
    column.column(0).map(|x| x * x).sum::<f64>().sqrt()
}

const FRESH_SEED: u64 = 0x0066_7265_7368;
