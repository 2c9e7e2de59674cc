//! How much of the mark is left in each band of frequencies: smoothing takes the high ones, decimation some of them.
//!
//! A coefficient that a chip moves is c = g b rather than b, with a gain g ≤ 1 of its band. Its square tells g without the bits: E c² = g². Gains are those that make the observations of all patches
//! likeliest, c being normally distributed with mean 0: g² is the mean of m² + v over the chips of a band, with the mean m and the variance v that the observations leave to c at the gains before (Dempster, Laird and Rubin 1977). More than 1 is noise: on parts of
//! machines, and where much was smoothed, the lowest band has it.

use super::patch::PatchEquations;

/// Bands that the frequencies of each patch are cut into.
pub(super) const BANDS: usize = 8;

/// Gains start at 1.
const STEPS: usize = 6;

/// Less is hardly ever told from nothing.
const LEAST_SQUARE: f64 = 1e-3;

/// g of each band, 1 for a mark that nobody touched.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains([f64; BANDS]);

impl Gains {
    /// The likeliest for patches with noises of these mean squares.
    pub(super) fn of<'a>(patches: impl Iterator<Item = (&'a PatchEquations, f64)> + Clone) -> Self {
        let mut gains = Self([1.0; BANDS]);
        for _ in 0..STEPS {
            let mut sums = [(0.0, 0.0); BANDS];
            for (patch, noise) in patches.clone() {
                for (band, square) in patch.squares(noise, &gains) {
                    sums[band].0 += square;
                    sums[band].1 += 1.0;
                }
            }
            for (gain, (sum, count)) in gains.0.iter_mut().zip(sums) {
                if count > 0.0 {
                    *gain = f64::clamp(sum / count, LEAST_SQUARE, 1.0).sqrt();
                }
            }
        }
        gains
    }

    /// That of a band.
    pub(super) fn of_band(&self, band: usize) -> f64 {
        self.0[band]
    }
}
