use std::sync::Arc;

use job::Job;
use sigmark::mark::{ChipLayout, CoefficientDetector, Detector, MarkLayout, Original};

use crate::{
    Algorithm, AlgorithmId, BaselineError, DetectorId, IdentifiedDetector, Prepared, Reference, Subject,
    algorithm::{check_alpha, check_bits, check_vertices},
};

/// Manifold harmonics, sigmark's own algorithm, read by the paper's detector and by any others. α is the one that the paper prints, in
/// the mesh's unit of length.
#[derive(Clone, Debug)]
pub struct Mhb {
    chip_rate: usize,
    detectors: Detectors,
}

/// Makes a detector for marks of a layout.
pub type MakeDetector = fn(&Arc<MarkLayout>) -> Box<dyn Detector>;

type Detectors = Vec<(DetectorId, MakeDetector)>;

impl Default for Mhb {
    /// The paper's.
    fn default() -> Self {
        Self {
            chip_rate: 3,
            detectors: vec![(DetectorId::PAPER, |layout| {
                Box::new(CoefficientDetector::new(layout))
            })],
        }
    }
}

impl Mhb {
    /// Lets another detector read the marks too.
    pub fn detector(mut self, id: DetectorId, detector: MakeDetector) -> Self {
        self.detectors.push((id, detector));
        self
    }

    /// c, how often each bit is repeated in a patch; 3 by default.
    pub fn chip_rate(self, rate: usize) -> Self {
        Self {
            chip_rate: rate,
            ..self
        }
    }
}

impl Algorithm for Mhb {
    fn id(&self) -> AlgorithmId {
        AlgorithmId::MHB
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        let detectors: Vec<String> = self.detectors.iter().map(|(id, _)| id.to_string()).collect();
        vec![
            ("chip rate", self.chip_rate.to_string()),
            ("detectors", detectors.join(", ")),
        ]
    }

    fn name(&self) -> String {
        "MHBs".into()
    }

    fn reference(&self) -> Reference {
        Reference::Original
    }

    fn prepare(&self, subject: &Subject<'_>, job: &Job) -> Result<Box<dyn Prepared>, BaselineError> {
        check_vertices(subject.patches.labels().len(), subject.mesh.vertex_count())?;
        let layout = ChipLayout::new(subject.bits, self.chip_rate)?;
        let original = Original::with_patches(subject.mesh.clone(), layout, subject.patches.clone());
        original.keep_bases(job)?;
        Ok(Box::new(PreparedMhb {
            original: Arc::new(original),
            detectors: self.detectors.clone(),
        }))
    }
}

#[derive(Debug)]
struct PreparedMhb {
    original: Arc<Original>,
    detectors: Detectors,
}

impl PreparedMhb {
    /// Marks of the paper's α, which is over unit area for each patch.
    fn layout(&self, alpha: f64) -> Result<Arc<MarkLayout>, BaselineError> {
        let patches = self.original.patches().iter();
        let alphas = patches.map(|patch| alpha / patch.mesh().area().sqrt());
        let layout = MarkLayout::new(Arc::clone(&self.original), alphas.collect())?;
        Ok(Arc::new(layout))
    }
}

impl Prepared for PreparedMhb {
    fn patches(&self) -> usize {
        self.original.patches().len()
    }

    fn functions(&self) -> usize {
        self.original.layout().functions()
    }

    fn embed(&self, bits: &[bool], alpha: f64, job: &Job) -> Result<Vec<[f64; 3]>, BaselineError> {
        check_bits(bits.len(), self.original.layout().bits())?;
        check_alpha(alpha)?;
        let written = self.layout(alpha)?.write(bits, job)?;
        Ok(written.positions(&self.original))
    }

    fn detectors(&self, alpha: f64) -> Result<Vec<IdentifiedDetector<'_>>, BaselineError> {
        check_alpha(alpha)?;
        let layout = self.layout(alpha)?;
        let detectors = self.detectors.iter();
        Ok(detectors.map(|(id, make)| (id.clone(), make(&layout))).collect())
    }
}
