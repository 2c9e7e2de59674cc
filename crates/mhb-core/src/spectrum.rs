use std::ops::Range;

use faer::{Mat, MatRef};
use mesh::TriMesh;
use rayon::prelude::*;

use crate::canonical::{References, clusters};
use crate::observer::Phase;
use crate::operator::Operator;
use crate::solver::{self, Progress};
use crate::{Laplacian, LaplacianKind, SpectrumBuilder, SpectrumError, dense};

/// What to compute, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct SpectrumOptions {
    /// How many of the lowest pairs: m.
    pub count: usize,
    /// Which Laplacian of the mesh.
    pub laplacian: LaplacianKind,
    /// Largest relative residual ‖S h − λ D h‖ / λ (in the norm of D⁻¹, for h of D-norm 1) that counts as converged. Eigenfunctions
    /// are orthonormal to a tenth of it.
    pub tolerance: f64,
    /// Threads to compute with; the result does not depend on it.
    pub threads: usize,
    /// Width of the blocks that the solver iterates with, 1 to 64, rounded up to a multiple of 8. Changes the time, and the
    /// result within the tolerance.
    pub block: usize,
    /// How many pairs a band should hold, at least 1. Changes the time, and the result within the tolerance.
    pub band: usize,
}

impl Default for SpectrumOptions {
    fn default() -> Self {
        Self {
            count: 325,
            laplacian: LaplacianKind::Cotangent,
            tolerance: 1e-10,
            threads: 1,
            block: 8,
            band: 88,
        }
    }
}

/// The m lowest eigenpairs of S h = λ D h (eq. 5): the manifold harmonics basis.
#[derive(Clone, Debug)]
pub struct Spectrum {
    eigenvalues: Vec<f64>,
    eigenfunctions: Mat<f64>,
    mass: Vec<f64>,
    residuals: Vec<f64>,
    clusters: Vec<Range<usize>>,
    certificate: Certificate,
}

/// Proof that no pair is missing: by Sylvester's law of inertia, A − σ I = L E Lᵀ has as many negative pivots as there
/// are eigenvalues below σ.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// Shifts σ, ascending, in the unit of the eigenvalues, each with the number of eigenvalues that inertia proves below it.
    pub counts: Vec<(f64, usize)>,
    /// Whether at every shift as many pairs were found as inertia proves.
    pub complete: bool,
}

impl Spectrum {
    /// A computation whose every choice has a default: see [`SpectrumBuilder`].
    pub fn builder() -> SpectrumBuilder<'static> {
        SpectrumBuilder::default()
    }

    /// The spectrum of a mesh, in the mesh's unit: eigenvalues scale as 1/s².
    ///
    /// # Errors
    /// See [`SpectrumError`]: what is wrong with the options or the mesh, and where.
    pub fn compute(mesh: &TriMesh, options: &SpectrumOptions) -> Result<Self, SpectrumError> {
        Self::builder().options(options.clone()).compute(mesh)
    }

    /// The spectrum of any Laplacian; [`SpectrumOptions::laplacian`] is not looked at.
    ///
    /// # Errors
    /// See [`SpectrumError`].
    pub fn of_laplacian(laplacian: &Laplacian, options: &SpectrumOptions) -> Result<Self, SpectrumError> {
        Self::builder().options(options.clone()).compute_of(laplacian)
    }

    /// m.
    pub fn len(&self) -> usize {
        self.eigenvalues.len()
    }

    /// Never: at least one pair is always asked for.
    pub fn is_empty(&self) -> bool {
        self.eigenvalues.is_empty()
    }

    /// λ_0 = 0 ≤ λ_1 ≤ …, m of them, in the inverse square of the mesh's unit.
    pub fn eigenvalues(&self) -> &[f64] {
        &self.eigenvalues
    }

    /// H, #V by m, column-major: column k belongs to eigenvalue k, Hᵀ D H = I. The basis is canonical: it depends on
    /// the mesh alone, and the first columns do not depend on how many were asked for. Column 0 is a positive constant.
    pub fn eigenfunctions(&self) -> MatRef<'_, f64> {
        self.eigenfunctions.as_ref()
    }

    /// Eigenfunction k, #V values.
    ///
    /// # Panics
    /// If there is no such pair.
    pub fn eigenfunction(&self, k: usize) -> &[f64] {
        self.eigenfunctions.col_as_slice(k)
    }

    /// The diagonal of D, #V.
    pub fn mass(&self) -> &[f64] {
        &self.mass
    }

    /// Relative residual of each pair, ‖S h − λ D h‖_{D⁻¹} / max(λ, 1 / area), recomputed from the final vectors.
    pub fn residuals(&self) -> &[f64] {
        &self.residuals
    }

    /// Runs of eigenvalues so close that only the space that they span together is well defined.
    pub fn clusters(&self) -> &[Range<usize>] {
        &self.clusters
    }

    /// Proof that no pair is missing.
    pub fn certificate(&self) -> &Certificate {
        &self.certificate
    }
}

/// Whether the options make sense for so many vertices.
pub(crate) fn check(options: &SpectrumOptions, vertices: usize) -> Result<(), SpectrumError> {
    if options.count == 0 || options.count > vertices {
        return Err(SpectrumError::Count {
            count: options.count,
            vertices,
        });
    }
    if !(options.tolerance > 0.0 && options.tolerance < 1.0) {
        return Err(SpectrumError::Tolerance {
            tolerance: options.tolerance,
        });
    }
    Ok(())
}

/// Canonical choice, cut to `count`, units of the mesh, residuals.
pub(crate) fn finish(
    laplacian: &Laplacian,
    operator: &Operator,
    zeros: usize,
    solution: solver::Solution,
    options: &SpectrumOptions,
    progress: &Progress<'_>,
) -> Result<Spectrum, SpectrumError> {
    let solver::Solution {
        eigenvalues,
        mut vectors,
        counts,
        complete,
    } = solution;
    let mut clusters = clusters(&eigenvalues);
    let mut references = References::new(operator.size());
    for cluster in &clusters {
        if cluster.end > zeros && cluster.start < options.count {
            let start = cluster.start.max(zeros);
            references.canonicalise(vectors.as_mut().subcols_mut(start, cluster.end - start))?;
        }
    }
    let count = options.count;
    vectors.truncate(operator.size(), count);
    let residuals = residuals(operator, vectors.as_ref(), &eigenvalues[..count]);
    progress.report(Phase::Finishing, 0.9)?;
    let area = operator.total_mass();
    let unscale: Vec<f64> = operator
        .root_mass()
        .iter()
        .map(|root| 1.0 / (root * area.sqrt()))
        .collect();
    let columns: Vec<_> = vectors.col_iter_mut().collect();
    columns.into_par_iter().map(dense::contiguous).for_each(|column| {
        column.iter_mut().zip(&unscale).for_each(|(y, s)| *y *= s);
    });
    clusters.retain(|c| c.start < count);
    if let Some(last) = clusters.last_mut() {
        last.end = last.end.min(count);
    }
    let spectrum = Spectrum {
        eigenvalues: eigenvalues[..count].iter().map(|l| l / area).collect(),
        eigenfunctions: vectors,
        mass: laplacian.mass().to_vec(),
        residuals,
        clusters,
        certificate: Certificate {
            counts: counts.iter().map(|cut| (cut.shift / area, cut.below)).collect(),
            complete,
        },
    };
    progress.report(Phase::Finishing, 1.0)?;
    Ok(spectrum)
}

/// ‖A y − λ y‖ / max(λ, 1) of each column.
fn residuals(operator: &Operator, vectors: MatRef<'_, f64>, eigenvalues: &[f64]) -> Vec<f64> {
    const LANES: usize = 8;
    let residual = |(chunk, lambdas): (usize, &[f64])| {
        // Rows of eight columns, so that the entries of A are read once for all of them.
        let mut rows = vec![[0.0; LANES]; operator.size()];
        for lane in 0..lambdas.len() {
            let column = dense::column(vectors, chunk * LANES + lane);
            rows.iter_mut().zip(column).for_each(|(row, &y)| row[lane] = y);
        }
        let mut squares = [0.0; LANES];
        let lambda: [f64; LANES] = std::array::from_fn(|lane| lambdas.get(lane).copied().unwrap_or(0.0));
        for (j, own) in rows.iter().enumerate() {
            let mut difference: [f64; LANES] = std::array::from_fn(|lane| -lambda[lane] * own[lane]);
            for (i, a) in operator.column(j) {
                let row = &rows[i];
                (0..LANES).for_each(|lane| difference[lane] += a * row[lane]);
            }
            (0..LANES).for_each(|lane| squares[lane] += difference[lane] * difference[lane]);
        }
        (0..lambdas.len())
            .map(|lane| squares[lane].sqrt() / lambda[lane].max(1.0))
            .collect::<Vec<_>>()
    };
    eigenvalues
        .par_chunks(LANES)
        .enumerate()
        .flat_map(residual)
        .collect()
}
