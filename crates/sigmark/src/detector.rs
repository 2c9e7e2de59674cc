use crate::{Original, SigmarkError, Work};

/// A suspect brought onto an original: for every vertex of the original, where the suspect's surface passes it, in the
/// original's frame; `None` where the suspect has no surface there.
#[derive(Clone, Debug, PartialEq)]
pub struct Registered {
    /// #V of the original, in its order.
    pub positions: Vec<Option<[f64; 3]>>,
}

/// An estimate of every bit of a signature: positive for 1, negative for 0, the larger the surer. The unit is the detector's.
#[derive(Clone, Debug, PartialEq)]
pub struct SoftBits(pub Vec<f64>);

impl SoftBits {
    /// The bits themselves: 1 where the estimate is not negative (eq. 17).
    pub fn hard(&self) -> Vec<bool> {
        self.0.iter().map(|&q| q >= 0.0).collect()
    }
}

/// Reads the bits of a mark from a registered suspect, knowing the original but not the signature.
///
/// That a detector never sees the signature is what makes the p-values of [`statistics`](crate::statistics) hold.
pub trait Detector: Sync {
    /// The estimates of all l bits.
    ///
    /// # Errors
    /// When the original's bases can't be computed.
    fn detect(
        &self,
        original: &Original,
        suspect: &Registered,
        work: Work<'_>,
    ) -> Result<SoftBits, SigmarkError>;
}

/// The paper's extraction: subtract coefficients and sum each bit's chips over all patches (eq. 15).
///
/// Where the suspect was not seen, the original's vertex takes its place, as in section 4.4.1.
#[derive(Clone, Copy, Debug, Default)]
pub struct CoefficientDetector;

impl Detector for CoefficientDetector {
    fn detect(
        &self,
        original: &Original,
        suspect: &Registered,
        work: Work<'_>,
    ) -> Result<SoftBits, SigmarkError> {
        let layout = original.layout();
        let sums_of = original.map_bases(work, |_, patch, basis| {
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
        })?;
        Ok(SoftBits(
            (0..layout.bits())
                .map(|bit| sums_of.iter().map(|sums| sums[bit]).sum())
                .collect(),
        ))
    }
}
