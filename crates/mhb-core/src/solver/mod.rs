//! The lowest eigenpairs of a standard sparse symmetric problem.

mod factor;

use std::ops::ControlFlow;

use faer::{Mat, MatRef};

use crate::canonical::in_one_cluster;
use crate::observer::{Observer, Phase};
use crate::operator::Operator;
use crate::{SpectrumError, SpectrumOptions, dense};

/// Up to this size a dense eigenproblem is quicker than a sparse one.
const DENSE: usize = 640;

/// Pairs of the operator, ascending, orthonormal, the kernel's vectors first; at least as many as were asked for, and
/// the cluster of the last one asked for is whole.
pub(crate) struct Solution {
    pub(crate) eigenvalues: Vec<f64>,
    pub(crate) vectors: Mat<f64>,
    /// Shifts with the number of eigenvalues below, by inertia.
    pub(crate) counts: Vec<(f64, usize)>,
}

/// An observer with its answer turned into a result.
pub(crate) struct Progress<'a>(&'a dyn Observer);

impl<'a> Progress<'a> {
    pub(crate) fn new(observer: &'a dyn Observer) -> Self {
        Self(observer)
    }

    pub(crate) fn report(&self, phase: Phase, fraction: f64) -> Result<(), SpectrumError> {
        match self.0.progress(phase, fraction) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(SpectrumError::Cancelled),
        }
    }
}

/// The lowest pairs of A, whose kernel is known.
pub(crate) fn lowest(
    operator: &Operator,
    kernel: MatRef<'_, f64>,
    options: &SpectrumOptions,
    progress: &Progress<'_>,
) -> Result<Solution, SpectrumError> {
    progress.report(Phase::Solving, 0.0)?;
    let solution = densely(operator, kernel, options.count)?;
    progress.report(Phase::Solving, 1.0)?;
    Ok(solution)
}

/// All pairs by a dense eigenproblem, in which the kernel is moved to the far end of the spectrum.
fn densely(operator: &Operator, kernel: MatRef<'_, f64>, count: usize) -> Result<Solution, SpectrumError> {
    let mut a = operator.to_dense();
    dense::add_product(
        a.as_mut(),
        2.0 * operator.norm_bound(),
        kernel,
        kernel.transpose(),
    );
    let (values, vectors) = dense::symmetric_eigen(a.as_ref())?;
    let zeros = kernel.ncols();
    let rest = operator.size() - zeros;
    let mut eigenvalues = vec![0.0; zeros];
    eigenvalues.extend(values[..rest].iter().map(|l| l.max(0.0)));
    let kept = whole_cluster(&eigenvalues, count);
    eigenvalues.truncate(kept);
    let mut all = Mat::zeros(operator.size(), kept);
    let zeros = zeros.min(kept);
    all.as_mut()
        .subcols_mut(0, zeros)
        .copy_from(kernel.subcols(0, zeros));
    all.as_mut()
        .subcols_mut(zeros, kept - zeros)
        .copy_from(vectors.subcols(0, kept - zeros));
    Ok(Solution {
        eigenvalues,
        vectors: all,
        counts: Vec::new(),
    })
}

/// The end of the cluster that pair `count − 1` belongs to.
fn whole_cluster(eigenvalues: &[f64], count: usize) -> usize {
    let mut end = count;
    while end < eigenvalues.len() && in_one_cluster(eigenvalues[end - 1], eigenvalues[end]) {
        end += 1;
    }
    end
}
