use std::ops::ControlFlow;

use mesh::TriMesh;
use mhb_core::{Phase, Spectrum, SpectrumError, SpectrumOptions};
use rayon::prelude::*;

use crate::{ChipLayout, Observer, PatchBasis, SigmarkError, Stage, partition_into_patches};

/// Everything about an original that does not depend on a signature: the mesh, its patches and their bases.
#[derive(Debug)]
pub struct PreparedOriginal {
    mesh: TriMesh,
    layout: ChipLayout,
    bases: Vec<PatchBasis>,
    unmarked_vertices: usize,
}

impl PreparedOriginal {
    /// Cuts a mesh into patches and computes the m manifold harmonics of each that `layout` needs.
    ///
    /// The result is the same for any number of threads. With several patches they are computed side by side, so memory
    /// is that of `threads` patches beyond the bases themselves (8 · #V · m bytes).
    ///
    /// # Errors
    /// When the mesh can't be cut into patches or a basis can't be computed.
    pub fn prepare(
        mesh: &TriMesh,
        layout: ChipLayout,
        threads: usize,
        observer: &dyn Observer,
    ) -> Result<Self, SigmarkError> {
        observer.stage(Stage::Patches);
        let patches = partition_into_patches(mesh, layout.functions())?;
        observer.stage(Stage::Harmonics);
        let bases = bases(patches.marked, layout.functions(), threads.max(1), observer)?;
        Ok(Self {
            mesh: mesh.clone(),
            layout,
            bases,
            unmarked_vertices: patches.unmarked_vertices,
        })
    }

    /// Whether the bases were computed for this layout.
    pub(crate) fn check_layout(&self, wanted: &ChipLayout) -> Result<(), SigmarkError> {
        if self.layout == *wanted {
            return Ok(());
        }
        Err(SigmarkError::Layout {
            prepared: self.layout,
            wanted: *wanted,
        })
    }

    /// The original mesh.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// Where the chips sit in each patch.
    pub fn layout(&self) -> &ChipLayout {
        &self.layout
    }

    /// The patches with their bases.
    pub fn bases(&self) -> &[PatchBasis] {
        &self.bases
    }

    /// Vertices of components too small to carry the signature.
    pub fn unmarked_vertices(&self) -> usize {
        self.unmarked_vertices
    }

    /// What a signature adds to the positions of the whole mesh; zero outside the patches. One α a patch.
    pub fn displacement(&self, signature: &[bool], alphas: &[f64]) -> Vec<[f64; 3]> {
        let mut displacement = vec![[0.0; 3]; self.mesh.vertex_count()];
        for (basis, &alpha) in self.bases.iter().zip(alphas) {
            let added = basis.displacement(&self.layout, signature, alpha);
            for (&v, d) in basis.patch().vertices().iter().zip(added) {
                displacement[v as usize] = d;
            }
        }
        displacement
    }
}

/// The bases of all patches, in their order.
fn bases(
    patches: Vec<crate::Patch>,
    functions: usize,
    threads: usize,
    observer: &dyn Observer,
) -> Result<Vec<PatchBasis>, SigmarkError> {
    let count = patches.len();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let threads_each = if count == 1 { threads } else { 1 };
    let basis = |(index, patch): (usize, crate::Patch)| {
        if patch.mesh().area() == 0.0 {
            return Err(SigmarkError::NoArea { patch: index });
        }
        let options = SpectrumOptions {
            count: functions,
            threads: threads_each,
            ..SpectrumOptions::default()
        };
        let watch = |phase: Phase, fraction: f64| {
            if count == 1 && phase == Phase::Solving {
                observer.fraction(fraction);
            }
            if observer.cancelled() {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let spectrum =
            Spectrum::compute_observed(patch.mesh(), &options, &watch).map_err(|source| match source {
                SpectrumError::Cancelled => SigmarkError::Cancelled,
                source => SigmarkError::Spectrum { patch: index, source },
            })?;
        let done = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        observer.fraction(done as f64 / count as f64);
        Ok(PatchBasis::new(patch, spectrum))
    };
    if count == 1 || threads == 1 {
        return patches.into_iter().enumerate().map(basis).collect();
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|_| SigmarkError::Threads { threads })?;
    pool.install(|| patches.into_par_iter().enumerate().map(basis).collect())
}
