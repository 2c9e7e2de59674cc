//! The lowest non-zero eigenvalues of a pencil, by block Krylov spaces of the shifted inverse.
//!
//! T = (S − σ B)⁻¹ B with σ below the spectrum is self-adjoint in the inner product of B, and turns the eigenvalues λ next to
//! σ into its greatest, θ = 1/(λ − σ). The space span(X, T X, T² X, …) is kept orthonormal in full, and orthogonal to the
//! kernel of S, which is known. That no eigenvalue is missing is proved by inertia (Sylvester).

use faer::diag::DiagMut;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::linalg::matmul::matmul;
use faer::reborrow::ReborrowMut;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use job::Job;
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use super::pencil::{Analysis, Factor, Pencil};
use crate::QualityError;

/// Below the spectrum, in units of 1 / area: near enough to zero to set the lowest eigenvalues apart, far enough to be solved
/// with accurately.
const SHIFT: f64 = -1.0;

/// Columns that are solved for together. Eigenvalues of higher multiplicity are found in several rounds.
const WIDTH: usize = 8;

/// Largest relative residual ‖T y − θ y‖ / θ of a converged pair; its eigenvalue is accurate to about the square.
const TOLERANCE: f64 = 1e-9;

/// What is left of a column when the space has closed, relative to what it was: rounding.
const CLOSED: f64 = 1e-10;

/// Eigenvalues closer than this, relatively, are not told apart when they are counted.
const CLOSE: f64 = 1e-8;

/// Numbers in the basis of a Krylov space.
const MOST_ENTRIES: usize = 1 << 30;

/// Rows of a dense problem.
const MOST_DENSE: usize = 8192;

/// How large a Krylov space may grow for so many pairs. Problems of about that size are solved densely.
fn room_for(pairs: usize) -> usize {
    4 * pairs + 24 * WIDTH
}

/// Searches, each orthogonal to what the ones before it found.
const ROUNDS: u64 = 20;

/// The `count` lowest eigenvalues that are not 0, ascending.
pub(crate) fn lowest(pencil: &Pencil, count: usize, job: &Job) -> Result<Vec<f64>, QualityError> {
    let available = pencil.size() - pencil.components();
    if count == 0 || count > available {
        return Err(QualityError::TooFewEigenvalues {
            count,
            vertices: pencil.size(),
            components: pencil.components(),
            available,
        });
    }
    let dense = available < room_for(count) + 4 * WIDTH;
    check_memory(pencil, count, dense)?;
    if dense {
        let mut values = densely(pencil)?.split_off(pencil.components());
        values.truncate(count);
        return Ok(values);
    }
    sparsely(pencil, count, job)
}

/// Refuses what would need more than 8 GiB, or hours of dense algebra.
fn check_memory(pencil: &Pencil, count: usize, dense: bool) -> Result<(), QualityError> {
    let size = pencil.size();
    let fits = if dense {
        size <= MOST_DENSE
    } else {
        size.saturating_mul(room_for(count)) <= MOST_ENTRIES
    };
    if fits {
        return Ok(());
    }
    let room = (MOST_ENTRIES / size).min(size - pencil.components() - 4 * WIDTH);
    Err(QualityError::TooManyEigenvalues {
        count,
        vertices: size,
        most: room.saturating_sub(room_for(0)) / 4,
    })
}

/// Searches until as many are found as inertia proves.
pub(super) fn sparsely(pencil: &Pencil, count: usize, job: &Job) -> Result<Vec<f64>, QualityError> {
    let available = pencil.size() - pencil.components();
    let analysis = Analysis::new(pencil)?;
    let factor = analysis.factorise(SHIFT)?;
    let mut found = Found::nothing(pencil.size());
    // One more than asked for, to have a gap behind the last where eigenvalues can be counted.
    let mut wanted = (count + 1).min(available);
    for round in 0..ROUNDS {
        let missing = wanted.saturating_sub(found.values.len()).max(1);
        let search = Search {
            pencil,
            factor: &factor,
            locked: found.vectors.as_ref(),
        };
        let new = search.run(missing, round, job)?;
        found.take(new);
        let sorted = found.sorted();
        if sorted.len() < count {
            wanted = (count + 1).min(available);
            continue;
        }
        let (below, cut) = cut(&sorted, count, available);
        let expected = analysis.count_below(cut)?.saturating_sub(pencil.components());
        if expected == below {
            return Ok(sorted[..count].to_vec());
        }
        if expected < below {
            return Err(QualityError::Incomplete {
                found: below,
                expected,
            });
        }
        wanted = sorted.len() + expected - below;
    }
    Err(QualityError::Incomplete {
        found: found.values.len(),
        expected: wanted,
    })
}

/// A gap of the spectrum where eigenvalues can be counted, and how many were found below it: behind the last of `count` if there
/// is one among those found, else before the cluster that it belongs to.
fn cut(sorted: &[f64], count: usize, available: usize) -> (usize, f64) {
    let apart = |i: usize| sorted[i] > sorted[i - 1] * (1.0 + CLOSE);
    if let Some(end) = (count..sorted.len()).find(|&i| apart(i)) {
        return (end, 0.5 * (sorted[end - 1] + sorted[end]));
    }
    if sorted.len() == available {
        return (available, 2.0 * sorted[available - 1]);
    }
    match (1..count).rev().find(|&i| apart(i)) {
        Some(start) => (start, 0.5 * (sorted[start - 1] + sorted[start])),
        None => (0, 0.5 * sorted[0]),
    }
}

/// All eigenvalues, the kernel's first, by reduction to a standard problem with B = C Cᵀ.
pub(super) fn densely(pencil: &Pencil) -> Result<Vec<f64>, QualityError> {
    let (s, b) = pencil.dense();
    let c = b
        .llt(faer::Side::Lower)
        .map_err(|_| QualityError::Factorisation { shift: 0.0 })?;
    let c = c.L();
    let mut a = s;
    c.solve_lower_triangular_in_place(a.as_mut());
    c.solve_lower_triangular_in_place(a.as_mut().transpose_mut());
    Ok(symmetric_eigen(a.as_ref())?.0)
}

/// Eigenpairs found so far.
struct Found {
    values: Vec<f64>,
    /// Orthonormal in the inner product of B.
    vectors: Mat<f64>,
}

impl Found {
    fn nothing(rows: usize) -> Self {
        Self {
            values: Vec::new(),
            vectors: Mat::zeros(rows, 0),
        }
    }

    fn take(&mut self, new: Self) {
        let old = self.vectors.ncols();
        self.vectors
            .resize_with(self.vectors.nrows(), old + new.vectors.ncols(), |i, j| {
                new.vectors[(i, j - old)]
            });
        self.values.extend(new.values);
    }

    fn sorted(&self) -> Vec<f64> {
        let mut sorted = self.values.clone();
        sorted.sort_by(f64::total_cmp);
        sorted
    }
}

/// One Krylov space from a random start, orthogonal to what is locked.
struct Search<'a> {
    pencil: &'a Pencil,
    factor: &'a Factor<'a>,
    locked: MatRef<'a, f64>,
}

impl Search<'_> {
    /// The lowest pairs, `wanted` of them unless the space has grown to its limit before.
    fn run(&self, wanted: usize, round: u64, job: &Job) -> Result<Found, QualityError> {
        let rows = self.pencil.size();
        let room = rows - self.pencil.components() - self.locked.ncols();
        if room < 2 * WIDTH {
            return Ok(Found::nothing(rows));
        }
        let limit = room_for(wanted).min((room - WIDTH) / WIDTH * WIDTH);
        let mut basis: Mat<f64> = Mat::zeros(rows, limit + WIDTH);
        let mut noise = ChaCha8Rng::seed_from_u64(SEED);
        noise.set_stream(round);
        let mut block = Mat::from_fn(rows, WIDTH, |_, _| centred(&mut noise));
        self.apply(&mut block);
        self.orthonormalise(&mut block, basis.as_ref().subcols(0, 0), &mut noise);
        basis.as_mut().subcols_mut(0, WIDTH).copy_from(&block);
        let mut projected = Mat::zeros(limit, limit);
        let mut size = 0;
        let mut next_check = (2 * wanted).next_multiple_of(WIDTH);
        loop {
            self.apply(&mut block);
            let so_far = basis.as_ref().subcols(0, size + WIDTH);
            let (coefficients, last) = self.orthonormalise(&mut block, so_far, &mut noise);
            projected
                .as_mut()
                .submatrix_mut(0, size, size + WIDTH, WIDTH)
                .copy_from(&coefficients);
            size += WIDTH;
            let full = size + WIDTH > limit;
            job.progress((size as f64 / (3 * wanted + 6 * WIDTH) as f64).min(0.95))?;
            if size >= next_check || full {
                let ritz = Ritz::new(projected.as_ref().submatrix(0, 0, size, size), last.as_ref())?;
                let converged = ritz.converged();
                if converged >= wanted || full {
                    return Ok(ritz.extract(converged, basis.as_ref().subcols(0, size)));
                }
                next_check = size + 3 * WIDTH;
            }
            basis.as_mut().subcols_mut(size, WIDTH).copy_from(&block);
        }
    }

    /// X ← T X.
    fn apply(&self, block: &mut Mat<f64>) {
        *block = self.pencil.mass_times(block.as_ref());
        self.factor.solve(block.as_mut());
        self.pencil.remove_kernel(block.as_mut());
    }

    /// Makes X orthonormal, and orthogonal to the basis V and to what is locked: X = V C + Q R, X ← Q; gives C and R.
    ///
    /// A column that depends on the others is replaced by noise, with a zero in R: the space has closed there.
    fn orthonormalise(
        &self,
        block: &mut Mat<f64>,
        basis: MatRef<'_, f64>,
        noise: &mut ChaCha8Rng,
    ) -> (Mat<f64>, Mat<f64>) {
        let width = block.ncols();
        let mut coefficients = Mat::zeros(basis.ncols(), width);
        let mut r: Mat<f64> = Mat::zeros(width, width);
        let before: Vec<f64> = (0..width)
            .map(|k| self.norm(block.as_ref().subcols(k, 1)))
            .collect();
        for _ in 0..2 {
            coefficients += self.project_out(block.as_mut(), basis);
            self.project_out(block.as_mut(), self.locked);
        }
        for k in 0..width {
            let (done, mut rest) = block.as_mut().split_at_col_mut(k);
            let done = done.as_ref();
            let mut column = rest.rb_mut().subcols_mut(0, 1);
            for _ in 0..2 {
                let c = self.project_out(column.rb_mut(), done);
                (0..k).for_each(|i| r[(i, k)] += c[(i, 0)]);
            }
            let mut length = self.norm(column.as_ref());
            r[(k, k)] = length;
            if length <= CLOSED * before[k] {
                r[(k, k)] = 0.0;
                column
                    .rb_mut()
                    .col_mut(0)
                    .iter_mut()
                    .for_each(|x| *x = centred(noise));
            }
            // After cancellation, what is left may have lost its orthogonality to the others.
            if length <= 1e-3 * before[k] {
                for _ in 0..3 {
                    self.pencil.remove_kernel(column.rb_mut());
                    for others in [basis, self.locked, done] {
                        self.project_out(column.rb_mut(), others);
                    }
                }
                length = self.norm(column.as_ref());
            }
            column.rb_mut().col_mut(0).iter_mut().for_each(|x| *x /= length);
        }
        (coefficients, r)
    }

    /// X ← X − V Vᵀ B X; gives Vᵀ B X.
    fn project_out(&self, mut x: MatMut<'_, f64>, v: MatRef<'_, f64>) -> Mat<f64> {
        let c = product(v.transpose(), self.pencil.mass_times(x.as_ref()).as_ref());
        matmul(x.rb_mut(), Accum::Add, v, c.as_ref(), -1.0, Par::Seq);
        c
    }

    /// √(xᵀ B x) of one column.
    fn norm(&self, x: MatRef<'_, f64>) -> f64 {
        product(x.transpose(), self.pencil.mass_times(x).as_ref())[(0, 0)]
            .max(0.0)
            .sqrt()
    }
}

const SEED: u64 = 0x7368_6170_6544_4e41;

/// Uniform in ±1.
fn centred(noise: &mut ChaCha8Rng) -> f64 {
    (noise.next_u64() >> 11) as f64 * (2.0 / (1_u64 << 53) as f64) - 1.0
}

/// Ritz pairs of T, the greatest θ first.
struct Ritz {
    theta: Vec<f64>,
    coordinates: Mat<f64>,
    residuals: Vec<f64>,
}

impl Ritz {
    /// Of `projected` = Vᵀ B T V, whose upper half is read, with T V = V Vᵀ B T V + Q R in the last columns, R = `last`.
    fn new(projected: MatRef<'_, f64>, last: MatRef<'_, f64>) -> Result<Self, QualityError> {
        let (size, width) = (projected.nrows(), last.ncols());
        let symmetric = Mat::from_fn(size, size, |i, j| projected[(i.min(j), i.max(j))]);
        let (values, vectors) = symmetric_eigen(symmetric.as_ref())?;
        let theta: Vec<f64> = values.into_iter().rev().collect();
        let coordinates = Mat::from_fn(size, size, |i, j| vectors[(i, size - 1 - j)]);
        let remainder = product(last, coordinates.as_ref().subrows(size - width, width));
        let residuals = (0..size)
            .map(|k| remainder.col(k).norm_l2() / theta[k].abs())
            .collect();
        Ok(Self {
            theta,
            coordinates,
            residuals,
        })
    }

    /// How many of the first pairs have converged, without a gap.
    fn converged(&self) -> usize {
        let pairs = self.theta.iter().zip(&self.residuals);
        pairs
            .take_while(|&(&theta, &r)| theta > 0.0 && r <= TOLERANCE)
            .count()
    }

    fn extract(&self, count: usize, basis: MatRef<'_, f64>) -> Found {
        Found {
            values: self.theta[..count]
                .iter()
                .map(|theta| SHIFT + 1.0 / theta)
                .collect(),
            vectors: product(basis, self.coordinates.as_ref().subcols(0, count)),
        }
    }
}

fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut c = Mat::zeros(a.nrows(), b.ncols());
    matmul(c.as_mut(), Accum::Replace, a, b, 1.0, Par::Seq);
    c
}

/// Eigenvalues, ascending, and orthonormal eigenvectors of a symmetric matrix of which the lower half is read.
fn symmetric_eigen(a: MatRef<'_, f64>) -> Result<(Vec<f64>, Mat<f64>), QualityError> {
    let size = a.nrows();
    let mut values = vec![0.0; size];
    let mut vectors = Mat::zeros(size, size);
    let scratch =
        self_adjoint_evd_scratch::<f64>(size, ComputeEigenvectors::Yes, Par::Seq, Default::default());
    self_adjoint_evd(
        a,
        DiagMut::from_slice_mut(&mut values),
        Some(vectors.as_mut()),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Default::default(),
    )
    .map_err(|_| mhb_core::SpectrumError::Dense { size })?;
    Ok((values, vectors))
}
