use std::sync::{
    Arc, OnceLock,
    atomic::{AtomicUsize, Ordering},
};

use job::Job;
use mesh::TriMesh;
use mhb_core::{LaplacianKind, Spectrum, SpectrumError, SpectrumOptions, SpectrumStage};

use super::{MarkError, MarkStage, Patch, PatchBasis, PatchCount, Patches, Pool, window::window};

/// What does not depend on the bits: the original mesh, its patches, and their bases.
///
/// Bases are large, 8 m bytes a vertex of a patch with m harmonics. They are computed when they are needed, patch by patch, and dropped again, unless
/// [`keep_bases`](Self::keep_bases) was called: worth it for who signs one model for many receivers. Readers keep a gigabyte of them.
/// Clones share everything, bases that are kept later too.
#[derive(Clone, Debug)]
pub struct Original {
    mesh: Arc<TriMesh>,
    patches: Arc<Patches>,
    /// m of each patch.
    functions: Arc<[usize]>,
    laplacian: LaplacianKind,
    borders: Borders,
    /// The last eigenvalue of each basis, where it is known, and how near it has to be.
    expected: Option<(Vec<f64>, f64)>,
    /// For each patch the harmonics that are turned into their opposites; none where all are as they come.
    opposite: Option<Arc<[Vec<bool>]>>,
    kept: Arc<KeptBases>,
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
    /// They end with any value, and are multiplied by a window that is zero there: the mark is continuous, and the basis not orthonormal. To compare
    /// with; no certificate has it.
    Windowed,
}

/// Bases that were computed, as far as there is room for them.
#[derive(Debug)]
struct KeptBases {
    of_patches: Vec<OnceLock<PatchBasis>>,
    /// Bytes that bases may still take.
    room: AtomicUsize,
}

/// Two correct programs agree on eigenvalues far better than this, relative to them.
const SAME_EIGENVALUE: f64 = 1e-6;

/// What rounding to 14 bits makes of eigenvalues, and no more.
const LIKE_EIGENVALUE: f64 = 0.05;

/// Bytes of bases that every machine has room for.
const SMALL_BASES: usize = 1 << 30;

impl Original {
    /// Cuts a mesh into patches with so many harmonics each, as the paper does.
    ///
    /// # Errors
    /// As [`Patches::cut`].
    pub fn cut(
        mesh: impl Into<Arc<TriMesh>>,
        functions: usize,
        count: PatchCount,
        job: &Job,
    ) -> Result<Self, MarkError> {
        job.begin(MarkStage::Patches)?;
        let mesh = mesh.into();
        let patches = Patches::cut(&mesh, functions, count, job)?;
        let functions = vec![functions; patches.len()];
        Self::with_patches(mesh, patches, functions)
    }

    /// Cuts a mesh into patches whose chips are pooled for so many bits.
    ///
    /// # Errors
    /// As [`Pool::cut`].
    pub fn pooled(
        mesh: impl Into<Arc<TriMesh>>,
        bits: usize,
        pool: Pool,
        job: &Job,
    ) -> Result<Self, MarkError> {
        job.begin(MarkStage::Patches)?;
        let mesh = mesh.into();
        let (patches, functions) = pool.cut(&mesh, bits, job)?;
        Self::with_patches(mesh, patches, functions)
    }

    /// A mesh whose patches are known, and how many harmonics each has.
    ///
    /// # Errors
    /// [`MarkError::Patches`] when there is not one number a patch.
    pub fn with_patches(
        mesh: impl Into<Arc<TriMesh>>,
        patches: Patches,
        functions: Vec<usize>,
    ) -> Result<Self, MarkError> {
        let original = Self {
            mesh: mesh.into(),
            kept: KeptBases::none(patches.len()),
            patches: Arc::new(patches),
            functions: functions.into(),
            laplacian: LaplacianKind::default(),
            borders: Borders::default(),
            expected: None,
            opposite: None,
        };
        original.check_patches(original.functions.len())?;
        Ok(original)
    }

    /// Takes the patches' harmonics from another Laplacian than the cotangent one. Bases kept so far are not used.
    pub fn with_laplacian(self, laplacian: LaplacianKind) -> Self {
        Self {
            laplacian,
            kept: KeptBases::none(self.patches.len()),
            ..self
        }
    }

    /// Takes harmonics that behave otherwise at borders between patches. Bases kept so far are not used.
    pub fn with_borders(self, borders: Borders) -> Self {
        Self {
            borders,
            kept: KeptBases::none(self.patches.len()),
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
            expected: Some((eigenvalues, SAME_EIGENVALUE)),
            ..self.clone()
        })
    }

    /// The same original, for bases like those of another file with this geometry: of nearly these last eigenvalues, and with some
    /// harmonics turned into their opposites. Bases kept so far are not used.
    ///
    /// # Errors
    /// [`MarkError::Patches`] when there is not one of either a patch.
    pub(crate) fn resembling(self, eigenvalues: Vec<f64>, opposite: &[Vec<bool>]) -> Result<Self, MarkError> {
        self.check_patches(eigenvalues.len())?;
        self.check_patches(opposite.len())?;
        Ok(Self {
            expected: Some((eigenvalues, LIKE_EIGENVALUE)),
            opposite: Some(opposite.into()),
            kept: KeptBases::none(self.patches.len()),
            ..self
        })
    }

    /// The mesh.
    pub fn mesh(&self) -> &Arc<TriMesh> {
        &self.mesh
    }

    /// m of each patch, the number of its harmonics.
    pub fn functions(&self) -> &[usize] {
        &self.functions
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
        let bytes = (0..self.patches.len()).map(|i| self.bytes_of_basis(i));
        bytes.fold(0, usize::saturating_add)
    }

    fn bytes_of_basis(&self, patch: usize) -> usize {
        let vertices = self.patches[patch].vertices().len();
        vertices.saturating_mul(8).saturating_mul(self.functions[patch])
    }

    /// Computes the bases and keeps them until this value and its clones are dropped.
    ///
    /// # Errors
    /// As [`map_bases`](Self::map_bases).
    pub fn keep_bases(&self, job: &Job) -> Result<(), MarkError> {
        self.kept.room.store(usize::MAX, Ordering::Relaxed);
        self.map_bases(|_, _, _| (), job)?;
        Ok(())
    }

    /// From now on keeps the bases that are computed, up to a gigabyte; others are computed anew for every pass over them.
    pub(crate) fn keep_a_gigabyte(&self) {
        let kept: usize = (0..self.patches.len())
            .filter(|&i| self.kept.of_patches[i].get().is_some())
            .map(|i| self.bytes_of_basis(i))
            .sum();
        let room = SMALL_BASES.saturating_sub(kept);
        self.kept.room.fetch_max(room, Ordering::Relaxed);
    }

    /// Whether the bases of some patches are kept, or will be once they are computed.
    pub(crate) fn keeps(&self, patches: &[usize]) -> bool {
        let missing = patches
            .iter()
            .filter(|&&i| self.kept.of_patches[i].get().is_none());
        let bytes: usize = missing.map(|&i| self.bytes_of_basis(i)).sum();
        bytes <= self.kept.room.load(Ordering::Relaxed)
    }

    /// What `f` makes of the number of each patch, the patch and its basis, in the order of the patches.
    ///
    /// Patches are worked on side by side, so memory is that of as many bases as there are threads, besides those that are kept.
    ///
    /// # Errors
    /// When a basis can't be computed, or is not the [expected](Self::expecting) one; [`MarkError::Job`].
    pub fn map_bases<T: Send>(
        &self,
        f: impl Fn(usize, &Patch, &PatchBasis) -> T + Sync + Send,
        job: &Job,
    ) -> Result<Vec<T>, MarkError> {
        let all: Vec<usize> = (0..self.patches.len()).collect();
        self.map_bases_of(&all, f, job)
    }

    /// As [`map_bases`](Self::map_bases), of some patches, which are numbered from 0 in ascending order.
    ///
    /// The threads work on one basis if only one is missing, otherwise each on its own: one that waited for another's threads would be
    /// one more in memory.
    ///
    /// # Errors
    /// As [`map_bases`](Self::map_bases).
    pub(crate) fn map_bases_of<T: Send>(
        &self,
        chosen: &[usize],
        f: impl Fn(usize, &Patch, &PatchBasis) -> T + Sync + Send,
        job: &Job,
    ) -> Result<Vec<T>, MarkError> {
        let missing = chosen
            .iter()
            .filter(|&&i| self.kept.of_patches[i].get().is_none());
        let missing = missing.count();
        if missing > 0 {
            job.begin(MarkStage::Harmonics)?;
        }
        if let [i] = chosen {
            return Ok(vec![self.with_basis(*i, &f, job)?]);
        }
        let alone = job.alone().quiet();
        let failed = AtomicUsize::new(usize::MAX);
        let of = |place: usize| {
            // After a failure no later patch is begun.
            if place > failed.load(Ordering::Relaxed) {
                return None;
            }
            let result = self.with_basis(chosen[place], &f, &alone);
            if result.is_err() {
                failed.fetch_min(place, Ordering::Relaxed);
            }
            Some(result)
        };
        let results = match missing {
            0 => job.map(chosen.len(), 1, of)?,
            _ => job.map_reported(chosen.len(), 1, of)?,
        };
        results.into_iter().flatten().collect()
    }

    /// What `f` makes of a patch and its basis, which is computed if it isn't kept, and kept if there is room.
    fn with_basis<T>(
        &self,
        i: usize,
        f: impl Fn(usize, &Patch, &PatchBasis) -> T,
        job: &Job,
    ) -> Result<T, MarkError> {
        let patch = &self.patches[i];
        if let Some(basis) = self.kept.of_patches[i].get() {
            self.check_basis(i, basis)?;
            return Ok(f(i, patch, basis));
        }
        let basis = self.basis(i, patch, job)?;
        let bytes = self.bytes_of_basis(i);
        let take = |room: usize| room.checked_sub(bytes);
        let room = &self.kept.room;
        Ok(
            match room.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take) {
                // Whoever was first has computed the same.
                Ok(_) => f(i, patch, self.kept.of_patches[i].get_or_init(|| basis)),
                Err(_) => f(i, patch, &basis),
            },
        )
    }

    fn basis(&self, index: usize, patch: &Patch, job: &Job) -> Result<PatchBasis, MarkError> {
        if patch.mesh().area() == 0.0 {
            return Err(MarkError::NoArea { patch: index });
        }
        let options = SpectrumOptions {
            count: self.functions[index],
            laplacian: self.laplacian,
            ..Default::default()
        };
        let job = job.within(SpectrumStage::Solving);
        let spectrum = match self.borders {
            Borders::Free => Spectrum::compute(patch.mesh(), &options, &job),
            Borders::Fixed => Spectrum::with_fixed(patch.mesh(), patch.at_border(), &options, &job),
            Borders::Windowed => Spectrum::compute(patch.mesh(), &options, &job)
                .map(|spectrum| spectrum.windowed(&window(patch))),
        };
        let spectrum = spectrum.map_err(|source| match source {
            SpectrumError::Job(error) => MarkError::Job(error),
            source => MarkError::Spectrum { patch: index, source },
        })?;
        let spectrum = match &self.opposite {
            Some(opposite) => spectrum.with_opposites(&opposite[index]),
            None => spectrum,
        };
        let basis = PatchBasis::new(spectrum);
        self.check_basis(index, &basis)?;
        Ok(basis)
    }

    /// Whether a basis is the expected one.
    fn check_basis(&self, patch: usize, basis: &PatchBasis) -> Result<(), MarkError> {
        let found = basis.last_eigenvalue();
        let Some((expected, tolerance)) = &self.expected else {
            return Ok(());
        };
        let expected = expected[patch];
        match (expected - found).abs() > tolerance * found.abs() {
            true => Err(MarkError::BasisMismatch {
                patch,
                expected,
                found,
            }),
            false => Ok(()),
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

impl KeptBases {
    fn none(patches: usize) -> Arc<Self> {
        Arc::new(Self {
            of_patches: (0..patches).map(|_| OnceLock::new()).collect(),
            room: AtomicUsize::new(0),
        })
    }
}
