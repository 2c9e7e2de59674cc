//! T₀ of an extraction rate.

/// T₀ = √l Φ⁻¹(ER) of the l bits of a mark: the signal-to-noise ratio of a matched filter, where each bit is carried as strongly as another. 0 where no more than half are right.
///
/// `read` bits say what the rate is, of one or several readings. Where all of them are right T₀ is at least what comes out: as if half of one were wrong.
pub fn margin_of_rate(rate: f64, bits: usize, read: usize) -> f64 {
    let wrong = (1.0 - rate).max(0.5 / read.max(1) as f64);
    match wrong < 0.5 {
        true => (bits as f64).sqrt() * inverse_tail(wrong),
        false => 0.0,
    }
}

/// x ≥ 0 that a standard normal variable exceeds with probability p ≤ 1/2.
pub fn inverse_tail(p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        match 0.5 * libm::erfc(middle * std::f64::consts::FRAC_1_SQRT_2) > p {
            true => low = middle,
            false => high = middle,
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_the_ones_in_print() {
        assert!((inverse_tail(1e-3) - 3.090_232).abs() < 1e-6);
        assert!((inverse_tail(0.025) - 1.959_964).abs() < 1e-6);
        assert!(inverse_tail(0.5) < 1e-9);
    }

    #[test]
    fn t0_follows_from_the_rate_and_ends_where_half_a_bit_is_wrong() {
        assert!((margin_of_rate(0.94, 512, 512) - 35.2).abs() < 0.1);
        assert!((margin_of_rate(0.79, 512, 512) - 18.2).abs() < 0.1);
        assert_eq!(margin_of_rate(0.5, 512, 512), 0.0);
        assert_eq!(margin_of_rate(0.4, 512, 512), 0.0);
        assert!((margin_of_rate(1.0, 512, 512) - 70.1).abs() < 0.1);
        assert!(margin_of_rate(1.0, 512, 1536) > margin_of_rate(1.0, 512, 512));
    }
}
