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
    fn a_layout_without_bits_or_chips_is_refused() {
        assert!(ChipLayout::new(0, 3).is_err());
        assert!(ChipLayout::new(324, 0).is_err());
    }
}
