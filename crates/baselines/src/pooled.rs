use std::sync::Arc;

use job::Job;
use sigmark::{
    Strength,
    mark::{
        ChipPlan, CoefficientDetector, Detector, JointEstimator, MarkLayout, Original, Pool, ReadingMethod,
        Registered, SoftBits,
    },
};

use crate::{
    Algorithm, AlgorithmId, BaselineError, DetectorId, Prepared, Reference, Subject,
    algorithm::{check_alpha, check_bits},
};

/// Manifold harmonics as `sigmark embed` uses them by default: the bits pooled over patches of its own, whose harmonics are zero at borders. α is the root mean
/// square displacement of the marked surface, as a fraction of the diagonal.
#[derive(Clone, Copy, Debug, Default)]
pub struct PooledMhb;

impl Algorithm for PooledMhb {
    fn id(&self) -> AlgorithmId {
        AlgorithmId::POOLED_MHB
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![("methods", DetectorId::LEAST_SQUARES.to_string())]
    }

    fn name(&self) -> String {
        "MHBs, pooled".into()
    }

    fn reference(&self) -> Reference {
        Reference::Original
    }

    fn prepare(&self, subject: &Subject<'_>, job: &Job) -> Result<Box<dyn Prepared>, BaselineError> {
        let bits = subject.bits;
        let original = Original::pooled(subject.mesh.clone(), bits, Pool::default(), job)?;
        original.keep_bases(job)?;
        let original = Arc::new(original);
        let plan = ChipPlan::Pooled { bits, key: [1; 32] };
        Ok(Box::new(PreparedPooled {
            alphas: Strength::Distortion(UNIT).alphas(&original, &plan)?,
            original,
            plan,
        }))
    }
}

/// A strength that every mesh takes; all others are multiples of it.
const UNIT: f64 = 1e-3;

#[derive(Debug)]
struct PreparedPooled {
    original: Arc<Original>,
    plan: ChipPlan,
    /// Those of strength [`UNIT`].
    alphas: Vec<f64>,
}

impl PreparedPooled {
    fn layout(&self, alpha: f64) -> Result<Arc<MarkLayout>, BaselineError> {
        check_alpha(alpha)?;
        let alphas = self.alphas.iter().map(|unit| alpha / UNIT * unit).collect();
        let layout = MarkLayout::new(Arc::clone(&self.original), self.plan, alphas)?;
        Ok(Arc::new(layout))
    }
}

impl Prepared for PreparedPooled {
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
        let joint = JointEstimator::new(&self.layout(alpha)?);
        let method = ReadingMethod::joint(Arc::new(joint));
        Ok(vec![(DetectorId::LEAST_SQUARES, method)])
    }
}
