//! The lowest eigenpairs of a sparse symmetric problem A y = λ M y.

mod band;
mod bands;
#[cfg(feature = "bench-internals")]
pub mod bench;
mod factor;
mod joint;
mod krylov;
mod packed;
mod product;
mod slicing;
mod tall;

use faer::{Mat, MatRef};
use job::Job;

use self::band::Workspaces;
use self::bands::{Bands, Certified};
use self::factor::Analysis;
use self::tall::Tall;
use crate::canonical::in_one_cluster;
use crate::operator::Operator;
use crate::{InertiaCount, SpectrumError, SpectrumOptions, SpectrumStage, dense, inertia};

/// Up to this size a dense eigenproblem is quicker than a sparse one.
const DENSE: usize = 640;

/// Pairs of the operator, ascending, orthonormal, the kernel's vectors first; at least as many as were asked for, and
/// the cluster of the last one asked for is whole.
pub(crate) struct Solution {
    pub(crate) eigenvalues: Vec<f64>,
    pub(crate) vectors: Mat<f64>,
    /// Where eigenvalues were counted by inertia.
    pub(crate) counts: Vec<InertiaCount>,
}

/// The lowest pairs, where those of eigenvalue 0 are known: `kernel`, all of them or as many as are asked for.
pub(crate) fn lowest(
    operator: &Operator,
    kernel: MatRef<'_, f64>,
    options: &SpectrumOptions,
    job: &Job,
) -> Result<Solution, SpectrumError> {
    if kernel.ncols() >= options.count {
        return by_kernel(operator, kernel, job);
    }
    if operator.size() <= DENSE {
        return densely(operator, kernel, options.count, job);
    }
    by_bands(operator, kernel, options, job)
}

/// A shift, for a surface of unit area, below which a positive semidefinite operator has no eigenvalue, whatever rounding does to those that are 0.
const BELOW_ZERO: f64 = -1.0;

/// Pairs of eigenvalue 0 alone, as there are so many: what is left to prove is that none is negative.
fn by_kernel(operator: &Operator, kernel: MatRef<'_, f64>, job: &Job) -> Result<Solution, SpectrumError> {
    job.begin(SpectrumStage::Ordering)?;
    let analysis = Analysis::new(operator)?;
    job.begin(SpectrumStage::Slicing)?;
    let counts = vec![analysis.factorise(BELOW_ZERO)?.inertia()];
    job.begin(SpectrumStage::Finishing)?;
    let eigenvalues = vec![0.0; kernel.ncols()];
    inertia::check(&counts, &eigenvalues)?;
    Ok(Solution {
        eigenvalues,
        vectors: kernel.to_owned(),
        counts,
    })
}

/// Solves bands around shifts of their own, checks their number against the inertia at the shifts, mends where it
/// differs, and joins them.
fn by_bands(
    operator: &Operator,
    kernel: MatRef<'_, f64>,
    options: &SpectrumOptions,
    job: &Job,
) -> Result<Solution, SpectrumError> {
    job.begin(SpectrumStage::Ordering)?;
    let analysis = Analysis::new(operator)?;
    let mut reordered = Tall::zeros(kernel.nrows(), kernel.ncols());
    for k in 0..kernel.ncols() {
        let values = analysis.forward().iter().map(|&old| kernel[(old as usize, k)]);
        reordered.column_mut(k).zip(values).for_each(|(t, s)| *t = s);
    }
    let zeros = kernel.ncols();
    let bands = Bands {
        analysis: &analysis,
        kernel: &reordered,
        zeros,
        options,
        job,
        workspaces: Workspaces::default(),
    };
    let mut bottom = InertiaCount {
        shift: BELOW_ZERO,
        below: 0,
    };
    let mut certified = Certified::default();
    let mut wanted = options.count.max(zeros);
    let eigenvalues = loop {
        job.begin(SpectrumStage::Slicing)?;
        let top = slicing::top(&analysis, bottom, wanted, options.band, job)?;
        job.begin(SpectrumStage::Solving)?;
        bands.solve(bottom, top, &mut certified)?;
        bottom = top;
        let mut eigenvalues = vec![0.0; zeros];
        eigenvalues.extend(certified.pairs.iter().map(|pair| pair.value));
        wanted = whole_cluster(&eigenvalues, options.count.max(zeros)) + 1;
        if wanted <= eigenvalues.len() || eigenvalues.len() == operator.size() {
            break eigenvalues;
        }
    };
    job.begin(SpectrumStage::Finishing)?;
    inertia::check(&certified.cuts, &eigenvalues)?;
    let kept = whole_cluster(&eigenvalues, options.count);
    let eigenvalues = eigenvalues[..kept].to_vec();
    let counts = std::mem::take(&mut certified.cuts);
    let vectors = joint::join(
        operator,
        kernel,
        certified,
        kept,
        analysis.inverse(),
        options.tolerance,
        job,
    )?;
    Ok(Solution {
        eigenvalues,
        vectors,
        counts,
    })
}

/// All pairs by a dense eigenproblem, in which the kernel is moved to the far end of the spectrum.
fn densely(
    operator: &Operator,
    kernel: MatRef<'_, f64>,
    count: usize,
    job: &Job,
) -> Result<Solution, SpectrumError> {
    job.begin(SpectrumStage::Solving)?;
    let mut a = operator.to_dense();
    let weighted = operator.full_mass_times(kernel);
    let weighted = weighted.as_ref().map_or(kernel, Mat::as_ref);
    let beyond = 2.0 * operator.norm_bound();
    dense::add_product(a.as_mut(), beyond, weighted, weighted.transpose());
    let (values, vectors) = match operator.full_mass_to_dense() {
        None => dense::symmetric_eigen(a.as_ref())?,
        Some(m) => dense::pencil_eigen(a, m.as_ref())?,
    };
    job.begin(SpectrumStage::Finishing)?;
    let zeros = kernel.ncols();
    let rest = operator.size() - zeros;
    let mut eigenvalues = vec![0.0; zeros];
    eigenvalues.extend(values[..rest].iter().map(|l| l.max(0.0)));
    let kept = whole_cluster(&eigenvalues, count);
    let counts = count_beyond(operator, &eigenvalues, kept)?;
    inertia::check(&counts, &eigenvalues)?;
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
    })
}

/// Counts eigenvalues half-way between pair `kept − 1` and the next.
fn count_beyond(
    operator: &Operator,
    eigenvalues: &[f64],
    kept: usize,
) -> Result<Vec<InertiaCount>, SpectrumError> {
    let Some(next) = eigenvalues.get(kept) else {
        return Ok(Vec::new());
    };
    let gap = next - eigenvalues[kept - 1];
    let analysis = Analysis::new(operator)?;
    let factor = analysis.factorise_near(next - 0.5 * gap, 0.07 * gap)?;
    Ok(vec![factor.inertia()])
}

/// The end of the cluster that pair `count − 1` belongs to.
fn whole_cluster(eigenvalues: &[f64], count: usize) -> usize {
    let mut end = count;
    while end < eigenvalues.len() && in_one_cluster(eigenvalues[end - 1], eigenvalues[end]) {
        end += 1;
    }
    end
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::kernel;
    use crate::{Laplacian, LaplacianKind, Mass};
    use mesh::{TriMesh, shapes};

    /// The lowest pairs by both ways.
    fn both(mesh: &TriMesh, mass: Mass, count: usize) -> [Solution; 2] {
        let operator = Operator::new(&Laplacian::of(mesh, LaplacianKind::Cotangent, mass).unwrap());
        let job = Job::default();
        let options = SpectrumOptions {
            count: count.min(mesh.vertex_count()),
            ..Default::default()
        };
        let kernel = kernel(&operator, |_| false, options.count, &job).unwrap();
        [
            densely(&operator, kernel.as_ref(), options.count, &job).unwrap(),
            by_bands(&operator, kernel.as_ref(), &options, &job).unwrap(),
        ]
    }

    #[test]
    fn sparse_and_dense_solvers_agree_for_either_mass() {
        for mesh in [
            shapes::bumpy_sphere(2, 5),
            shapes::bumpy_torus(20, 10, 3),
            shapes::bumpy_block(2, 6, 3),
        ] {
            for mass in [Mass::Lumped, Mass::Full] {
                let [dense, sparse] = both(&mesh, mass, 21);
                for (x, y) in dense.eigenvalues.iter().zip(&sparse.eigenvalues) {
                    assert!((x - y).abs() <= 1e-10 * y, "{x} {y}");
                }
            }
        }
    }

    #[test]
    fn a_solution_that_lacks_any_one_of_its_pairs_fails_the_check() {
        let [solution, _] = both(&shapes::bumpy_sphere(2, 5), Mass::Lumped, 21);
        assert_eq!(inertia::check(&solution.counts, &solution.eigenvalues), Ok(()));
        for missing in 0..21 {
            let mut some = solution.eigenvalues.clone();
            some.remove(missing);
            let failed = inertia::check(&solution.counts, &some);
            assert!(
                matches!(failed, Err(SpectrumError::Incomplete { proven, found, .. }) if found + 1 == proven)
            );
        }
    }
}
