mod coefficients;
mod joint;

pub use coefficients::CoefficientDetector;
pub(crate) use joint::Equations;
pub use joint::LeastSquaresDetector;

use job::Job;

use super::{MarkError, Original, Registered, SoftBits};

/// Reads the bits of a mark from a registered suspect, knowing the original but not the signature.
///
/// That a detector never sees the signature is what makes the p-values of [`statistics`](crate::statistics) hold.
pub trait Detector: std::fmt::Debug + Send + Sync {
    /// The estimates of all l bits, the mark having the strength `alphas[i]` in patch i.
    ///
    /// # Errors
    /// When the original's bases can't be computed.
    fn detect(
        &self,
        original: &Original,
        alphas: &[f64],
        suspect: &Registered,
        job: &Job,
    ) -> Result<SoftBits, MarkError>;
}
