//! How strong a mark is: the paper's α, or the one that distorts as much as in the paper.

use anyhow::{Context, Result, ensure};
use mesh::TriMesh;
use quality::{DistanceOptions, surface_distance};
use serde_json::{Value, json};

use super::{Signed, Strength, Study};

/// How far d_rmse may be from the printed one for the paper's α to be taken, as a share of it. Signatures differ, so the bound that the
/// audit has for each mark, a tenth, is wider.
const NEAR_ENOUGH: f64 = 0.08;

impl Study<'_> {
    /// α for the distortion that the study has, in the mean over the signatures.
    pub(crate) fn strength(&self) -> Result<Strength> {
        let inputs = self.inputs(key(self.distortion, self.setup().signatures));
        if let Some(kept) = self.store().get("strength", &inputs) {
            return Ok(kept);
        }
        let strength = self.calibrated()?;
        self.store().put("strength", &inputs, &strength)?;
        Ok(strength)
    }

    /// The paper's α where it has no unit and distorts as much as in the paper; else the one that does.
    fn calibrated(&self) -> Result<Strength> {
        let base = self.positions(0, 0.0)?;
        let sizes = self.sizes(&base)?;
        // The mean beside the first, which is the one that is measured.
        let mean = sizes.iter().sum::<f64>() / (sizes.len() as f64 * sizes[0]);
        if let Some(alpha) = self.marking.paper_alpha() {
            let found = self.d_rmse(&self.marked(0, alpha)?)?;
            if (found * mean / self.distortion - 1.0).abs() < NEAR_ENOUGH {
                return Ok(Strength {
                    alpha,
                    printed: true,
                    reached: true,
                });
            }
        }
        let mut strength = self.fitted(base, sizes[0])?;
        if strength.reached {
            strength.alpha /= mean;
        }
        Ok(strength)
    }

    /// Per cent of the original's diagonal. The metric divides before it multiplies: its rounding is another, and would go into α and so
    /// into every cell.
    fn d_rmse(&self, marked: &TriMesh) -> Result<f64> {
        let distance = surface_distance(marked, self.original(), &DistanceOptions::default(), &self.job())?;
        Ok(100.0 / self.original().bounding_box().diagonal() * distance.rmse)
    }

    /// How far each signature moves vertices at α = 1, root mean square.
    fn sizes(&self, base: &[[f64; 3]]) -> Result<Vec<f64>> {
        let size = |signature: usize| {
            let unit = self.positions(signature, 1.0)?;
            let pairs = base.iter().zip(&unit);
            let squares = pairs.map(|(p, q)| (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>());
            let size = (squares.sum::<f64>() / base.len() as f64).sqrt();
            ensure!(size > 0.0, "{}: a mark has no size", self.marking.name());
            Ok(size)
        };
        (0..self.setup().signatures.len()).map(size).collect()
    }

    /// α for the first signature. The mark is affine in α, so d² is t² + (k α)² to first order, t being the distortion at α = 0.
    fn fitted(&self, base: Vec<[f64; 3]>, per_alpha: f64) -> Result<Strength> {
        let least = if base == self.original().positions() {
            0.0
        } else {
            self.d_rmse(&self.original().with_positions(base)?)?
        };
        let wanted = self.distortion.powi(2) - least.powi(2);
        if wanted <= 0.0 {
            let name = self.marking.name();
            let alpha = self.marking.paper_alpha();
            let alpha = alpha.with_context(|| {
                format!("{name} distorts by {least:.4} % unmarked, and there is no other strength to take")
            })?;
            return Ok(Strength {
                alpha,
                printed: true,
                reached: false,
            });
        }
        // A third of a displacement's square is along the normal.
        let mut alpha =
            3f64.sqrt() * wanted.sqrt() / 100.0 * self.original().bounding_box().diagonal() / per_alpha;
        // Secant steps; one or two do, since d² is nearly quadratic in α.
        for _ in 0..5 {
            let found = self.d_rmse(&self.marked(0, alpha)?)?;
            if (found / self.distortion - 1.0).abs() < 0.01 {
                break;
            }
            let marked = found.powi(2) - least.powi(2);
            ensure!(
                marked > 0.0,
                "{}: a stronger mark distorts no more",
                self.marking.name()
            );
            alpha *= (wanted / marked).sqrt();
        }
        Ok(Strength {
            alpha,
            printed: false,
            reached: true,
        })
    }
}

/// What α depends on beside the mesh and the algorithm: it is right in the mean over these signatures.
fn key(distortion: f64, signatures: &[Signed]) -> Value {
    let signatures: Vec<String> = signatures
        .iter()
        .map(|signed| signed.signature.to_hex())
        .collect();
    json!({"distortion": distortion, "signatures": signatures})
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::SCHEME;
    use sigmark::Signature;

    #[test]
    fn a_strength_for_one_signature_is_not_taken_for_two() {
        let signed = |number| Signed {
            number,
            message: String::new(),
            signature: Signature::from_bits(SCHEME, &vec![number == 0; SCHEME.bits()]).unwrap(),
        };
        assert_ne!(key(0.02, &[signed(0)]), key(0.02, &[signed(0), signed(1)]));
    }
}
