use std::sync::Arc;

use job::Job;
use sigmark::{
    Strength,
    mark::{ChipPlan, JointEstimator, Original, Pool, ReadingMethod},
};

use crate::{
    Algorithm, AlgorithmId, BaselineError, DetectorId, Prepared, Reference, Subject, mhb::PreparedMhb,
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
        let plan = ChipPlan::pooled(bits, [1; 32]);
        let alphas = Strength::Distortion(UNIT).alphas(&original, &plan)?;
        Ok(Box::new(PreparedMhb {
            original,
            plan,
            units: alphas.into_iter().map(|alpha| UNIT / alpha).collect(),
            methods: vec![(DetectorId::LEAST_SQUARES, |layout| {
                ReadingMethod::joint(JointEstimator::new(layout).into())
            })],
        }))
    }
}

/// A strength that every mesh takes; all others are multiples of it.
const UNIT: f64 = 1e-3;
