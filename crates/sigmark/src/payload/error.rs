use super::{Curve, Scheme};

/// Why a signature could not be made or read, or is not valid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SignatureError {
    /// Eq. 20 does not hold.
    #[error(
        "the signature does not belong to this message and this key: \
         the message was changed, another key signed it, or bits of the signature are wrong"
    )]
    Mismatch,
    /// `r` or `s` is zero, or not below the order of the curve: no signer produces it.
    #[error(
        "the signature's component {component} is not between 1 and d - 1, d the order of {curve}: \
         its bits are damaged or were not made by a signer"
    )]
    ComponentOutOfRange {
        /// `'r'` or `'s'`.
        component: char,
        /// The curve of the scheme.
        curve: Curve,
    },
    /// The key is on another curve than the scheme asks for.
    #[error("the scheme {scheme} needs a key on {}, but this one is on {curve}: choose a scheme of that curve or another key", scheme.curve())]
    CurveMismatch {
        /// The scheme asked for.
        scheme: Scheme,
        /// The key's curve.
        curve: Curve,
    },
    /// The bit string is not as long as the scheme's signatures.
    #[error(
        "a signature by {scheme} has {expected} bits, not {found}: it was made by another scheme, or cut off"
    )]
    Length {
        /// The scheme asked for.
        scheme: Scheme,
        /// Its number of bits.
        expected: usize,
        /// The number of bits given.
        found: usize,
    },
    /// A character of the signature's text is no hexadecimal digit.
    #[error(
        "character {position} of the signature is {character:?}, not a hexadecimal digit: copy the signature again from the certificate"
    )]
    NotHexadecimal {
        /// Index of the character, from 0.
        position: usize,
        /// What stands there.
        character: char,
    },
}
