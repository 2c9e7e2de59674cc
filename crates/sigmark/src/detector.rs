use crate::{Original, SigmarkError, Work};

/// A suspect brought onto an original, and sampled at the original's vertices; everything is in the original's order and frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Registered {
    /// Where the suspect passes each vertex of the original (#V); `None` where it has no surface.
    pub positions: Vec<Option<[f64; 3]>>,
    /// Where only the surface was found again, not the vertex: the vector u for which u·δ is known of a displacement δ (#V).
    /// A line along the normal n that meets a plane with normal f tells u = f / (f·n).
    pub along: Vec<Option<[f64; 3]>>,
    /// What u·δ would be if the suspect's vertices lay on the original: flat triangles cut the corners of a curved surface (#V). Zero
    /// where the vertex itself was found again.
    pub facets: Vec<f64>,
    /// How many vertices the suspect has: no more samples than that are independent.
    pub suspect_vertices: usize,
}

impl Registered {
    /// A suspect whose vertices are known to correspond to the original's.
    pub fn by_vertices(positions: Vec<Option<[f64; 3]>>) -> Self {
        Self {
            along: vec![None; positions.len()],
            facets: vec![0.0; positions.len()],
            suspect_vertices: positions.len(),
            positions,
        }
    }

    /// How many samples there are to a vertex of the suspect; at least 1.
    pub(crate) fn redundancy(&self) -> f64 {
        let seen = self.positions.iter().flatten().count();
        (seen as f64 / self.suspect_vertices.max(1) as f64).max(1.0)
    }

    /// The share of the original's vertices at which the suspect has no surface, from 0 to 1.
    pub fn missing(&self) -> f64 {
        let missing = self.positions.iter().filter(|seen| seen.is_none()).count();
        missing as f64 / self.positions.len().max(1) as f64
    }
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
pub trait Detector: std::fmt::Debug + Sync {
    /// The estimates of all l bits, the mark having the strength `alphas[i]` in patch i.
    ///
    /// # Errors
    /// When the original's bases can't be computed.
    fn detect(
        &self,
        original: &Original,
        alphas: &[f64],
        suspect: &Registered,
        work: Work<'_>,
    ) -> Result<SoftBits, SigmarkError>;
}

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
