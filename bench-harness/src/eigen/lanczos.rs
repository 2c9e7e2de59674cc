//! The peer in Rust: faer's own partial eigensolver.

use anyhow::{Result, ensure};
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::matrix_free::LinOp;
use faer::matrix_free::eigen::{
    PartialEigenParams, partial_self_adjoint_eigen, partial_self_adjoint_eigen_scratch,
};
use faer::prelude::Solve;
use faer::sparse::linalg::solvers::Llt;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Col, Mat, MatMut, MatRef, Par, Side};
use mhb_core::Laplacian;

/// Just below the spectrum of a surface of unit area, as with all peers, so that A − σ I is definite.
const SHIFT: f64 = -0.01;

/// The lowest pairs of S h = λ D h by faer's own partial eigensolver, a Lanczos method with thick restarts, on
/// (A − σ I)⁻¹ with A = D^-½ S D^-½ and faer's own Cholesky factor; on one thread. A last solve makes residuals of A as small as those of its
/// inverse. Fails when not all pairs converge within faer's default number of restarts.
///
/// Eigenvalues, ascending, and eigenfunctions of unit D-norm as columns.
pub(crate) fn faer_lanczos(
    laplacian: &Laplacian,
    count: usize,
    tolerance: f64,
) -> Result<(Vec<f64>, Mat<f64>)> {
    let mass = laplacian.mass();
    let (n, area) = (mass.len(), mass.iter().sum::<f64>());
    let root: Vec<f64> = mass.iter().map(|m| (m / area).sqrt()).collect();
    let inverse = Inverse::new(laplacian, &root)?;
    let mut vectors = Mat::zeros(n, count);
    let mut theta = vec![0.0; count];
    let params = PartialEigenParams::default();
    let scratch = partial_self_adjoint_eigen_scratch::<f64>(&inverse, count, Par::Seq, params);
    // The residual of θ is bounded absolutely: by Weyl's law the largest eigenvalue is about 4π count, and 1/θ as large.
    let absolute = tolerance / (4.0 * std::f64::consts::PI * count as f64);
    let converged = partial_self_adjoint_eigen(
        vectors.as_mut(),
        &mut theta,
        &inverse,
        start(n).as_ref(),
        absolute,
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        params,
    )
    .n_converged_eigen;
    ensure!(converged == count, "only {converged} of {count} pairs converged");
    // y + r / θ instead of y: r has frequencies that A amplifies, and one more solve damps.
    inverse.factor.solve_in_place(vectors.as_mut());
    for mut column in vectors.col_iter_mut() {
        let norm = column.norm_l2();
        for (i, r) in root.iter().enumerate() {
            column[i] /= norm * r * area.sqrt();
        }
    }
    // Largest θ first are smallest λ first.
    let eigenvalues = theta.iter().map(|t| (SHIFT + 1.0 / t) / area).collect();
    Ok((eigenvalues, vectors))
}

/// Numbers without a pattern, between −½ and ½.
fn start(n: usize) -> Col<f64> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    Col::from_fn(n, |i| {
        ((i + 1) as f64 * GOLDEN * (i % 97 + 1) as f64).fract() - 0.5
    })
}

/// (A − σ I)⁻¹.
#[derive(Debug)]
struct Inverse {
    factor: Llt<usize, f64>,
    size: usize,
}

impl Inverse {
    fn new(laplacian: &Laplacian, root: &[f64]) -> Result<Self> {
        let entry = |(&s, (i, j)): (&f64, (usize, usize))| {
            let shift = if i == j { SHIFT } else { 0.0 };
            Triplet::new(i, j, s / (root[i] * root[j]) - shift)
        };
        let entries: Vec<_> = laplacian.stiffness().iter().map(entry).collect();
        let size = root.len();
        let matrix = SparseColMat::try_new_from_triplets(size, size, &entries)?;
        let factor = matrix.sp_cholesky(Side::Lower)?;
        Ok(Self { factor, size })
    }
}

impl LinOp<f64> for Inverse {
    fn apply_scratch(&self, _: usize, _: Par) -> StackReq {
        StackReq::EMPTY
    }

    fn nrows(&self) -> usize {
        self.size
    }

    fn ncols(&self) -> usize {
        self.size
    }

    fn apply(&self, mut out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, _: Par, _: &mut MemStack) {
        out.copy_from(rhs);
        self.factor.solve_in_place(out);
    }

    fn conj_apply(&self, out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, par: Par, stack: &mut MemStack) {
        self.apply(out, rhs, par, stack);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{eigen::residual::worst_residual, surface};
    use mhb_core::{Spectrum, SpectrumOptions};

    #[test]
    fn pairs_of_the_peer_are_ours() {
        let laplacian = Laplacian::cotangent(&surface(600)).unwrap();
        let (eigenvalues, functions) = faer_lanczos(&laplacian, 20, 1e-9).unwrap();
        assert!(worst_residual(&laplacian, &eigenvalues, |k| functions.col_as_slice(k)) < 1e-7);
        let options = SpectrumOptions {
            count: 20,
            ..Default::default()
        };
        let spectrum = Spectrum::of_laplacian(&laplacian, &options, &job::Job::default()).unwrap();
        for (theirs, ours) in eigenvalues.iter().zip(spectrum.eigenvalues()) {
            assert!((theirs - ours).abs() < 1e-8 * ours.max(1.0), "{theirs} {ours}");
        }
    }
}
