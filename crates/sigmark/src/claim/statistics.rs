//! How sure the answer is.
//!
//! The bits of a mark are pseudo-random and do not depend on the suspect. For any estimate x that a detector makes
//! without looking at them, a mesh that does not carry the mark gives fair coin flips, whatever the attack was. That holds for the bits of a codeword, too, of which only some combinations
//! are codewords: what stands in the shape is added to a stream of h, so that to everybody who has not computed h, each bit is a coin of its own.

pub use crate::mark::{correlation, extraction_rate};

use crate::mark::Reading;

/// The probability that a mesh without the mark agrees with `signature` at least as well as `soft` does, or better: an
/// upper bound that holds for every attack and every noise.
///
/// Two tails are known. T is a Rademacher sum, so P(T ≥ τ) ≤ exp(−τ²/2) (Hoeffding 1963). The number of matching signs
/// is binomial with p = ½ over the non-zero xₜ, whose tail is exact. The smaller of the two counts, doubled because
/// there are two of them.
pub fn p_value(signature: &[bool], soft: &[f64]) -> f64 {
    let t = correlation(signature, soft);
    let by_correlation = if t > 0.0 { (-0.5 * t * t).exp() } else { 1.0 };
    let [read, wrong] = read_and_wrong(signature, soft);
    (2.0 * by_correlation.min(binomial_tail(read, read - wrong))).min(1.0)
}

/// P(Σ sₜ xₜ ≥ T √(Σ xₜ²)) for fair signs s and any x, an upper bound: the smaller of Hoeffding's (1963) exp(−T²/2) and Q(T) / (4 Q(√2)), which is attained (Bentkus and Dzindzalieta 2015). Of Q, the normal tail, it takes
/// Sampford's (1953) upper bound 4 φ(T) / (3 T + √(T² + 8)).
pub fn rademacher_tail(t: f64) -> f64 {
    if t <= 0.0 {
        return 1.0;
    }
    let hoeffding = (-0.5 * t * t).exp();
    let normal = 4.0 * hoeffding / ((2.0 * std::f64::consts::PI).sqrt() * (3.0 * t + (t * t + 8.0).sqrt()));
    hoeffding.min(RADEMACHER_TO_NORMAL * normal)
}

/// 1 / (4 Q(√2)).
const RADEMACHER_TO_NORMAL: f64 = 3.178_517;

/// T₀ = T / √(1 − T²/l) over the l bits of which something was read: the matched filter's signal-to-noise ratio, √l Φ⁻¹(ER) where noise is Gaussian. T ends at √l, T₀
/// does not. What was read almost without a spread counts as T² short of l by a ten-thousandth: 100 √l.
pub fn margin(signature: &[bool], soft: &[f64]) -> f64 {
    let read = soft.iter().filter(|x| **x != 0.0).count();
    margin_of(correlation(signature, soft), read)
}

/// T₀ of T over so many bits.
pub(super) fn margin_of(t: f64, bits: usize) -> f64 {
    t / (1.0 - t * t / bits.max(1) as f64).max(1e-4).sqrt()
}

/// Of how many bits something was read, and how many of those are wrong.
pub fn read_and_wrong(signature: &[bool], soft: &[f64]) -> [usize; 2] {
    let decided = signature.iter().zip(soft).filter(|(_, x)| **x != 0.0);
    decided.fold([0, 0], |[read, wrong], (&s, &x)| {
        [read + 1, wrong + usize::from(s != (x > 0.0))]
    })
}

/// The [`p_value`] of a reading that was chosen, times the number of all that could have been (union bound), at most 1.
pub fn p_of_chosen(signature: &[bool], reading: &Reading) -> f64 {
    (p_value(signature, &reading.soft.weights()) * reading.tries as f64).min(1.0)
}

/// P(X ≥ k) for X ~ Binomial(n, ½), to about 12 digits.
pub fn binomial_tail(n: usize, k: usize) -> f64 {
    if k == 0 {
        return 1.0;
    }
    if 2 * k <= n {
        return 1.0 - binomial_tail(n, n - k + 1);
    }
    // From the largest term outwards: C(n, k) 2⁻ⁿ, then ratios C(n, i+1)/C(n, i) = (n − i)/(i + 1).
    let log_choose: f64 = (0..n.saturating_sub(k))
        .map(|i| ((n - i) as f64 / (i + 1) as f64).ln())
        .sum();
    let mut term = 1.0;
    let mut sum = 0.0;
    for i in k..=n {
        sum += term;
        term *= (n - i) as f64 / (i + 1) as f64;
    }
    sum * (log_choose - n as f64 * std::f64::consts::LN_2).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_binomial_tail_sums_small_cases_exactly() {
        assert!((binomial_tail(4, 0) - 1.0).abs() < 1e-15);
        assert!((binomial_tail(4, 1) - 15.0 / 16.0).abs() < 1e-12);
        assert!((binomial_tail(4, 2) - 11.0 / 16.0).abs() < 1e-12);
        assert!((binomial_tail(4, 3) - 5.0 / 16.0).abs() < 1e-12);
        assert!((binomial_tail(4, 4) - 1.0 / 16.0).abs() < 1e-12);
        assert_eq!(binomial_tail(4, 5), 0.0);
    }

    #[test]
    fn the_known_thresholds_of_324_bits_come_out() {
        // Matches needed for a false-positive rate of 1e-6, 1e-9, 1e-12 and 2^-80.
        for (matches, bound) in [(206, 1e-6), (216, 1e-9), (226, 1e-12), (252, 2f64.powi(-80))] {
            assert!(binomial_tail(324, matches) <= bound);
            assert!(binomial_tail(324, matches - 1) > bound);
        }
        // The paper's threshold of 56.1 %: 182 matches, a false-positive rate of about 1.5 %.
        assert!((binomial_tail(324, 182) - 0.015).abs() < 0.002);
    }

    /// Of n fair signs and equal weights the tail is binomial; the bound is above it, and within a factor of four where it is smooth.
    #[test]
    fn the_tail_of_a_sum_of_signs_is_bounded() {
        for n in [2, 3, 10, 100, 1000, 3000] {
            for k in n / 2 + 1..=n {
                let t = (2 * k - n) as f64 / (n as f64).sqrt();
                let (bound, exact) = (rademacher_tail(t), binomial_tail(n, k));
                assert!(bound >= exact * (1.0 - 1e-9), "{n} {k}: {bound:e} {exact:e}");
                if n >= 1000 && t > 2.0 && t < 7.0 {
                    assert!(bound < 4.5 * exact, "{n} {k}: {bound:e} {exact:e}");
                }
            }
        }
        assert_eq!(rademacher_tail(-1.0), 1.0);
    }

    #[test]
    fn silence_proves_nothing() {
        assert_eq!(p_value(&[true; 324], &[0.0; 324]), 1.0);
        assert_eq!(correlation(&[true; 3], &[0.0; 3]), 0.0);
    }

    #[test]
    fn a_perfect_reading_is_sure_and_an_inverted_one_is_not() {
        let signature: Vec<bool> = (0..324).map(|i| i % 3 == 0).collect();
        let soft: Vec<f64> = signature.iter().map(|&s| if s { 2.0 } else { -2.0 }).collect();
        assert!((correlation(&signature, &soft) - 18.0).abs() < 1e-12);
        assert!(p_value(&signature, &soft) < 1e-90);
        let inverted: Vec<f64> = soft.iter().map(|x| -x).collect();
        assert_eq!(p_value(&signature, &inverted), 1.0);
    }

    #[test]
    fn the_margin_is_the_signal_to_noise_ratio_of_all_bits_together() {
        use rand_chacha::{
            ChaCha8Rng,
            rand_core::{Rng, SeedableRng},
        };
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        // Twelve uniform numbers make a normal one of variance 1.
        let mut normal = || {
            (0..12)
                .map(|_| f64::from(rng.next_u32()) / f64::from(u32::MAX))
                .sum::<f64>()
                - 6.0
        };
        let bits = vec![true; 8192];
        for signal in [0.1, 0.5, 2.0] {
            let soft: Vec<f64> = bits.iter().map(|_| signal + normal()).collect();
            let expected = signal * 8192f64.sqrt();
            assert!(
                (margin(&bits, &soft) - expected).abs() < 3.0 + 0.02 * expected,
                "{signal}"
            );
        }
        assert_eq!(margin(&bits, &[0.0; 8192]), 0.0);
        assert!((margin(&bits, &[1.0; 8192]) / (100.0 * 8192f64.sqrt()) - 1.0).abs() < 1e-9);
        // What was not seen takes no part.
        let half: Vec<f64> = (0..8192).map(|t| if t < 4096 { 1.0 } else { 0.0 }).collect();
        assert!((margin(&bits, &half) / (100.0 * 64.0) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_bound_holds_for_random_signs() {
        use rand_chacha::{
            ChaCha8Rng,
            rand_core::{Rng, SeedableRng},
        };
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let soft: Vec<f64> = (0..64).map(|t| f64::from(t % 7) - 2.5).collect();
        let mut below = [0usize; 3];
        for _ in 0..20_000 {
            let signature: Vec<bool> = (0..64).map(|_| rng.next_u32() & 1 == 1).collect();
            let p = p_value(&signature, &soft);
            for (count, level) in below.iter_mut().zip([0.1, 0.01, 0.001]) {
                *count += usize::from(p <= level);
            }
        }
        assert!(below[0] <= 2000 && below[1] <= 200 && below[2] <= 20, "{below:?}");
    }
}
