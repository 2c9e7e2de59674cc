use code::{CheckNodes, PolarCode};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{Permutation, Scheme, Signature};
use crate::mark::{MarkError, SoftBits};

/// What a mark holds of a signature (r, s) over a statement with the hash h.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum PayloadKind {
    /// The whole of it, e = F_h(r ‖ s), as a codeword.
    Signature,
    /// The first 128 bits of a hash over h, r and s, as a codeword: for models that have no room for the whole, or that will lose most of their shape.
    Tag,
    /// r ‖ s as they are, without a code, as in the paper: a signer can choose half of them.
    PlainSignature,
}

const TAG_BITS: usize = 128;

/// With fewer chips to a bit of payload than this, the code has rate 1: a longer one, of which most bits had no chip, would lose words without any noise.
const LEAST_FOR_A_CODE: f64 = 1.25;

impl PayloadKind {
    /// Every kind.
    pub const ALL: &[Self] = &[Self::Signature, Self::Tag, Self::PlainSignature];

    /// The name in certificates and statements.
    pub fn name(self) -> &'static str {
        match self {
            Self::Signature => "signature",
            Self::Tag => "tag",
            Self::PlainSignature => "plain-signature",
        }
    }

    /// Whether marks of a scheme may hold it: the paper's the signature as it is, others a codeword.
    pub fn suits(self, scheme: Scheme) -> bool {
        scheme.is_of_paper() == (self == Self::PlainSignature)
    }

    /// k, the bits of payload.
    pub fn bits(self, scheme: Scheme) -> usize {
        match self {
            Self::Signature | Self::PlainSignature => scheme.bits(),
            Self::Tag => TAG_BITS,
        }
    }

    /// l, the bits that a mark of so many chips has: the code's, or those of the payload.
    ///
    /// # Errors
    /// [`MarkError::Room`] where there are fewer chips than bits of payload.
    pub fn mark_bits(self, scheme: Scheme, chips: usize) -> Result<usize, MarkError> {
        let code = self.code(scheme, chips)?;
        Ok(code.map_or(self.bits(scheme), |code| code.length()))
    }

    fn code(self, scheme: Scheme, chips: usize) -> Result<Option<PolarCode>, MarkError> {
        let bits = self.bits(scheme);
        let no_room = MarkError::Room {
            found: chips,
            least: bits,
        };
        if chips < bits {
            return Err(no_room);
        }
        if self == Self::PlainSignature {
            return Ok(None);
        }
        let code = match (chips as f64) < LEAST_FOR_A_CODE * bits as f64 {
            true => PolarCode::new(bits, bits),
            false => PolarCode::for_chips(bits, chips),
        };
        // Ratios come from several detectors, in units of their own.
        code.map(|code| Some(code.with_check_nodes(CheckNodes::MinSum)))
            .map_err(|_| no_room)
    }
}

/// The way from a signature to the bits of a mark, and back.
///
/// The k bits of payload become l code bits, c, and what stands in the shape is c ⊕ z with a stream z of h: for who sees only the statement every bit of a mark is a
/// fair coin, independent of the others, though those of a codeword are not.
#[derive(Clone, Debug)]
pub struct Payload {
    kind: PayloadKind,
    scheme: Scheme,
    hash: [u8; 32],
    /// None where the payload stands in the shape as it is.
    code: Option<PolarCode>,
}

impl Payload {
    /// What a mark of so many chips holds of signatures over the statement with this hash.
    ///
    /// # Errors
    /// [`MarkError::Room`] where there are fewer chips than bits of payload.
    pub fn new(kind: PayloadKind, scheme: Scheme, hash: [u8; 32], chips: usize) -> Result<Self, MarkError> {
        Ok(Self {
            code: kind.code(scheme, chips)?,
            kind,
            scheme,
            hash,
        })
    }

    /// The k bits of payload for a signature of this scheme.
    pub fn message(&self, signature: &Signature) -> Vec<bool> {
        match self.kind {
            PayloadKind::PlainSignature => signature.bits(),
            PayloadKind::Signature => {
                let [r, s] = Permutation::keyed(self.hash).apply([*signature.r(), *signature.s()]);
                Signature::new(self.scheme, r, s).bits()
            }
            PayloadKind::Tag => {
                let hash = Sha256::new_with_prefix(b"sigmark tag v6\0")
                    .chain_update(self.hash)
                    .chain_update(signature.r())
                    .chain_update(signature.s());
                bits_of(&hash.finalize()).take(TAG_BITS).collect()
            }
        }
    }

    /// The signature that a payload holds; none in a [tag](PayloadKind::Tag), or where there are not k bits. Where a bit is wrong, it is nothing like the right one.
    pub fn signature(&self, message: &[bool]) -> Option<Signature> {
        let read = Signature::from_bits(self.scheme, message).ok()?;
        match self.kind {
            PayloadKind::Tag => None,
            PayloadKind::PlainSignature => Some(read),
            PayloadKind::Signature => {
                let [r, s] = Permutation::keyed(self.hash).invert([*read.r(), *read.s()]);
                Some(Signature::new(self.scheme, r, s))
            }
        }
    }

    /// The l bits of a mark that holds a signature of this scheme.
    pub fn bits(&self, signature: &Signature) -> Vec<bool> {
        let message = self.message(signature);
        let word = self.code.as_ref().and_then(|code| code.encode(&message).ok());
        match word {
            Some(word) => word.into_iter().zip(self.stream()).map(|(c, z)| c ^ z).collect(),
            None => message,
        }
    }

    /// The first payload among those which soft bits say most likely that is accepted, of lists that grow. Without a code, there is one.
    ///
    /// Soft bits that have nothing to do with the mark are granted with a probability of Σ lists · 2⁻ᵏ at most, if one payload is accepted.
    pub fn read(
        &self,
        soft: &SoftBits,
        lists: &[usize],
        mut accepts: impl FnMut(&[bool]) -> bool,
    ) -> Option<Vec<bool>> {
        let Some(code) = &self.code else {
            return Some(soft.hard()).filter(|message| accepts(message));
        };
        // A code's ratios are positive for 0, soft bits for 1.
        let ratios: Vec<f64> = soft
            .values()
            .iter()
            .zip(self.stream())
            .map(|(&x, z)| if z { x } else { -x })
            .collect();
        let found = code.search(&ratios, lists, accepts).ok()??;
        Some(found.payload)
    }

    /// z: SHA-256(domain ‖ h ‖ i), i = 0, 1, … as 64-bit integers, most significant bits first.
    fn stream(&self) -> impl Iterator<Item = bool> + '_ {
        (0_u64..).flat_map(|i| {
            let hash = Sha256::new_with_prefix(b"sigmark stream v6\0")
                .chain_update(self.hash)
                .chain_update(i.to_le_bytes());
            bits_of(&hash.finalize()).collect::<Vec<_>>()
        })
    }
}

/// The most significant of each byte first.
fn bits_of(bytes: &[u8]) -> impl Iterator<Item = bool> + '_ {
    bytes
        .iter()
        .flat_map(|byte| (0..8).rev().map(move |i| byte >> i & 1 == 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use code::LISTS;
    use proptest::prelude::*;
    use rand_chacha::{
        ChaCha8Rng,
        rand_core::{Rng, SeedableRng},
    };

    fn kinds_of(scheme: Scheme) -> impl Iterator<Item = PayloadKind> {
        PayloadKind::ALL
            .iter()
            .copied()
            .filter(move |kind| kind.suits(scheme))
    }

    fn soft(bits: &[bool]) -> SoftBits {
        SoftBits::new(bits.iter().map(|&bit| if bit { 1.0 } else { -1.0 }).collect())
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(bits in prop::collection::vec(any::<bool>(), 512), h: [u8; 32], chips in 512usize..9000) {
            for &scheme in Scheme::ALL {
                let signature = Signature::from_bits(scheme, &bits[..scheme.bits()]).unwrap();
                for kind in kinds_of(scheme) {
                    let payload = Payload::new(kind, scheme, h, chips).unwrap();
                    let written = payload.bits(&signature);
                    prop_assert_eq!(written.len(), kind.mark_bits(scheme, chips).unwrap());
                    let read = payload.read(&soft(&written), &[1], |_| true).unwrap();
                    prop_assert_eq!(&read, &payload.message(&signature));
                    let held = payload.signature(&read);
                    prop_assert_eq!(held, (kind != PayloadKind::Tag).then_some(signature));
                }
            }
        }

        /// Of l bits, all of which are coins to who knows the statement, half agree with another mark's but for eight standard deviations.
        #[test]
        fn another_statement_is_another_mark(h: [u8; 32], bit in 0usize..256) {
            let mut other = h;
            other[bit / 8] ^= 1 << (bit % 8);
            let signature = Signature::from_bits(Scheme::default(), &[true; 512]).unwrap();
            for kind in kinds_of(Scheme::default()) {
                let of = |h| Payload::new(kind, Scheme::default(), h, 3072).unwrap().bits(&signature);
                let (a, b) = (of(h), of(other));
                let alike = a.iter().zip(&b).filter(|(a, b)| a == b).count() as f64;
                let l = a.len() as f64;
                prop_assert!((alike - l / 2.0).abs() < 4.0 * l.sqrt());
            }
        }
    }

    #[test]
    fn only_the_papers_marks_hold_the_signature_as_it_is() {
        for &scheme in Scheme::ALL {
            let bits: Vec<bool> = (0..scheme.bits()).map(|t| t % 3 == 0).collect();
            let signature = Signature::from_bits(scheme, &bits).unwrap();
            for kind in kinds_of(scheme) {
                let payload = Payload::new(kind, scheme, [1; 32], 3072).unwrap();
                assert_eq!(
                    payload.message(&signature) == bits,
                    scheme.is_of_paper(),
                    "{scheme}"
                );
            }
        }
    }

    #[test]
    fn a_third_of_the_chips_and_a_fifth_of_wrong_bits_are_read() {
        let signature = Signature::from_bits(Scheme::default(), &[true; 512]).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut one_of = |n: u32| rng.next_u32() % n == 0;
        // (kind, one in so many bits is seen, of which one in so many is wrong)
        for (kind, seen, wrong) in [
            (PayloadKind::Signature, 3, 1 << 30),
            (PayloadKind::Signature, 1, 8),
            (PayloadKind::Tag, 3, 8),
            (PayloadKind::Tag, 1, 4),
        ] {
            let payload = Payload::new(kind, Scheme::default(), [5; 32], 3072).unwrap();
            let mut received = soft(&payload.bits(&signature)).values().to_vec();
            for x in &mut received {
                *x = match (one_of(seen), one_of(wrong)) {
                    (true, false) => *x,
                    (true, true) => -*x,
                    (false, _) => 0.0,
                };
            }
            let expected = payload.message(&signature);
            let read = payload.read(&SoftBits::new(received), &LISTS, |message| message == expected);
            assert!(read.is_some(), "{kind:?} {seen} {wrong}");
        }
    }

    #[test]
    fn a_mark_has_as_many_bits_as_its_chips_fill() {
        let of = |kind: PayloadKind, chips| kind.mark_bits(Scheme::default(), chips);
        assert_eq!(of(PayloadKind::Signature, 3072).unwrap(), 2048);
        assert_eq!(of(PayloadKind::Signature, 700).unwrap(), 1024);
        assert_eq!(of(PayloadKind::Signature, 600).unwrap(), 512);
        assert_eq!(of(PayloadKind::Tag, 3072).unwrap(), 2048);
        assert_eq!(of(PayloadKind::Tag, 300).unwrap(), 256);
        let error = of(PayloadKind::Signature, 511).unwrap_err();
        assert!(matches!(
            error,
            MarkError::Room {
                found: 511,
                least: 512
            }
        ));
    }
}
