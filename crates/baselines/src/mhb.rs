use std::sync::Arc;

use job::Job;
use sigmark::mark::{
    Borders, ChipLayout, ChipPlan, CoefficientDetector, Detector, MarkLayout, Original, ReadingMethod,
    Registered, SoftBits,
};

use crate::{
    Algorithm, AlgorithmId, BaselineError, DetectorId, Prepared, Reference, Subject,
    algorithm::{check_alpha, check_bits, check_vertices},
};

/// Manifold harmonics, sigmark's own algorithm, read by the paper's rule and by any other methods. α is the one that the paper prints, in
/// the mesh's unit of length.
#[derive(Clone, Debug)]
pub struct Mhb {
    chip_rate: usize,
    methods: Methods,
}

/// Makes a method for marks of a layout.
pub type MakeMethod = fn(&Arc<MarkLayout>) -> ReadingMethod;

type Methods = Vec<(DetectorId, MakeMethod)>;

impl Default for Mhb {
    /// The paper's.
    fn default() -> Self {
        Self {
            chip_rate: 3,
            methods: Vec::new(),
        }
    }
}

impl Mhb {
    /// Lets another method read the marks too.
    pub fn method(mut self, id: DetectorId, method: MakeMethod) -> Self {
        self.methods.push((id, method));
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
        let methods: Vec<String> = self.methods.iter().map(|(id, _)| id.to_string()).collect();
        vec![
            ("chip rate", self.chip_rate.to_string()),
            ("methods", methods.join(", ")),
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
        let functions = vec![layout.functions(); subject.patches.len()];
        let original = Original::with_patches(subject.mesh.clone(), subject.patches.clone(), functions)?;
        let original = original.with_borders(Borders::Free);
        original.keep_bases(job)?;
        Ok(Box::new(PreparedMhb {
            original: Arc::new(original),
            layout,
            methods: self.methods.clone(),
        }))
    }
}

#[derive(Debug)]
struct PreparedMhb {
    original: Arc<Original>,
    layout: ChipLayout,
    methods: Methods,
}

impl PreparedMhb {
    /// Marks of the paper's α, which is over unit area for each patch.
    fn layout(&self, alpha: f64) -> Result<Arc<MarkLayout>, BaselineError> {
        check_alpha(alpha)?;
        let patches = self.original.patches().iter();
        let alphas = patches.map(|patch| alpha / patch.mesh().area().sqrt());
        let layout = MarkLayout::new(
            Arc::clone(&self.original),
            ChipPlan::EveryPatch(self.layout),
            alphas.collect(),
        )?;
        Ok(Arc::new(layout))
    }
}

impl Prepared for PreparedMhb {
    fn patches(&self) -> usize {
        self.original.patches().len()
    }

    fn functions(&self) -> usize {
        self.layout.functions()
    }

    fn embed(&self, bits: &[bool], alpha: f64, job: &Job) -> Result<Vec<[f64; 3]>, BaselineError> {
        check_bits(bits.len(), self.layout.bits())?;
        let written = self.layout(alpha)?.write(bits, job)?;
        Ok(written.positions(&self.original))
    }

    fn extract(&self, suspect: &Registered, alpha: f64, job: &Job) -> Result<SoftBits, BaselineError> {
        let detector = CoefficientDetector::new(&self.layout(alpha)?);
        Ok(detector.detect(suspect, job)?)
    }

    fn methods(&self, alpha: f64) -> Result<Vec<(DetectorId, ReadingMethod)>, BaselineError> {
        let layout = self.layout(alpha)?;
        let methods = self.methods.iter();
        Ok(methods.map(|(id, make)| (id.clone(), make(&layout))).collect())
    }
}
