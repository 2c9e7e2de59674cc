use super::{ChipPlan, MarkError, Original};

/// How strongly a mark is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Strength {
    /// Root mean square displacement of the marked surface, as a fraction of the bounding box's diagonal.
    Distortion(f64),
    /// As [`Distortion`](Self::Distortion), but where chips are pooled less where the model is thin: a wire, a rim, a wing. What is asked for is then the most.
    Level(f64),
    /// α of eq. 12 for patches of unit area: the same for every patch, whatever the unit of the model.
    Alpha(f64),
    /// The α that the paper prints, in the model's unit of length: α/√(area) for each patch.
    PaperAlpha(f64),
}

/// A mark that moves the surface by more than this part of the diagonal is not a watermark any more.
pub const MOST_DISTORTION: f64 = 0.1;

impl Default for Strength {
    /// [`STANDARD`](Self::STANDARD).
    fn default() -> Self {
        Self::STANDARD
    }
}

impl Strength {
    /// 4·10⁻⁴ of the diagonal, less where it is thin: about what the paper's α does to the bunny (d_rmse 0.02 % of the diagonal).
    pub const STANDARD: Self = Self::Level(4e-4);

    /// Half of the default.
    pub const SUBTLE: Self = Self::Level(2e-4);

    /// Twice the default.
    pub const STRONG: Self = Self::Level(8e-4);

    /// α of every patch, for patches of unit area. Where chips are pooled, a [`Distortion`](Self::Distortion) moves the surface of all patches
    /// alike; in the paper's plan α is the same for all.
    ///
    /// # Errors
    /// When the strength is no positive number or would ruin the shape, and when a patch has no area.
    pub fn alphas(self, original: &Original, plan: &ChipPlan) -> Result<Vec<f64>, MarkError> {
        let (what, value) = self.checked()?;
        let areas = areas(original);
        if let Some(patch) = areas.iter().position(|&area| area == 0.0) {
            return Err(MarkError::NoArea { patch });
        }
        let relative: Vec<f64> = match (self, plan) {
            (Self::Distortion(_) | Self::Level(_), ChipPlan::Pooled { .. }) => squares(original, plan)
                .zip(super::roughness::weights(original))
                .map(|(square, weight)| weight * square.max(f64::MIN_POSITIVE).sqrt().recip())
                .collect(),
            (Self::Distortion(_) | Self::Level(_) | Self::Alpha(_), _) => vec![1.0; areas.len()],
            (Self::PaperAlpha(_), _) => areas.iter().map(|area| 1.0 / area.sqrt()).collect(),
        };
        // For a strength of 1; everything grows linearly with it.
        let scale = match self {
            Self::Distortion(_) | Self::Level(_) => distortion(original, plan, &relative).recip(),
            Self::Alpha(_) | Self::PaperAlpha(_) => 1.0,
        };
        let unit: Vec<f64> = relative.iter().map(|alpha| scale * alpha).collect();
        let most = MOST_DISTORTION / distortion(original, plan, &unit);
        if value > most {
            return Err(MarkError::TooStrong { what, value, most });
        }
        let mut alphas: Vec<f64> = unit.iter().map(|alpha| value * alpha).collect();
        if let (Self::Level(_), ChipPlan::Pooled { .. }) = (self, plan) {
            let displacements = squares(original, plan).zip(&alphas);
            let displacements: Vec<f64> = displacements
                .map(|(square, alpha)| alpha * square.sqrt())
                .collect();
            let factors = super::thickness::factors(original, &displacements);
            alphas
                .iter_mut()
                .zip(factors)
                .for_each(|(alpha, factor)| *alpha *= factor);
        }
        Ok(alphas)
    }

    /// What a person calls it, and its number, which is positive.
    pub(crate) fn checked(self) -> Result<(&'static str, f64), MarkError> {
        let (what, value) = match self {
            Self::Distortion(value) | Self::Level(value) => ("distortion", value),
            Self::Alpha(value) => ("alpha", value),
            Self::PaperAlpha(value) => ("the paper's alpha", value),
        };
        if value > 0.0 && value.is_finite() {
            Ok((what, value))
        } else {
            Err(MarkError::NotPositive { what, value })
        }
    }
}

/// The root mean square displacement of the marked surface by chips of these strengths, as a fraction of the diagonal. The basis
/// is orthonormal, so each chip adds (α φ)² to the mean square of its patch.
pub(crate) fn distortion(original: &Original, plan: &ChipPlan, alphas: &[f64]) -> f64 {
    let areas = areas(original);
    let squares = squares(original, plan).zip(&areas).zip(alphas);
    let squares = squares.map(|((square, area), alpha)| area * alpha * alpha * square);
    let rms = (squares.sum::<f64>() / areas.iter().sum::<f64>()).sqrt();
    rms / original.mesh().bounding_box().diagonal()
}

/// The mean square displacement of each patch for α = 1.
fn squares(original: &Original, plan: &ChipPlan) -> impl Iterator<Item = f64> {
    let patches = original.patches().iter().zip(original.functions());
    patches.map(|(patch, &functions)| {
        let (chips, size) = (plan.chips_per_axis(functions), plan.size(patch));
        (0..3).map(|axis| chips[axis] as f64 * size[axis].powi(2)).sum()
    })
}

fn areas(original: &Original) -> Vec<f64> {
    let patches = original.patches().iter();
    patches.map(|patch| patch.mesh().area()).collect()
}
