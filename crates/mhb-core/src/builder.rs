use mesh::TriMesh;

use crate::kernel::kernel;
use crate::observer::{Observer, Phase, Unobserved};
use crate::operator::Operator;
use crate::solver::{self, Progress};
use crate::spectrum::{check, finish};
use crate::{Laplacian, LaplacianKind, Spectrum, SpectrumError, SpectrumOptions};

/// A computation of a [`Spectrum`], chosen step by step.
///
/// ```
/// use std::ops::ControlFlow;
/// use mhb_core::{Phase, Spectrum};
///
/// let watch = |_phase: Phase, _fraction: f64| ControlFlow::Continue(()); // Break(()) cancels
/// let spectrum = Spectrum::builder()
///     .count(20)
///     .tolerance(1e-8)
///     .threads(2)
///     .observer(&watch)
///     .compute(&mesh::shapes::icosphere(4))?;
/// assert_eq!(spectrum.len(), 20);
/// # Ok::<(), mhb_core::SpectrumError>(())
/// ```
#[derive(Clone)]
#[must_use = "nothing happens before compute or compute_of"]
pub struct SpectrumBuilder<'a> {
    options: SpectrumOptions,
    observer: &'a dyn Observer,
}

impl Default for SpectrumBuilder<'_> {
    fn default() -> Self {
        Self {
            options: SpectrumOptions::default(),
            observer: &Unobserved,
        }
    }
}

impl<'a> SpectrumBuilder<'a> {
    /// All options at once.
    pub fn options(mut self, options: SpectrumOptions) -> Self {
        self.options = options;
        self
    }

    /// See [`SpectrumOptions::count`].
    pub fn count(mut self, count: usize) -> Self {
        self.options.count = count;
        self
    }

    /// See [`SpectrumOptions::laplacian`].
    pub fn laplacian(mut self, kind: LaplacianKind) -> Self {
        self.options.laplacian = kind;
        self
    }

    /// See [`SpectrumOptions::tolerance`].
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.options.tolerance = tolerance;
        self
    }

    /// See [`SpectrumOptions::threads`].
    pub fn threads(mut self, threads: usize) -> Self {
        self.options.threads = threads;
        self
    }

    /// Sees the progress and may cancel.
    pub fn observer<'b>(self, observer: &'b dyn Observer) -> SpectrumBuilder<'b> {
        SpectrumBuilder {
            options: self.options,
            observer,
        }
    }

    /// The spectrum of a mesh, in the mesh's unit: eigenvalues scale as 1/s².
    ///
    /// # Errors
    /// See [`SpectrumError`]: what is wrong with the options or the mesh, and where; or that the observer cancelled.
    pub fn compute(&self, mesh: &TriMesh) -> Result<Spectrum, SpectrumError> {
        check(&self.options, mesh.vertex_count())?;
        let progress = Progress::new(self.observer);
        progress.report(Phase::Assembly, 0.0)?;
        let laplacian = Laplacian::of(mesh, self.options.laplacian)?;
        progress.report(Phase::Assembly, 1.0)?;
        self.compute_of(&laplacian)
    }

    /// The spectrum of any Laplacian; [`SpectrumOptions::laplacian`] is not looked at.
    ///
    /// # Errors
    /// As [`compute`](Self::compute).
    pub fn compute_of(&self, laplacian: &Laplacian) -> Result<Spectrum, SpectrumError> {
        let options = &self.options;
        check(options, laplacian.mass().len())?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(options.threads.max(1))
            .build()
            .map_err(|e| SpectrumError::Threads {
                threads: options.threads,
                reason: e.to_string(),
            })?;
        let progress = Progress::new(self.observer);
        pool.install(|| {
            let operator = Operator::new(laplacian)?;
            let kernel = kernel(&operator);
            let sane = SpectrumOptions {
                block: options.block.clamp(1, 64),
                band: options.band.max(1),
                ..options.clone()
            };
            let solution = solver::lowest(&operator, kernel.as_ref(), &sane, &progress)?;
            finish(laplacian, &operator, kernel.ncols(), solution, options, &progress)
        })
    }
}
