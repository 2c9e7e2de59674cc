use sha2::{Digest, Sha256};

use super::MarkError;

/// Where the chips of a signature of `bits` bits sit in the spectrum of a patch, each bit repeated `rate` times (eqs. 11–13).
///
/// Chip p carries bit p mod l and moves the coefficient of frequency 1 + ⌊p/3⌋ along axis p mod 3. Frequency 0, the
/// constant function, is never touched. Bit t thus sits at p = t, t + l, t + 2l, …: the printed index `k+1+i/3` of
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
pub enum ChipOrder {
    /// That of eq. 15, in every patch.
    #[default]
    Natural,
    /// Another one in every patch, by a key. Bits change places with others that sit on the same axis and in the same repetition, so that
    /// each keeps its share of every axis and of low and high frequencies.
    ///
    /// The chips of two marks with different keys that meet in a coefficient belong to different bits: what another mark does to one chip of
    /// a bit says nothing about the bit's other chips, and adds up like noise.
    Keyed([u8; 32]),
}

impl ChipOrder {
    /// All l c chips of a patch, by its number from 0.
    pub fn chips(&self, layout: &ChipLayout, patch: usize) -> Vec<Chip> {
        let mut chips: Vec<Chip> = layout.chips().collect();
        let Self::Keyed(key) = self else {
            return chips;
        };
        for repetition in chips.chunks_mut(layout.bits) {
            for axis in 0..3 {
                let mut places: Vec<usize> = (axis..repetition.len()).step_by(3).collect();
                let bits: Vec<usize> = places.iter().map(|&i| repetition[i].bit).collect();
                places.sort_by_cached_key(|&i| rank(key, patch, &repetition[i]));
                for (&i, bit) in places.iter().zip(bits) {
                    repetition[i].bit = bit;
                }
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
    fn a_keyed_order_moves_bits_along_their_axis_within_their_repetition() {
        for (bits, rate) in [(512, 3), (324, 3), (7, 2), (1, 1)] {
            let layout = ChipLayout::new(bits, rate).unwrap();
            let keyed = ChipOrder::Keyed([4; 32]).chips(&layout, 1);
            let sorted = |chips: &[Chip]| {
                let mut of_repetition: Vec<(usize, usize)> =
                    chips.iter().map(|chip| (chip.bit, chip.axis)).collect();
                of_repetition.sort_unstable();
                of_repetition
            };
            let natural: Vec<Chip> = layout.chips().collect();
            for (a, b) in keyed.chunks(bits).zip(natural.chunks(bits)) {
                assert_eq!(sorted(a), sorted(b));
            }
            let place = |chip: &Chip| (chip.frequency, chip.axis);
            assert!(keyed.iter().map(place).eq(natural.iter().map(place)));
        }
    }

    /// The page of the certificate says how the order is made: places by hashes take the bits from the least on.
    #[test]
    fn the_order_is_the_one_that_the_certificate_page_prints() {
        let layout = ChipLayout::new(11, 2).unwrap();
        let chips = ChipOrder::Keyed([7; 32]).chips(&layout, 2);
        for j in 0..2 {
            for a in 0..3 {
                let hash = |p: usize| {
                    let numbers = [2u64.to_le_bytes(), (p as u64).to_le_bytes()].concat();
                    Sha256::digest([b"sigmark chips v3\0", &[7; 32][..], &numbers].concat())
                };
                let mut places: Vec<usize> = (0..11).filter(|t| t % 3 == a).map(|t| 11 * j + t).collect();
                places.sort_by_key(|&p| hash(p));
                let bits: Vec<usize> = places.iter().map(|&p| chips[p].bit).collect();
                assert_eq!(bits, (0..11).filter(|t| t % 3 == a).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn another_key_or_patch_is_another_order() {
        let layout = ChipLayout::new(512, 3).unwrap();
        let of = |key, patch| ChipOrder::Keyed([key; 32]).chips(&layout, patch);
        let same = |a: Vec<Chip>, b: Vec<Chip>| a.iter().zip(&b).filter(|(a, b)| a == b).count();
        // Of 1 536 chips nine stay in the mean: one of each of nine permutations.
        assert!(same(of(1, 0), of(2, 0)) < 30 && same(of(1, 0), of(1, 1)) < 30);
        assert_eq!(of(1, 0), of(1, 0));
    }

    #[test]
    fn a_layout_without_bits_or_chips_is_refused() {
        assert!(ChipLayout::new(0, 3).is_err());
        assert!(ChipLayout::new(324, 0).is_err());
    }
}
