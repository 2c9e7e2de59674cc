//! What a mark survives, as far as that can be told before it is written.

use super::verdict::EVIDENCE;
use crate::{
    mark::MarkLayout,
    payload::{PayloadKind, Scheme},
};

/// The noise that a [margin](Prediction::margin) is quoted for: each coordinate is off by up to a thousandth of the bounding box's edge, the first of
/// the paper's Table 4.
pub const QUOTED_NOISE: f64 = 1e-3;

/// Of a hundred marks without a code, one has a bit that is read wrong.
const ONE_WRONG: f64 = 0.01;

/// T₀ / √k at which about one codeword of a hundred is not read, from so many chips to a bit of payload on. Words of 128 and of 512 bits agree; below two chips some code bits have none.
const READ_AT: [(f64, f64); 5] = [(1.25, 2.05), (1.5, 1.8), (1.75, 1.7), (2.0, 1.62), (4.0, 1.49)];

/// With more noise a copy is not recognised as one: too few of its vertices lie within a hundredth of the diagonal of their places.
const RECOGNISED: f64 = 0.015;

/// What the owner's own p-value has to be below.
const DETECTED: f64 = 1e-6;

/// By vertices, in two looks.
const TRIES: f64 = 4.0;

/// What a mark of some strength survives if all vertices of the model are found again and each is off by itself: noise and rounding. Smoothing,
/// decimation and cropping depend on the shape; `results/visibility.md` has what was measured.
///
/// Real scans come within a tenth of it; small models, whose bits have few chips each, lost up to a third (`tests/small.rs`).
///
/// T₀ = √(l · signal to noise of a bit) is what all of it follows from: T = T₀ / √(1 + T₀²/l), and a code is read above a T₀ of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Prediction {
    /// What the mark will hold.
    pub payload: PayloadKind,
    /// k, the bits of that.
    pub payload_bits: usize,
    /// How many chips carry it.
    pub chips: usize,
    /// Root mean square displacement of the marked surface, as a fraction of the diagonal.
    pub distortion_rms: f64,
    /// T₀ under [noise of 0.1 %](QUOTED_NOISE).
    pub margin: f64,
    /// T₀ at which the payload is read.
    pub margin_read: f64,
    /// Up to this noise, as a share of the bounding box's edges, the payload is read.
    pub noise_read: f64,
    /// Up to this noise, p is [evidence](EVIDENCE) against a stranger.
    pub noise_evidence: f64,
    /// Up to this noise, the mark is detected.
    pub noise_detected: f64,
}

impl Prediction {
    /// For a mark of a layout with such a payload, whatever its bits.
    pub fn of(layout: &MarkLayout, scheme: Scheme, payload: PayloadKind) -> Self {
        Self::by_margin(layout, scheme, payload, |noise| layout.margin(noise))
    }

    /// The same where T₀ depends on the noise by a rule of its own: it falls as the noise grows.
    pub(super) fn by_margin(
        layout: &MarkLayout,
        scheme: Scheme,
        payload: PayloadKind,
        margin_at: impl Fn(f64) -> f64,
    ) -> Self {
        let bits = layout.bits() as f64;
        let margin_read = match payload {
            PayloadKind::PlainSignature => margin_for_all(bits),
            _ => margin_for_code(payload.bits(scheme) as f64, layout.chip_count() as f64),
        };
        let noise_at = |needed: f64| most_noise(&margin_at, needed);
        Self {
            payload,
            payload_bits: payload.bits(scheme),
            chips: layout.chip_count(),
            distortion_rms: layout.distortion_rms(),
            margin: margin_at(QUOTED_NOISE),
            margin_read,
            noise_read: noise_at(margin_read),
            noise_evidence: noise_at(margin_for(EVIDENCE, bits)),
            noise_detected: noise_at(margin_for(DETECTED, bits)),
        }
    }
}

/// The most noise under which so much is left; none where even without noise there isn't.
fn most_noise(margin_at: impl Fn(f64) -> f64, needed: f64) -> f64 {
    let (mut low, mut high) = (0.0, RECOGNISED);
    if margin_at(high) >= needed {
        return high;
    }
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if margin_at(middle) >= needed {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// The fewest bits a coordinate to which rounding is no worse than a noise, as a share of the box's edges; as many as a float has at most.
pub fn bits_for(noise: f64) -> u32 {
    // Rounding to b bits is off by up to half of 2⁻ᵇ.
    let bits = (0.5 / noise).log2().ceil();
    if bits >= 0.0 { bits.min(53.0) as u32 } else { 0 }
}

/// T₀ at which all bits are right.
fn margin_for_all(bits: f64) -> f64 {
    bits.sqrt() * quantile(ONE_WRONG / bits)
}

/// T₀ at which a payload is read from so many chips.
fn margin_for_code(payload: f64, chips: f64) -> f64 {
    let rate = chips / payload;
    match READ_AT.iter().rev().find(|(least, _)| rate >= *least) {
        Some((_, margin)) => payload.sqrt() * margin,
        None => margin_for_all(payload),
    }
}

/// T₀ at which p comes to a bound.
fn margin_for(p: f64, bits: f64) -> f64 {
    // p = 2 tries exp(−T²/2); where T is above √l, nothing would do.
    let square = 2.0 * (2.0 * TRIES / p).ln();
    if square < bits {
        (square / (1.0 - square / bits)).sqrt()
    } else {
        f64::INFINITY
    }
}

/// z with Φ(−z) = p, for p below 0.1, to some per cent: by Mills' ratio, z²/2 = −ln(p √(2π) (z + 1/z)).
fn quantile(p: f64) -> f64 {
    let mut z: f64 = 2.0;
    for _ in 0..20 {
        let tail = p * (2.0 * std::f64::consts::PI).sqrt() * (z + 1.0 / z);
        z = (-2.0 * tail.ln()).max(1.0).sqrt();
    }
    z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_and_margins_are_the_known_ones() {
        for (p, z) in [(1e-2, 2.326), (1e-3, 3.090), (2e-5, 4.107), (1e-7, 5.199)] {
            assert!((quantile(p) / z - 1.0).abs() < 0.05, "{p} {}", quantile(p));
        }
        // T ≥ 12.95 is evidence of one try; four need a little more.
        let margin = margin_for(EVIDENCE, 512.0);
        let t = margin / (1.0 + margin * margin / 512.0).sqrt();
        assert!((13.0..13.2).contains(&t), "{t}");
        assert_eq!(margin_for(EVIDENCE, 64.0), f64::INFINITY);
        assert_eq!([0.5, 0.25, 2f64.powi(-11), 0.0].map(bits_for), [0, 1, 10, 53]);
    }
}
