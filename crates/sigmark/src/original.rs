use std::sync::{
    Mutex, OnceLock, PoisonError,
    atomic::{AtomicUsize, Ordering},
};

use job::Job;
use mesh::TriMesh;
use mhb_core::{LaplacianKind, Spectrum, SpectrumOptions};

use crate::{ChipLayout, Observer, Patch, PatchBasis, PatchCount, Patches, SigmarkError, Stage};

/// Threads to work with, and who watches. Results do not depend on either.
#[derive(Clone, Copy)]
pub struct Work<'a> {
    /// At least 1.
    pub threads: usize,
    /// Sees the progress and may stop it.
    pub observer: &'a dyn Observer,
}

impl Default for Work<'_> {
    /// One thread, nobody watching.
    fn default() -> Self {
        Self {
            threads: 1,
            observer: &(),
        }
    }
}

/// What does not depend on a signature: the original mesh, its patches, and their bases.
///
/// Bases are large, 8 m bytes a vertex. They are computed when they are needed, patch by patch, and dropped again, unless
/// [`keep_bases`](Self::keep_bases) was called: worth it for who signs one model for many receivers, or judges many suspects.
#[derive(Debug)]
pub struct Original {
    mesh: TriMesh,
    layout: ChipLayout,
    patches: Patches,
    laplacian: LaplacianKind,
    kept: OnceLock<Vec<PatchBasis>>,
}

impl Original {
    /// Cuts a mesh into patches with room for `layout`.
    ///
    /// # Errors
    /// As [`Patches::cut`].
    pub fn cut(
        mesh: &TriMesh,
        layout: ChipLayout,
        count: PatchCount,
        work: Work<'_>,
    ) -> Result<Self, SigmarkError> {
        work.observer.stage(Stage::Patches);
        let patches = Patches::cut(mesh, layout.functions(), count, work.threads.max(1))?;
        Ok(Self::with_patches(mesh, layout, patches))
    }

    /// A mesh whose patches are known.
    pub fn with_patches(mesh: &TriMesh, layout: ChipLayout, patches: Patches) -> Self {
        Self {
            mesh: mesh.clone(),
            layout,
            patches,
            laplacian: LaplacianKind::default(),
            kept: OnceLock::new(),
        }
    }

    /// Takes the patches' harmonics from another Laplacian than the cotangent one. Bases kept so far are dropped.
    pub fn with_laplacian(self, laplacian: LaplacianKind) -> Self {
        Self {
            laplacian,
            kept: OnceLock::new(),
            ..self
        }
    }

    /// The mesh.
    pub fn mesh(&self) -> &TriMesh {
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

    /// The patches.
    pub fn patches(&self) -> &Patches {
        &self.patches
    }

    /// Bytes that all bases take together.
    pub fn basis_bytes(&self) -> usize {
        let vertices: usize = self.patches.iter().map(|patch| patch.vertices().len()).sum();
        vertices.saturating_mul(8).saturating_mul(self.layout.functions())
    }

    /// Computes the bases and keeps them until this value is dropped.
    ///
    /// # Errors
    /// As [`map_bases`](Self::map_bases).
    pub fn keep_bases(&self, work: Work<'_>) -> Result<(), SigmarkError> {
        if self.kept.get().is_none() {
            let bases = self.compute_bases(work, |_, _, basis| basis)?;
            // Whoever was first has computed the same.
            let _ = self.kept.set(bases);
        }
        Ok(())
    }

    /// What `f` makes of the number of each patch, the patch and its basis, in the order of the patches.
    ///
    /// Patches are worked on side by side, so memory is that of `threads` bases.
    ///
    /// # Errors
    /// When a basis can't be computed; [`SigmarkError::Cancelled`] when the observer stopped it.
    pub fn map_bases<T: Send>(
        &self,
        work: Work<'_>,
        f: impl Fn(usize, &Patch, &PatchBasis) -> T + Sync,
    ) -> Result<Vec<T>, SigmarkError> {
        match self.kept.get() {
            Some(bases) => Ok(self
                .patches
                .iter()
                .zip(bases)
                .enumerate()
                .map(|(i, (patch, b))| f(i, patch, b))
                .collect()),
            None => self.compute_bases(work, |i, patch, basis| f(i, patch, &basis)),
        }
    }

    /// What a signature adds to the positions of the whole mesh; zero outside the patches. One α a patch.
    ///
    /// # Errors
    /// As [`map_bases`](Self::map_bases).
    pub fn displacement(
        &self,
        signature: &[bool],
        alphas: &[f64],
        work: Work<'_>,
    ) -> Result<Vec<[f64; 3]>, SigmarkError> {
        let added = self.map_bases(work, |i, _, basis| {
            basis.displacement(&self.layout, signature, alphas[i])
        })?;
        Ok(self.scatter(added))
    }

    /// Joins fields over the patches to one over the mesh; zero outside.
    pub(crate) fn scatter(&self, fields: Vec<Vec<[f64; 3]>>) -> Vec<[f64; 3]> {
        let mut whole = vec![[0.0; 3]; self.mesh.vertex_count()];
        for (patch, field) in self.patches.iter().zip(fields) {
            for (&v, value) in patch.vertices().iter().zip(field) {
                whole[v as usize] = value;
            }
        }
        whole
    }

    /// Computes every basis once and hands it over.
    ///
    /// Plain threads, each with one patch at a time: a work-stealing pool would begin further patches while one waits.
    fn compute_bases<T: Send>(
        &self,
        work: Work<'_>,
        f: impl Fn(usize, &Patch, PatchBasis) -> T + Sync,
    ) -> Result<Vec<T>, SigmarkError> {
        work.observer.stage(Stage::Harmonics);
        let count = self.patches.len();
        let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let results: Mutex<Vec<Option<Result<T, SigmarkError>>>> =
            Mutex::new((0..count).map(|_| None).collect());
        let worker = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(patch) = self.patches.get(index) else {
                    break;
                };
                let result = self.basis(index, patch, work).map(|basis| f(index, patch, basis));
                if result.is_err() {
                    next.store(count, Ordering::Relaxed);
                }
                let done = 1 + done.fetch_add(1, Ordering::Relaxed);
                work.observer.fraction(done as f64 / count as f64);
                results.lock().unwrap_or_else(PoisonError::into_inner)[index] = Some(result);
            }
        };
        let threads = work.threads.clamp(1, count);
        std::thread::scope(|scope| {
            for _ in 1..threads {
                // With fewer threads than wanted the work takes longer, that is all.
                if std::thread::Builder::new().spawn_scoped(scope, worker).is_err() {
                    break;
                }
            }
            worker();
        });
        // After a failure later patches may be missing, never earlier ones.
        results
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
            .into_iter()
            .flatten()
            .collect()
    }

    /// The threads work on one patch if there is one, otherwise each on its own.
    fn basis(&self, index: usize, patch: &Patch, work: Work<'_>) -> Result<PatchBasis, SigmarkError> {
        if patch.mesh().area() == 0.0 {
            return Err(SigmarkError::NoArea { patch: index });
        }
        let threads = if self.patches.len() == 1 { work.threads } else { 1 };
        let options = SpectrumOptions {
            count: self.layout.functions(),
            laplacian: self.laplacian,
            ..Default::default()
        };
        let spectrum = Spectrum::compute(patch.mesh(), &options, &Job::new(threads))
            .map_err(|source| SigmarkError::Spectrum { patch: index, source })?;
        if work.observer.cancelled() {
            return Err(SigmarkError::Cancelled);
        }
        Ok(PatchBasis::new(patch, spectrum))
    }

    /// Whether the patches were cut for this layout.
    pub(crate) fn check_layout(&self, wanted: &ChipLayout) -> Result<(), SigmarkError> {
        if self.layout == *wanted {
            return Ok(());
        }
        Err(SigmarkError::Layout {
            prepared: self.layout,
            wanted: *wanted,
        })
    }
}
