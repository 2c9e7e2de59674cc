//! ECDSA (FIPS 186-4, 6; ANS X9.62) with the nonces of RFC 6979.

use crypto_bigint::modular::ConstMontyForm;
use crypto_bigint::{U192, const_monty_params};
use rfc6979::KGenerator;
use sha1::digest::Digest;
use sha1::digest::block_api::BlockSizeUser;
use zeroize::{Zeroize, Zeroizing};

use super::curve::{AffinePoint, GENERATOR, ORDER};

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

/// `(r, s)` of a digest, each below 2^`bits`, with RFC 6979's first nonce of which that is true: one that fails goes the way of
/// one that makes `r` or `s` zero (RFC 6979, 3.2, step h).
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sha1::Sha1;
    use sha2::Sha256;

    /// The key of RFC 6979, A.2.13.
    fn rfc6979_key() -> SecretScalar {
        SecretScalar(U192::from_be_hex(
            "000000035318fc447d48d7e6bc93b48617dddedf26aa658f",
        ))
    }

    fn hex(digits: &str) -> [u8; 32] {
        let digits = format!("{digits:0>64}");
        std::array::from_fn(|i| u8::from_str_radix(&digits[2 * i..2 * i + 2], 16).expect("hex"))
    }

    fn check(signature: ([u8; 32], [u8; 32]), digest: &[u8], r: &str, s: &str) {
        assert_eq!(signature, (hex(r), hex(s)));
        let public = rfc6979_key().public_point();
        assert!(verifies(&public, digest, &signature.0, &signature.1));
    }

    #[test]
    fn signatures_are_those_of_rfc_6979() {
        let key = rfc6979_key();
        for bits in [162, ORDER_BITS] {
            for (message, r, s) in [
                (
                    "sample",
                    "153FEBD179A69B6122DEBF5BC61EB947B24C93526",
                    "37AC9C670F8CF18045049BAE7DD35553545C19E49",
                ),
                (
                    "test",
                    "256D4079C6C7169B8BC92529D701776A269D56308",
                    "341D3FFEC9F1EB6A6ACBE88E3C86A1C8FDEB8B8E1",
                ),
            ] {
                let digest = Sha1::digest(message);
                check(sign::<Sha1>(&key, &digest, bits), &digest, r, s);
            }
            for (message, r, s) in [
                (
                    "sample",
                    "134E00F78FC1CB9501675D91C401DE20DDF228CDC",
                    "373273AEC6C36CB7BAFBB1903A5F5EA6A1D50B624",
                ),
                (
                    "test",
                    "227DF377B3FA50F90C1CB3CDCBBDBA552C1D35104",
                    "1F7BEAD92583FE920D353F368C1960D0E88B46A56",
                ),
            ] {
                let digest = Sha256::digest(message);
                check(sign::<Sha256>(&key, &digest, bits), &digest, r, s);
            }
        }
    }

    #[test]
    fn the_public_key_is_that_of_rfc_6979() {
        let octets = rfc6979_key().public_point().to_sec1();
        assert_eq!(
            octets[1..22],
            hex("126CF562D95A1D77D387BA75A3EA3A1407F23425A")[11..]
        );
        assert_eq!(
            octets[22..],
            hex("7D7CB5273C94DA8CA93049AFDA18721C24672BD71")[11..]
        );
    }

    /// With 162 bits this happens once in 2^81 times; with fewer it can be watched.
    #[test]
    fn a_component_with_too_many_bits_makes_the_signer_take_the_next_nonce() {
        let key = rfc6979_key();
        let digest = Sha1::digest("sample");
        let first = sign::<Sha1>(&key, &digest, ORDER_BITS);
        let short = sign::<Sha1>(&key, &digest, 160);
        assert_ne!(first, short);
        assert!(U192::from_be_slice(&short.0[8..]).bits() <= 160);
        assert!(U192::from_be_slice(&short.1[8..]).bits() <= 160);
        assert!(verifies(&key.public_point(), &digest, &short.0, &short.1));
    }

    #[test]
    fn components_that_are_zero_or_not_below_the_order_are_refused() {
        let key = rfc6979_key();
        let public = key.public_point();
        let digest = Sha1::digest("sample");
        let (r, s) = sign::<Sha1>(&key, &digest, 162);
        // d + r and d + s are congruent to the right values.
        let beyond = |value: &[u8; 32]| pad(&U192::from_be_slice(&value[8..]).wrapping_add(&ORDER));
        let mut huge = r;
        huge[0] = 1;
        assert!(verifies(&public, &digest, &r, &s));
        for bad in [[0; 32], order(), beyond(&r), beyond(&s), [255; 32], huge] {
            assert!(!verifies(&public, &digest, &bad, &s));
            assert!(!verifies(&public, &digest, &r, &bad));
        }
    }

    #[test]
    fn private_keys_lie_between_1_and_d_minus_1() {
        let key = |value: &U192| SecretScalar::from_octets(&octets(value)).is_some();
        assert!(!key(&U192::ZERO));
        assert!(key(&U192::ONE));
        assert!(key(&ORDER.wrapping_sub(&U192::ONE)));
        assert!(!key(&ORDER));
        assert!(!key(&ORDER.wrapping_add(&U192::ONE)));
        assert!(SecretScalar::from_octets(&[255; OCTETS]).is_none());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        #[test]
        fn a_signature_verifies_for_its_key_and_digest_alone(
            key in any::<[u8; 20]>(), other in any::<[u8; 20]>(), digest in any::<[u8; 20]>(), wrong in any::<[u8; 20]>()
        ) {
            let key = SecretScalar(integer(&key));
            let other = SecretScalar(integer(&other));
            prop_assume!(key.0 != U192::ZERO && other.0 != U192::ZERO && key.0 != other.0 && digest != wrong);
            let (r, s) = sign::<Sha1>(&key, &digest, 162);
            prop_assert!(verifies(&key.public_point(), &digest, &r, &s));
            prop_assert!(!verifies(&other.public_point(), &digest, &r, &s));
            prop_assert!(!verifies(&key.public_point(), &wrong, &r, &s));
        }
    }
}
