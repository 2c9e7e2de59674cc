use std::fmt::Debug;

use sigmark::{ChipLayout, CoefficientDetector, Detector, Original, Registered, SoftBits, Work};

use crate::{
    Algorithm, BaselineError, Prepared, Reference, Subject,
    algorithm::{check_alpha, check_bits, check_vertices},
};

/// Manifold harmonics, sigmark's own algorithm, with any of its detectors. α is the one that the paper prints, in the mesh's unit of length.
#[derive(Clone, Debug)]
pub struct Mhb<D = CoefficientDetector> {
    name: String,
    chip_rate: usize,
    detector: D,
}

impl Default for Mhb {
    /// The paper's.
    fn default() -> Self {
        Self::new("MHBs", CoefficientDetector)
    }
}

impl<D> Mhb<D> {
    /// Manifold harmonics read by another detector, under another name.
    pub fn new(name: impl Into<String>, detector: D) -> Self {
        Self {
            name: name.into(),
            chip_rate: 3,
            detector,
        }
    }

    /// c, how often each bit is repeated in a patch; 3 by default.
    pub fn chip_rate(self, rate: usize) -> Self {
        Self {
            chip_rate: rate,
            ..self
        }
    }
}

impl<D: Detector + Clone + Debug + Send + 'static> Algorithm for Mhb<D> {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn reference(&self) -> Reference {
        Reference::Original
    }

    fn prepare(&self, subject: &Subject<'_>, work: Work<'_>) -> Result<Box<dyn Prepared>, BaselineError> {
        check_vertices(subject.patches.labels().len(), subject.mesh.vertex_count())?;
        let layout = ChipLayout::new(subject.bits, self.chip_rate)?;
        let original = Original::with_patches(subject.mesh, layout, subject.patches.clone());
        original.keep_bases(work)?;
        Ok(Box::new(PreparedMhb {
            original,
            detector: self.detector.clone(),
        }))
    }
}

#[derive(Debug)]
struct PreparedMhb<D> {
    original: Original,
    detector: D,
}

impl<D> PreparedMhb<D> {
    /// The paper's α over unit area, for each patch.
    fn alphas(&self, alpha: f64) -> Vec<f64> {
        let patches = self.original.patches().iter();
        patches.map(|patch| alpha / patch.mesh().area().sqrt()).collect()
    }
}

impl<D: Detector + Debug + Send> Prepared for PreparedMhb<D> {
    fn patches(&self) -> usize {
        self.original.patches().len()
    }

    fn functions(&self) -> usize {
        self.original.layout().functions()
    }

    fn embed(&self, bits: &[bool], alpha: f64, work: Work<'_>) -> Result<Vec<[f64; 3]>, BaselineError> {
        check_bits(bits.len(), self.original.layout().bits())?;
        check_alpha(alpha)?;
        let displacement = self.original.displacement(bits, &self.alphas(alpha), work)?;
        let marked = self.original.mesh().positions().iter().zip(displacement);
        Ok(marked
            .map(|(p, d)| std::array::from_fn(|axis| p[axis] + d[axis]))
            .collect())
    }

    fn extract(&self, suspect: &Registered, alpha: f64, work: Work<'_>) -> Result<SoftBits, BaselineError> {
        check_vertices(suspect.positions.len(), self.original.mesh().vertex_count())?;
        check_alpha(alpha)?;
        let alphas = self.alphas(alpha);
        Ok(self.detector.detect(&self.original, &alphas, suspect, work)?)
    }
}
