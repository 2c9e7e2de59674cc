//! ECDSA on P-256: RustCrypto's arithmetic, with the hash function left open.

use ecdsa::hazmat::{sign_prehashed_rfc6979, verify_prehashed};
use p256::ecdsa::Signature;
use p256::elliptic_curve::Curve as _;
use p256::elliptic_curve::sec1::ToSec1Point;
use p256::{FieldBytes, NistP256, PublicKey, SecretKey};
use sha1::Sha1;
use sha2::Sha256;

use super::error::PointError;
use crate::payload::Scheme;

/// The order `d` of the base point, big-endian.
pub(super) fn order() -> [u8; 32] {
    let mut octets = [0; 32];
    octets.copy_from_slice(NistP256::ORDER.to_be_bytes().as_ref());
    octets
}

/// `(r, s)` of a digest, with RFC 6979's nonce for the scheme's hash function.
pub(super) fn sign(key: &SecretKey, scheme: Scheme, digest: &[u8]) -> ([u8; 32], [u8; 32]) {
    let d = key.to_nonzero_scalar();
    let (signature, _) = match scheme {
        Scheme::EcdsaP256Sha256 => sign_prehashed_rfc6979::<NistP256, Sha256>(&d, digest, &[]),
        _ => sign_prehashed_rfc6979::<NistP256, Sha1>(&d, digest, &[]),
    };
    let (r, s) = signature.split_bytes();
    (r.into(), s.into())
}

/// Whether eq. 20 holds for `(r, s)`, the digest and the public key.
pub(super) fn verifies(key: &PublicKey, digest: &[u8], r: &[u8; 32], s: &[u8; 32]) -> bool {
    Signature::from_scalars(FieldBytes::from(*r), FieldBytes::from(*s))
        .and_then(|signature| verify_prehashed(&key.to_projective(), digest, &signature))
        .is_ok()
}

/// Decodes and validates a public key; the cofactor is 1, so a point of the curve has the right order.
pub(super) fn decode_point(octets: &[u8]) -> Result<PublicKey, PointError> {
    match octets {
        [] => return Err(PointError::Encoding("it is empty")),
        [0] => return Err(PointError::Infinity),
        [4, ..] if octets.len() == 65 => {}
        [2 | 3, ..] if octets.len() == 33 => {}
        [0 | 2 | 3 | 4, ..] => return Err(PointError::Encoding("its length is wrong")),
        _ => return Err(PointError::Encoding("its first octet is not 0, 2, 3 or 4")),
    }
    PublicKey::from_sec1_bytes(octets).map_err(|_| PointError::NotOnCurve)
}

/// The uncompressed encoding 04 || x || y.
pub(super) fn encode_point(key: &PublicKey) -> Vec<u8> {
    key.to_sec1_point(false).as_bytes().to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hex(digits: &str) -> [u8; 32] {
        std::array::from_fn(|i| u8::from_str_radix(&digits[2 * i..2 * i + 2], 16).expect("hex"))
    }

    /// RFC 6979, A.2.5.
    #[test]
    fn signatures_are_those_of_rfc_6979() {
        let x = hex("C9AFA9D845BA75166B5C215767B1D6934E50C3DB36E89B127B8A622B120F6721");
        let key = SecretKey::from_slice(&x).expect("the key of the RFC");
        for (scheme, message, r, s) in [
            (
                Scheme::EcdsaP256Sha1,
                "sample",
                "61340C88C3AAEBEB4F6D667F672CA9759A6CCAA9FA8811313039EE4A35471D32",
                "6D7F147DAC089441BB2E2FE8F7A3FA264B9C475098FDCF6E00D7C996E1B8B7EB",
            ),
            (
                Scheme::EcdsaP256Sha256,
                "sample",
                "EFD48B2AACB6A8FD1140DD9CD45E81D69D2C877B56AAF991C34D0EA84EAF3716",
                "F7CB1C942D657C41D436C7A1B6E29F65F3E900DBB9AFF4064DC4AB2F843ACDA8",
            ),
            (
                Scheme::EcdsaP256Sha1,
                "test",
                "0CBCC86FD6ABD1D99E703E1EC50069EE5C0B4BA4B9AC60E409E8EC5910D81A89",
                "01B9D7B73DFAA60D5651EC4591A0136F87653E0FD780C3B1BC872FFDEAE479B1",
            ),
            (
                Scheme::EcdsaP256Sha256,
                "test",
                "F1ABB023518351CD71D881567B1EA663ED3EFCF6C5132B354F28D3B0B7D38367",
                "019F4113742A2B14BD25926B49C649155F267E60D3814B4C0CC84250E46F0083",
            ),
        ] {
            let digest = scheme.digest(message.as_bytes());
            let signature = sign(&key, scheme, &digest);
            assert_eq!(signature, (hex(r), hex(s)), "{scheme}, {message}");
            let public = key.public_key();
            assert!(verifies(&public, &digest, &signature.0, &signature.1));
        }
    }

    #[test]
    fn components_that_are_zero_or_not_below_the_order_are_refused() {
        let key = SecretKey::from_slice(&[7; 32]).expect("below the order");
        let digest = Scheme::EcdsaP256Sha256.digest(b"sample");
        let (r, s) = sign(&key, Scheme::EcdsaP256Sha256, &digest);
        for bad in [[0; 32], order(), [255; 32]] {
            assert!(!verifies(&key.public_key(), &digest, &bad, &s));
            assert!(!verifies(&key.public_key(), &digest, &r, &bad));
        }
    }

    #[test]
    fn encodings_that_are_no_points_are_refused() {
        let key = SecretKey::from_slice(&[7; 32]).expect("below the order");
        let good = encode_point(&key.public_key());
        let refused = |octets: &[u8]| decode_point(octets).expect_err("no point");
        assert_eq!(decode_point(&good), Ok(key.public_key()));
        assert_eq!(refused(&[0]), PointError::Infinity);
        for length in 0..65 {
            assert!(matches!(refused(&good[..length]), PointError::Encoding(_)));
        }
        for tag in [0, 1, 5, 6, 7, 255] {
            let mut octets = good.clone();
            octets[0] = tag;
            assert!(matches!(refused(&octets), PointError::Encoding(_)), "{tag}");
        }
        for bit in (0..8 * 64).step_by(3) {
            let mut octets = good.clone();
            octets[1 + bit / 8] ^= 1 << (bit % 8);
            assert_eq!(refused(&octets), PointError::NotOnCurve, "{bit}");
        }
        let mut octets = [255; 65]; // coordinates beyond the field
        octets[0] = 4;
        assert_eq!(refused(&octets), PointError::NotOnCurve);
    }
}
