//! The eigenpairs of one band, by a block Krylov space of the shifted inverse.
//!
//! T = (A − σ M)⁻¹ M maps eigenvalues λ to θ = 1/(λ − σ), so those near σ become the extreme ones. The space
//! span(V₁, T V₁, T² V₁, …) is kept orthonormal in full; the projected problem Vᵀ M T V gives Ritz pairs (θ, V s).
//! With r = T y − θ y, the vector T y / θ = y + r / θ costs no solve and has the residual
//! ‖(A − λ M) (y + r/θ)‖ = ‖r‖ / θ² exactly (in the norm of M⁻¹, r in that of M): that is what is compared with the tolerance.

use std::sync::{Mutex, PoisonError};

use faer::Mat;
use job::JobError;

use super::factor::Factor;
use super::krylov::{Krylov, orthonormalise_one_by_one};
use super::product::{lengths, orthogonalise};
use super::tall::{LANES, Tall, combination};
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
    /// Proven: the search goes on until all are found, or it has restarted too often.
    Exactly(usize),
    /// Expected: the search ends when no more show up, and the caller checks.
    About(usize),
}

/// Converged pairs, in any order.
pub(crate) struct Pairs {
    pub(crate) values: Vec<f64>,
    /// #V by count, of unit length, orthogonal within the tolerance.
    pub(crate) vectors: Tall,
    /// Residual ‖A y − λ M y‖ of each.
    pub(crate) residuals: Vec<f64>,
}

/// Called after each block of a Krylov space; an error ends the search.
pub(crate) type Advance<'a> = &'a (dyn Fn() -> Result<(), JobError> + Sync);

/// After how many blocks of `block` columns a search for so many pairs is likely to end: some 2.8 columns a pair.
pub(crate) fn likely_blocks(pairs: usize, block: usize) -> usize {
    (3 * pairs).div_ceil(block.next_multiple_of(LANES)) + 1
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

/// Residual that rounding may leave in a combination of basis vectors, relative to the norm of A.
const ROUNDING: f64 = 4e-14;

/// Restarts before a band is given up.
const ROUNDS: u64 = 12;

/// A pair beyond the band's end that has converged to this residual shows that the search has gone past the end.
const WITNESS: f64 = 1e-3;

/// The pairs of `band` orthogonal to `deflated`, an orthonormal set of known eigenvectors.
pub(crate) fn solve(
    factor: &Factor<'_>,
    band: Band,
    deflated: &Tall,
    block: usize,
    tolerance: f64,
    workspaces: &Workspaces,
    advance: Advance<'_>,
) -> Result<Pairs, SpectrumError> {
    let mut search = Search {
        factor,
        band,
        expected: 0,
        exact: false,
        tolerance,
        locked: deflated,
        advance,
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
        let operator = factor.operator();
        orthogonalise(operator, new.vectors.all_mut(), locked.all());
        orthonormalise_one_by_one(operator, &mut new.vectors, count, &[locked.all()], 0.0);
        locked.append(&new.vectors);
        found.take(&new);
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
    factor: &'a Factor<'a>,
    band: Band,
    expected: usize,
    exact: bool,
    tolerance: f64,
    locked: &'a Tall,
    advance: Advance<'a>,
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
        let mut space = Krylov::start(self.factor, self.locked, width, limit, round, basis);
        let mut next_check = 5 * self.expected / 2;
        loop {
            space.grow();
            (self.advance)()?;
            let full = space.size() + width > limit;
            if space.size() >= next_check || full {
                space.settle();
                let ritz = Ritz::new(&space)?;
                let open = self.open(&ritz);
                if open == 0 || full {
                    return Ok(self.extract(&ritz, space.rows(), space.blocks()));
                }
                next_check = space.size() + (3 * open / 2).max(width);
            }
        }
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
        combination(rows, vectors.all_mut(), basis, coordinates.as_ref());
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

    /// y ← T y / ‖T y‖. Sums of many vectors leave rounding errors of all frequencies, which A amplifies and T damps.
    fn smooth(&self, vectors: &mut Tall, count: usize) {
        self.factor.apply(vectors.all_mut());
        for first in (0..count).step_by(LANES) {
            let lengths = lengths(self.factor.operator(), vectors.blocks(first, first + LANES));
            for (k, length) in (first..count).zip(lengths) {
                vectors.column_mut(k).for_each(|y| *y /= length);
            }
        }
    }
}

impl Ritz {
    /// Of Vᵀ M T V, with T V = V Vᵀ M T V + Q R in the last columns.
    fn new(space: &Krylov<'_>) -> Result<Self, SpectrumError> {
        let (size, last) = (space.size(), space.remainder());
        let width = last.ncols();
        let (theta, coordinates) = dense::symmetric_eigen(space.projected(size).as_ref())?;
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
