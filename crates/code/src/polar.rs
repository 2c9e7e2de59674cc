use crate::{
    CodeError,
    candidates::Candidates,
    list::Paths,
    plan::{Step, plan},
    precode::Precoder,
    reliability::by_reliability,
    transform::transform,
};

/// A code: which positions carry payload, and what runs before the polar transform.
///
/// Making one takes a millisecond or less; it is plain data and can be shared by threads.
#[derive(Clone, Debug)]
pub struct PolarCode {
    carries: Vec<bool>,
    payload_bits: usize,
    precoder: Precoder,
    check_nodes: CheckNodes,
    steps: Vec<Step>,
}

/// How ratios of two bits are combined to the ratio of their sum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum CheckNodes {
    /// 2 artanh(tanh(a/2) tanh(b/2)), logarithms to within 0.02. Needs ratios in their true unit, the natural logarithm.
    #[default]
    Accurate,
    /// sign(a b) min(|a|, |b|), which asks for ratios up to a common factor only. Leaves somewhat more words unread (`results/code.md`).
    MinSum,
}

impl PolarCode {
    /// The longest code.
    pub const LONGEST: usize = 1 << 14;

    /// The longest list.
    pub const LONGEST_LIST: usize = 1 << 16;

    /// Ratios are cut off here: e^±10⁶ is certain.
    pub const MOST_CERTAIN: f64 = 1e6;

    /// A code for `payload_bits` bits of payload in `length` code bits, a power of two.
    ///
    /// Equal numbers give the same code on every platform and in every version.
    ///
    /// # Errors
    /// When the length is no power of two from 2 to [`Self::LONGEST`], or there is no payload or more than fits.
    pub fn new(payload_bits: usize, length: usize) -> Result<Self, CodeError> {
        check_length(length)?;
        if payload_bits == 0 || payload_bits > length {
            return Err(CodeError::PayloadBits {
                bits: payload_bits,
                length,
            });
        }
        let mut carries = vec![false; length];
        for i in by_reliability(length).into_iter().take(payload_bits) {
            carries[i] = true;
        }
        Ok(Self::of(carries, Precoder::PI))
    }

    /// The code for a channel of `chips` chips: the longest power of two that they fill, up to 16 times the payload.
    ///
    /// Longer codes read the same payload of a weaker mark (`results/code.md`) and take hardly more time; what chips remain repeat code bits. Where the chips fill less than twice the payload, the code is the next longer one, and the bits that have no chip are
    /// erased ([`Self::fold`]).
    ///
    /// # Errors
    /// When there are fewer chips than bits of payload, no payload, or more than half of [`Self::LONGEST`].
    pub fn for_chips(payload_bits: usize, chips: usize) -> Result<Self, CodeError> {
        if payload_bits == 0 || payload_bits > chips || payload_bits > Self::LONGEST / 2 {
            return Err(CodeError::PayloadBits {
                bits: payload_bits,
                length: chips.min(Self::LONGEST / 2),
            });
        }
        let least = (2 * payload_bits).next_power_of_two();
        let most = (16 * payload_bits).next_power_of_two().min(Self::LONGEST);
        let filled = 1 << chips.ilog2().min(Self::LONGEST.ilog2());
        Self::new(payload_bits, filled.clamp(least, most))
    }

    /// A code of other positions and another convolution than the ones that [`Self::new`] takes, for comparisons. Bit j of `generator` is g_j; 1 is the
    /// plain polar code.
    ///
    /// # Errors
    /// As [`Self::new`]; when a position is out of range or given twice, or g_0 is 0.
    pub fn of_positions(length: usize, positions: &[usize], generator: u64) -> Result<Self, CodeError> {
        check_length(length)?;
        let bits = positions.len();
        if bits == 0 || bits > length {
            return Err(CodeError::PayloadBits { bits, length });
        }
        let precoder = Precoder::new(generator).ok_or(CodeError::Generator { generator })?;
        let mut carries = vec![false; length];
        for &position in positions {
            match carries.get_mut(position) {
                Some(carries) if !*carries => *carries = true,
                _ => return Err(CodeError::Position { position, length }),
            }
        }
        Ok(Self::of(carries, precoder))
    }

    fn of(carries: Vec<bool>, precoder: Precoder) -> Self {
        Self {
            payload_bits: carries.iter().filter(|&&carries| carries).count(),
            steps: plan(&carries),
            carries,
            precoder,
            check_nodes: CheckNodes::default(),
        }
    }

    /// Decodes with these check nodes. Codewords stay what they are.
    #[must_use]
    pub fn with_check_nodes(mut self, check_nodes: CheckNodes) -> Self {
        self.check_nodes = check_nodes;
        self
    }

    /// Bits of payload k.
    pub fn payload_bits(&self) -> usize {
        self.payload_bits
    }

    /// Code bits N.
    pub fn length(&self) -> usize {
        self.carries.len()
    }

    /// The positions that carry payload, in ascending order: bit j of the payload is v at the j-th.
    pub fn positions(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.length()).filter(|&i| self.carries[i])
    }

    /// The codeword of a payload.
    ///
    /// # Errors
    /// When the payload has another length than [`Self::payload_bits`].
    pub fn encode(&self, payload: &[bool]) -> Result<Vec<bool>, CodeError> {
        check_count("bits of payload", payload.len(), self.payload_bits)?;
        let mut bits = vec![false; self.length()];
        for (i, &bit) in self.positions().zip(payload) {
            bits[i] = bit;
        }
        self.precoder.precode(&mut bits);
        transform(&mut bits);
        Ok(bits)
    }

    /// What chips say of code bits, where chip t carries code bit t mod N: ratios of the same bit add up, and bits without a chip have 0. In
    /// which order chips lie is the caller's affair.
    pub fn fold(&self, chips: &[f64]) -> Vec<f64> {
        let mut ratios = vec![0.0; self.length()];
        for word in chips.chunks(self.length()) {
            for (ratio, chip) in ratios.iter_mut().zip(word) {
                *ratio += chip;
            }
        }
        ratios
    }

    /// The likeliest payloads, at most `list`, the best first.
    ///
    /// `ratios[j]` is ln P(code bit j is 0) / P(it is 1) as the channel says: positive for 0, 0 where nothing is known (erased, punctured). Beyond
    /// ±[`Self::MOST_CERTAIN`] they are cut off. In Gaussian noise of variance σ² around ±a it is 2 a y / σ², + for bit 0.
    ///
    /// # Errors
    /// When there are not N ratios, one is infinite or not a number, or the list is 0 or longer than [`Self::LONGEST_LIST`].
    pub fn decode(&self, ratios: &[f64], list: usize) -> Result<Candidates, CodeError> {
        check_count("log-likelihood ratios", ratios.len(), self.length())?;
        if list == 0 || list > Self::LONGEST_LIST {
            return Err(CodeError::List {
                list,
                most: Self::LONGEST_LIST,
            });
        }
        if let Some(index) = ratios.iter().position(|ratio| !ratio.is_finite()) {
            return Err(CodeError::NotFinite {
                index,
                value: ratios[index],
            });
        }
        let most = Self::MOST_CERTAIN;
        let ratios: Vec<f32> = ratios
            .iter()
            .map(|ratio| ratio.clamp(-most, most) as f32)
            .collect();
        let paths = Paths::new(&ratios, self.precoder, list);
        Ok(match self.check_nodes {
            CheckNodes::Accurate => paths.run::<true>(&self.steps),
            CheckNodes::MinSum => paths.run::<false>(&self.steps),
        })
    }
}

fn check_length(length: usize) -> Result<(), CodeError> {
    let most = PolarCode::LONGEST;
    if length < 2 || length > most || !length.is_power_of_two() {
        return Err(CodeError::Length { length, most });
    }
    Ok(())
}

fn check_count(what: &'static str, given: usize, expected: usize) -> Result<(), CodeError> {
    if given != expected {
        return Err(CodeError::Count {
            what,
            given,
            expected,
        });
    }
    Ok(())
}
