//! 3 by 3 matrices, and their singular values.

use std::ops::{AddAssign, Mul};

use mesh::Vec3;

/// A matrix by its rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mat3(pub(crate) [Vec3; 3]);

impl Mat3 {
    pub(crate) const ZERO: Self = Self([Vec3::ZERO; 3]);
    pub(crate) const IDENTITY: Self = Self([Vec3::X, Vec3::Y, Vec3::Z]);

    /// a bᵀ.
    pub(crate) fn outer(a: Vec3, b: Vec3) -> Self {
        Self(a.0.map(|x| b * x))
    }

    /// Rows as a [`Similarity`](mesh::Similarity) has them.
    pub(crate) fn rows(self) -> [[f64; 3]; 3] {
        self.0.map(|row| row.0)
    }

    pub(crate) fn transposed(self) -> Self {
        let Self(rows) = self;
        Self([0, 1, 2].map(|j| Vec3(rows.map(|row| row[j]))))
    }

    pub(crate) fn determinant(self) -> f64 {
        let Self([a, b, c]) = self;
        a.dot(b.cross(c))
    }

    pub(crate) fn trace(self) -> f64 {
        let Self([a, b, c]) = self;
        a[0] + b[1] + c[2]
    }
}

impl From<[[f64; 3]; 3]> for Mat3 {
    fn from(rows: [[f64; 3]; 3]) -> Self {
        Self(rows.map(Vec3))
    }
}

impl Mul<Vec3> for Mat3 {
    type Output = Vec3;

    fn mul(self, v: Vec3) -> Vec3 {
        Vec3(self.0.map(|row| row.dot(v)))
    }
}

impl Mul for Mat3 {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let Self(columns) = other.transposed();
        Self(self.0.map(|row| Vec3(columns.map(|column| row.dot(column)))))
    }
}

impl AddAssign for Mat3 {
    fn add_assign(&mut self, other: Self) {
        for (row, other) in self.0.iter_mut().zip(other.0) {
            *row += other;
        }
    }
}

/// Singular values in descending order, with left and right singular vectors as rows: A = Σ σᵢ uᵢ vᵢᵀ.
pub(crate) struct Svd {
    pub(crate) values: [f64; 3],
    pub(crate) left: Mat3,
    pub(crate) right: Mat3,
}

/// One-sided Jacobi (Hestenes 1958): rotates pairs of columns of A until all are orthogonal.
///
/// Converges quadratically, and finds even small singular values to high relative accuracy, where forming AᵀA would
/// not.
pub(crate) fn svd(a: &Mat3) -> Svd {
    let largest =
        a.0.iter()
            .flat_map(|row| row.0)
            .fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest == 0.0 {
        return Svd {
            values: [0.0; 3],
            left: Mat3::IDENTITY,
            right: Mat3::IDENTITY,
        };
    }
    // The columns of A, scaled so that their squares neither overflow nor vanish.
    let Mat3(columns) = a.transposed();
    let mut columns = columns.map(|c| c * (1.0 / largest));
    let Mat3(mut right) = Mat3::IDENTITY;
    for _sweep in 0..MOST_SWEEPS {
        let mut rotated = false;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let (x, y) = (columns[p], columns[q]);
            let (xx, yy, xy) = (x.squared(), y.squared(), x.dot(y));
            if xy.abs() <= f64::EPSILON * (xx * yy).sqrt() {
                continue;
            }
            rotated = true;
            let zeta = (yy - xx) / (2.0 * xy);
            let t = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
            let c = 1.0 / t.hypot(1.0);
            let s = c * t;
            for rows in [&mut columns, &mut right] {
                let (x, y) = (rows[p], rows[q]);
                rows[p] = x * c - y * s;
                rows[q] = x * s + y * c;
            }
        }
        if !rotated {
            break;
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| columns[j].squared().total_cmp(&columns[i].squared()));
    let columns = order.map(|i| columns[i]);
    let values = columns.map(Vec3::norm);
    Svd {
        values: values.map(|value| value * largest),
        left: completed(columns, values),
        right: Mat3(order.map(|i| right[i])),
    }
}

/// Three columns need about five sweeps; the rest is for what rounding does.
const MOST_SWEEPS: usize = 30;

/// Unit left singular vectors; those of vanishing singular values are chosen to complete an orthonormal basis.
fn completed(columns: [Vec3; 3], values: [f64; 3]) -> Mat3 {
    let negligible = 4.0 * f64::EPSILON * values[0];
    let first = columns[0] * (1.0 / values[0]);
    let second = if values[1] > negligible {
        columns[1] * (1.0 / values[1])
    } else {
        any_perpendicular(first)
    };
    let third = first.cross(second).unit();
    // The sign of the third vector follows its column, where that one has a direction.
    let sign = if third.dot(columns[2]) < 0.0 { -1.0 } else { 1.0 };
    Mat3([first, second, third * sign])
}

/// A unit vector at a right angle to the unit vector `v`.
fn any_perpendicular(v: Vec3) -> Vec3 {
    let smallest = (0..3).min_by(|&i, &j| v[i].abs().total_cmp(&v[j].abs()));
    let Mat3(axes) = Mat3::IDENTITY;
    v.cross(axes[smallest.unwrap_or(0)]).unit()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn check(a: &Mat3) {
        let svd = svd(a);
        let size = svd.values[0].max(f64::MIN_POSITIVE);
        assert!(svd.values[0] >= svd.values[1] && svd.values[1] >= svd.values[2] && svd.values[2] >= 0.0);
        let mut back = Mat3::ZERO;
        for k in 0..3 {
            back += Mat3::outer(svd.left.0[k] * svd.values[k], svd.right.0[k]);
        }
        for i in 0..3 {
            assert!((back.0[i] - a.0[i]).norm() <= 1e-14 * size, "{back:?} {a:?}");
            for basis in [svd.left, svd.right] {
                let gram = basis * basis.transposed();
                assert!((gram.0[i] - Mat3::IDENTITY.0[i]).norm() < 1e-14);
            }
        }
    }

    proptest! {
        #[test]
        fn the_factors_are_orthogonal_and_multiply_to_the_matrix(
            a in prop::array::uniform3(prop::array::uniform3(-1.0..1.0_f64)), exponent in -100..100_i32,
        ) {
            check(&Mat3(a.map(|row| Vec3(row) * 10_f64.powi(exponent))));
        }

        #[test]
        fn rank_one_matrices_have_orthogonal_factors_too(
            u in prop::array::uniform3(-1.0..1.0_f64), v in prop::array::uniform3(-1.0..1.0_f64),
        ) {
            check(&Mat3::outer(Vec3(u), Vec3(v)));
        }
    }

    #[test]
    fn the_zero_matrix_and_repeated_values_are_decomposed() {
        check(&Mat3::ZERO);
        check(&Mat3::IDENTITY);
        check(&[[0.0, 2.0, 0.0], [0.0; 3], [0.0; 3]].into());
    }
}
