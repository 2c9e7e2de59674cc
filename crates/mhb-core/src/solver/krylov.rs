//! A block Krylov space of the shifted inverse T = (A − σ M)⁻¹ M, with a basis V = (Q₁, Q₂, …) that is orthonormal in the inner
//! product of M, as everything here is.
//!
//! T is symmetric in it, so in exact arithmetic T Q_k overlaps with Q_{k−1}, Q_k and Q_{k+1} only. Rounding adds a little of all
//! other blocks, and each step multiplies that by up to ‖T‖/‖R‖, where R is what is left of T Q_k. So every block is
//! orthogonalised against all others; two at a time where they can't have grown far, because reading V from memory is what
//! this costs.

use faer::{Mat, MatRef};

use super::factor::Factor;
use super::product::{lengths, orthogonalise, overlaps};
use super::tall::{LANES, Tall, add, multiply};
use crate::dense;
use crate::noise::Noise;
use crate::operator::Operator;

/// Overlaps between basis vectors below this are rounding, and left alone.
const NEGLIGIBLE: f64 = 1e-13;

/// By how much overlaps of the size of rounding may have grown before they are taken out. Their squares are what remains.
const LARGEST_GROWTH: f64 = 1e7;

pub(crate) struct Krylov<'a> {
    factor: &'a Factor<'a>,
    /// Known eigenvectors, to which the space is orthogonal.
    locked: &'a Tall,
    width: usize,
    basis: &'a mut Tall,
    /// Columns of V that T has been applied to; the basis holds one block more.
    size: usize,
    /// The upper half of Vᵀ M T V.
    projected: Mat<f64>,
    /// R of the last blocks, which are orthogonal to the two before them only, and of the last one of all.
    remainders: Vec<Mat<f64>>,
    /// How many of the last blocks that is.
    pending: usize,
    /// What T made of a unit vector at most.
    norm: f64,
    growth: f64,
}

impl<'a> Krylov<'a> {
    /// The space of noise, smoothed by one solve, orthogonal to the locked vectors, with room for `limit` columns.
    pub(crate) fn start(
        factor: &'a Factor<'a>,
        locked: &'a Tall,
        width: usize,
        limit: usize,
        round: u64,
        basis: &'a mut Tall,
    ) -> Self {
        let (operator, rows) = (factor.operator(), basis.rows());
        let x = &mut basis.all_mut()[..rows * width];
        let mut noise = Noise::new(START_SEED, round);
        x.iter_mut().for_each(|entry| *entry = noise.next());
        factor.solve(x);
        let scale = mean_length(rows, x);
        orthogonalise(operator, x, locked.all());
        orthogonalise(operator, x, locked.all());
        orthonormalise(operator, x, &[locked.all()], scale);
        Self {
            factor,
            locked,
            width,
            basis,
            size: 0,
            projected: Mat::zeros(limit + width, limit + width),
            remainders: Vec::new(),
            pending: 0,
            norm: 0.0,
            growth: 1.0,
        }
    }

    pub(crate) fn rows(&self) -> usize {
        self.basis.rows()
    }

    /// Columns that T has been applied to.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// All blocks, one more than [`size`](Self::size) says.
    pub(crate) fn blocks(&self) -> &[f64] {
        self.basis.blocks(0, self.size + self.width)
    }

    /// R in T V = V Vᵀ M T V + Q R, where Q is the last block.
    pub(crate) fn remainder(&self) -> MatRef<'_, f64> {
        self.remainders
            .last()
            .map_or(self.projected.as_ref().submatrix(0, 0, 0, 0), Mat::as_ref)
    }

    /// The first `size` rows and columns of Vᵀ M T V.
    pub(crate) fn projected(&self, size: usize) -> Mat<f64> {
        Mat::from_fn(size, size, |i, j| self.projected[(i.min(j), i.max(j))])
    }

    /// Applies T to the last block, and makes a new one of what is left.
    pub(crate) fn grow(&mut self) {
        let (operator, width, size) = (self.factor.operator(), self.width, self.size);
        let rows = operator.size();
        let (done, next) = self.basis.split_at_mut(size + width);
        let next = &mut next[..rows * width];
        next.copy_from_slice(&done[rows * size..]);
        self.factor.apply(next);
        let scale = mean_length(rows, next);
        let first = size.saturating_sub(width);
        let near = &done[rows * first..];
        let mut coefficients = orthogonalise(operator, next, near);
        coefficients += orthogonalise(operator, next, near);
        orthogonalise(operator, next, self.locked.all());
        let remainder = orthonormalise(operator, next, &[done, self.locked.all()], scale);
        self.projected
            .as_mut()
            .submatrix_mut(first, size, coefficients.nrows(), width)
            .copy_from(coefficients.as_ref());
        self.size += width;
        self.norm = self.norm.max(scale);
        let least = (0..width)
            .map(|i| remainder.row(i).norm_l2())
            .fold(f64::INFINITY, f64::min);
        let factor = self.norm / least;
        self.growth *= factor;
        if self.pending == 0 {
            self.remainders.clear();
        }
        self.remainders.push(remainder);
        self.pending += 1;
        // The next step would let them grow as much again.
        if self.pending == 2 || self.growth * factor > LARGEST_GROWTH {
            self.settle();
        }
    }

    /// Makes the last blocks orthogonal to all before them.
    pub(crate) fn settle(&mut self) {
        if self.pending == 0 {
            return;
        }
        let (rows, width) = (self.rows(), self.width);
        let first = self.size + width - self.pending * width;
        let (settled, new) = self.basis.split_at_mut(first);
        let new = &mut new[..rows * self.pending * width];
        let overlaps = overlaps(self.factor.operator(), settled, new);
        subtract(rows, new, settled, overlaps.as_ref(), NEGLIGIBLE);
        self.correct(first, overlaps.as_ref());
        self.pending = 0;
        self.growth = 1.0;
    }

    /// Writes Vᵀ M T V for the basis as it is, after `overlaps` = (C₁, C₂) with the blocks before column `first` were taken out of those from it.
    ///
    /// Let K be the last block before them, T K = V h + Q₁ R₁ and T Q₁ = V g + Q₁ G + Q₂ R₂. With Q₁ = V C₁ + Q₁′ and
    /// Q₂ = V C₂ + Q₂′, and H = Vᵀ M T V:
    /// T K = V (h + C₁ R₁) + Q₁′ R₁ and T Q₁′ = V (g + C₁ G + C₂ R₂ − H C₁) + Q₁′ (G − R₁ C₁|_K) + Q₂′ R₂.
    fn correct(&mut self, first: usize, overlaps: MatRef<'_, f64>) {
        let width = self.width;
        let c1 = overlaps.subcols(0, width);
        let r1 = self.remainders[0].as_ref();
        let added = dense::product(c1, r1);
        let before = first - width;
        if let Some(r2) = self.remainders.get(1) {
            let c2 = overlaps.subcols(width, width);
            let own = self.projected.as_ref().submatrix(first, first, width, width);
            let mut column = dense::product(c1, own);
            dense::add_product(column.as_mut(), 1.0, c2, r2.as_ref());
            dense::add_product(column.as_mut(), -1.0, self.projected(first).as_ref(), c1);
            let diagonal = dense::product(r1, c1.subrows(before, width));
            let mut target = self.projected.as_mut().submatrix_mut(0, first, first, width);
            target += &column;
            let mut target = self.projected.as_mut().submatrix_mut(first, first, width, width);
            target -= &diagonal;
        }
        let mut target = self.projected.as_mut().submatrix_mut(0, before, first, width);
        target += &added;
    }
}

const START_SEED: u64 = 0x6b72_796c_6f76;

/// X ← X − V C, without the blocks of V whose coefficients are all at most `negligible`.
fn subtract(rows: usize, x: &mut [f64], v: &[f64], c: MatRef<'_, f64>, negligible: f64) {
    for (k, block) in v.chunks_exact(rows * LANES).enumerate() {
        let c = c.subrows(k * LANES, LANES);
        if c.norm_max() > negligible {
            add(rows, x, block, (-1.0 * c).as_ref());
        }
    }
}

/// Root of the mean squared length of the columns: a size, so that M is not asked.
fn mean_length(rows: usize, x: &[f64]) -> f64 {
    (x.iter().map(|entry| entry * entry).sum::<f64>() * rows as f64 / x.len() as f64).sqrt()
}

/// Orthonormalises the columns of X, which are orthogonal to the `others`, among themselves: X = Q R, returns R.
///
/// From the eigenvectors U and eigenvalues Λ of XᵀMX: Q = X U Λ^-1/2, R = Λ^1/2 Uᵀ, twice. Where X is too close to
/// dependent for that, column by column. `scale` is the size that X had before the others were taken out of it.
fn orthonormalise(operator: &Operator, x: &mut [f64], others: &[&[f64]], scale: f64) -> Mat<f64> {
    let rows = operator.size();
    let width = x.len() / rows;
    let mut r = Mat::identity(width, width);
    for floor in [(1e-6 * scale).powi(2), 0.0] {
        let eigen = dense::symmetric_eigen(overlaps(operator, x, x).as_ref());
        let Some((values, vectors)) = eigen.ok().filter(|(values, _)| well_conditioned(values, floor)) else {
            let mut columns = Tall::zeros(rows, width);
            columns.all_mut().copy_from_slice(x);
            let last = orthonormalise_one_by_one(operator, &mut columns, width, others, scale);
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
pub(crate) fn orthonormalise_one_by_one(
    operator: &Operator,
    x: &mut Tall,
    count: usize,
    others: &[&[f64]],
    scale: f64,
) -> Mat<f64> {
    let rows = x.rows();
    let mut r = Mat::zeros(x.columns(), x.columns());
    // Only columns that are done, of unit length, may be projected out.
    let given = x.clone();
    x.all_mut().fill(0.0);
    let length = |column: &Tall| lengths(operator, column.all())[0];
    for k in 0..count {
        let mut column = Tall::zeros(rows, 1);
        column
            .column_mut(0)
            .zip(given.column(k))
            .for_each(|(t, s)| *t = s);
        let before = length(&column).max(scale);
        for _ in 0..2 {
            let c = orthogonalise(operator, column.all_mut(), x.all());
            for i in 0..k {
                r[(i, k)] += c[(i, 0)];
            }
        }
        r[(k, k)] = length(&column);
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
                    orthogonalise(operator, column.all_mut(), other);
                }
                orthogonalise(operator, column.all_mut(), x.all());
            }
        }
        let length = length(&column);
        x.column_mut(k)
            .zip(column.column(0))
            .for_each(|(t, s)| *t = s / length);
    }
    r
}

const FRESH_SEED: u64 = 0x0066_7265_7368;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Laplacian, LaplacianKind, Mass};

    #[test]
    fn columns_of_any_length_are_orthonormalised_one_by_one() {
        let mesh = mesh::shapes::bumpy_torus(25, 20, 1);
        for mass in [Mass::Lumped, Mass::Full] {
            let operator = Operator::new(&Laplacian::of(&mesh, LaplacianKind::Cotangent, mass).unwrap());
            let (rows, width) = (operator.size(), LANES);
            let mut x = Tall::zeros(rows, width);
            let mut noise = Noise::new(1, 1);
            x.all_mut()
                .iter_mut()
                .for_each(|entry| *entry = 1e3 * noise.next());
            let given = x.clone();
            let r = orthonormalise_one_by_one(&operator, &mut x, width, &[], 0.0);
            let gram = overlaps(&operator, x.all(), x.all());
            assert!((&gram - &Mat::<f64>::identity(width, width)).norm_max() < 1e-12);
            let mut back = vec![0.0; rows * width];
            add(rows, &mut back, x.all(), r.as_ref());
            let errors = back.iter().zip(given.all()).map(|(a, b)| (a - b).abs());
            assert!(errors.fold(0.0, f64::max) < 1e-9);
        }
    }
}
