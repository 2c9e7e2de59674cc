use sha2::{Digest, Sha256};

use super::{MarkError, Patch, Rotation};

/// Where the chips of `bits` bits sit in the spectrum of a patch, each bit repeated `rate` times (eqs. 11–13).
///
/// Chip p carries bit p mod l and moves the coefficient of frequency 1 + ⌊p/3⌋ along axis p mod 3. Frequency 0, the
/// constant function (the lowest one where borders are fixed), is never touched. Bit t thus sits at p = t, t + l, t + 2l, …: the printed index `k+1+i/3` of
/// eq. 15 is k + 1 + i·l/3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChipLayout {
    bits: usize,
    rate: usize,
}

/// The place of one chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chip {
    /// The bit that it repeats, from 0.
    pub bit: usize,
    /// The manifold harmonic that it modulates, from 1.
    pub frequency: usize,
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
}

/// Which bit each chip of a mark carries, in all patches.
///
/// A patch with m manifold harmonics has 3 (m − 1) places for chips: place p is frequency 1 + ⌊p/3⌋ along axis p mod 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ChipPlan {
    /// The paper's: every patch carries all bits, c times each, in the order of eq. 15.
    EveryPatch(ChipLayout),
    /// All places of all patches are one sequence, patch after patch, in which l that follow each other carry every bit once. Patches may
    /// have any numbers of harmonics.
    Pooled {
        /// l, how many bits there are.
        bits: usize,
        /// How many chips say all that the bits hold, at most l: fewer where these are a codeword.
        enough: usize,
        /// What the [rotation](Rotation) follows from, that spreads chips over the harmonics.
        ///
        /// A mark of another key is noise to it: what that does to one chip of a bit says nothing about the bit's other chips, and adds up like noise.
        key: [u8; 32],
    },
}

impl ChipPlan {
    /// A pooled plan of bits of which each is needed.
    pub fn pooled(bits: usize, key: [u8; 32]) -> Self {
        let enough = bits;
        Self::Pooled { bits, enough, key }
    }

    /// l, how many bits there are.
    pub fn bits(&self) -> usize {
        match self {
            Self::EveryPatch(layout) => layout.bits,
            Self::Pooled { bits, .. } => *bits,
        }
    }

    /// How many chips lie on each axis of a patch with so many harmonics.
    pub fn chips_per_axis(&self, functions: usize) -> [usize; 3] {
        match self {
            Self::EveryPatch(layout) => layout.chips_per_axis(),
            Self::Pooled { .. } => [functions.saturating_sub(1); 3],
        }
    }

    /// φ, the size of a patch along each axis that α is relative to: in the paper the edges of its bounding box, and the side of a square of its
    /// area where chips are pooled, so that a small flat patch is marked alike however it lies.
    pub fn size(&self, patch: &Patch) -> [f64; 3] {
        match self {
            Self::EveryPatch(_) => patch.size(),
            Self::Pooled { .. } => [patch.mesh().area().sqrt(); 3],
        }
    }

    /// Whether patches with these numbers of harmonics have room for the mark (Theorem 1): 3 (m − 1) chips a patch at most, and every bit
    /// once, or enough of them.
    ///
    /// # Errors
    /// [`MarkError::Room`] if not.
    pub fn check(&self, functions: &[usize]) -> Result<(), MarkError> {
        // Numbers may come from a file.
        let places = |m: &usize| m.saturating_sub(1).saturating_mul(3);
        let (found, least) = match self {
            Self::EveryPatch(layout) => (
                functions.iter().map(places).min().unwrap_or(0),
                layout.bits.saturating_mul(layout.rate),
            ),
            Self::Pooled { enough, .. } => {
                let all = functions.iter().map(places);
                (all.fold(0, usize::saturating_add), *enough)
            }
        };
        if found >= least && least > 0 {
            return Ok(());
        }
        Err(MarkError::Room { found, least })
    }

    /// The chips of all patches, each of which has so many harmonics.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn chips(&self, functions: &[usize]) -> Result<Vec<Vec<Chip>>, MarkError> {
        self.check(functions)?;
        Ok(match self {
            Self::EveryPatch(layout) => vec![layout.chips().collect(); functions.len()],
            Self::Pooled { bits, .. } => pooled(*bits, functions),
        })
    }

    /// What spreads the chips of patches with so many harmonics over these; in the paper's plan each chip sits on one.
    pub fn rotation(&self, functions: &[usize]) -> Option<Rotation> {
        match self {
            Self::EveryPatch(_) => None,
            Self::Pooled { key, .. } => Some(Rotation::keyed(key, functions)),
        }
    }
}

/// Low, middle and high frequencies of a patch.
const STRATA: usize = 3;

/// Repetition j of the bits takes the places q = j l … (j + 1) l − 1 of the sequence. There, bits take turns on the axes and on low,
/// middle and high frequencies, so that each gets its share of all: an axis is what a surface sampled along normals shows, and a frequency what smoothing takes.
/// Which of a code's bits a crop takes should have no pattern, so the order is a random one; it is the same for all marks, whose keys are in their rotations.
fn pooled(bits: usize, functions: &[usize]) -> Vec<Vec<Chip>> {
    let places: Vec<Place> = functions.iter().flat_map(|&m| places(m)).collect();
    let mut ranked: Vec<usize> = (0..bits).collect();
    ranked.sort_by_cached_key(|&t| hash("bit", t));
    let mut carried = vec![0; places.len()];
    for (j, in_repetition) in places.chunks(bits).enumerate() {
        let first = j * bits;
        // Ranks r of the bits that are carried: of all but in the last repetition, which may be shorter.
        let mut turns: Vec<usize> = (0..in_repetition.len()).collect();
        turns.sort_by_key(|&r| ((r + j) % 3, (r / 3 + j) % STRATA, r));
        let mut order: Vec<usize> = (0..in_repetition.len()).collect();
        order.sort_by_cached_key(|&i| {
            let place = &in_repetition[i];
            (place.axis, place.stratum, hash("place", first + i))
        });
        for (i, r) in order.into_iter().zip(turns) {
            carried[first + i] = ranked[r];
        }
    }
    let mut chips = places.iter().zip(carried).map(|(place, bit)| Chip {
        bit,
        frequency: place.frequency,
        axis: place.axis,
    });
    let of_patch = |&m: &usize| chips.by_ref().take(3 * m.saturating_sub(1)).collect();
    functions.iter().map(of_patch).collect()
}

/// A place for a chip.
struct Place {
    frequency: usize,
    axis: usize,
    stratum: usize,
}

/// Those of a patch with so many harmonics, in order.
fn places(functions: usize) -> impl Iterator<Item = Place> {
    let useful = functions.saturating_sub(1);
    (0..3 * useful).map(move |p| Place {
        frequency: 1 + p / 3,
        axis: p % 3,
        stratum: STRATA * (p / 3) / useful,
    })
}

fn hash(of: &str, number: usize) -> [u8; 32] {
    let hash = Sha256::new()
        .chain_update(b"sigmark chips v7\0")
        .chain_update(of)
        .chain_update((number as u64).to_le_bytes());
    hash.finalize().into()
}

impl ChipLayout {
    /// A layout of l = `bits` with chip rate c = `rate`.
    ///
    /// # Errors
    /// When either is zero.
    pub fn new(bits: usize, rate: usize) -> Result<Self, MarkError> {
        if bits == 0 || rate == 0 {
            return Err(MarkError::EmptyLayout { bits, rate });
        }
        Ok(Self { bits, rate })
    }

    /// l, the length of the signature.
    pub fn bits(&self) -> usize {
        self.bits
    }

    /// c, how often each bit is repeated in a patch.
    pub fn rate(&self) -> usize {
        self.rate
    }

    /// ⌈l c / 3⌉, how many frequencies are modulated.
    pub fn frequencies(&self) -> usize {
        self.bits.saturating_mul(self.rate).div_ceil(3)
    }

    /// m = ⌈l c / 3⌉ + 1, the least number of manifold harmonics that a patch needs (Theorem 1).
    pub fn functions(&self) -> usize {
        self.frequencies() + 1
    }

    /// All l c chips in the order of p.
    pub fn chips(&self) -> impl Iterator<Item = Chip> + use<> {
        let bits = self.bits;
        (0..bits * self.rate).map(move |p| Chip {
            bit: p % bits,
            frequency: 1 + p / 3,
            axis: p % 3,
        })
    }

    /// How many chips lie on each axis.
    pub fn chips_per_axis(&self) -> [usize; 3] {
        let chips = self.bits * self.rate;
        std::array::from_fn(|axis| (chips + 2 - axis) / 3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_parameters_need_325_functions() {
        assert_eq!(ChipLayout::new(324, 3).unwrap().functions(), 325);
        assert_eq!(ChipLayout::new(512, 3).unwrap().functions(), 513);
    }

    #[test]
    fn every_bit_has_its_chips_and_no_coefficient_has_two() {
        for (bits, rate) in [(324, 3), (512, 3), (512, 1), (7, 2), (1, 1)] {
            let layout = ChipLayout::new(bits, rate).unwrap();
            let mut chips_of_bit = vec![0; bits];
            let mut per_axis = [0; 3];
            let mut used = std::collections::HashSet::new();
            for chip in layout.chips() {
                chips_of_bit[chip.bit] += 1;
                per_axis[chip.axis] += 1;
                assert!((1..=layout.frequencies()).contains(&chip.frequency));
                assert!(used.insert((chip.frequency, chip.axis)));
            }
            assert!(chips_of_bit.iter().all(|&count| count == rate));
            assert_eq!(per_axis, layout.chips_per_axis());
        }
    }

    #[test]
    fn pooled_chips_fill_every_place_and_repetitions_have_every_bit_in_turn_on_the_axes() {
        for (bits, functions) in [
            (512, vec![220, 3, 90, 141, 33]),
            (7, vec![2, 2, 5]),
            (1, vec![2]),
            (9, vec![4, 1, 9, 2]),
        ] {
            let chips = ChipPlan::pooled(bits, [4; 32]).chips(&functions).unwrap();
            for (chips, &m) in chips.iter().zip(&functions) {
                let places = chips.iter().map(|chip| 3 * (chip.frequency - 1) + chip.axis);
                assert!(places.eq(0..3 * (m - 1)));
            }
            let all = chips.concat();
            let mut axes = vec![[0; 3]; bits];
            for repetition in all.chunks(bits) {
                let mut seen: Vec<usize> = repetition.iter().map(|chip| chip.bit).collect();
                seen.sort_unstable();
                seen.dedup();
                assert_eq!(seen.len(), repetition.len());
            }
            let turns = all.len() / bits / 3;
            all[..3 * turns * bits]
                .iter()
                .for_each(|chip| axes[chip.bit][chip.axis] += 1);
            // Axes differ by one place in size at most, so that few bits are one axis off.
            let uneven = axes
                .iter()
                .filter(|axes| axes.iter().any(|&n| n != turns))
                .count();
            assert!(uneven <= 9 * turns, "{uneven} of {bits}");
        }
    }

    /// The page of the certificate says how the order is made.
    #[test]
    fn the_order_is_the_one_that_the_certificate_page_prints() {
        let (l, functions) = (11, [4, 3, 6]);
        let plan = ChipPlan::pooled(l, [7; 32]);
        let chips = plan.chips(&functions).unwrap().concat();
        let hash = |of: &str, number: usize| {
            let number = (number as u64).to_le_bytes();
            Sha256::digest([b"sigmark chips v7\0", of.as_bytes(), &number].concat())
        };
        let frequencies = functions.iter().flat_map(|&m| (1..m).map(move |k| (k, m)));
        let places: Vec<(usize, usize)> = frequencies
            .flat_map(|(k, m)| (0..3).map(move |axis| (axis, 3 * (k - 1) / (m - 1))))
            .collect();
        let mut ranked: Vec<usize> = (0..l).collect();
        ranked.sort_by_key(|&t| hash("bit", t));
        for j in 0..chips.len().div_ceil(l) {
            let mut here: Vec<usize> = (j * l..((j + 1) * l).min(chips.len())).collect();
            let mut ranks: Vec<usize> = (0..here.len()).collect();
            here.sort_by_key(|&q| (places[q].0, places[q].1, hash("place", q)));
            ranks.sort_by_key(|&r| ((r + j) % 3, (r / 3 + j) % 3, r));
            for (q, r) in here.into_iter().zip(ranks) {
                assert_eq!(chips[q].bit, ranked[r]);
            }
        }
    }

    #[test]
    fn the_papers_plan_is_the_same_in_every_patch_and_each_needs_room_for_all() {
        let layout = ChipLayout::new(7, 2).unwrap();
        let plan = ChipPlan::EveryPatch(layout);
        let chips = plan.chips(&[layout.functions(), 99]).unwrap();
        assert_eq!(chips[0], layout.chips().collect::<Vec<_>>());
        assert_eq!(chips[0], chips[1]);
        let error = plan.check(&[layout.functions() - 1, 99]).unwrap_err();
        assert!(matches!(error, MarkError::Room { found: 12, least: 14 }));
        let pooled = ChipPlan::pooled(7, [0; 32]);
        assert!(matches!(
            pooled.check(&[2, 2, 1]).unwrap_err(),
            MarkError::Room { found: 6, least: 7 }
        ));
        assert!(pooled.check(&[2, 3, 1]).is_ok());
    }

    #[test]
    fn a_layout_without_bits_or_chips_is_refused() {
        assert!(ChipLayout::new(0, 3).is_err());
        assert!(ChipLayout::new(324, 0).is_err());
    }
}
