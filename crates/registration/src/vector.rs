//! Arithmetic on 3-vectors (`mesh::vector`) and 3 × 3 matrices (rows of `[f64; 3]`).

pub(crate) use mesh::vector::{Vec3, add, cross, dot, norm, scaled, squared, sub};

pub(crate) type Mat3 = [[f64; 3]; 3];

pub(crate) fn apply(m: &Mat3, v: Vec3) -> Vec3 {
    [dot(m[0], v), dot(m[1], v), dot(m[2], v)]
}

pub(crate) fn transposed(m: &Mat3) -> Mat3 {
    std::array::from_fn(|i| std::array::from_fn(|j| m[j][i]))
}

pub(crate) fn product(a: &Mat3, b: &Mat3) -> Mat3 {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

pub(crate) fn determinant(m: &Mat3) -> f64 {
    dot(m[0], cross(m[1], m[2]))
}

/// Singular values in descending order, with left and right singular vectors as rows: A = Σ σᵢ uᵢ vᵢᵀ.
pub(crate) struct Svd {
    pub(crate) values: Vec3,
    pub(crate) left: Mat3,
    pub(crate) right: Mat3,
}

/// One-sided Jacobi (Hestenes): rotates pairs of columns of A until all are orthogonal.
///
/// Converges quadratically, and finds even small singular values to high relative accuracy, where forming AᵀA
/// would not.
pub(crate) fn svd(a: &Mat3) -> Svd {
    let largest = a.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest == 0.0 {
        return Svd {
            values: [0.0; 3],
            left: IDENTITY,
            right: IDENTITY,
        };
    }
    // Rows of `columns` are the columns of A, scaled so that their squares neither overflow nor vanish.
    let mut columns = transposed(a).map(|c| scaled(c, 1.0 / largest));
    let mut right = IDENTITY;
    for _sweep in 0..30 {
        let mut rotated = false;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let (x, y) = (columns[p], columns[q]);
            let (xx, yy, xy) = (dot(x, x), dot(y, y), dot(x, y));
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
                rows[p] = sub(scaled(x, c), scaled(y, s));
                rows[q] = add(scaled(x, s), scaled(y, c));
            }
        }
        if !rotated {
            break;
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| squared(columns[j]).total_cmp(&squared(columns[i])));
    let columns = order.map(|i| columns[i]);
    let values = columns.map(norm);
    Svd {
        values: scaled(values, largest),
        left: completed(columns, values),
        right: order.map(|i| right[i]),
    }
}

pub(crate) const IDENTITY: Mat3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Unit left singular vectors; those of vanishing singular values are chosen to complete an orthonormal
/// basis.
fn completed(columns: Mat3, values: Vec3) -> Mat3 {
    let negligible = 4.0 * f64::EPSILON * values[0];
    let first = scaled(columns[0], 1.0 / values[0]);
    let second = if values[1] > negligible {
        scaled(columns[1], 1.0 / values[1])
    } else {
        any_perpendicular(first)
    };
    let third = cross(first, second);
    let third = scaled(third, 1.0 / norm(third));
    // The sign of the third vector follows its column, where that one has a direction.
    [
        first,
        second,
        if dot(third, columns[2]) < 0.0 {
            scaled(third, -1.0)
        } else {
            third
        },
    ]
}

/// A unit vector at a right angle to the unit vector `v`.
pub(crate) fn any_perpendicular(v: Vec3) -> Vec3 {
    let axis = (0..3)
        .min_by(|&i, &j| v[i].abs().total_cmp(&v[j].abs()))
        .unwrap_or(0);
    let across = cross(v, IDENTITY[axis]);
    scaled(across, 1.0 / norm(across))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn check(a: &Mat3) {
        let svd = svd(a);
        let size = svd.values[0].max(f64::MIN_POSITIVE);
        assert!(svd.values[0] >= svd.values[1] && svd.values[1] >= svd.values[2] && svd.values[2] >= 0.0);
        for i in 0..3 {
            for j in 0..3 {
                let back: f64 = (0..3)
                    .map(|k| svd.values[k] * svd.left[k][i] * svd.right[k][j])
                    .sum();
                assert!((back - a[i][j]).abs() <= 1e-14 * size, "{back} {}", a[i][j]);
                for basis in [&svd.left, &svd.right] {
                    assert!((dot(basis[i], basis[j]) - IDENTITY[i][j]).abs() < 1e-14);
                }
            }
        }
    }

    proptest! {
        #[test]
        fn the_factors_are_orthogonal_and_multiply_to_the_matrix(
            a in prop::array::uniform3(prop::array::uniform3(-1.0..1.0_f64)), exponent in -100..100_i32,
        ) {
            check(&a.map(|row| scaled(row, 10_f64.powi(exponent))));
        }

        #[test]
        fn rank_one_matrices_have_orthogonal_factors_too(
            u in prop::array::uniform3(-1.0..1.0_f64), v in prop::array::uniform3(-1.0..1.0_f64),
        ) {
            check(&u.map(|x| scaled(v, x)));
        }
    }

    #[test]
    fn the_zero_matrix_and_repeated_values_are_decomposed() {
        check(&[[0.0; 3]; 3]);
        check(&IDENTITY);
        check(&[[0.0, 2.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]);
    }
}
