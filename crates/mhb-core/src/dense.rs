//! faer's dense kernels, sequential, so that results do not depend on the number of threads.

use faer::diag::DiagMut;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::linalg::matmul;
use faer::linalg::svd::{ComputeSvdVectors, svd, svd_scratch};
use faer::{Accum, ColMut, Mat, MatMut, MatRef, Par, Side};

use crate::SpectrumError;

/// Eigenvalues, ascending, and orthonormal eigenvectors of a symmetric matrix of which the lower half is read.
pub(crate) fn symmetric_eigen(a: MatRef<'_, f64>) -> Result<(Vec<f64>, Mat<f64>), SpectrumError> {
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
    .map_err(|_| SpectrumError::Dense { size })?;
    Ok((values, vectors))
}

/// Eigenvalues, ascending, and M-orthonormal eigenvectors of A y = λ M y: with M = C Cᵀ those of C⁻¹ A C⁻ᵀ, the vectors multiplied by C⁻ᵀ.
pub(crate) fn pencil_eigen(
    mut a: Mat<f64>,
    m: MatRef<'_, f64>,
) -> Result<(Vec<f64>, Mat<f64>), SpectrumError> {
    let size = a.nrows();
    let factor = m.llt(Side::Lower).map_err(|_| SpectrumError::Dense { size })?;
    let c = factor.L();
    c.solve_lower_triangular_in_place(a.as_mut());
    c.solve_lower_triangular_in_place(a.as_mut().transpose_mut());
    let (values, mut vectors) = symmetric_eigen(a.as_ref())?;
    c.transpose().solve_upper_triangular_in_place(vectors.as_mut());
    Ok((values, vectors))
}

/// The orthogonal polar factor of a square matrix: U Vᵀ of its singular value decomposition.
pub(crate) fn polar(a: MatRef<'_, f64>) -> Result<Mat<f64>, SpectrumError> {
    let size = a.nrows();
    let (mut u, mut v) = (Mat::zeros(size, size), Mat::zeros(size, size));
    let mut singular = vec![0.0; size];
    let vectors = ComputeSvdVectors::Full;
    let scratch = svd_scratch::<f64>(size, size, vectors, vectors, Par::Seq, Default::default());
    svd(
        a,
        DiagMut::from_slice_mut(&mut singular),
        Some(u.as_mut()),
        Some(v.as_mut()),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Default::default(),
    )
    .map_err(|_| SpectrumError::Dense { size })?;
    Ok(product(u.as_ref(), v.transpose()))
}

/// A B.
pub(crate) fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut c = Mat::zeros(a.nrows(), b.ncols());
    matmul::matmul(c.as_mut(), Accum::Replace, a, b, 1.0, Par::Seq);
    c
}

/// C ← C + α A B.
pub(crate) fn add_product(c: MatMut<'_, f64>, alpha: f64, a: MatRef<'_, f64>, b: MatRef<'_, f64>) {
    matmul::matmul(c, Accum::Add, a, b, alpha, Par::Seq);
}

/// Column k of a column-major matrix.
pub(crate) fn column<'a>(x: MatRef<'a, f64>, k: usize) -> &'a [f64] {
    x.col(k)
        .try_as_col_major()
        .expect("columns are contiguous")
        .as_slice()
}

/// A column of a column-major matrix, to write to.
pub(crate) fn contiguous<'a>(column: ColMut<'a, f64>) -> &'a mut [f64] {
    column
        .try_as_col_major_mut()
        .expect("columns are contiguous")
        .as_slice_mut()
}
