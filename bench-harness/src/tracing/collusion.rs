//! What colluders make of their copies (Zhao, Wang, Wu and Liu 2005).

use rand_chacha::{ChaCha20Rng, rand_core::Rng};

/// What they compare.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Domain {
    /// Coordinates of vertices, which stand in their files.
    Coordinates,
    /// Coefficients of the very harmonics of the mark: who has not the original knows them nearly.
    Harmonics,
}

impl Domain {
    pub(super) const ALL: &[Self] = &[Self::Coordinates, Self::Harmonics];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Coordinates => "coordinates",
            Self::Harmonics => "harmonics",
        }
    }
}

/// What they take of each number, of which every one has his own.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Rule {
    /// The mean.
    Average,
    /// Any one's.
    Interleaving,
    /// The mean of the least and the greatest.
    MinMax,
    Median,
    /// Of the least and the greatest that which is farther from the median.
    Minority,
    /// The least and the greatest less the median.
    ModifiedNegative,
    /// The least or the greatest.
    RandomNegative,
}

/// All of them.
pub(super) const RULES: [Rule; 7] = [
    Rule::Average,
    Rule::Interleaving,
    Rule::MinMax,
    Rule::Median,
    Rule::Minority,
    Rule::ModifiedNegative,
    Rule::RandomNegative,
];

impl Rule {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Average => "average",
            Self::Interleaving => "interleaving",
            Self::MinMax => "min-max",
            Self::Median => "median",
            Self::Minority => "minority",
            Self::ModifiedNegative => "modified negative",
            Self::RandomNegative => "random negative",
        }
    }

    /// What becomes of one number.
    fn of(self, own: &mut [f64], rng: &mut ChaCha20Rng) -> f64 {
        let count = own.len();
        let any = own[rng.next_u32() as usize % count];
        own.sort_by(f64::total_cmp);
        let (least, most, median) = (
            own[0],
            own[count - 1],
            0.5 * (own[(count - 1) / 2] + own[count / 2]),
        );
        match self {
            Self::Average => own.iter().sum::<f64>() / count as f64,
            Self::Interleaving => any,
            Self::MinMax => 0.5 * (least + most),
            Self::Median => median,
            Self::Minority if median - least > most - median => least,
            Self::Minority => most,
            Self::ModifiedNegative => least + most - median,
            Self::RandomNegative if rng.next_u32() & 1 == 0 => least,
            Self::RandomNegative => most,
        }
    }

    /// What becomes of all.
    pub(super) fn mixed(self, copies: &[&[f64]], rng: &mut ChaCha20Rng) -> Vec<f64> {
        let count = copies.first().map_or(0, |copy| copy.len());
        let mut own = vec![0.0; copies.len()];
        let one = |i: usize| {
            own.iter_mut().zip(copies).for_each(|(own, copy)| *own = copy[i]);
            self.of(&mut own, rng)
        };
        (0..count).map(one).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::rand_core::SeedableRng;

    #[test]
    fn rules_are_what_their_names_say() {
        let copies: [&[f64]; 3] = [&[1.0], &[2.0], &[6.0]];
        let of = |rule: Rule| rule.mixed(&copies, &mut ChaCha20Rng::from_seed([1; 32]))[0];
        assert_eq!(of(Rule::Average), 3.0);
        assert_eq!(of(Rule::MinMax), 3.5);
        assert_eq!(of(Rule::Median), 2.0);
        assert_eq!(of(Rule::Minority), 6.0);
        assert_eq!(of(Rule::ModifiedNegative), 5.0);
        assert!([1.0, 6.0].contains(&of(Rule::RandomNegative)));
        assert!([1.0, 2.0, 6.0].contains(&of(Rule::Interleaving)));
        // Of ±1 on known harmonics, the minority is the sign that two of three don't have.
        let signs: [&[f64]; 3] = [&[1.0], &[1.0], &[-1.0]];
        assert_eq!(
            Rule::Minority.mixed(&signs, &mut ChaCha20Rng::from_seed([1; 32])),
            [-1.0]
        );
    }
}
