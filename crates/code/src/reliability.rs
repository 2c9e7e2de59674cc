//! Which positions carry payload: those of the greatest β-expansion (He et al. 2017, *β-expansion: a theoretical framework for
//! fast and recursive construction of polar codes*), β = 2^¼.
//!
//! Position i counts w(i) = Σ β^s over the bits s of i that are 1. w respects what is known of every channel (the universal partial
//! order: a further 1, or a 1 moved to a higher place, makes a position more reliable) and decides the rest without knowing
//! the noise, so that one set serves every strength of the mark.
//!
//! **No platform orders differently.** w(i) − w(j) = a + b β + c β² + d β³ with whole a, b, c, d. If one of them is not 0 the product of
//! the four conjugates is a whole number that is not 0, and none of them exceeds Σ β^s < 55 for the longest code; so two
//! weights are at least 55⁻³ > 10⁻⁶ apart, and double precision errs by 10⁻¹³.

/// w(i) for every position of a code of this length.
fn weights(length: usize) -> Vec<f64> {
    const POWERS: [f64; 4] = [
        1.0,
        1.189_207_115_002_721,
        std::f64::consts::SQRT_2,
        1.681_792_830_507_429,
    ];
    let power = |s: usize| POWERS[s % 4] * (1u64 << (s / 4)) as f64;
    let bits = length.trailing_zeros() as usize;
    let weight = |i: usize| (0..bits).filter(|s| i >> s & 1 == 1).map(power).sum();
    (0..length).map(weight).collect()
}

/// All positions, the most reliable first.
pub(crate) fn by_reliability(length: usize) -> Vec<usize> {
    let weights = weights(length);
    let mut order: Vec<usize> = (0..length).collect();
    order.sort_by(|&a, &b| weights[b].total_cmp(&weights[a]));
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PolarCode;

    #[test]
    fn weights_are_further_apart_than_rounding_could_move_them() {
        let mut weights = weights(PolarCode::LONGEST);
        weights.sort_by(f64::total_cmp);
        assert!(weights.windows(2).all(|pair| pair[1] - pair[0] > 1e-6));
        assert!(weights[weights.len() - 1] < 55.0);
    }

    #[test]
    fn the_universal_partial_order_holds() {
        for length in [2, 64, 1024, PolarCode::LONGEST] {
            let mut rank = vec![0; length];
            for (place, i) in by_reliability(length).into_iter().enumerate() {
                rank[i] = place;
            }
            for i in 0..length {
                for s in (0..length.trailing_zeros()).filter(|s| i >> s & 1 == 0) {
                    assert!(rank[i | 1 << s] < rank[i], "a further 1 in {i}");
                    if s > 0 && i >> (s - 1) & 1 == 1 {
                        assert!(rank[i ^ (3 << (s - 1))] < rank[i], "a 1 of {i} one place higher");
                    }
                }
            }
        }
    }

    #[test]
    fn short_sets_are_the_ones_in_print() {
        let best = |length, count| {
            let mut set = by_reliability(length)[..count].to_vec();
            set.sort_unstable();
            set
        };
        // Arıkan 2009, the (8, 4) code of his figures; it is the Reed–Muller code RM(1, 3), as (16, 5) is RM(1, 4).
        assert_eq!(best(8, 4), [3, 5, 6, 7]);
        assert_eq!(best(16, 5), [7, 11, 13, 14, 15]);
        assert_eq!(by_reliability(8), [7, 6, 5, 3, 4, 2, 1, 0]);
    }
}
