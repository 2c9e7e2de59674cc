use job::Job;

use super::Detector;
use crate::mark::{MarkError, Original, Patch, PatchBasis, Registered, SoftBits};

/// The paper's extraction: subtract coefficients and sum each bit's chips over all patches (eq. 15).
///
/// Where the suspect was not seen, the original's vertex takes its place, as in section 4.4.1. Best where all vertices were
/// found again: the basis is orthonormal then, and the bits do not disturb each other.
#[derive(Clone, Copy, Debug, Default)]
pub struct CoefficientDetector;

impl Detector for CoefficientDetector {
    fn detect(
        &self,
        original: &Original,
        _alphas: &[f64],
        suspect: &Registered,
        job: &Job,
    ) -> Result<SoftBits, MarkError> {
        let layout = original.layout();
        let sums_of = |_: usize, patch: &Patch, basis: &PatchBasis| {
            let seen = patch.gather(&suspect.positions);
            // The transform is linear: the difference of coefficients is the transform of the difference.
            let difference: Vec<[f64; 3]> = seen
                .iter()
                .zip(patch.mesh().positions())
                .map(|(r, v)| r.map_or([0.0; 3], |r| std::array::from_fn(|axis| r[axis] - v[axis])))
                .collect();
            let coefficients = basis.transform(&difference);
            let mut sums = vec![0.0; layout.bits()];
            for chip in layout.chips() {
                sums[chip.bit] += coefficients[chip.frequency][chip.axis];
            }
            sums
        };
        let sums_of = original.map_bases(sums_of, job)?;
        Ok(SoftBits(
            (0..layout.bits())
                .map(|bit| sums_of.iter().map(|sums| sums[bit]).sum())
                .collect(),
        ))
    }
}
