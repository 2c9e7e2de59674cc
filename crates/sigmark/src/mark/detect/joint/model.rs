//! How much the joint estimate takes into account: all that there is, or less, to see what each part is worth.

use super::observations::Observation;

/// What the equations know of a suspect beside its bits. Each knows what those before it know, too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum JointModel {
    /// Nothing: plain least squares.
    Bits,
    /// A misalignment, smoothing, and what flat triangles do.
    Interference,
    /// Where decimation puts vertices, an offset, and mild bends of space.
    Shape,
    /// How noisy observations, patches and bands of frequencies are, which says how much each counts.
    #[default]
    Noise,
}

impl JointModel {
    /// Leaves of an observation what is known.
    pub(super) fn limit(self, observation: &mut Observation) {
        let known = match self {
            Self::Bits => 0,
            Self::Interference => 2,
            Self::Shape | Self::Noise => observation.tessellation_bias.len(),
        };
        observation.tessellation_bias[known..].fill(0.0);
        if self < Self::Noise {
            observation.robust_weight = 1.0;
        }
    }

    /// Whether the fields of a small similarity and of smoothing are among the unknowns.
    pub(super) fn has_interference(self) -> bool {
        self >= Self::Interference
    }

    /// Whether an offset and bends of space are.
    pub(super) fn has_optional(self) -> bool {
        self >= Self::Shape
    }

    /// Whether weights follow from residuals.
    pub(super) fn has_weights(self) -> bool {
        self == Self::Noise
    }
}
