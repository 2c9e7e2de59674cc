//! Which signatures are checked: RSA (RFC 8017, both paddings) with keys from 2048 bits and ECDSA (FIPS 186-5) on P-256 and
//! P-384, each with SHA-256, SHA-384 or SHA-512 (RFC 4055, RFC 5754, RFC 5758).

use der::{Any, asn1::ObjectIdentifier, oid::AssociatedOid};
use rsa::{
    RsaPublicKey,
    pkcs1::{DecodeRsaPublicKey, RsaPssParams},
    pkcs1v15, pss,
    signature::hazmat::PrehashVerifier,
    traits::PublicKeyParts,
};
use sha1::Sha1;
use sha2::{Digest, Sha256, Sha384, Sha512};
use x509_cert::spki::{AlgorithmIdentifierOwned, SubjectPublicKeyInfoOwned};

use crate::message::oids;

oids! {
    /// rsaEncryption, RFC 8017 appendix A.1.
    RSA = "1.2.840.113549.1.1.1";
    /// id-RSASSA-PSS, RFC 8017 appendix A.2.3.
    RSA_PSS = "1.2.840.113549.1.1.10";
    /// id-mgf1, RFC 8017 appendix A.2.1.
    MGF1 = "1.2.840.113549.1.1.8";
    /// sha256WithRSAEncryption and its kin, RFC 8017 appendix A.2.4.
    RSA_SHA256 = "1.2.840.113549.1.1.11";
    RSA_SHA384 = "1.2.840.113549.1.1.12";
    RSA_SHA512 = "1.2.840.113549.1.1.13";
    /// id-ecPublicKey, RFC 5480 section 2.1.1.
    EC = "1.2.840.10045.2.1";
    /// secp256r1 and secp384r1, RFC 5480 section 2.1.1.1.
    P256 = "1.2.840.10045.3.1.7";
    P384 = "1.3.132.0.34";
    /// ecdsa-with-SHA256 and its kin, RFC 5758 section 3.2.
    ECDSA_SHA256 = "1.2.840.10045.4.3.2";
    ECDSA_SHA384 = "1.2.840.10045.4.3.3";
    ECDSA_SHA512 = "1.2.840.10045.4.3.4";
}

/// RSA keys below this many bits are refused (NIST SP 800-131A).
const LEAST_RSA_BITS: u32 = 2048;

/// Why a signature does not count.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// It is not one of this key over these bytes.
    Wrong,
    /// It is of a kind that is not checked here.
    Algorithm(ObjectIdentifier),
    /// The key is damaged, or too short.
    Key(&'static str),
}

/// A hash function of signatures and of digests that are signed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Hash {
    Sha256,
    Sha384,
    Sha512,
}

impl Hash {
    /// Parameters are absent or NULL (RFC 5754 section 2).
    pub(crate) fn named(algorithm: &AlgorithmIdentifierOwned) -> Result<Self, Fault> {
        match algorithm.parameters.as_ref().is_none_or(Any::is_null) {
            true => Self::numbered(algorithm.oid),
            false => Err(Fault::Algorithm(algorithm.oid)),
        }
    }

    fn numbered(oid: ObjectIdentifier) -> Result<Self, Fault> {
        let all = [
            (Sha256::OID, Self::Sha256),
            (Sha384::OID, Self::Sha384),
            (Sha512::OID, Self::Sha512),
        ];
        let found = all.into_iter().find(|&(known, _)| known == oid);
        found.map(|(_, hash)| hash).ok_or(Fault::Algorithm(oid))
    }

    pub(crate) fn digest(self, bytes: &[u8]) -> Vec<u8> {
        match self {
            Self::Sha256 => Sha256::digest(bytes).to_vec(),
            Self::Sha384 => Sha384::digest(bytes).to_vec(),
            Self::Sha512 => Sha512::digest(bytes).to_vec(),
        }
    }
}

/// SHA-1, which the first version of the signing-certificate attribute names a certificate by, and nothing else here.
pub(crate) fn sha1(bytes: &[u8]) -> Vec<u8> {
    Sha1::digest(bytes).to_vec()
}

/// How a signature was made.
enum Scheme {
    Pkcs1,
    Pss { salt: usize },
    Ecdsa,
}

/// The scheme and hash that an algorithm says. `rsaEncryption` says no hash: it is the one of the signer's digest (RFC 5754 section 3.2).
fn scheme(algorithm: &AlgorithmIdentifierOwned, digest: Option<Hash>) -> Result<(Scheme, Hash), Fault> {
    let unknown = Fault::Algorithm(algorithm.oid);
    Ok(match algorithm.oid {
        RSA => (Scheme::Pkcs1, digest.ok_or(unknown)?),
        RSA_SHA256 => (Scheme::Pkcs1, Hash::Sha256),
        RSA_SHA384 => (Scheme::Pkcs1, Hash::Sha384),
        RSA_SHA512 => (Scheme::Pkcs1, Hash::Sha512),
        RSA_PSS => pss_scheme(algorithm.parameters.as_ref()).ok_or(unknown)?,
        ECDSA_SHA256 => (Scheme::Ecdsa, Hash::Sha256),
        ECDSA_SHA384 => (Scheme::Ecdsa, Hash::Sha384),
        ECDSA_SHA512 => (Scheme::Ecdsa, Hash::Sha512),
        _ => return Err(unknown),
    })
}

/// RSASSA-PSS-params, RFC 4055 section 3.1, with the same hash for both purposes.
fn pss_scheme(parameters: Option<&Any>) -> Option<(Scheme, Hash)> {
    let parameters: RsaPssParams<Any> = parameters?.decode_as().ok()?;
    let hash = Hash::numbered(parameters.hash.oid).ok()?;
    let mask_hash = parameters.mask_gen.parameters.as_ref()?.oid;
    let same = parameters.mask_gen.oid == MGF1 && mask_hash == parameters.hash.oid;
    let salt = parameters.salt_len.into();
    same.then_some((Scheme::Pss { salt }, hash))
}

/// Whether `signature` is one by `key` over `message`. Of a signer, `digest` is the hash that it names beside; the two must be the same.
pub(crate) fn check(
    key: &SubjectPublicKeyInfoOwned,
    algorithm: &AlgorithmIdentifierOwned,
    digest: Option<Hash>,
    message: &[u8],
    signature: &[u8],
) -> Result<(), Fault> {
    let (scheme, hash) = scheme(algorithm, digest)?;
    if digest.is_some_and(|digest| digest != hash) {
        return Err(Fault::Wrong);
    }
    let bytes = key.subject_public_key.as_bytes();
    let bytes = bytes.ok_or(Fault::Key("the key is damaged"))?;
    let digest = hash.digest(message);
    let good = match (scheme, key.algorithm.oid) {
        (Scheme::Pkcs1, RSA) => is_pkcs1(rsa_key(bytes)?, hash, &digest, signature),
        (Scheme::Pss { salt }, RSA) => is_pss(rsa_key(bytes)?, salt, hash, &digest, signature),
        (Scheme::Ecdsa, EC) => is_ecdsa(key.algorithm.parameters.as_ref(), bytes, &digest, signature)?,
        (_, RSA | EC) => false,
        (_, other) => return Err(Fault::Algorithm(other)),
    };
    if good { Ok(()) } else { Err(Fault::Wrong) }
}

fn rsa_key(bytes: &[u8]) -> Result<RsaPublicKey, Fault> {
    let key = RsaPublicKey::from_pkcs1_der(bytes).map_err(|_| Fault::Key("the RSA key is damaged"))?;
    match key.n().bits() >= LEAST_RSA_BITS {
        true => Ok(key),
        false => Err(Fault::Key("the RSA key has fewer than 2048 bits")),
    }
}

fn is_pkcs1(key: RsaPublicKey, hash: Hash, digest: &[u8], signature: &[u8]) -> bool {
    let Ok(signature) = pkcs1v15::Signature::try_from(signature) else {
        return false;
    };
    let good = match hash {
        Hash::Sha256 => pkcs1v15::VerifyingKey::<Sha256>::new(key).verify_prehash(digest, &signature),
        Hash::Sha384 => pkcs1v15::VerifyingKey::<Sha384>::new(key).verify_prehash(digest, &signature),
        Hash::Sha512 => pkcs1v15::VerifyingKey::<Sha512>::new(key).verify_prehash(digest, &signature),
    };
    good.is_ok()
}

fn is_pss(key: RsaPublicKey, salt: usize, hash: Hash, digest: &[u8], signature: &[u8]) -> bool {
    let Ok(signature) = pss::Signature::try_from(signature) else {
        return false;
    };
    let good = match hash {
        Hash::Sha256 => {
            pss::VerifyingKey::<Sha256>::new_with_salt_len(key, salt).verify_prehash(digest, &signature)
        }
        Hash::Sha384 => {
            pss::VerifyingKey::<Sha384>::new_with_salt_len(key, salt).verify_prehash(digest, &signature)
        }
        Hash::Sha512 => {
            pss::VerifyingKey::<Sha512>::new_with_salt_len(key, salt).verify_prehash(digest, &signature)
        }
    };
    good.is_ok()
}

/// A digest longer than the order is cut to it (FIPS 186-5 section 6.4.2), so that each hash suits each curve.
fn is_ecdsa(curve: Option<&Any>, key: &[u8], digest: &[u8], signature: &[u8]) -> Result<bool, Fault> {
    let curve: Option<ObjectIdentifier> = curve.and_then(|curve| curve.decode_as().ok());
    let damaged = |_| Fault::Key("the key is not a point of its curve");
    match curve.ok_or(Fault::Key("the key names no curve"))? {
        P256 => {
            let key = p256::ecdsa::VerifyingKey::from_sec1_bytes(key).map_err(damaged)?;
            let signature = p256::ecdsa::Signature::from_der(signature);
            Ok(signature.is_ok_and(|signature| key.verify_prehash(digest, &signature).is_ok()))
        }
        P384 => {
            let key = p384::ecdsa::VerifyingKey::from_sec1_bytes(key).map_err(damaged)?;
            let signature = p384::ecdsa::Signature::from_der(signature);
            Ok(signature.is_ok_and(|signature| key.verify_prehash(digest, &signature).is_ok()))
        }
        other => Err(Fault::Algorithm(other)),
    }
}
