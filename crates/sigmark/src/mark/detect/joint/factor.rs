//! Cholesky's factor of a Gram matrix, in memory that serves for one noise after the other.

use faer::{
    Mat, MatRef, Par,
    dyn_stack::{MemBuffer, MemStack},
    linalg::{
        cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch},
        triangular_inverse::invert_lower_triangular,
        triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place},
    },
};

use crate::mark::MarkError;

/// What is added to the diagonal where it has no factor, one after the other.
const MORE_RIDGES: [f64; 4] = [1e-11, 1e-10, 1e-8, 1e-6];

/// L of A = L Lᵀ.
pub(super) struct Factor {
    /// What stands above the diagonal means nothing.
    lower: Mat<f64>,
}

impl Factor {
    /// That of a Gram matrix, by its lower triangle, to whose diagonal something is added, (i). Where few observations leave many unknowns open, rounding may make a pivot negative that should be nearly zero: the
    /// diagonal grows then by as little as helps. The memory of a factor that is no longer needed is used again.
    pub(super) fn of(
        gram: MatRef<'_, f64>,
        added: impl Fn(usize) -> f64,
        spent: Option<Self>,
    ) -> Result<Self, MarkError> {
        let size = gram.nrows();
        let spent = spent.map(|spent| spent.lower);
        let spent = spent.filter(|lower| lower.nrows() == size);
        let mut lower = spent.unwrap_or_else(|| Mat::zeros(size, size));
        let scratch = cholesky_in_place_scratch::<f64>(size, Par::Seq, Default::default());
        let mut scratch = MemBuffer::new(scratch);
        let mut grown = 1.0;
        for growth in [0.0].into_iter().chain(MORE_RIDGES) {
            grown *= 1.0 + growth;
            lower.copy_from_triangular_lower(gram);
            for i in 0..size {
                lower[(i, i)] = (lower[(i, i)] + added(i)) * grown;
            }
            let stack = MemStack::new(&mut scratch);
            let into = lower.as_mut();
            if cholesky_in_place(into, Default::default(), Par::Seq, stack, Default::default()).is_ok() {
                return Ok(Self { lower });
            }
        }
        Err(MarkError::Alignment)
    }

    /// A⁻¹ of some columns.
    pub(super) fn solve(&self, mut right: Mat<f64>) -> Mat<f64> {
        solve_lower_triangular_in_place(self.lower.as_ref(), right.as_mut(), Par::Seq);
        solve_upper_triangular_in_place(self.lower.transpose(), right.as_mut(), Par::Seq);
        right
    }

    /// The first entries of the diagonal of A⁻¹: the squares of the columns of L⁻¹.
    pub(super) fn first_of_inverse(&self, count: usize) -> Vec<f64> {
        let mut inverse = Mat::zeros(self.lower.nrows(), self.lower.nrows());
        invert_lower_triangular(inverse.as_mut(), self.lower.as_ref(), Par::Seq);
        let squares = |t: usize| inverse.col_as_slice(t)[t..].iter().map(|x| x * x).sum();
        (0..count).map(squares).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Gram matrix of 600 unknowns that ten observations say something about, with rounding as in single precision.
    fn of_few_observations() -> Mat<f64> {
        let rows = Mat::from_fn(10, 600, |i, j| ((7 * i + 3 * j + i * j) % 101) as f64 - 50.0);
        let mut gram = rows.transpose() * &rows;
        for (j, column) in gram.as_mut().col_iter_mut().enumerate() {
            for (i, entry) in column.iter_mut().enumerate() {
                *entry *= 1.0 + 1e-12 * (((i + j) % 7) as f64 - 3.0);
            }
        }
        gram
    }

    #[test]
    fn equations_of_few_observations_have_a_factor() {
        let gram = of_few_observations();
        assert!(gram.llt(faer::Side::Lower).is_err());
        let Factor { mut lower } = Factor::of(gram.as_ref(), |_| 0.0, None).expect("a factor");
        for j in 0..lower.ncols() {
            lower.col_as_slice_mut(j)[..j].fill(0.0);
        }
        let again = &lower * lower.transpose();
        let (most, off) = (gram.norm_max(), (&again - &gram).norm_max());
        assert!(off < 1e-9 * most, "{off} of {most}");
    }

    #[test]
    fn what_is_no_gram_matrix_has_none() {
        let indefinite = Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { 2.0 });
        let infinite = Mat::from_fn(2, 2, |_, _| f64::INFINITY);
        for gram in [indefinite, infinite] {
            assert!(matches!(
                Factor::of(gram.as_ref(), |_| 0.0, None),
                Err(MarkError::Alignment)
            ));
        }
    }

    #[test]
    fn a_factor_solves_and_knows_the_inverse_whatever_its_memory_held() {
        let size = 40;
        let gram = Mat::from_fn(size, size, |i, j| (-(i.abs_diff(j) as f64) / 3.0).exp());
        let spent = Factor::of((&gram * 3.0).as_ref(), |_| 1.0, None).unwrap();
        let factor = Factor::of(gram.as_ref(), |i| i as f64, Some(spent)).unwrap();
        let more = Mat::from_fn(size, size, |i, j| if i == j { i as f64 } else { 0.0 });
        let inverse = factor.solve(Mat::identity(size, size));
        assert!(((&gram + &more) * &inverse - Mat::<f64>::identity(size, size)).norm_max() < 1e-13);
        for (t, entry) in factor.first_of_inverse(7).into_iter().enumerate() {
            assert!((entry - inverse[(t, t)]).abs() < 1e-14);
        }
    }
}
