//! Private and public keys, always valid, and what they are for.

use std::fmt;

use rand_core::CryptoRng;
use sha2::{Digest, Sha256};
use zeroize::Zeroizing;

#[cfg(feature = "paper")]
use super::b163;
use super::der::{self, PrivateKeyFields};
use super::{KeyError, p256, pem};
use crate::payload::{Curve, Scheme, Signature, SignatureError};

const PRIVATE: &str = "PRIVATE KEY";
const ENCRYPTED: &str = "ENCRYPTED PRIVATE KEY";
const SEC1: &str = "EC PRIVATE KEY";
const PUBLIC: &str = "PUBLIC KEY";

/// A private key `k_d`. It is wiped from memory when dropped, and `Debug` does not show it.
#[derive(Clone)]
pub struct SigningKey(Secret);

#[derive(Clone)]
enum Secret {
    P256(::p256::SecretKey),
    #[cfg(feature = "paper")]
    B163(b163::SecretScalar),
}

impl SigningKey {
    /// Draws a new key, uniform between 1 and `d` - 1.
    ///
    /// The same state of `rng` gives the same key: for keys that matter it must be the operating system's generator.
    pub fn generate(curve: Curve, rng: &mut (impl CryptoRng + ?Sized)) -> Self {
        let mut octets = Zeroizing::new(vec![0; curve.octets()]);
        let unused_bits = 8 * curve.octets() - curve.bits();
        loop {
            rng.fill_bytes(&mut octets);
            octets[0] &= 0xff >> unused_bits;
            if let Ok(key) = SigningKey::from_scalar(curve, &octets) {
                return key;
            }
        }
    }

    /// Reads a private key that is not locked: PEM with PKCS#8 (`PRIVATE KEY`) or SEC1 (`EC PRIVATE KEY`) inside.
    ///
    /// # Errors
    /// [`KeyError::PassphraseNeeded`] if it is locked; otherwise what is wrong with the text or the key.
    pub fn from_pem(text: &str) -> Result<Self, KeyError> {
        let block = pem::decode(text)?;
        match block.label.as_str() {
            PRIVATE => SigningKey::from_fields(&der::decode_pkcs8(&block.der)?),
            SEC1 => SigningKey::from_fields(&der::decode_sec1(&block.der, None)?),
            ENCRYPTED => Err(KeyError::PassphraseNeeded),
            _ => Err(not_a_private_key(block.label)),
        }
    }

    /// Reads a private key locked by a passphrase: PEM with PKCS#8, PBES2 (`ENCRYPTED PRIVATE KEY`), as
    /// `openssl pkcs8 -topk8` and [`SigningKey::to_encrypted_pem`] write it.
    ///
    /// # Errors
    /// [`KeyError::WrongPassphrase`], [`KeyError::NotEncrypted`], or what is wrong with the text or the key.
    pub fn from_encrypted_pem(text: &str, passphrase: &str) -> Result<Self, KeyError> {
        let block = pem::decode(text)?;
        match block.label.as_str() {
            ENCRYPTED => {
                let plain = der::decrypt(&block.der, passphrase)?;
                SigningKey::from_fields(&der::decode_pkcs8(&plain)?)
            }
            PRIVATE | SEC1 => Err(KeyError::NotEncrypted),
            _ => Err(not_a_private_key(block.label)),
        }
    }

    /// The key as PEM, not locked (PKCS#8). Who reads the file can sign: keep it where only its owner can.
    pub fn to_pem(&self) -> Zeroizing<String> {
        pem::encode(PRIVATE, &self.to_pkcs8())
    }

    /// The key as PEM, locked by a passphrase (PKCS#8 and PBES2 with PBKDF2-HMAC-SHA-256, AES-256-CBC).
    ///
    /// # Errors
    /// [`KeyError::EmptyPassphrase`].
    pub fn to_encrypted_pem(
        &self,
        passphrase: &str,
        rng: &mut (impl CryptoRng + ?Sized),
    ) -> Result<Zeroizing<String>, KeyError> {
        if passphrase.is_empty() {
            return Err(KeyError::EmptyPassphrase);
        }
        let locked = der::encrypt(&self.to_pkcs8(), passphrase, rng);
        Ok(pem::encode(ENCRYPTED, &locked))
    }

    /// The curve that the key is on.
    pub fn curve(&self) -> Curve {
        match self.0 {
            Secret::P256(_) => Curve::P256,
            #[cfg(feature = "paper")]
            Secret::B163(_) => Curve::B163,
        }
    }

    /// `K_e = k_d A`.
    pub fn public_key(&self) -> PublicKey {
        PublicKey(match &self.0 {
            Secret::P256(key) => Point::P256(key.public_key()),
            #[cfg(feature = "paper")]
            Secret::B163(key) => Point::B163(key.public_point()),
        })
    }

    /// Signs a message (eqs. 9 and 10), with the nonce of RFC 6979: the same message gives the same signature.
    ///
    /// # Errors
    /// [`SignatureError::CurveMismatch`] if the scheme is of another curve.
    pub fn sign(&self, scheme: Scheme, message: &[u8]) -> Result<Signature, SignatureError> {
        check_curve(scheme, self.curve())?;
        let digest = scheme.digest(message);
        let (r, s) = match &self.0 {
            Secret::P256(key) => p256::sign(key, scheme, &digest),
            #[cfg(feature = "paper")]
            Secret::B163(key) => b163::sign::<sha1::Sha1>(key, &digest, scheme.component_bits() as u32),
        };
        Ok(Signature::new(scheme, r, s))
    }

    fn from_fields(fields: &PrivateKeyFields) -> Result<Self, KeyError> {
        let key = SigningKey::from_scalar(fields.curve, &fields.scalar)?;
        match &fields.public {
            Some(octets) if PublicKey::from_sec1(fields.curve, octets)? != key.public_key() => {
                Err(KeyError::KeysDisagree)
            }
            _ => Ok(key),
        }
    }

    /// The key of at most as many octets as the order has; RFC 5915 asks for exactly as many, old writers drop zeros.
    fn from_scalar(curve: Curve, octets: &[u8]) -> Result<Self, KeyError> {
        let out_of_range = KeyError::ScalarOutOfRange { curve };
        let Some(padding) = curve.octets().checked_sub(octets.len()) else {
            return Err(out_of_range);
        };
        let mut padded = Zeroizing::new([0; 32]);
        padded[padding..curve.octets()].copy_from_slice(octets);
        let secret = match curve {
            Curve::P256 => ::p256::SecretKey::from_slice(&padded[..]).ok().map(Secret::P256),
            #[cfg(feature = "paper")]
            Curve::B163 => padded
                .first_chunk()
                .and_then(b163::SecretScalar::from_octets)
                .map(Secret::B163),
        };
        secret.map(SigningKey).ok_or(out_of_range)
    }

    fn to_pkcs8(&self) -> Zeroizing<Vec<u8>> {
        let scalar = Zeroizing::new(match &self.0 {
            Secret::P256(key) => Zeroizing::new(key.to_bytes()).to_vec(),
            #[cfg(feature = "paper")]
            Secret::B163(key) => key.to_octets().to_vec(),
        });
        der::encode_pkcs8(self.curve(), &scalar, &self.public_key().to_sec1())
    }
}

impl fmt::Debug for SigningKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SigningKey")
            .field("public_key", &self.public_key())
            .finish_non_exhaustive()
    }
}

/// A public key `K_e`: a point of the curve, of the order of the base point.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct PublicKey(Point);

#[derive(Clone, Copy, PartialEq, Eq)]
enum Point {
    P256(::p256::PublicKey),
    #[cfg(feature = "paper")]
    B163(b163::AffinePoint),
}

impl PublicKey {
    /// Reads a public key: PEM with a SubjectPublicKeyInfo (`PUBLIC KEY`) inside, as `openssl pkey -pubout` writes it.
    ///
    /// # Errors
    /// What is wrong with the text or the key; a private key is refused, it need not be here.
    pub fn from_pem(text: &str) -> Result<Self, KeyError> {
        let block = pem::decode(text)?;
        if block.label != PUBLIC {
            return Err(not_a_public_key(block.label));
        }
        let (curve, octets) = der::decode_spki(&block.der)?;
        PublicKey::from_sec1(curve, &octets)
    }

    /// The key as PEM.
    pub fn to_pem(&self) -> String {
        pem::encode(PUBLIC, &self.to_spki()).to_string()
    }

    /// The curve that the key is on.
    pub fn curve(&self) -> Curve {
        match self.0 {
            Point::P256(_) => Curve::P256,
            #[cfg(feature = "paper")]
            Point::B163(_) => Curve::B163,
        }
    }

    /// Checks that the owner of this key signed the message (eqs. 19 and 20).
    ///
    /// # Errors
    /// [`SignatureError::CurveMismatch`] if the signature's scheme is of another curve;
    /// [`SignatureError::ComponentOutOfRange`] and [`SignatureError::Mismatch`] if the signature is not valid.
    pub fn verify(&self, message: &[u8], signature: &Signature) -> Result<(), SignatureError> {
        let scheme = signature.scheme();
        let curve = self.curve();
        check_curve(scheme, curve)?;
        for (component, value) in [('r', signature.r()), ('s', signature.s())] {
            if *value == [0; 32] || *value >= order(curve) {
                return Err(SignatureError::ComponentOutOfRange { component, curve });
            }
        }
        let digest = scheme.digest(message);
        let valid = match &self.0 {
            Point::P256(key) => p256::verifies(key, &digest, signature.r(), signature.s()),
            #[cfg(feature = "paper")]
            Point::B163(key) => b163::verifies(key, &digest, signature.r(), signature.s()),
        };
        if valid {
            Ok(())
        } else {
            Err(SignatureError::Mismatch)
        }
    }

    /// The SHA-256 of the key's DER, in 64 hexadecimal digits: what two people compare to know that they have the same key.
    /// It is also what `openssl pkey -pubin -in key.pem -outform DER | sha256sum` prints.
    pub fn fingerprint(&self) -> String {
        Sha256::digest(self.to_spki())
            .iter()
            .map(|octet| format!("{octet:02x}"))
            .collect()
    }

    /// Decodes and validates a point (SEC 1, 2.3.4).
    fn from_sec1(curve: Curve, octets: &[u8]) -> Result<Self, KeyError> {
        let point = match curve {
            Curve::P256 => p256::decode_point(octets).map(Point::P256),
            #[cfg(feature = "paper")]
            Curve::B163 => b163::AffinePoint::from_sec1(octets).map(Point::B163),
        };
        point.map(PublicKey).map_err(|error| error.on(curve))
    }

    /// The uncompressed encoding.
    fn to_sec1(self) -> Vec<u8> {
        match self.0 {
            Point::P256(key) => p256::encode_point(&key),
            #[cfg(feature = "paper")]
            Point::B163(point) => point.to_sec1().to_vec(),
        }
    }

    pub(crate) fn to_spki(self) -> Vec<u8> {
        der::encode_spki(self.curve(), &self.to_sec1())
    }
}

impl fmt::Debug for PublicKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PublicKey")
            .field("curve", &self.curve())
            .field("fingerprint", &self.fingerprint())
            .finish()
    }
}

/// The order `d` of the base point, big-endian.
fn order(curve: Curve) -> [u8; 32] {
    match curve {
        Curve::P256 => p256::order(),
        #[cfg(feature = "paper")]
        Curve::B163 => b163::order(),
    }
}

fn check_curve(scheme: Scheme, curve: Curve) -> Result<(), SignatureError> {
    if scheme.curve() == curve {
        Ok(())
    } else {
        Err(SignatureError::CurveMismatch { scheme, curve })
    }
}

fn not_a_private_key(label: String) -> KeyError {
    let remedy = match label.as_str() {
        PUBLIC => "signing needs the private key that belongs to it",
        "CERTIFICATE" => "signing needs the private key that belongs to it",
        "RSA PRIVATE KEY" | "DSA PRIVATE KEY" => {
            "make an elliptic curve key with `openssl genpkey -algorithm EC -pkeyopt ec_paramgen_curve:P-256`"
        }
        "OPENSSH PRIVATE KEY" => "convert it with `ssh-keygen -p -m PKCS8`",
        _ => "give the PEM file of a private key, such as `openssl genpkey` writes",
    };
    KeyError::WrongKind {
        expected: "private key",
        found: label,
        remedy,
    }
}

fn not_a_public_key(label: String) -> KeyError {
    let remedy = match label.as_str() {
        PRIVATE | ENCRYPTED | SEC1 => {
            "keep it secret; `openssl pkey -pubout` extracts the public key to give away"
        }
        "CERTIFICATE" => "`openssl x509 -pubkey -noout` extracts the public key from it",
        _ => "give the PEM file of a public key, such as `openssl pkey -pubout` writes",
    };
    KeyError::WrongKind {
        expected: "public key",
        found: label,
        remedy,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pkcs8(curve: Curve, scalar: &[u8], public: &[u8]) -> String {
        pem::encode(PRIVATE, &der::encode_pkcs8(curve, scalar, public)).to_string()
    }

    fn key_of_one(curve: Curve) -> SigningKey {
        SigningKey::from_scalar(curve, &[1]).expect("1 is a private key")
    }

    #[test]
    fn a_private_key_that_is_zero_or_not_below_the_order_is_refused() {
        for &curve in Curve::ALL {
            let public = key_of_one(curve).public_key().to_sec1();
            let order = &order(curve)[32 - curve.octets()..];
            let mut above = order.to_vec();
            above[curve.octets() - 1] += 1;
            let mut long = vec![0; curve.octets() + 1];
            long[curve.octets()] = 1;
            let zero = vec![0; curve.octets()];
            let ones = vec![255; curve.octets()];
            for scalar in [&zero, order, &above, &ones, &long, &[]] {
                let result = SigningKey::from_pem(&pkcs8(curve, scalar, &public));
                assert_eq!(
                    result.expect_err("out of range"),
                    KeyError::ScalarOutOfRange { curve }
                );
            }
        }
    }

    #[test]
    fn a_private_key_whose_leading_zeros_were_dropped_is_read() {
        for &curve in Curve::ALL {
            let key = key_of_one(curve);
            let text = pkcs8(curve, &[1], &key.public_key().to_sec1());
            let read = SigningKey::from_pem(&text).expect("the key 1");
            assert_eq!(read.to_pem(), key.to_pem());
        }
    }

    #[test]
    fn a_foreign_public_key_beside_the_private_one_is_refused() {
        for &curve in Curve::ALL {
            let other = SigningKey::from_scalar(curve, &[2]).expect("2 is a private key");
            let text = pkcs8(curve, &[1], &other.public_key().to_sec1());
            assert_eq!(
                SigningKey::from_pem(&text).expect_err("another's public key"),
                KeyError::KeysDisagree
            );
        }
    }

    #[test]
    fn a_public_key_that_is_no_point_of_the_group_is_refused() {
        let read = |curve, octets: &[u8]| {
            let text = pem::encode(PUBLIC, &der::encode_spki(curve, octets));
            PublicKey::from_pem(&text).expect_err("no public key")
        };
        for &curve in Curve::ALL {
            let mut off = key_of_one(curve).public_key().to_sec1();
            *off.last_mut().expect("octets") ^= 1;
            assert_eq!(read(curve, &off), KeyError::PointNotOnCurve { curve });
            assert_eq!(read(curve, &[0]), KeyError::PointAtInfinity { curve });
            for bad in [&off[..5], &[], &[9; 43], &[4; 44]] {
                assert!(matches!(
                    read(curve, bad),
                    KeyError::PointEncoding { curve: found, .. } if found == curve
                ));
            }
        }
    }

    #[cfg(feature = "paper")]
    #[test]
    fn a_point_of_the_curve_outside_of_the_group_is_refused() {
        // y^2 = b at x = 0: the point of order 2.
        let mut small = vec![0; 22];
        small[0] = 2;
        let curve = Curve::B163;
        let text = pem::encode(PUBLIC, &der::encode_spki(curve, &small));
        let error = PublicKey::from_pem(&text).expect_err("no public key");
        assert_eq!(error, KeyError::PointOfWrongOrder { curve });
    }
}
