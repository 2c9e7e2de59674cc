//! ECDSA on P-256: RustCrypto's arithmetic, with the hash function left open.

use ecdsa::hazmat::{sign_prehashed_rfc6979, verify_prehashed};
use p256::ecdsa::Signature;
use p256::elliptic_curve::Curve as _;
use p256::elliptic_curve::sec1::ToSec1Point;
use p256::{FieldBytes, NistP256, PublicKey, SecretKey};
use sha1::Sha1;
use sha2::Sha256;

use super::Scheme;
use super::error::PointError;

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
        Scheme::EcdsaP256Sha1 | Scheme::EcdsaB163Sha1 => {
            sign_prehashed_rfc6979::<NistP256, Sha1>(&d, digest, &[])
        }
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
