//! The lowest eigenpairs of a standard sparse symmetric problem.

mod band;
mod factor;
mod slicing;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use faer::{Mat, MatRef};
use rayon::prelude::*;

use self::band::{Band, Pairs};
use self::factor::Analysis;
use self::slicing::{Cut, slice};
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
    /// Where eigenvalues were counted by inertia.
    pub(crate) counts: Vec<Cut>,
    /// Whether as many pairs were found below each of them.
    pub(crate) complete: bool,
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
    if operator.size() <= DENSE {
        progress.report(Phase::Solving, 0.0)?;
        return densely(operator, kernel, options.count);
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(options.threads.max(1))
        .build()
        .map_err(|e| SpectrumError::Threads {
            threads: options.threads,
            reason: e.to_string(),
        })?;
    pool.install(|| by_bands(operator, kernel, options, progress))
}

/// Cuts the spectrum into bands by counting eigenvalues, solves each around a shift of its own, and joins them.
fn by_bands(
    operator: &Operator,
    kernel: MatRef<'_, f64>,
    options: &SpectrumOptions,
    progress: &Progress<'_>,
) -> Result<Solution, SpectrumError> {
    progress.report(Phase::Ordering, 0.0)?;
    let analysis = Analysis::new(operator)?;
    let zeros = kernel.ncols();
    let mut cuts = vec![Cut {
        shift: -1.0,
        below: 0,
    }];
    let mut eigenvalues = vec![0.0; zeros];
    let mut parts = vec![kernel.to_owned()];
    let mut wanted = options.count;
    loop {
        progress.report(Phase::Slicing, 0.0)?;
        let bottom = *cuts.last().unwrap_or(&Cut {
            shift: -1.0,
            below: 0,
        });
        let new = slice(&analysis, bottom, wanted, options.band)?;
        let bands: Vec<Band> = std::iter::once(&bottom)
            .chain(&new)
            .zip(&new)
            .map(|(a, b)| Band {
                lower: a.shift,
                upper: b.shift,
                count: b.below - a.below.max(zeros),
            })
            .collect();
        cuts.extend(new);
        for pairs in solve_bands(&analysis, &bands, kernel, options, progress)? {
            eigenvalues.extend(pairs.values);
            parts.push(pairs.vectors);
        }
        wanted = whole_cluster(&eigenvalues, options.count) + 1;
        if wanted <= eigenvalues.len() || eigenvalues.len() == operator.size() {
            break;
        }
    }
    progress.report(Phase::Finishing, 0.0)?;
    let counts = cuts.split_off(1);
    let complete = agree(&counts, &eigenvalues);
    let kept = whole_cluster(&eigenvalues, options.count);
    let mut vectors = join(&parts, operator.size(), kept);
    orthonormalise_jointly(&mut vectors);
    let zeros = zeros.min(kept);
    vectors
        .as_mut()
        .subcols_mut(0, zeros)
        .copy_from(kernel.subcols(0, zeros));
    eigenvalues.truncate(kept);
    Ok(Solution {
        eigenvalues,
        vectors,
        counts,
        complete,
    })
}

fn solve_bands(
    analysis: &Analysis<'_>,
    bands: &[Band],
    kernel: MatRef<'_, f64>,
    options: &SpectrumOptions,
    progress: &Progress<'_>,
) -> Result<Vec<Pairs>, SpectrumError> {
    let done = AtomicUsize::new(0);
    let nothing = Mat::zeros(kernel.nrows(), 0);
    bands
        .par_iter()
        .map(|band| {
            let (lower, width) = (band.lower.max(0.0), band.upper - band.lower.max(0.0));
            let factor = analysis.factorise_near(lower + 0.5 * width, 0.013 * width)?;
            let deflated = if band.lower < 0.0 {
                kernel
            } else {
                nothing.as_ref()
            };
            let pairs = band::solve(&factor, *band, deflated, options.block, options.tolerance)?;
            let finished = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress.report(Phase::Solving, finished as f64 / bands.len() as f64)?;
            Ok(pairs)
        })
        .collect()
}

/// The first `kept` columns of the parts side by side.
fn join(parts: &[Mat<f64>], size: usize, kept: usize) -> Mat<f64> {
    let mut joined = Mat::zeros(size, kept);
    let mut start = 0;
    for part in parts {
        let width = part.ncols().min(kept - start);
        joined
            .as_mut()
            .subcols_mut(start, width)
            .copy_from(part.as_ref().subcols(0, width));
        start += width;
    }
    joined
}

/// X ← X (XᵀX)^-1/2 by Newton's iteration X ← X (3 I − XᵀX) / 2: the nearest orthonormal set, which favours no band.
fn orthonormalise_jointly(x: &mut Mat<f64>) {
    for _ in 0..8 {
        let mut correction = dense::gram(x.as_ref());
        let mut defect: f64 = 0.0;
        for j in 0..correction.ncols() {
            for i in 0..correction.nrows() {
                let unit = f64::from(u8::from(i == j));
                defect = defect.max((correction[(i, j)] - unit).abs());
                correction[(i, j)] = 1.5 * unit - 0.5 * correction[(i, j)];
            }
        }
        if defect < 1e-13 {
            return;
        }
        *x = dense::product(x.as_ref(), correction.as_ref());
    }
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
    let counts = count_beyond(operator, &eigenvalues, kept)?;
    let complete = agree(&counts, &eigenvalues);
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
        counts,
        complete,
    })
}

/// Counts eigenvalues half-way between pair `kept − 1` and the next.
fn count_beyond(operator: &Operator, eigenvalues: &[f64], kept: usize) -> Result<Vec<Cut>, SpectrumError> {
    let Some(next) = eigenvalues.get(kept) else {
        return Ok(Vec::new());
    };
    let gap = next - eigenvalues[kept - 1];
    let analysis = Analysis::new(operator)?;
    let factor = analysis.factorise_near(next - 0.5 * gap, 0.07 * gap)?;
    Ok(vec![Cut {
        shift: factor.shift(),
        below: factor.below(),
    }])
}

/// Whether as many eigenvalues were found below each cut as inertia proves.
fn agree(counts: &[Cut], eigenvalues: &[f64]) -> bool {
    counts
        .iter()
        .all(|cut| eigenvalues.partition_point(|&l| l < cut.shift) == cut.below)
}

/// The end of the cluster that pair `count − 1` belongs to.
fn whole_cluster(eigenvalues: &[f64], count: usize) -> usize {
    let mut end = count;
    while end < eigenvalues.len() && in_one_cluster(eigenvalues[end - 1], eigenvalues[end]) {
        end += 1;
    }
    end
}
