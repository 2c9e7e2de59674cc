//! What counts say of probabilities.

/// How sure bounds are.
pub(super) const CONFIDENCE: f64 = 0.999;

/// The largest probability with which so few of `n` trials come true in at least one of a thousand cases (Clopper and Pearson 1934).
pub(super) fn upper_bound(count: usize, n: usize) -> f64 {
    if count >= n {
        return 1.0;
    }
    let (mut low, mut high) = (count as f64 / n as f64, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at_most(count, n, middle) > 1.0 - CONFIDENCE {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// Whether a probability of `p` would give so many of `n` in less than one of a thousand cases. This holds, too, where trials have different
/// probabilities, none above p.
pub(super) fn is_refuted(p: f64, count: usize, n: usize) -> bool {
    count > 0 && 1.0 - at_most(count - 1, n, p) < 1.0 - CONFIDENCE
}

/// P(X ≤ k) for X ~ Binomial(n, p), 0 < p < 1.
fn at_most(k: usize, n: usize, p: f64) -> f64 {
    let odds = (p / (1.0 - p)).ln();
    let mut log_term = n as f64 * (-p).ln_1p();
    let mut sum = 0.0;
    for i in 0..=k.min(n) {
        sum += log_term.exp();
        log_term += ((n - i) as f64 / (i + 1) as f64).ln() + odds;
    }
    sum.min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_those_of_the_definitions() {
        assert!((at_most(1, 4, 0.5) - 5.0 / 16.0).abs() < 1e-14);
        assert!((at_most(4, 4, 0.3) - 1.0).abs() < 1e-14);
        // Of none of n: (1 − p)ⁿ = 10⁻³.
        assert!((upper_bound(0, 100) - (1.0 - 1e-3f64.powf(0.01))).abs() < 1e-12);
        assert_eq!(upper_bound(7, 7), 1.0);
        // P(X ≥ 1) = 10⁻³ for p = 10⁻⁵ in a hundred trials.
        assert!(is_refuted(9.9e-6, 1, 100) && !is_refuted(1.02e-5, 1, 100));
        assert!(
            !is_refuted(0.1, 0, 100_000)
                && !is_refuted(0.1, 10_290, 100_000)
                && is_refuted(0.1, 10_300, 100_000)
        );
    }
}
