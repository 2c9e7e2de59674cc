//! From a registered suspect to soft bits.

mod coefficients;
mod joint;

pub use coefficients::CoefficientDetector;
pub use joint::{AttackModel, Bending, JointEstimate, JointEstimator, JointModel};

use job::Job;

use super::{MarkError, Registered, SoftBits};

/// Reads the bits of a mark from a registered suspect, knowing the original but not the bits.
///
/// A detector is bound to what it reads: an original, where the mark lies in it, and how strong it is. That it never sees the bits
/// that are looked for is what makes p-values hold.
pub trait Detector: std::fmt::Debug + Send + Sync {
    /// The estimates of all l bits.
    ///
    /// # Errors
    /// When there is not one observation a vertex of the original, or its bases can't be computed; [`MarkError::Job`].
    fn detect(&self, suspect: &Registered, job: &Job) -> Result<SoftBits, MarkError>;
}

impl<T: Detector + ?Sized> Detector for &T {
    fn detect(&self, suspect: &Registered, job: &Job) -> Result<SoftBits, MarkError> {
        (**self).detect(suspect, job)
    }
}
