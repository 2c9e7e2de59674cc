//! The structures inside key files, as DER: PKCS#8 private keys (RFC 5958), plain and locked (RFC 8018, PBES2),
//! SEC1 private keys (RFC 5915) and public keys (SubjectPublicKeyInfo, RFC 5480).

use pkcs8::der::asn1::{AnyRef, BitStringRef, OctetStringRef};
use pkcs8::der::{Decode, Encode, SliceReader};
use pkcs8::pkcs5::{self, EncryptionScheme, pbes2};
use pkcs8::spki::SubjectPublicKeyInfoRef;
use pkcs8::{AlgorithmIdentifierRef, EncryptedPrivateKeyInfoRef, ObjectIdentifier, PrivateKeyInfoRef};
use rand_core::CryptoRng;
use sec1::{EcParameters, EcPrivateKey};
use zeroize::Zeroizing;

use super::KeyError;
use crate::payload::Curve;

/// id-ecPublicKey: an elliptic curve key, the parameters name the curve.
const EC_PUBLIC_KEY: ObjectIdentifier = ObjectIdentifier::new_unwrap("1.2.840.10045.2.1");

/// Algorithms that people mistake for ours.
const OTHER_ALGORITHMS: [(&str, &str); 6] = [
    ("1.2.840.113549.1.1.1", "RSA"),
    ("1.2.840.113549.1.1.10", "RSA-PSS"),
    ("1.2.840.10040.4.1", "DSA"),
    ("1.3.101.110", "X25519"),
    ("1.3.101.112", "Ed25519"),
    ("1.3.101.113", "Ed448"),
];

/// PBKDF2 iterations for new locked keys (OWASP's advice for HMAC-SHA-256).
const ITERATIONS: u32 = 600_000;

/// What opening a locked key may cost at most, so that a forged file cannot block the program: some seconds, and 128 MiB.
const MAX_ITERATIONS: u64 = 10_000_000;
const MAX_SCRYPT_MEMORY: u64 = 128 << 20;
const MAX_SCRYPT_ROUNDS: u64 = 16;

/// The object identifier by which key files name a curve.
fn oid_of(curve: Curve) -> ObjectIdentifier {
    match curve {
        Curve::P256 => ObjectIdentifier::new_unwrap("1.2.840.10045.3.1.7"),
        #[cfg(feature = "paper")]
        Curve::B163 => ObjectIdentifier::new_unwrap("1.3.132.0.15"),
    }
}

/// A private key as its file holds it.
#[cfg_attr(test, derive(Debug))]
pub(super) struct PrivateKeyFields {
    pub(super) curve: Curve,
    /// Big-endian, not yet validated.
    pub(super) scalar: Zeroizing<Vec<u8>>,
    /// The encoded point beside it, if any, not yet validated.
    pub(super) public: Option<Vec<u8>>,
}

/// Reads a PKCS#8 private key.
pub(super) fn decode_pkcs8(der: &[u8]) -> Result<PrivateKeyFields, KeyError> {
    let damaged = |error: pkcs8::der::Error| damaged("PKCS#8 private key", &error);
    let info = PrivateKeyInfoRef::from_der(der).map_err(damaged)?;
    let curve = curve_of(&info.algorithm)?;
    decode_sec1(info.private_key.as_bytes(), Some(curve))
}

/// Reads a SEC1 private key; inside PKCS#8 the curve is named outside, `outer`.
pub(super) fn decode_sec1(der: &[u8], outer: Option<Curve>) -> Result<PrivateKeyFields, KeyError> {
    let key = EcPrivateKey::from_der(der).map_err(|error| damaged("SEC1 private key", &error))?;
    let inner = key.parameters.and_then(EcParameters::named_curve);
    let curve = match (outer, inner) {
        (Some(curve), None) => curve,
        (Some(curve), Some(oid)) if oid == oid_of(curve) => curve,
        (Some(curve), Some(oid)) => {
            return Err(KeyError::CurvesDisagree {
                outer: oid_of(curve).to_string(),
                inner: oid.to_string(),
            });
        }
        (None, Some(oid)) => curve_by_oid(oid)?,
        (None, None) => return Err(KeyError::CurveNotNamed),
    };
    Ok(PrivateKeyFields {
        curve,
        scalar: Zeroizing::new(key.private_key.to_vec()),
        public: key.public_key.map(<[u8]>::to_vec),
    })
}

/// Writes a PKCS#8 private key, with its public key inside, as OpenSSL does.
pub(super) fn encode_pkcs8(curve: Curve, scalar: &[u8], public: &[u8]) -> Zeroizing<Vec<u8>> {
    const FITS: &str = "a key of a few dozen octets can be encoded";
    let key = EcPrivateKey {
        private_key: scalar,
        parameters: None,
        public_key: Some(public),
    };
    let key = Zeroizing::new(key.to_der().expect(FITS));
    let oid = oid_of(curve);
    let info = PrivateKeyInfoRef::new(algorithm(&oid), OctetStringRef::new(&key).expect(FITS));
    Zeroizing::new(info.to_der().expect(FITS))
}

/// Unlocks a private key: the DER of a PKCS#8 private key.
pub(super) fn decrypt(der: &[u8], passphrase: &str) -> Result<Zeroizing<Vec<u8>>, KeyError> {
    let (scheme, encrypted) = decode_encrypted(der)?;
    let EncryptionScheme::Pbes2(parameters) = &scheme else {
        return Err(unsupported("by PBES1"));
    };
    limit_costs(&parameters.kdf)?;
    let plain = scheme
        .decrypt(passphrase, encrypted)
        .map_err(|error| match error {
            pkcs5::Error::DecryptFailed => KeyError::WrongPassphrase,
            error => unsupported(&error.to_string()),
        })?;
    let plain = Zeroizing::new(plain);
    // A wrong passphrase passes the test of the padding once in 256 times, and then yields noise.
    match PrivateKeyInfoRef::from_der(&plain) {
        Ok(_) => Ok(plain),
        Err(_) => Err(KeyError::WrongPassphrase),
    }
}

/// The fields of an EncryptedPrivateKeyInfo (RFC 5958, 3), read one by one to tell an unknown algorithm from damage.
fn decode_encrypted<'a>(der: &'a [u8]) -> Result<(EncryptionScheme, &'a [u8]), KeyError> {
    let fields = |reader: &mut SliceReader<'a>| -> pkcs8::der::Result<_> {
        Ok((
            AlgorithmIdentifierRef::decode(reader)?,
            <&OctetStringRef>::decode(reader)?,
        ))
    };
    let (algorithm, encrypted) = AnyRef::from_der(der)
        .and_then(|info| info.sequence(fields))
        .map_err(|error| damaged("encrypted private key", &error))?;
    let scheme = EncryptionScheme::try_from(algorithm)
        .map_err(|error| unsupported(&format!("by algorithm {}: {error}", algorithm.oid)))?;
    Ok((scheme, encrypted.as_bytes()))
}

/// Locks a PKCS#8 private key by PBES2 with PBKDF2-HMAC-SHA-256 and AES-256-CBC, as `openssl pkcs8 -topk8` does.
pub(super) fn encrypt(plain: &[u8], passphrase: &str, rng: &mut (impl CryptoRng + ?Sized)) -> Vec<u8> {
    const FITS: &str = "a salt of 16 octets and a key of a few dozen can be encoded";
    let mut salt = [0; 16];
    let mut iv = [0; 16];
    rng.fill_bytes(&mut salt);
    rng.fill_bytes(&mut iv);
    let parameters = pbes2::Parameters::generate_pbkdf2_sha256_aes256cbc(ITERATIONS, &salt, iv).expect(FITS);
    let encrypted = parameters.encrypt(passphrase, plain).expect(FITS);
    EncryptedPrivateKeyInfoRef {
        encryption_algorithm: parameters.into(),
        encrypted_data: OctetStringRef::new(&encrypted).expect(FITS),
    }
    .to_der()
    .expect(FITS)
}

/// Reads a public key: its curve and the encoded point, not yet validated.
pub(super) fn decode_spki(der: &[u8]) -> Result<(Curve, Vec<u8>), KeyError> {
    let damaged = |error: pkcs8::der::Error| damaged("public key", &error);
    let info = SubjectPublicKeyInfoRef::from_der(der).map_err(damaged)?;
    let curve = curve_of(&info.algorithm)?;
    let point = info
        .subject_public_key
        .as_bytes()
        .ok_or(KeyError::PointEncoding {
            curve,
            detail: "it is not a whole number of octets",
        })?;
    Ok((curve, point.to_vec()))
}

/// Writes a public key.
pub(super) fn encode_spki(curve: Curve, point: &[u8]) -> Vec<u8> {
    const FITS: &str = "a point of a few dozen octets can be encoded";
    let oid = oid_of(curve);
    SubjectPublicKeyInfoRef {
        algorithm: algorithm(&oid),
        subject_public_key: BitStringRef::from_bytes(point).expect(FITS),
    }
    .to_der()
    .expect(FITS)
}

fn algorithm(curve: &ObjectIdentifier) -> AlgorithmIdentifierRef<'_> {
    AlgorithmIdentifierRef {
        oid: EC_PUBLIC_KEY,
        parameters: Some(AnyRef::from(curve)),
    }
}

fn curve_of(algorithm: &AlgorithmIdentifierRef<'_>) -> Result<Curve, KeyError> {
    if algorithm.oid != EC_PUBLIC_KEY {
        let oid = algorithm.oid.to_string();
        let name = OTHER_ALGORITHMS
            .into_iter()
            .find(|(other, _)| *other == oid)
            .map_or("unknown", |(_, name)| name);
        return Err(KeyError::WrongAlgorithm { name, oid });
    }
    match algorithm.parameters_oid() {
        Ok(oid) => curve_by_oid(oid),
        Err(_) => Err(KeyError::CurveNotNamed),
    }
}

fn curve_by_oid(oid: ObjectIdentifier) -> Result<Curve, KeyError> {
    Curve::ALL
        .iter()
        .copied()
        .find(|&curve| oid_of(curve) == oid)
        .ok_or_else(|| KeyError::UnknownCurve { oid: oid.to_string() })
}

/// Refuses key derivations that would take minutes or gigabytes.
fn limit_costs(kdf: &pbes2::Kdf) -> Result<(), KeyError> {
    let limit = |what, found: u64, limit| {
        if found <= limit {
            Ok(())
        } else {
            Err(KeyError::CostlyEncryption { what, found, limit })
        }
    };
    match kdf {
        pbes2::Kdf::Pbkdf2(parameters) => limit(
            "PBKDF2 iterations",
            parameters.iteration_count.into(),
            MAX_ITERATIONS,
        ),
        pbes2::Kdf::Scrypt(parameters) => {
            // The cost N is a power of two, and none of the three is zero (RFC 7914, 6): the crate takes it for granted.
            if !parameters.cost_parameter.is_power_of_two()
                || parameters.block_size == 0
                || parameters.parallelization == 0
            {
                return Err(unsupported("by scrypt with impossible parameters"));
            }
            let memory = parameters
                .cost_parameter
                .saturating_mul(128 * u64::from(parameters.block_size));
            limit("bytes of scrypt memory", memory, MAX_SCRYPT_MEMORY)?;
            limit(
                "rounds of scrypt",
                parameters.parallelization.into(),
                MAX_SCRYPT_ROUNDS,
            )
        }
        _ => Err(unsupported("by neither PBKDF2 nor scrypt")),
    }
}

fn damaged(what: &'static str, error: &pkcs8::der::Error) -> KeyError {
    KeyError::DamagedDer {
        what,
        detail: error.to_string(),
    }
}

fn unsupported(detail: &str) -> KeyError {
    KeyError::UnsupportedEncryption {
        detail: detail.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pkcs8::pkcs5::pbes2::{Kdf, Parameters, Pbkdf2Params, ScryptParams};

    fn locked_by(kdf: Kdf) -> Vec<u8> {
        let parameters = Parameters {
            kdf,
            encryption: pbes2::EncryptionScheme::Aes256Cbc { iv: [0; 16] },
        };
        EncryptedPrivateKeyInfoRef {
            encryption_algorithm: parameters.into(),
            encrypted_data: OctetStringRef::new(&[0; 64]).expect("64 octets"),
        }
        .to_der()
        .expect("valid parameters")
    }

    fn scrypt(cost_parameter: u64, block_size: u16, parallelization: u16) -> Kdf {
        Kdf::Scrypt(ScryptParams {
            salt: [1; 8].as_slice().try_into().expect("a salt of 8 octets"),
            cost_parameter,
            block_size,
            parallelization,
            key_length: None,
        })
    }

    fn pbkdf2(iterations: u32) -> Kdf {
        Kdf::Pbkdf2(Pbkdf2Params::hmac_sha256(iterations, &[1; 8]).expect("a salt of 8 octets"))
    }

    #[test]
    fn a_key_that_would_take_minutes_or_gigabytes_to_open_is_refused() {
        for (kdf, what) in [
            (pbkdf2(10_000_001), "PBKDF2 iterations"),
            (scrypt(1 << 18, 8, 1), "bytes of scrypt memory"),
            (scrypt(1 << 63, u16::MAX, 1), "bytes of scrypt memory"),
            (scrypt(2, 8, 17), "rounds of scrypt"),
        ] {
            match decrypt(&locked_by(kdf), "x") {
                Err(KeyError::CostlyEncryption { what: found, .. }) => assert_eq!(found, what),
                other => panic!("{what}: {other:?}"),
            }
        }
    }

    #[test]
    fn impossible_parameters_of_the_key_derivation_are_refused_and_do_not_panic() {
        for kdf in [
            scrypt(0, 8, 1),
            scrypt(1, 8, 1),
            scrypt(3, 8, 1),
            scrypt(16, 0, 1),
            scrypt(16, 8, 0),
            pbkdf2(0),
        ] {
            let result = decrypt(&locked_by(kdf.clone()), "x");
            assert!(
                matches!(
                    result,
                    Err(KeyError::UnsupportedEncryption { .. } | KeyError::WrongPassphrase)
                ),
                "{kdf:?}: {result:?}"
            );
        }
    }

    #[test]
    fn a_curve_named_twice_must_be_named_alike() {
        let key = |oid| {
            EcPrivateKey {
                private_key: &[1; 32],
                parameters: Some(EcParameters::NamedCurve(oid)),
                public_key: None,
            }
            .to_der()
            .expect("valid fields")
        };
        assert!(decode_sec1(&key(oid_of(Curve::P256)), Some(Curve::P256)).is_ok());
        #[cfg(feature = "paper")]
        assert!(matches!(
            decode_sec1(&key(oid_of(Curve::B163)), Some(Curve::P256)),
            Err(KeyError::CurvesDisagree { .. })
        ));
        assert!(matches!(
            decode_sec1(&key(EC_PUBLIC_KEY), None),
            Err(KeyError::UnknownCurve { .. })
        ));
    }

    #[test]
    fn a_sec1_key_that_names_no_curve_is_refused() {
        let key = EcPrivateKey {
            private_key: &[1; 32],
            parameters: None,
            public_key: None,
        };
        let der = key.to_der().expect("valid fields");
        assert!(matches!(decode_sec1(&der, None), Err(KeyError::CurveNotNamed)));
    }
}
