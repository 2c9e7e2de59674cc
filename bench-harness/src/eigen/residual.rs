//! The judge of eigenpairs, whoever computed them.

use mhb_core::Laplacian;
use rayon::prelude::*;

use crate::measure::greatest;

/// The greatest relative residual ‖S h − λ D h‖_{D⁻¹} / max(λ, 1 / area) over all pairs; `function(k)` is eigenfunction k, #V
/// values of unit D-norm, of eigenvalue k. Infinite where one is no number.
pub fn worst_residual<'a>(
    laplacian: &Laplacian,
    eigenvalues: &[f64],
    function: impl Fn(usize) -> &'a [f64] + Sync,
) -> f64 {
    let mass = laplacian.mass();
    let floor = 1.0 / mass.iter().sum::<f64>();
    let residual = |(k, &lambda): (usize, &f64)| {
        let h = function(k);
        let rows = laplacian.stiffness().outer_iterator().enumerate();
        let squares = rows.map(|(i, row)| {
            let product: f64 = row.iter().map(|(j, s)| s * h[j]).sum();
            (product - lambda * mass[i] * h[i]).powi(2) / mass[i]
        });
        squares.sum::<f64>().sqrt() / lambda.max(floor)
    };
    let residuals = eigenvalues.par_iter().enumerate().map(residual);
    residuals.reduce(|| 0.0, |a, b| greatest([a, b]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface;
    use mhb_core::{Spectrum, SpectrumOptions};

    #[test]
    fn pairs_of_one_spectrum_pass_and_shifted_eigenvalues_show_their_error() {
        let laplacian = Laplacian::cotangent(&surface(600)).unwrap();
        let options = SpectrumOptions {
            count: 12,
            ..Default::default()
        };
        let spectrum = Spectrum::of_laplacian(&laplacian, &options, &job::Job::default()).unwrap();
        let function = |k| spectrum.eigenfunction(k);
        assert!(worst_residual(&laplacian, spectrum.eigenvalues(), function) < 1e-9);
        // S h − (1 + ε) λ D h = −ε λ D h, whose norm is ε λ.
        let wrong: Vec<f64> = spectrum.eigenvalues().iter().map(|l| 1.001 * l).collect();
        let residual = worst_residual(&laplacian, &wrong, function);
        assert!((residual - 0.001 / 1.001).abs() < 1e-8, "{residual}");
    }

    #[test]
    fn a_pair_that_is_no_number_has_not_converged() {
        let laplacian = Laplacian::cotangent(&surface(40)).unwrap();
        let n = laplacian.mass().len();
        let (zero, broken) = (vec![0.0; n], vec![f64::NAN; n]);
        for nan in [0, 1, 2] {
            let function = |k| {
                if k == nan {
                    broken.as_slice()
                } else {
                    zero.as_slice()
                }
            };
            assert_eq!(
                worst_residual(&laplacian, &[0.0, 1.0, 2.0], function),
                f64::INFINITY
            );
        }
        let values = [0.0, f64::NAN, 2.0];
        assert_eq!(
            worst_residual(&laplacian, &values, |_| zero.as_slice()),
            f64::INFINITY
        );
        assert_eq!(worst_residual(&laplacian, &[0.0, 1.0], |_| zero.as_slice()), 0.0);
    }
}
