use faer::{Accum, Mat, MatRef, Par, Side, linalg::matmul::matmul};
use mesh::BoundingBox;

use crate::BaselineError;

/// φ(r), the profile of a radial function; r is a distance in diagonals of the bounding box, so that size does not matter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Kernel {
    /// r, which gives the paper's figures.
    #[default]
    Linear,
    /// r³.
    Cubic,
    /// r² ln r.
    ThinPlate,
    /// exp(−(r/w)²).
    Gaussian {
        /// w, in diagonals.
        width: f64,
    },
}

impl Kernel {
    /// φ at a distance.
    pub fn value(self, r: f64) -> f64 {
        match self {
            Self::Linear => r,
            Self::Cubic => r * r * r,
            Self::ThinPlate if r > 0.0 => r * r * r.ln(),
            Self::ThinPlate => 0.0,
            Self::Gaussian { width } => (-(r / width).powi(2)).exp(),
        }
    }
}

/// Indices of `count` points, each as far as can be from those before it. The first is the farthest from the centroid; of equally far
/// ones the first in order.
///
/// # Errors
/// [`BaselineError::Centres`] when there are fewer points.
pub fn farthest_points(points: &[[f64; 3]], count: usize) -> Result<Vec<usize>, BaselineError> {
    if count > points.len() {
        return Err(BaselineError::Centres {
            centres: count,
            vertices: points.len(),
        });
    }
    let scale = 1.0 / points.len().max(1) as f64;
    let centroid = std::array::from_fn(|axis| points.iter().map(|p| scale * p[axis]).sum());
    let mut chosen = Vec::with_capacity(count);
    let mut nearest: Vec<f64> = points.iter().map(|&p| distance(p, centroid)).collect();
    while chosen.len() < count {
        let farthest = (1..points.len()).fold(0, |best, i| if nearest[i] > nearest[best] { i } else { best });
        if chosen.is_empty() {
            nearest.fill(f64::INFINITY);
        }
        chosen.push(farthest);
        for (near, &p) in nearest.iter_mut().zip(points) {
            *near = near.min(distance(p, points[farthest]));
        }
    }
    Ok(chosen)
}

/// U = B W Σ⁻¹, #V by `count` (Wu and Kobbelt 2005): the functions Bᵢⱼ = φ(|vᵢ − cⱼ|) about farthest points c made orthonormal, Σ² and W
/// being the eigenvalues of BᵀB, descending, and its eigenvectors.
///
/// Each column's largest entry is positive. Eigenpairs of BᵀB lose half of the digits, so that UᵀU is off the identity where φ's functions are
/// nearly dependent; U (UᵀU)^(−½), the nearest orthonormal basis, mends that.
///
/// # Errors
/// [`BaselineError::Centres`] and [`BaselineError::Dependent`].
pub fn radial_basis(points: &[[f64; 3]], count: usize, kernel: Kernel) -> Result<Mat<f64>, BaselineError> {
    let centres = farthest_points(points, count)?;
    let unit = 1.0 / BoundingBox::of(points).diagonal();
    let b = Mat::from_fn(points.len(), count, |i, j| {
        kernel.value(unit * distance(points[i], points[centres[j]]))
    });
    let (squares, w) = eigen(gram(b.as_ref()).as_ref())?;
    let least = squares
        .last()
        .map_or(0.0, |largest| largest * count as f64 * f64::EPSILON);
    let rank = squares.iter().filter(|&&square| square > least).count();
    if rank < count {
        return Err(BaselineError::Dependent { rank, centres: count });
    }
    let descending = Mat::from_fn(count, count, |i, k| {
        w[(i, count - 1 - k)] / squares[count - 1 - k].sqrt()
    });
    let u = product(b.as_ref(), descending.as_ref());
    let (squares, w) = eigen(gram(u.as_ref()).as_ref())?;
    let scaled = Mat::from_fn(count, count, |i, k| w[(i, k)] / squares[k].sqrt());
    let mut u = product(u.as_ref(), product(scaled.as_ref(), w.transpose()).as_ref());
    for column in 0..count {
        let entries = u.col_as_slice_mut(column);
        let largest = entries
            .iter()
            .fold(0.0_f64, |most, &x| if x.abs() > most.abs() { x } else { most });
        if largest < 0.0 {
            entries.iter_mut().for_each(|x| *x = -*x);
        }
    }
    Ok(u)
}

fn distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    (0..3).map(|axis| (p[axis] - q[axis]).powi(2)).sum::<f64>().sqrt()
}

/// Eigenvalues, ascending, and eigenvectors of a symmetric matrix.
fn eigen(a: MatRef<'_, f64>) -> Result<(Vec<f64>, Mat<f64>), BaselineError> {
    let failed = BaselineError::Dense { size: a.nrows() };
    if !a.is_all_finite() {
        return Err(failed);
    }
    let eigen = a.self_adjoint_eigen(Side::Lower).map_err(|_| failed)?;
    let values = eigen.S().column_vector().iter().copied().collect();
    Ok((values, eigen.U().to_owned()))
}

fn gram(a: MatRef<'_, f64>) -> Mat<f64> {
    product(a.transpose(), a)
}

fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut c = Mat::zeros(a.nrows(), b.ncols());
    matmul(c.as_mut(), Accum::Replace, a, b, 1.0, Par::Seq);
    c
}

#[cfg(test)]
mod tests {
    use mesh::shapes;

    use super::*;

    const KERNELS: [Kernel; 4] = [
        Kernel::Linear,
        Kernel::Cubic,
        Kernel::ThinPlate,
        Kernel::Gaussian { width: 0.2 },
    ];

    #[test]
    fn the_basis_is_orthonormal_for_every_kernel() {
        let mesh = shapes::bumpy_sphere(3, 1);
        for kernel in KERNELS {
            let u = radial_basis(mesh.positions(), 40, kernel).unwrap();
            let off = gram(u.as_ref()) - Mat::<f64>::identity(40, 40);
            assert!(off.norm_max() < 1e-13, "{kernel:?}: {}", off.norm_max());
        }
    }

    #[test]
    fn the_basis_spans_the_radial_functions() {
        let points = shapes::bumpy_sphere(3, 1);
        let points = points.positions();
        let unit = 1.0 / BoundingBox::of(points).diagonal();
        for kernel in KERNELS {
            let u = radial_basis(points, 40, kernel).unwrap();
            for centre in farthest_points(points, 40).unwrap() {
                let b = Mat::from_fn(points.len(), 1, |i, _| {
                    kernel.value(unit * distance(points[i], points[centre]))
                });
                let rest = &b - product(u.as_ref(), product(u.transpose(), b.as_ref()).as_ref());
                assert!(rest.norm_l2() < 1e-7 * b.norm_l2(), "{kernel:?}");
            }
        }
    }

    #[test]
    fn farthest_points_keep_their_distance() {
        let mesh = shapes::bumpy_torus(24, 12, 3);
        let points = mesh.positions();
        let chosen = farthest_points(points, 20).unwrap();
        let gap = |i: usize, before: &[usize]| {
            let distances = before.iter().map(|&j| distance(points[i], points[j]));
            distances.fold(f64::INFINITY, f64::min)
        };
        for k in 1..chosen.len() {
            let before = &chosen[..k];
            assert!((0..points.len()).all(|i| gap(i, before) <= gap(chosen[k], before)));
        }
    }

    #[test]
    fn dependent_functions_are_refused() {
        let mesh = shapes::bumpy_sphere(3, 1);
        let wide = Kernel::Gaussian { width: 1e3 };
        let refused = radial_basis(mesh.positions(), 40, wide);
        assert!(matches!(
            refused,
            Err(BaselineError::Dependent { centres: 40, .. })
        ));
        let refused = radial_basis(mesh.positions(), 10_000, Kernel::Linear);
        assert!(matches!(
            refused,
            Err(BaselineError::Centres { centres: 10_000, .. })
        ));
    }
}
