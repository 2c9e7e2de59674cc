use std::sync::Arc;

use job::Job;

use super::Detector;
use crate::mark::{MarkError, MarkLayout, Patch, PatchBasis, Registered, SoftBits};

/// The paper's extraction: subtract coefficients and sum each bit's chips over all patches (eq. 15).
///
/// Where the suspect was not seen, the original's vertex takes its place, as in section 4.4.1. Best where all vertices were
/// found again: the basis is orthonormal then, and the bits do not disturb each other.
#[derive(Clone, Debug)]
pub struct CoefficientDetector {
    layout: Arc<MarkLayout>,
}

impl CoefficientDetector {
    /// A detector for marks of this layout; their strengths make no difference.
    pub fn new(layout: &Arc<MarkLayout>) -> Self {
        Self {
            layout: Arc::clone(layout),
        }
    }
}

impl Detector for CoefficientDetector {
    fn detect(&self, suspect: &Registered, job: &Job) -> Result<SoftBits, MarkError> {
        let layout = &self.layout;
        suspect.check(layout.original().mesh().vertex_count())?;
        let sums_of_patch = |index: usize, patch: &Patch, basis: &PatchBasis| {
            let seen = patch.gather(&suspect.positions);
            // The transform is linear: the difference of coefficients is the transform of the difference.
            let difference: Vec<[f64; 3]> = seen
                .iter()
                .zip(patch.mesh().positions())
                .map(|(r, v)| r.map_or([0.0; 3], |r| std::array::from_fn(|axis| r[axis] - v[axis])))
                .collect();
            let coefficients = basis.transform(&difference);
            let mut sums = vec![0.0; layout.bits()];
            let received = layout.received(index, &coefficients);
            for (chip, received) in layout.chips(index).iter().zip(received) {
                sums[chip.bit] += received;
            }
            sums
        };
        let sums = layout.map_seen(&suspect.positions, sums_of_patch, job)?;
        let bits = 0..layout.bits();
        Ok(SoftBits::new(
            bits.map(|bit| sums.iter().map(|sums| sums[bit]).sum()).collect(),
        ))
    }
}
