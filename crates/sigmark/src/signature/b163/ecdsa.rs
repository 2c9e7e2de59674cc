//! ECDSA (FIPS 186-4, 6; ANS X9.62) with the nonces of RFC 6979.

use crypto_bigint::modular::ConstMontyForm;
use crypto_bigint::{U192, const_monty_params};
use rfc6979::KGenerator;
use sha1::digest::Digest;
use sha1::digest::block_api::BlockSizeUser;
use zeroize::{Zeroize, Zeroizing};

use super::curve::{AffinePoint, GENERATOR};

/// The order `d` of the base point, a prime of 163 bits that exceeds 2¹⁶² by about 2⁸¹.
pub(crate) const ORDER: U192 =
    U192::from_be_hex("000000040000000000000000000292fe77e70c12a4234c33");

const_monty_params!(
    Order,
    U192,
    "000000040000000000000000000292fe77e70c12a4234c33",
    "The order of the base point."
);

/// An integer modulo `d`.
type Scalar = ConstMontyForm<Order, { U192::LIMBS }>;

/// The bits of `d`, and of a field element.
const ORDER_BITS: u32 = 163;

/// The octets of a scalar.
const OCTETS: usize = 21;

/// The bits of `r`, and of `s`, in a signature that is embedded: the paper's 324 = 2 · 162.
///
/// A component needs the 163rd bit with a probability of 2⁻⁸¹. [`sign`] then goes on to the next nonce, as RFC 6979, 3.2,
/// step h does when `r` or `s` is zero.
pub(crate) const COMPONENT_BITS: u32 = 162;

/// The order `d`, big-endian, padded to 256 bits.
pub(crate) fn order() -> [u8; 32] {
    pad(&ORDER)
}

/// A private key `k_d`, 0 < `k_d` < `d`; wiped when dropped.
#[derive(Clone)]
pub(crate) struct SecretScalar(U192);

impl SecretScalar {
    /// The key of 21 big-endian octets, unless it is zero or not below `d`.
    pub(crate) fn from_octets(octets: &[u8; OCTETS]) -> Option<Self> {
        let key = SecretScalar(integer(octets));
        let in_range = key.0 != U192::ZERO && key.0 < ORDER;
        in_range.then_some(key)
    }

    pub(crate) fn to_octets(&self) -> Zeroizing<[u8; OCTETS]> {
        Zeroizing::new(octets(&self.0))
    }

    /// `K_e = k_d A`.
    pub(crate) fn public_point(&self) -> AffinePoint {
        GENERATOR
            .mul(&self.0)
            .expect("not the neutral element, since 0 < k_d < d")
    }
}

impl Drop for SecretScalar {
    fn drop(&mut self) {
        self.0.zeroize();
    }
}

/// `(r, s)` of a digest, each below 2^`bits`, with RFC 6979's first nonce of which that is true.
pub(crate) fn sign<H: Digest + BlockSizeUser>(
    key: &SecretScalar,
    digest: &[u8],
    bits: u32,
) -> ([u8; 32], [u8; 32]) {
    let x = key.to_octets();
    let mut nonces = KGenerator::<H, U192>::new(&x[..], digest, &[], &ORDER);
    let mut k = Zeroizing::new([0; OCTETS]);
    loop {
        nonces.fill_next_k(&mut k[..]);
        if let Some((r, s)) = sign_with(key, digest, &Zeroizing::new(integer(&k[..])))
            && r.bits_vartime() <= bits
            && s.bits_vartime() <= bits
        {
            return (pad(&r), pad(&s));
        }
    }
}

/// Eqs. 9 and 10 for one nonce, unless `r` or `s` is zero.
fn sign_with(key: &SecretScalar, digest: &[u8], k: &U192) -> Option<(U192, U192)> {
    let k_inv = Scalar::new(k).invert().into_option()?;
    // R = k A
    let big_r = GENERATOR.mul(k)?;
    // r = x_R mod d
    let r = to_scalar(big_r);
    // s = k⁻¹ (h + k_d r) mod d
    let s = k_inv * (bits2int(digest) + Scalar::new(&key.0) * r);
    let (r, s) = (r.retrieve(), s.retrieve());
    (r != U192::ZERO && s != U192::ZERO).then_some((r, s))
}

/// Whether eq. 20 holds for `(r, s)`, the digest and the public key; false where a component is not in 1 … `d` - 1.
pub(crate) fn verifies(key: &AffinePoint, digest: &[u8], r: &[u8; 32], s: &[u8; 32]) -> bool {
    let (Some(r), Some(s)) = (component(r), component(s)) else {
        return false;
    };
    let Some(w) = s.invert_vartime().into_option() else {
        return false;
    };
    // R' = (h s⁻¹) A + (r s⁻¹) K_e
    let u1 = (bits2int(digest) * w).retrieve();
    let u2 = (r * w).retrieve();
    match GENERATOR.mul_add(&u1, *key, &u2) {
        Some(big_r) => to_scalar(big_r) == r,
        None => false,
    }
}

/// The x-coordinate as an integer modulo `d`.
fn to_scalar(point: AffinePoint) -> Scalar {
    Scalar::new(&integer(&point.x.to_octets()))
}

/// RFC 6979, 2.3.2: the leftmost 163 bits of a digest as an integer, here modulo `d`.
fn bits2int(digest: &[u8]) -> Scalar {
    let octets = &digest[..digest.len().min(OCTETS)];
    let excess = (8 * octets.len() as u32).saturating_sub(ORDER_BITS);
    Scalar::new(&(integer(octets) >> excess))
}

/// The integer of at most 24 big-endian octets.
fn integer(octets: &[u8]) -> U192 {
    let mut padded = Zeroizing::new([0; 24]);
    padded[24 - octets.len()..].copy_from_slice(octets);
    U192::from_be_slice(&padded[..])
}

/// A component of a signature, unless it is zero or not below `d`.
fn component(octets: &[u8; 32]) -> Option<Scalar> {
    let (zeros, low) = octets.split_at(32 - 24);
    let value = integer(low);
    let in_range = zeros.iter().all(|&octet| octet == 0) && value != U192::ZERO && value < ORDER;
    in_range.then(|| Scalar::new(&value))
}

/// The 21 big-endian octets of an integer below 2¹⁶⁸.
fn octets(value: &U192) -> [u8; OCTETS] {
    let all = Zeroizing::new(pad(value));
    std::array::from_fn(|i| all[32 - OCTETS + i])
}

/// The 32 big-endian octets.
fn pad(value: &U192) -> [u8; 32] {
    let mut octets = [0; 32];
    octets[8..].copy_from_slice(value.to_be_bytes().as_ref());
    octets
}
