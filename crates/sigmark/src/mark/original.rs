use std::sync::{
    Arc, OnceLock,
    atomic::{AtomicUsize, Ordering},
};

use job::Job;
use mesh::TriMesh;
use mhb_core::{LaplacianKind, Spectrum, SpectrumError, SpectrumOptions, SpectrumStage};

use super::{ChipLayout, MarkError, MarkStage, Patch, PatchBasis, PatchCount, Patches};

/// What does not depend on the bits: the original mesh, its patches, and their bases.
///
/// Bases are large, 8 m bytes a vertex. They are computed when they are needed, patch by patch, and dropped again, unless
/// [`keep_bases`](Self::keep_bases) was called: worth it for who signs one model for many receivers, or judges many suspects.
/// Clones share everything, bases that are kept later too.
#[derive(Clone, Debug)]
pub struct Original {
    mesh: Arc<TriMesh>,
    layout: ChipLayout,
    patches: Arc<Patches>,
    laplacian: LaplacianKind,
    borders: Borders,
    /// The last eigenvalue of each basis, where it is known.
    expected: Option<Vec<f64>>,
    kept: Arc<OnceLock<Vec<PatchBasis>>>,
}

/// What harmonics do where a patch borders on another, or on what is unmarked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Borders {
    /// They end with any value (Neumann's condition), as in the paper: the mark jumps from patch to patch.
    Free,
    /// They are zero there (Dirichlet's condition): the mark is continuous.
    #[default]
    Fixed,
}

/// Two correct programs agree on eigenvalues far better than this, relative to them.
const SAME_EIGENVALUE: f64 = 1e-6;

/// Bytes of bases that every machine has room for.
const SMALL_BASES: usize = 1 << 30;

impl Original {
    /// Cuts a mesh into patches with room for `layout`.
    ///
    /// # Errors
    /// As [`Patches::cut`].
    pub fn cut(
        mesh: impl Into<Arc<TriMesh>>,
        layout: ChipLayout,
        count: PatchCount,
        job: &Job,
    ) -> Result<Self, MarkError> {
        job.begin(MarkStage::Patches)?;
        let mesh = mesh.into();
        let patches = Patches::cut(&mesh, layout.functions(), count, job)?;
        Ok(Self::with_patches(mesh, layout, patches))
    }

    /// A mesh whose patches are known.
    pub fn with_patches(mesh: impl Into<Arc<TriMesh>>, layout: ChipLayout, patches: Patches) -> Self {
        Self {
            mesh: mesh.into(),
            layout,
            patches: Arc::new(patches),
            laplacian: LaplacianKind::default(),
            borders: Borders::default(),
            expected: None,
            kept: Arc::default(),
        }
    }

    /// Takes the patches' harmonics from another Laplacian than the cotangent one. Bases kept so far are not used.
    pub fn with_laplacian(self, laplacian: LaplacianKind) -> Self {
        Self {
            laplacian,
            kept: Arc::default(),
            ..self
        }
    }

    /// Takes harmonics that behave otherwise at borders between patches. Bases kept so far are not used.
    pub fn with_borders(self, borders: Borders) -> Self {
        Self {
            borders,
            kept: Arc::default(),
            ..self
        }
    }

    /// The same original, for bases that have these [last eigenvalues](PatchBasis::last_eigenvalue), one a patch: any other is an
    /// error when it is computed or used.
    ///
    /// # Errors
    /// [`MarkError::Patches`] when there is not one a patch.
    pub fn expecting(&self, eigenvalues: Vec<f64>) -> Result<Self, MarkError> {
        self.check_patches(eigenvalues.len())?;
        Ok(Self {
            expected: Some(eigenvalues),
            ..self.clone()
        })
    }

    /// The mesh.
    pub fn mesh(&self) -> &Arc<TriMesh> {
        &self.mesh
    }

    /// Where the chips sit in each patch.
    pub fn layout(&self) -> &ChipLayout {
        &self.layout
    }

    /// Which Laplacian the patches' harmonics belong to.
    pub fn laplacian(&self) -> LaplacianKind {
        self.laplacian
    }

    /// What harmonics do at borders between patches.
    pub fn borders(&self) -> Borders {
        self.borders
    }

    /// The patches.
    pub fn patches(&self) -> &Patches {
        &self.patches
    }

    /// Bytes that all bases take together.
    pub fn basis_bytes(&self) -> usize {
        let vertices: usize = self.patches.iter().map(|patch| patch.vertices().len()).sum();
        vertices.saturating_mul(8).saturating_mul(self.layout.functions())
    }

    /// Computes the bases and keeps them until this value and its clones are dropped.
    ///
    /// # Errors
    /// As [`map_bases`](Self::map_bases).
    pub fn keep_bases(&self, job: &Job) -> Result<(), MarkError> {
        if self.kept.get().is_none() {
            let bases = self.compute_bases(|_, _, basis| basis, job)?;
            // Whoever was first has computed the same.
            let _ = self.kept.set(bases);
        }
        Ok(())
    }

    /// As [`keep_bases`](Self::keep_bases), if they take less than a gigabyte; others are computed anew for every pass over them.
    pub(crate) fn keep_small_bases(&self, job: &Job) -> Result<(), MarkError> {
        if self.basis_bytes() <= SMALL_BASES {
            self.keep_bases(job)?;
        }
        Ok(())
    }

    /// What `f` makes of the number of each patch, the patch and its basis, in the order of the patches.
    ///
    /// Patches are worked on side by side, so memory is that of as many bases as there are threads.
    ///
    /// # Errors
    /// When a basis can't be computed, or is not the [expected](Self::expecting) one; [`MarkError::Job`].
    pub fn map_bases<T: Send>(
        &self,
        f: impl Fn(usize, &Patch, &PatchBasis) -> T + Sync + Send,
        job: &Job,
    ) -> Result<Vec<T>, MarkError> {
        let Some(bases) = self.kept.get() else {
            return self.compute_bases(|i, patch, basis| f(i, patch, &basis), job);
        };
        let of = |i: usize| {
            self.check_basis(i, &bases[i])?;
            Ok(f(i, &self.patches[i], &bases[i]))
        };
        job.map(bases.len(), 1, of)?.into_iter().collect()
    }

    /// Computes every basis once and hands it over. The threads work on one patch if there is one, otherwise each on its own:
    /// a basis that waited for another's threads would be one more in memory.
    fn compute_bases<T: Send>(
        &self,
        f: impl Fn(usize, &Patch, PatchBasis) -> T + Sync + Send,
        job: &Job,
    ) -> Result<Vec<T>, MarkError> {
        job.begin(MarkStage::Harmonics)?;
        if let [patch] = &self.patches[..] {
            return Ok(vec![f(0, patch, self.basis(0, patch, job)?)]);
        }
        let alone = job.alone().quiet();
        let failed = AtomicUsize::new(usize::MAX);
        let of = |i: usize| {
            // After a failure no later patch is begun.
            if i > failed.load(Ordering::Relaxed) {
                return None;
            }
            let patch = &self.patches[i];
            let result = self.basis(i, patch, &alone).map(|basis| f(i, patch, basis));
            if result.is_err() {
                failed.fetch_min(i, Ordering::Relaxed);
            }
            Some(result)
        };
        let results = job.map_reported(self.patches.len(), 1, of)?;
        results.into_iter().flatten().collect()
    }

    fn basis(&self, index: usize, patch: &Patch, job: &Job) -> Result<PatchBasis, MarkError> {
        if patch.mesh().area() == 0.0 {
            return Err(MarkError::NoArea { patch: index });
        }
        let options = SpectrumOptions {
            count: self.layout.functions(),
            laplacian: self.laplacian,
            ..Default::default()
        };
        let job = job.within(SpectrumStage::Solving);
        let spectrum = match self.borders {
            Borders::Free => Spectrum::compute(patch.mesh(), &options, &job),
            Borders::Fixed => Spectrum::with_fixed(patch.mesh(), patch.at_border(), &options, &job),
        };
        let spectrum = spectrum.map_err(|source| match source {
            SpectrumError::Job(error) => MarkError::Job(error),
            source => MarkError::Spectrum { patch: index, source },
        })?;
        let basis = PatchBasis::new(patch, spectrum);
        self.check_basis(index, &basis)?;
        Ok(basis)
    }

    /// Whether a basis is the expected one.
    fn check_basis(&self, patch: usize, basis: &PatchBasis) -> Result<(), MarkError> {
        let found = basis.last_eigenvalue();
        match self.expected.as_ref().map(|expected| expected[patch]) {
            Some(expected) if (expected - found).abs() > SAME_EIGENVALUE * found.abs() => {
                Err(MarkError::BasisMismatch {
                    patch,
                    expected,
                    found,
                })
            }
            _ => Ok(()),
        }
    }

    /// Whether the harmonics are those of a mark.
    pub(crate) fn check_borders(&self, wanted: Borders) -> Result<(), MarkError> {
        let found = self.borders;
        if found == wanted {
            return Ok(());
        }
        Err(MarkError::Borders { found, wanted })
    }

    /// Whether there is one value a patch.
    pub(crate) fn check_patches(&self, given: usize) -> Result<(), MarkError> {
        let patches = self.patches.len();
        if given == patches {
            return Ok(());
        }
        Err(MarkError::Patches { given, patches })
    }
}
