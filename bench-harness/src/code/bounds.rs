//! What any code of a length and a payload needs: T₀ = √(n · SNR) by the normal approximation, without a limit to its length, and by repetition.

use evaluation::margin::inverse_tail;

/// The least number from `low` to `high` for which `holds`, if it holds from there on.
fn least(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// Capacity and dispersion of a Gaussian channel for ±1 at this signal-to-noise ratio, in bits and bits².
fn capacity_and_dispersion(snr: f64) -> (f64, f64) {
    const STEPS: i32 = 400;
    let (mut total, mut mean, mut square) = (0.0, 0.0, 0.0);
    for i in -STEPS..=STEPS {
        let z = 9.0 * f64::from(i) / f64::from(STEPS);
        let weight = (-0.5 * z * z).exp();
        let ratio = 2.0 * snr + 2.0 * snr.sqrt() * z;
        let bits = 1.0 - ((-ratio).max(0.0) + (-ratio.abs()).exp().ln_1p()) / std::f64::consts::LN_2;
        total += weight;
        mean += weight * bits;
        square += weight * bits * bits;
    }
    let capacity = mean / total;
    (capacity, square / total - capacity * capacity)
}

/// √(n · SNR) from which `carries`, of SNR.
fn t0_from(length: usize, carries: impl Fn(f64) -> bool) -> f64 {
    let log_snr = least(-12.0, 5.0, |log_snr: f64| carries(log_snr.exp()));
    (length as f64 * log_snr.exp()).sqrt()
}

/// For k bits in n at this frame error rate (Polyanskiy, Poor and Verdú 2010): k ≤ n C − √(n V) Q⁻¹(ε) + ½ log₂ n.
pub(super) fn normal_approximation(bits: f64, length: usize, rate: f64) -> f64 {
    let (n, quantile) = (length as f64, inverse_tail(rate));
    t0_from(length, |snr| {
        let (capacity, dispersion) = capacity_and_dispersion(snr);
        n * capacity - (n * dispersion).sqrt() * quantile + 0.5 * n.log2() >= bits
    })
}

/// For codes of this rate and any length (Shannon 1948).
pub(super) fn shannon(bits: usize, length: usize) -> f64 {
    t0_from(length, |snr| {
        capacity_and_dispersion(snr).0 * length as f64 >= bits as f64
    })
}

/// All bits right with this frame error rate, where each is repeated alike and the sign of its sum decides.
pub(super) fn repetition(bits: usize, rate: f64) -> f64 {
    let wrong = -((-rate).ln_1p() / bits as f64).exp_m1();
    (bits as f64).sqrt() * inverse_tail(wrong)
}

/// Decibels of Eb/N0 at T₀: T₀² = 2 k Eb/N0.
pub(super) fn eb_n0(t0: f64, bits: usize) -> f64 {
    10.0 * (t0 * t0 / (2.0 * bits as f64)).log10()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn capacities_are_the_ones_in_print() {
        // Rate 1/2 over the Gaussian channel for ±1: Eb/N0 = 0.187 dB; rate 1/4: −0.794 dB.
        assert!((eb_n0(shannon(512, 1024), 512) - 0.187).abs() < 2e-3);
        assert!((eb_n0(shannon(512, 2048), 512) + 0.794).abs() < 2e-3);
    }

    #[test]
    fn the_bound_lies_above_capacity_and_nears_it_with_length() {
        let above = |k: usize| normal_approximation(k as f64, 4 * k, 1e-3) / shannon(k, 4 * k);
        assert!(above(128) > above(512) && above(512) > above(8192) && above(8192) > 1.0);
        assert!((repetition(1, 1e-3) - 3.090_232).abs() < 1e-5);
    }
}
