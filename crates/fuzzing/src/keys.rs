//! Keys: what is read is written alike, signs, and checks what it signed.

use pkcs8::der::{Decode, Encode, pem};
use pkcs8::{LineEnding, PrivateKeyInfoRef, pkcs5::pbes2};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use sigmark::{Curve, PublicKey, Scheme, SigningKey};

const PASSPHRASE: &str = "correct horse";

/// What the blocks of key files are called.
const LABELS: [&str; 4] = [
    "PRIVATE KEY",
    "ENCRYPTED PRIVATE KEY",
    "EC PRIVATE KEY",
    "PUBLIC KEY",
];

/// Reads a text in every way that keys are read; and bytes as the content of every block that key files have.
pub(crate) fn check(bytes: &[u8]) {
    if let Ok(text) = std::str::from_utf8(bytes) {
        check_text(text);
    }
    for label in LABELS {
        if let Ok(text) = pem::encode_string(label, LineEnding::LF, bytes) {
            check_text(&text);
        }
    }
}

fn check_text(text: &str) {
    if let Ok(key) = SigningKey::from_pem(text) {
        check_private(&key);
    }
    if let Ok(key) = SigningKey::from_encrypted_pem(text, PASSPHRASE) {
        check_private(&key);
    }
    if let Ok(key) = PublicKey::from_pem(text) {
        let again = PublicKey::from_pem(&key.to_pem()).expect("a key that we wrote ourselves");
        assert_eq!(again, key);
        assert_eq!(again.to_pem(), key.to_pem());
    }
}

fn check_private(key: &SigningKey) {
    let again = SigningKey::from_pem(&key.to_pem()).expect("a key that we wrote ourselves");
    assert_eq!(again.public_key(), key.public_key());
    let scheme = match key.curve() {
        Curve::P256 => Scheme::EcdsaP256Sha256,
        _ => Scheme::EcdsaB163Sha1,
    };
    let signature = key.sign(scheme, b"a model").expect("a scheme of the key's curve");
    assert!(key.public_key().verify(b"a model", &signature).is_ok());
}

/// Keys of both curves, open and locked, as text and as bytes.
pub(crate) fn seeds() -> Vec<Vec<u8>> {
    let mut seeds = Vec::new();
    for (number, curve) in [(1, Curve::P256), (2, Curve::B163)] {
        let key = SigningKey::generate(curve, &mut ChaCha20Rng::from_seed([number; 32]));
        let texts = [key.to_pem().to_string(), key.public_key().to_pem()];
        for text in texts {
            let (_, der) = pem::decode_vec(text.as_bytes()).expect("PEM that we wrote");
            seeds.push(text.into_bytes());
            if let Ok(info) = PrivateKeyInfoRef::from_der(&der) {
                seeds.push(info.private_key.as_bytes().to_vec());
                seeds.extend(locked(&der));
            }
            seeds.push(der);
        }
    }
    seeds
}

/// A key locked in both ways, cheaply: what takes a second to open is no seed.
fn locked(der: &[u8]) -> [Vec<u8>; 2] {
    const FITS: &str = "parameters of a few octets can be encoded";
    let (salt, iv) = ([1; 16], [2; 16]);
    let pbkdf2 = pbes2::Parameters::generate_pbkdf2_sha256_aes256cbc(10, &salt, iv).expect(FITS);
    let cheap = pkcs8::pkcs5::scrypt::Params::new(4, 8, 1).expect(FITS);
    let scrypt = pbes2::Parameters::generate_scrypt_aes256cbc(cheap, &salt, iv).expect(FITS);
    [pbkdf2, scrypt].map(|parameters| {
        let encrypted = parameters.encrypt(PASSPHRASE, der).expect(FITS);
        let info = pkcs8::EncryptedPrivateKeyInfoRef {
            encryption_algorithm: parameters.into(),
            encrypted_data: pkcs8::der::asn1::OctetStringRef::new(&encrypted).expect(FITS),
        };
        info.to_der().expect(FITS)
    })
}
