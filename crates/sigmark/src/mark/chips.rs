use sha2::{Digest, Sha256};

use super::MarkError;

/// Where the chips of a signature of `bits` bits sit in the spectrum of a patch, each bit repeated `rate` times (eqs. 11–13).
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
    /// The bit of the signature that it repeats, from 0.
    pub bit: usize,
    /// The manifold harmonic that it modulates, from 1.
    pub frequency: usize,
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
}

/// Which bit goes to which of the places that a [`ChipLayout`] has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ChipOrder {
    /// That of eq. 15, in every patch.
    #[default]
    Natural,
    /// Another one in every patch and repetition, by a key. Bits take turns on the axes, so that each keeps its share of every axis and of
    /// low and high frequencies.
    ///
    /// Where the chips of two marks with different keys meet, they belong to different bits: what another mark does to one chip of a bit
    /// says nothing about the bit's other chips, and adds up like noise.
    Keyed([u8; 32]),
}

impl ChipOrder {
    /// All l c chips of a patch, by its number from 0.
    pub fn chips(&self, layout: &ChipLayout, patch: usize) -> Vec<Chip> {
        let mut chips: Vec<Chip> = layout.chips().collect();
        let Self::Keyed(key) = self else {
            return chips;
        };
        for (j, repetition) in chips.chunks_mut(layout.bits).enumerate() {
            let turn = patch * layout.rate + j;
            let mut bits: Vec<usize> = (0..layout.bits).collect();
            bits.sort_by_key(|&t| (t + turn) % 3);
            repetition.sort_by_cached_key(|place| (place.axis, rank(key, patch, place)));
            for (place, bit) in repetition.iter_mut().zip(bits) {
                place.bit = bit;
            }
        }
        chips
    }
}

/// The places of an axis are in the order of these hashes.
fn rank(key: &[u8; 32], patch: usize, place: &Chip) -> [u8; 32] {
    let p = 3 * (place.frequency - 1) + place.axis;
    let hash = Sha256::new()
        .chain_update(b"sigmark chips v3\0")
        .chain_update(key)
        .chain_update((patch as u64).to_le_bytes())
        .chain_update((p as u64).to_le_bytes());
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

    /// Whether patches that were cut for this layout suit a mark of another.
    pub(crate) fn check(&self, wanted: &Self) -> Result<(), MarkError> {
        if self == wanted {
            return Ok(());
        }
        Err(MarkError::Layout {
            bits: self.bits,
            rate: self.rate,
            wanted_bits: wanted.bits,
            wanted_rate: wanted.rate,
        })
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
    fn in_a_keyed_order_every_repetition_has_every_bit_and_bits_take_turns_on_the_axes() {
        for (bits, rate) in [(512, 3), (324, 3), (7, 2), (1, 1)] {
            let layout = ChipLayout::new(bits, rate).unwrap();
            let mut axes = vec![[0; 3]; bits];
            for patch in 0..3 {
                let keyed = ChipOrder::Keyed([4; 32]).chips(&layout, patch);
                let of_places = |chips: &[Chip]| -> std::collections::BTreeSet<_> {
                    chips.iter().map(|chip| (chip.frequency, chip.axis)).collect()
                };
                assert_eq!(of_places(&keyed), of_places(&layout.chips().collect::<Vec<_>>()));
                for repetition in keyed.chunks(bits) {
                    let mut seen: Vec<usize> = repetition.iter().map(|chip| chip.bit).collect();
                    seen.sort_unstable();
                    assert!(seen.into_iter().eq(0..bits));
                    repetition.iter().for_each(|chip| axes[chip.bit][chip.axis] += 1);
                }
            }
            // Axes differ by one place in size at most, so that one bit in each turn may be one axis off.
            let uneven = axes.iter().filter(|axes| axes.iter().any(|&n| n != rate)).count();
            assert!(uneven <= 6 * rate, "{uneven} of {bits}");
        }
    }

    /// The page of the certificate says how the order is made.
    #[test]
    fn the_order_is_the_one_that_the_certificate_page_prints() {
        let (l, c, patch) = (11, 2, 2);
        let chips = ChipOrder::Keyed([7; 32]).chips(&ChipLayout::new(l, c).unwrap(), patch);
        let bit_at = |p: usize| {
            let at_place = |chip: &&Chip| (chip.frequency, chip.axis) == (1 + p / 3, p % 3);
            chips.iter().find(at_place).map(|chip| chip.bit)
        };
        for j in 0..c {
            let hash = |p: usize| {
                let numbers = [(patch as u64).to_le_bytes(), (p as u64).to_le_bytes()].concat();
                Sha256::digest([b"sigmark chips v3\0", &[7; 32][..], &numbers].concat())
            };
            let mut places: Vec<usize> = (j * l..(j + 1) * l).collect();
            places.sort_by_key(|&p| (p % 3, hash(p)));
            let mut bits: Vec<usize> = (0..l).collect();
            bits.sort_by_key(|t| ((t + patch * c + j) % 3, *t));
            for (p, bit) in places.into_iter().zip(bits) {
                assert_eq!(bit_at(p), Some(bit));
            }
        }
    }

    #[test]
    fn another_key_or_patch_is_another_order() {
        let layout = ChipLayout::new(512, 3).unwrap();
        let of = |key, patch| ChipOrder::Keyed([key; 32]).chips(&layout, patch);
        let same = |a: Vec<Chip>, b: Vec<Chip>| a.iter().filter(|chip| b.contains(chip)).count();
        // Of 1 536 chips nine stay in the mean where bits keep their axes: one of each of nine permutations.
        assert!(same(of(1, 0), of(2, 0)) < 30 && same(of(1, 0), of(1, 1)) < 30);
        assert_eq!(of(1, 0), of(1, 0));
    }

    #[test]
    fn a_layout_without_bits_or_chips_is_refused() {
        assert!(ChipLayout::new(0, 3).is_err());
        assert!(ChipLayout::new(324, 0).is_err());
    }
}
