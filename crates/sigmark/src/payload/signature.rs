//! The signature as a value: two integers, a bit string, or hexadecimal text.

use super::{Scheme, SignatureError};

/// A signature `S = r || s`, with the scheme that gives it meaning.
///
/// Any bit string of the right length is a value of this type, since what is extracted from a damaged mesh may be anything:
/// whether it is valid only [`PublicKey::verify`](crate::PublicKey::verify) says.
/// As always with ECDSA, where `(r, s)` is valid so is `(r, d - s)`: two different bit strings may confirm one message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Signature {
    scheme: Scheme,
    /// Big-endian, padded on the left to 256 bits.
    r: [u8; 32],
    s: [u8; 32],
}

impl Signature {
    /// The signature `r || s`; the caller has seen to it that both fit in the scheme's bits.
    pub(crate) fn new(scheme: Scheme, r: [u8; 32], s: [u8; 32]) -> Self {
        Signature { scheme, r, s }
    }

    /// The signature whose bits are `bits`: `r`, then `s`, most significant bit first.
    ///
    /// # Errors
    /// [`SignatureError::Length`] unless there are `scheme.bits()` of them.
    pub fn from_bits(scheme: Scheme, bits: &[bool]) -> Result<Self, SignatureError> {
        if bits.len() != scheme.bits() {
            return Err(SignatureError::Length {
                scheme,
                expected: scheme.bits(),
                found: bits.len(),
            });
        }
        let (r, s) = bits.split_at(scheme.component_bits());
        Ok(Signature::new(scheme, pack(r), pack(s)))
    }

    /// The `l` bits: `r`, then `s`, most significant bit first.
    pub fn bits(&self) -> Vec<bool> {
        let count = self.scheme.component_bits();
        [&self.r, &self.s]
            .into_iter()
            .flat_map(|integer| (0..count).rev().map(|i| bit(integer, i)))
            .collect()
    }

    /// The bits in hexadecimal, four to a digit: 128 digits on P-256, 81 on B-163.
    pub fn to_hex(&self) -> String {
        let nibble = |four: &[bool]| four.iter().fold(0, |value, &bit| 2 * value + u32::from(bit));
        self.bits()
            .chunks(4)
            .filter_map(|four| char::from_digit(nibble(four), 16))
            .collect()
    }

    /// The inverse of [`Signature::to_hex`]; digits of either case.
    ///
    /// # Errors
    /// [`SignatureError::NotHexadecimal`] at a character that is no digit, [`SignatureError::Length`] for too few or too many.
    pub fn from_hex(scheme: Scheme, text: &str) -> Result<Self, SignatureError> {
        let mut bits = Vec::with_capacity(scheme.bits());
        for (position, character) in text.chars().enumerate() {
            let digit = character
                .to_digit(16)
                .ok_or(SignatureError::NotHexadecimal { position, character })?;
            bits.extend((0..4).rev().map(|i| (digit >> i) & 1 == 1));
        }
        Signature::from_bits(scheme, &bits)
    }

    /// The scheme by which it was made and is to be verified.
    pub fn scheme(&self) -> Scheme {
        self.scheme
    }

    /// `r` (eq. 9), big-endian.
    pub(crate) fn r(&self) -> &[u8; 32] {
        &self.r
    }

    /// `s` (eq. 10), big-endian.
    pub(crate) fn s(&self) -> &[u8; 32] {
        &self.s
    }
}

/// The bit of weight 2^i.
fn bit(integer: &[u8; 32], i: usize) -> bool {
    (integer[31 - i / 8] >> (i % 8)) & 1 == 1
}

/// The integer whose at most 256 bits are given, most significant first.
fn pack(bits: &[bool]) -> [u8; 32] {
    let mut integer = [0; 32];
    for (i, &bit) in bits.iter().rev().enumerate() {
        integer[31 - i / 8] |= u8::from(bit) << (i % 8);
    }
    integer
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_bit_string_of_the_right_length_is_a_signature(bits in proptest::collection::vec(any::<bool>(), 512)) {
            for &scheme in Scheme::ALL {
                let bits = &bits[..scheme.bits()];
                let signature = Signature::from_bits(scheme, bits).expect("the length is right");
                prop_assert_eq!(signature.bits(), bits);
                let hex = signature.to_hex();
                prop_assert_eq!(hex.len(), scheme.bits() / 4);
                prop_assert_eq!(Signature::from_hex(scheme, &hex), Ok(signature));
                prop_assert_eq!(Signature::from_hex(scheme, &hex.to_uppercase()), Ok(signature));
            }
        }
    }

    #[cfg(feature = "paper")]
    #[test]
    fn the_first_bit_is_the_most_significant_of_r() {
        let mut bits = [false; 324];
        bits[0] = true;
        bits[323] = true;
        let signature = Signature::from_bits(Scheme::EcdsaB163Sha1, &bits).expect("324 bits");
        assert_eq!(signature.r()[32 - 21], 2); // 2^161
        assert_eq!(signature.s()[31], 1);
        assert!(signature.to_hex().starts_with('8') && signature.to_hex().ends_with('1'));
    }

    #[test]
    fn a_wrong_length_and_a_foreign_character_are_refused() {
        let scheme = Scheme::EcdsaP256Sha256;
        for length in [0, 324, 511, 513] {
            assert!(matches!(
                Signature::from_bits(scheme, &vec![true; length]),
                Err(SignatureError::Length { expected: 512, found, .. }) if found == length
            ));
        }
        assert!(matches!(
            Signature::from_hex(scheme, "00ß"),
            Err(SignatureError::NotHexadecimal {
                position: 2,
                character: 'ß'
            })
        ));
    }
}
