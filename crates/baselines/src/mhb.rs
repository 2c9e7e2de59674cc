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
        let patches = original.patches().iter();
        Ok(Box::new(PreparedMhb {
            // The paper's α is over unit area for each patch.
            units: patches.map(|patch| patch.mesh().area().sqrt()).collect(),
            original: Arc::new(original),
            plan: ChipPlan::EveryPatch(layout),
            methods: self.methods.clone(),
        }))
    }
}

/// A mesh that was cut for marks of a plan, with its bases.
#[derive(Debug)]
struct PreparedMhb {
    original: Arc<Original>,
    plan: ChipPlan,
    /// What the algorithm's α is divided by to be a patch's.
    units: Vec<f64>,
    methods: Methods,
}

impl PreparedMhb {
    fn layout(&self, alpha: f64) -> Result<Arc<MarkLayout>, BaselineError> {
        check_alpha(alpha)?;
        let alphas = self.units.iter().map(|unit| alpha / unit).collect();
        let layout = MarkLayout::new(Arc::clone(&self.original), self.plan, alphas)?;
        Ok(Arc::new(layout))
    }
}

impl Prepared for PreparedMhb {
    fn patches(&self) -> usize {
        self.original.patches().len()
    }

    fn functions(&self) -> usize {
        self.original.functions().iter().copied().max().unwrap_or(0)
    }

    fn embed(&self, bits: &[bool], alpha: f64, job: &Job) -> Result<Vec<[f64; 3]>, BaselineError> {
        check_bits(bits.len(), self.plan.bits())?;
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
