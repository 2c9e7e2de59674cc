use std::sync::Arc;

use crate::mark::{CoefficientDetector, Detector, JointEstimator, MarkLayout};

/// How bits are read from suspects: by the joint estimate, or by a detector for which it only betters the pose.
#[derive(Clone, Debug)]
pub struct ReadingMethod {
    joint: Arc<JointEstimator>,
    detector: Option<Arc<dyn Detector>>,
}

impl ReadingMethod {
    /// Bits and pose by the joint estimate.
    pub fn joint(joint: Arc<JointEstimator>) -> Self {
        Self {
            joint,
            detector: None,
        }
    }

    /// Bits by another detector, in the pose that the joint estimate betters.
    pub fn with_detector(self, detector: Arc<dyn Detector>) -> Self {
        Self {
            detector: Some(detector),
            ..self
        }
    }

    /// Bits by the paper's rule, in the pose that the joint estimate betters.
    pub fn with_papers_rule(self) -> Self {
        let detector = Arc::new(CoefficientDetector::new(self.layout()));
        self.with_detector(detector)
    }

    /// Where the marks lie, and how strong they are.
    pub fn layout(&self) -> &Arc<MarkLayout> {
        self.joint.layout()
    }

    /// The same method, which reads some patches only, numbered from 0 and ascending, by the joint estimate.
    pub(super) fn among(&self, patches: &[usize]) -> Self {
        Self {
            joint: Arc::new(self.joint.among(patches)),
            detector: self.detector.clone(),
        }
    }

    pub(super) fn estimator(&self) -> &JointEstimator {
        &self.joint
    }

    /// The detector override.
    pub(super) fn detector(&self) -> Option<&dyn Detector> {
        self.detector.as_deref()
    }
}
