use mesh::Similarity;
use registration::MatchedBy;

use crate::{
    mark::{AttackModel, SoftBits},
    payload::PayloadKind,
};

/// The answer to "is this our model?".
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Outcome {
    /// The payload was read back from the shape, every bit of it: the signature, which checks against the public key, or the tag of it.
    Verified,
    /// The payload could not be read, but a mesh without the mark would agree this well with probability `p` at most.
    Detected {
        /// See [`p_value`](super::statistics::p_value).
        p: f64,
    },
    /// Nothing that chance does not explain.
    NotFound {
        /// See [`p_value`](super::statistics::p_value); 1 where the suspect is another shape.
        p: f64,
    },
}

impl Outcome {
    /// The name in JSON reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Verified => "verified",
            Self::Detected { .. } => "detected",
            Self::NotFound { .. } => "not_found",
        }
    }

    /// Whether it is our model.
    pub fn is_found(self) -> bool {
        !matches!(self, Self::NotFound { .. })
    }
}

/// What the suspect was compared with.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Compared {
    /// The very mesh that was signed.
    Original,
    /// Another file of the same geometry: in another order, at another precision, in another unit. What is read with it informs the owner and is
    /// no evidence, since nothing binds the certificate to this file.
    SameGeometry {
        /// Root mean square distance of its vertices from those of the original, as a fraction of the diagonal, at the points that the certificate
        /// knows.
        residual: f64,
    },
}

/// Why a suspect is taken for another shape.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Mismatch {
    /// Too little of its surface lies on the original, in the best position.
    Surface {
        /// The share that does.
        overlap: f64,
        /// The share that is needed.
        least: f64,
    },
    /// It has the original's triangles, but too few of its vertices lie where those of the original do.
    Shape {
        /// The share that does.
        in_place: f64,
        /// The share that is needed.
        least: f64,
    },
}

/// The largest p-value that is evidence against a stranger, 2⁻¹²⁰: who is free in key, message, original, patches and strengths, and
/// tries 2⁸⁰ of them, comes as far with probability 2⁻⁴⁰ at most.
pub const EVIDENCE: f64 = 7.52316384526264e-37;

/// How many claims a stranger may try: 2⁸⁰.
pub const STRANGERS_TRIES: f64 = 1.2089258196146292e24;

/// A connected part of the original that was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FoundPart {
    /// Its number, as [`mesh::components`] numbers the original's.
    pub part: usize,
    /// One of its vertices, the first.
    pub vertex: usize,
    /// The share of its vertices that were seen where they belong, from 0 to 1.
    pub seen: f64,
    /// What takes it from the suspect to the original, where it was put back by itself.
    pub transform: Option<Similarity>,
}

/// What was found, and how.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Verdict {
    /// The answer.
    pub outcome: Outcome,
    /// Whether the signature in the shape is over the original, and not over a message alone. Where it is not, the verdict says nothing
    /// of who made the model.
    pub binds_original: bool,
    /// What the suspect was compared with.
    pub compared_with: Compared,
    /// What the bits in the shape hold.
    pub payload: PayloadKind,
    /// ER (eq. 18), of the bits of which something was read, from 0 to 1, before the code mends any; `None` if the suspect is another shape.
    pub extraction_rate: Option<f64>,
    /// The probability of such agreement without the mark, an upper bound; 1 if the suspect is another shape. Where the best of several
    /// readings was taken, since the suspect could lie in several ways or was read in two, it is multiplied by their number.
    pub p_value: f64,
    /// T = Σ sₜ xₜ / √(Σ xₜ²); 0 if the suspect is another shape.
    pub correlation: f64,
    /// T₀ = T / √(1 − T²/l), the signal-to-noise ratio of the whole mark; `None` if the suspect is another shape. By vertices and the paper's rule, bits that the
    /// layout marks unequally spread as noise does: where all are right it says little.
    pub margin: Option<f64>,
    /// The bits of the mark as they were read; `None` if the suspect is another shape.
    pub soft: Option<SoftBits>,
    /// Of how many bits of the mark something was read, of l at most; 0 if the suspect is another shape.
    pub bits: usize,
    /// How many of those are wrong, before the code mends any; `None` if the suspect is another shape.
    pub bit_errors: Option<usize>,
    /// Of how many patches the bits were read; 0 if the suspect is another shape.
    pub patches_read: usize,
    /// Of how many readings this one could have been chosen, by which the p-value is multiplied: looks, poses, rules and parts, whether or not they were taken. 1 if the suspect is another shape.
    pub tries: usize,
    /// How the suspect was laid onto the original: by its vertices, or by its surface.
    pub matched_by: MatchedBy,
    /// In how many ways it could lie there; above 1 for symmetric shapes.
    pub poses: usize,
    /// Share of the suspect's surface that lies on the original, from 0 to 1; measured where it does not fit, too.
    pub overlap: f64,
    /// Share of the original's surface that lies on the suspect, from 0 to 1.
    pub coverage: f64,
    /// Share of the original's vertices at which the suspect has no surface, from 0 to 1; 1 where it does not fit.
    pub missing: f64,
    /// RMS distance of corresponding points after alignment, as a fraction of the original's diagonal.
    pub residual: Option<f64>,
    /// Takes the suspect to the original; `None` if it does not fit, or was [bent](MatchedBy::is_bent): then no one transform does.
    pub transform: Option<Similarity>,
    /// What moved the suspect beside the mark; `None` where the paper's rule alone read it, or the suspect is another shape.
    pub attack_model: Option<AttackModel>,
    /// Of the connected parts of the original that carry the mark, those of which the suspect shows at least half; the largest first.
    pub parts: Vec<FoundPart>,
    /// How many connected parts of the original carry the mark.
    pub marked_parts: usize,
    /// Why the suspect is another shape, if it is. Then nothing that was read counts, since a mark can be copied onto any mesh with the original's triangles: only how it lies is told, and of a
    /// suspect that does not fit not even that.
    pub mismatch: Option<Mismatch>,
}

impl Verdict {
    /// How the suspect was laid onto the original; `None` if it does not fit.
    pub fn registration(&self) -> Option<MatchedBy> {
        self.residual.map(|_| self.matched_by)
    }

    /// The probability that one of 2⁸⁰ claims that a stranger tried would have come as far, an upper bound: 2⁸⁰ p, at most 1. For marks
    /// that do not bind the original it is 1, since they can be forged without trying; so it is where the verdict [informs the owner alone](Self::is_for_owner_alone), and where nothing is found. For a tag it is 2⁻⁴⁸ at least: whoever looks for statements under which some tag would be read needs a signature that has it, one of 2¹²⁸.
    pub fn p_dispute(&self) -> f64 {
        let of_one = match self.payload {
            PayloadKind::Tag => self.p_value.max(2f64.powi(-128)),
            _ => self.p_value,
        };
        match self.is_bound() && self.outcome.is_found() {
            true => (STRANGERS_TRIES * of_one).min(1.0),
            false => 1.0,
        }
    }

    /// Whether it is evidence even if the claim is a stranger's, who may have chosen it after he saw the suspect: p ≤ [`EVIDENCE`].
    pub fn is_evidence(&self) -> bool {
        self.is_bound() && self.outcome.is_found() && self.p_value <= EVIDENCE
    }

    /// Whether it informs the owner and is evidence for nobody else: the suspect was compared with another file than the one that was signed.
    pub fn is_for_owner_alone(&self) -> bool {
        self.compared_with != Compared::Original
    }

    /// Whether the signature in the shape is over what the suspect was compared with.
    fn is_bound(&self) -> bool {
        self.binds_original && !self.is_for_owner_alone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::claim::statistics::{binomial_tail, p_value};

    #[test]
    fn the_levels_are_powers_of_two() {
        assert_eq!(EVIDENCE, 2f64.powi(-120));
        assert_eq!(STRANGERS_TRIES, 2f64.powi(80));
    }

    /// Of 512 bits 397 that agree are evidence, 396 are not; and T ≥ 12.95 is.
    #[test]
    fn evidence_takes_397_of_512_bits_or_a_correlation_of_12_95() {
        assert!(2.0 * binomial_tail(512, 397) <= EVIDENCE && 2.0 * binomial_tail(512, 396) > EVIDENCE);
        let bits = [true; 512];
        let soft = |agreeing: usize| -> Vec<f64> {
            (0..512).map(|t| if t < agreeing { 1.0 } else { -0.5 }).collect()
        };
        for agreeing in 300..450 {
            let t = crate::mark::correlation(&bits, &soft(agreeing));
            if t >= 12.96 {
                assert!(p_value(&bits, &soft(agreeing)) <= EVIDENCE, "{agreeing}");
            }
        }
    }
}
