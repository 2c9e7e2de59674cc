use std::sync::Arc;

use job::Job;

use super::{Chip, ChipOrder, MarkError, Original, Patch, PatchBasis, Strength, strength::distortion};

/// Where a mark lies in an original, in which order, and how strong it is in each patch, whatever its bits are.
#[derive(Clone, Debug)]
pub struct MarkLayout {
    original: Arc<Original>,
    alphas: Vec<f64>,
    order: ChipOrder,
}

impl MarkLayout {
    /// A mark with strength α for each patch, α belonging to unit area.
    ///
    /// # Errors
    /// [`MarkError::Patches`] when there is not one α a patch.
    pub fn new(original: Arc<Original>, alphas: Vec<f64>) -> Result<Self, MarkError> {
        original.check_patches(alphas.len())?;
        Ok(Self {
            original,
            alphas,
            order: ChipOrder::Natural,
        })
    }

    /// A mark of a strength that was asked for.
    ///
    /// # Errors
    /// As [`Strength::alphas`].
    pub fn with_strength(original: Arc<Original>, strength: Strength) -> Result<Self, MarkError> {
        let alphas = strength.alphas(&original)?;
        Self::new(original, alphas)
    }

    /// The same places and strengths, with the bits in another order.
    pub fn with_order(self, order: ChipOrder) -> Self {
        Self { order, ..self }
    }

    /// The chips of a patch, by its number from 0.
    pub fn chips(&self, patch: usize) -> Vec<Chip> {
        self.order.chips(self.original.layout(), patch)
    }

    /// The original with its patches.
    pub fn original(&self) -> &Arc<Original> {
        &self.original
    }

    /// α of each patch.
    pub fn alphas(&self) -> &[f64] {
        &self.alphas
    }

    /// α when it is the same for every patch, else its root mean square over the marked surface.
    pub fn alpha(&self) -> f64 {
        let areas = self.original.patches().iter().map(|patch| patch.mesh().area());
        let squares = areas.clone().zip(&self.alphas);
        let square: f64 = squares.map(|(area, alpha)| area * alpha * alpha).sum();
        (square / areas.sum::<f64>()).sqrt()
    }

    /// Root mean square displacement of the marked surface, as a fraction of the bounding box's diagonal.
    pub fn distortion_rms(&self) -> f64 {
        distortion(&self.original, &self.alphas)
    }

    /// Writes bits (eq. 26).
    ///
    /// # Errors
    /// [`MarkError::Bits`]; as [`Original::map_bases`].
    pub fn write(&self, bits: &[bool], job: &Job) -> Result<Written, MarkError> {
        let (layout, given) = (self.original.layout(), bits.len());
        if given != layout.bits() {
            let wanted = layout.bits();
            return Err(MarkError::Bits { given, wanted });
        }
        let of_patch = |index: usize, _: &Patch, basis: &PatchBasis| {
            let added = basis.displacement(&self.chips(index), bits, self.alphas[index]);
            (added, basis.last_eigenvalue())
        };
        let mut written = Written {
            displacement: vec![[0.0; 3]; self.original.mesh().vertex_count()],
            last_eigenvalues: Vec::new(),
        };
        let patches = self.original.map_bases(of_patch, job)?;
        for (patch, (added, eigenvalue)) in self.original.patches().iter().zip(patches) {
            for (&v, value) in patch.vertices().iter().zip(added) {
                written.displacement[v as usize] = value;
            }
            written.last_eigenvalues.push(eigenvalue);
        }
        Ok(written)
    }
}

/// A mark as it was written.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Written {
    /// What it adds to the positions of the whole mesh, #V; zero outside the patches.
    pub displacement: Vec<[f64; 3]>,
    /// [Of each patch's basis](PatchBasis::last_eigenvalue); who reads the mark [expects](Original::expecting) the same.
    pub last_eigenvalues: Vec<f64>,
}

impl Written {
    /// The marked positions, #V.
    pub fn positions(&self, original: &Original) -> Vec<[f64; 3]> {
        let pairs = original.mesh().positions().iter().zip(&self.displacement);
        pairs
            .map(|(p, d)| std::array::from_fn(|axis| p[axis] + d[axis]))
            .collect()
    }
}
