//! Alignment of a suspect whose vertices are known to correspond to the original's.

use mesh::{Similarity, TriMesh};
use registration::{Correspondence, Handedness, fit_similarity};

use crate::{CoefficientDetector, Detector, PreparedOriginal, Registered, SigmarkError, SoftBits};

/// A suspect in the original's frame, and the bits read from it there.
#[derive(Clone, Debug)]
pub(crate) struct Aligned {
    pub(crate) soft: SoftBits,
    /// Takes the suspect to the original.
    pub(crate) transform: Similarity,
    /// Share of the original's vertices that were seen.
    pub(crate) overlap: f64,
    /// RMS distance of corresponding points, in the original's unit.
    pub(crate) residual: f64,
}

/// Each round removes nearly all of the pull that the one before it left.
const ROUNDS: usize = 4;

/// Fits the similarity, reads the bits, and fits again to the original with those bits written into it, until they stay.
///
/// The mark itself pulls a least-squares similarity: it is not orthogonal to the coordinate functions, whose own
/// coefficients are far larger than a chip. Fitting to the marked original takes the pull away as soon as most bits are
/// right. The bits come from the suspect alone, so the p-value is as good as without this.
pub(crate) fn align_and_detect(
    original: &PreparedOriginal,
    alphas: &[f64],
    suspect: &TriMesh,
    correspondence: &Correspondence,
) -> Result<Aligned, SigmarkError> {
    let seen = correspondence.carry(suspect);
    let mut target = original.mesh().positions().to_vec();
    let mut aligned = fit_and_detect(original, &seen, &target)?;
    for _ in 1..ROUNDS {
        let bits = aligned.soft.hard();
        let displacement = original.displacement(&bits, alphas);
        for ((t, p), d) in target
            .iter_mut()
            .zip(original.mesh().positions())
            .zip(&displacement)
        {
            *t = std::array::from_fn(|axis| p[axis] + d[axis]);
        }
        aligned = fit_and_detect(original, &seen, &target)?;
        if aligned.soft.hard() == bits {
            break;
        }
    }
    Ok(aligned)
}

/// Takes what was `seen` onto `target`, and reads the bits there.
fn fit_and_detect(
    original: &PreparedOriginal,
    seen: &[Option<[f64; 3]>],
    target: &[[f64; 3]],
) -> Result<Aligned, SigmarkError> {
    let (source, target): (Vec<_>, Vec<_>) = seen
        .iter()
        .zip(target)
        .filter_map(|(s, &t)| s.map(|s| (s, t)))
        .unzip();
    let transform = fit_similarity(&source, &target, None, Handedness::Either)?.transform;
    let registered = Registered {
        positions: seen.iter().map(|s| s.map(|s| transform.apply(s))).collect(),
    };
    let squares = registered
        .positions
        .iter()
        .zip(original.mesh().positions())
        .filter_map(|(r, v)| r.map(|r| (0..3).map(|axis| (r[axis] - v[axis]).powi(2)).sum::<f64>()));
    Ok(Aligned {
        soft: CoefficientDetector.detect(original, &registered),
        transform,
        overlap: source.len() as f64 / seen.len() as f64,
        residual: (squares.sum::<f64>() / source.len() as f64).sqrt(),
    })
}
