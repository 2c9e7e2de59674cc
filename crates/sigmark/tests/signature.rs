//! Keys and signatures as a user meets them; the fixtures and how they were made stand in `tests/keys`.

use proptest::prelude::*;
use rand_chacha::ChaCha20Rng;
use rand_chacha::rand_core::SeedableRng;
use sigmark::{Curve, KeyError, PublicKey, Scheme, Signature, SignatureError, SigningKey};

const PASSPHRASE: &str = "correct horse";

macro_rules! key_file {
    ($name:literal) => {
        include_str!(concat!("keys/", $name, ".pem"))
    };
}

const CURVES: &[Curve] = &[
    Curve::P256,
    #[cfg(feature = "paper")]
    Curve::B163,
];

fn key(seed: u8, curve: Curve) -> SigningKey {
    SigningKey::generate(curve, &mut ChaCha20Rng::from_seed([seed; 32]))
}

fn private_error(text: &str) -> KeyError {
    SigningKey::from_pem(text).expect_err("not a private key to read")
}

fn public_error(text: &str) -> KeyError {
    PublicKey::from_pem(text).expect_err("not a public key to read")
}

#[test]
fn keys_written_by_openssl_are_read_in_every_form() {
    for (plain, sec1, compressed_sec1, locked, public, compressed_public, curve, fingerprint) in [
        (
            key_file!("p256"),
            key_file!("p256.sec1"),
            key_file!("p256.compressed.sec1"),
            key_file!("p256.locked"),
            key_file!("p256.public"),
            key_file!("p256.compressed.public"),
            Curve::P256,
            "5312d69fe3b8a747c1eedc36c0f5fb0b175a196540fe5e8a01e8e78f47bfc203",
        ),
        #[cfg(feature = "paper")]
        (
            key_file!("b163"),
            key_file!("b163.sec1"),
            key_file!("b163.compressed.sec1"),
            key_file!("b163.locked"),
            key_file!("b163.public"),
            key_file!("b163.compressed.public"),
            Curve::B163,
            "b0d216477c8b38eff95b23e0c2d9c1af98d75a55bd9be0e889f14dbe044de8c0",
        ),
    ] {
        let key = SigningKey::from_pem(plain).expect("PKCS#8");
        assert_eq!(key.curve(), curve);
        // Written again, it is the same file, octet by octet.
        assert_eq!(key.to_pem().as_str(), plain);
        assert_eq!(key.public_key().to_pem(), public);
        // openssl pkey -pubin -in KEY.public.pem -outform DER | sha256sum
        assert_eq!(key.public_key().fingerprint(), fingerprint);
        for text in [sec1, compressed_sec1] {
            let read = SigningKey::from_pem(text).expect("SEC1");
            assert_eq!(read.to_pem(), key.to_pem());
        }
        let read = SigningKey::from_encrypted_pem(locked, PASSPHRASE).expect("PBES2");
        assert_eq!(read.to_pem(), key.to_pem());
        for text in [public, compressed_public] {
            assert_eq!(PublicKey::from_pem(text), Ok(key.public_key()));
        }
    }
}

#[test]
fn a_sec1_key_behind_its_parameters_is_read() {
    for (text, curve) in [
        (key_file!("p256.ecparam"), Curve::P256),
        #[cfg(feature = "paper")]
        (key_file!("b163.ecparam"), Curve::B163),
    ] {
        assert!(text.starts_with("-----BEGIN EC PARAMETERS-----"));
        let key = SigningKey::from_pem(text).expect("SEC1");
        assert_eq!(key.curve(), curve);
    }
}

#[test]
fn a_key_locked_by_scrypt_is_read() {
    let key = SigningKey::from_encrypted_pem(key_file!("p256.locked-scrypt"), PASSPHRASE);
    assert_eq!(key.expect("scrypt").to_pem().as_str(), key_file!("p256"));
}

/// `openssl dgst -sha256 -sign p256.pem message`, with `message` the nine octets "watermark", and so on.
#[test]
fn signatures_made_by_openssl_are_valid_here() {
    for (public, scheme, hex) in [
        (
            key_file!("p256.public"),
            Scheme::EcdsaP256Sha256,
            "86AEC20C1E32953ED30413FECD0538D509BED488BB3F18A078D7086EE880EAB7\
             D562619F574CF05F62D99FF785BF2BF844C136035DF5FFD041B3C5D145EB0742",
        ),
        (
            key_file!("p256.public"),
            Scheme::EcdsaP256Sha1,
            "FCFCEA22A46744357D739C5289F51E6C73B4FBBCE4AE96251A71D1D74ED0EF3C\
             CFF95A1841D4698CE3DCEA1C0E47C9C03E8AF0F3A7D7326CA1BE9FABC43240E1",
        ),
    ] {
        let public = PublicKey::from_pem(public).expect("a public key");
        let signature = Signature::from_hex(scheme, hex).expect("hexadecimal");
        assert_eq!(public.verify(b"watermark", &signature), Ok(()));
        assert_eq!(
            public.verify(b"Watermark", &signature),
            Err(SignatureError::Mismatch)
        );
    }
}

#[cfg(feature = "paper")]
#[test]
fn a_signature_made_by_openssl_on_the_papers_curve_is_valid_here() {
    // r = 02853ABF628005A0C5E1DB209757A95F6E8722A1B7, s = 4385AC80770580B8C4D9089082ED9C8759BE2DC5, in 162 bits each.
    let integers = [
        "0x02853ABF628005A0C5E1DB209757A95F6E8722A1B7",
        "0x004385AC80770580B8C4D9089082ED9C8759BE2DC5",
    ];
    let bits: Vec<bool> = integers
        .iter()
        .flat_map(|text| {
            let digits = text.trim_start_matches("0x").chars();
            let bits: Vec<bool> = digits
                .filter_map(|digit| digit.to_digit(16))
                .flat_map(|digit| (0..4).rev().map(move |i| (digit >> i) & 1 == 1))
                .collect();
            bits[bits.len() - 162..].to_vec()
        })
        .collect();
    let signature = Signature::from_bits(Scheme::EcdsaB163Sha1, &bits).expect("324 bits");
    let public = PublicKey::from_pem(key_file!("b163.public")).expect("a public key");
    assert_eq!(public.verify(b"watermark", &signature), Ok(()));
    assert_eq!(
        public.verify(b"Watermark", &signature),
        Err(SignatureError::Mismatch)
    );
}

/// Each was found valid by `openssl dgst -sha256 -verify p256.public.pem -signature signature.der message`, and so on,
/// with `signature.der` the SEQUENCE of r and s.
#[test]
fn signatures_made_here_are_those_that_openssl_found_valid() {
    for (private, scheme, hex) in [
        (
            key_file!("p256"),
            Scheme::EcdsaP256Sha256,
            "962f1b269c30b385dbd77f3adcd3ca5f92bd4ad474d51068e970a67133374694\
             977b33eb7ef6d3ec5d045126a1e8b9ac4cf10936b041dc27e3861dd5e82b9c14",
        ),
        (
            key_file!("p256"),
            Scheme::EcdsaP256Sha1,
            "5e0fbbb5758343f2501ea6877ac39f717dda7f73cacf17066f809c9932a7071e\
             bc10ae145ae4a52294618a0c35db8d1147c908450b6fe0062b9e1095ec3e4bba",
        ),
        #[cfg(feature = "paper")]
        (
            key_file!("b163"),
            Scheme::EcdsaB163Sha1,
            "61bbf12ec5d4d9ba4a644418aa270738798744424db3ab23f3ec0060446138bae105e2190f1ccb626",
        ),
    ] {
        let key = SigningKey::from_pem(private).expect("a private key");
        let signature = key.sign(scheme, b"watermark").expect("its own curve");
        assert_eq!(signature.to_hex(), hex);
    }
}

/// The first scheme of a curve.
fn scheme_of(curve: Curve) -> Scheme {
    let mut schemes = Scheme::ALL.iter().copied();
    schemes.find(|scheme| scheme.curve() == curve).expect("a scheme")
}

#[test]
fn any_flipped_bit_makes_a_signature_invalid() {
    for &curve in CURVES {
        let scheme = scheme_of(curve);
        let key = key(1, scheme.curve());
        let public = key.public_key();
        let signature = key.sign(scheme, b"watermark").expect("its own curve");
        assert_eq!(public.verify(b"watermark", &signature), Ok(()));
        let bits = signature.bits();
        for i in 0..bits.len() {
            let mut flipped = bits.clone();
            flipped[i] = !flipped[i];
            let flipped = Signature::from_bits(scheme, &flipped).expect("l bits");
            assert!(
                public.verify(b"watermark", &flipped).is_err(),
                "{scheme}, bit {i}"
            );
        }
    }
}

#[test]
fn a_component_that_no_signer_produces_is_named() {
    let order = "ffffffff00000000ffffffffffffffffbce6faada7179e84f3b9cac2fc632551";
    let above = "ffffffff00000000ffffffffffffffffbce6faada7179e84f3b9cac2fc632552";
    let (zero, ones) = ("0".repeat(64), "f".repeat(64));
    let public = key(1, Curve::P256).public_key();
    let one = format!("{:0>64}", "1");
    for bad in [&zero, order, above, &ones] {
        for (text, component) in [(format!("{bad}{one}"), 'r'), (format!("{one}{bad}"), 's')] {
            let signature = Signature::from_hex(Scheme::default(), &text).expect("512 bits");
            assert_eq!(
                public.verify(b"watermark", &signature),
                Err(SignatureError::ComponentOutOfRange {
                    component,
                    curve: Curve::P256
                })
            );
        }
    }
}

#[cfg(feature = "paper")]
#[test]
fn a_component_of_zero_is_named_on_the_papers_curve() {
    let public = key(1, Curve::B163).public_key();
    for (component, range) in [('r', 0..162), ('s', 162..324)] {
        let mut bits = [true; 324];
        bits[range].fill(false);
        let signature = Signature::from_bits(Scheme::EcdsaB163Sha1, &bits).expect("324 bits");
        assert_eq!(
            public.verify(b"watermark", &signature),
            Err(SignatureError::ComponentOutOfRange {
                component,
                curve: Curve::B163
            })
        );
    }
}

#[test]
fn key_message_and_hash_function_must_all_be_the_signers() {
    for &scheme in Scheme::ALL {
        let signer = key(1, scheme.curve());
        let signature = signer.sign(scheme, b"watermark").expect("its own curve");
        let public = signer.public_key();
        let stranger = key(2, scheme.curve()).public_key();
        assert_eq!(public.verify(b"watermark", &signature), Ok(()));
        for wrong in [&b""[..], b"watermar", b"watermarks", b"Watermark"] {
            assert_eq!(public.verify(wrong, &signature), Err(SignatureError::Mismatch));
        }
        assert_eq!(
            stranger.verify(b"watermark", &signature),
            Err(SignatureError::Mismatch)
        );
        assert_eq!(signer.sign(scheme, b"watermark"), Ok(signature));
    }
    let signer = key(1, Curve::P256);
    let signature = signer
        .sign(Scheme::EcdsaP256Sha256, b"watermark")
        .expect("its own curve");
    let relabelled = Signature::from_bits(Scheme::EcdsaP256Sha1, &signature.bits()).expect("512 bits");
    assert_eq!(
        signer.public_key().verify(b"watermark", &relabelled),
        Err(SignatureError::Mismatch)
    );
}

#[cfg(feature = "paper")]
#[test]
fn a_scheme_of_another_curve_is_refused() {
    let scheme = Scheme::EcdsaB163Sha1;
    let mismatch = SignatureError::CurveMismatch {
        scheme,
        curve: Curve::P256,
    };
    let signer = key(1, Curve::P256);
    assert_eq!(signer.sign(scheme, b"watermark"), Err(mismatch.clone()));
    let signature = key(1, Curve::B163)
        .sign(scheme, b"watermark")
        .expect("its own curve");
    assert_eq!(
        signer.public_key().verify(b"watermark", &signature),
        Err(mismatch)
    );
}

#[test]
fn a_locked_key_opens_with_its_passphrase_alone() {
    for &curve in CURVES {
        let mut rng = ChaCha20Rng::from_seed([3; 32]);
        let key = SigningKey::generate(curve, &mut rng);
        let locked = key
            .to_encrypted_pem("Grüße, 世界", &mut rng)
            .expect("a passphrase");
        let opened = SigningKey::from_encrypted_pem(&locked, "Grüße, 世界").expect("the passphrase");
        assert_eq!(opened.to_pem(), key.to_pem());
        let again = key
            .to_encrypted_pem("Grüße, 世界", &mut rng)
            .expect("a passphrase");
        assert_ne!(locked, again, "salt and initial vector are drawn anew");
        assert_eq!(
            key.to_encrypted_pem("", &mut rng).expect_err("no passphrase"),
            KeyError::EmptyPassphrase
        );
        assert_eq!(private_error(&locked), KeyError::PassphraseNeeded);
        assert_eq!(
            SigningKey::from_encrypted_pem(&key.to_pem(), "x").expect_err("not locked"),
            KeyError::NotEncrypted
        );
    }
    // Among 600 wrong passphrases some pass the test of the padding.
    for i in 0..600 {
        assert_eq!(
            SigningKey::from_encrypted_pem(key_file!("p256.locked"), &i.to_string())
                .expect_err("a wrong passphrase"),
            KeyError::WrongPassphrase
        );
    }
}

#[test]
fn keys_of_other_kinds_are_named() {
    let kind = |error| match error {
        KeyError::WrongKind { expected, found, .. } => (expected, found),
        other => panic!("{other:?}"),
    };
    for (text, label) in [
        (key_file!("p256.public"), "PUBLIC KEY"),
        (key_file!("certificate"), "CERTIFICATE"),
    ] {
        assert_eq!(kind(private_error(text)), ("private key", label.to_owned()));
    }
    for (text, label) in [
        (key_file!("p256"), "PRIVATE KEY"),
        (key_file!("p256.locked"), "ENCRYPTED PRIVATE KEY"),
        (key_file!("b163.sec1"), "EC PRIVATE KEY"),
        (key_file!("certificate"), "CERTIFICATE"),
    ] {
        assert_eq!(kind(public_error(text)), ("public key", label.to_owned()));
    }
    for (text, algorithm) in [(key_file!("rsa"), "RSA"), (key_file!("ed25519"), "Ed25519")] {
        assert!(matches!(private_error(text), KeyError::WrongAlgorithm { name, .. } if name == algorithm));
    }
    let p384 = KeyError::UnknownCurve {
        oid: "1.3.132.0.34".to_owned(),
    };
    assert_eq!(private_error(key_file!("p384")), p384);
    assert_eq!(public_error(key_file!("p384.public")), p384);
    assert_eq!(
        public_error(key_file!("p256.explicit.public")),
        KeyError::CurveNotNamed
    );
}

#[test]
fn keys_locked_in_old_ways_are_refused_with_a_remedy() {
    assert_eq!(
        private_error(key_file!("p256.locked-legacy")),
        KeyError::LegacyEncryption
    );
    for text in [
        key_file!("p256.locked-pbes1"),
        key_file!("p256.locked-3des"),
        key_file!("p256.locked-hmac-sha1"),
    ] {
        let error = SigningKey::from_encrypted_pem(text, PASSPHRASE).expect_err("an old algorithm");
        assert!(
            matches!(error, KeyError::UnsupportedEncryption { .. }),
            "{error:?}"
        );
        assert!(error.to_string().contains("openssl pkcs8 -topk8"));
    }
}

#[test]
fn text_around_the_key_is_skipped_before_and_refused_after() {
    let text = key_file!("p256");
    assert!(SigningKey::from_pem(&format!("my key\n{text}\n \r\n")).is_ok());
    assert!(SigningKey::from_pem(&text.replace('\n', "\r\n")).is_ok());
    assert_eq!(private_error(&format!("{text}{text}")), KeyError::TrailingText);
    assert_eq!(private_error(&format!("{text}x")), KeyError::TrailingText);
    for text in ["", "x", "-----BEGIN", key_file!("p256").trim_start_matches('-')] {
        assert_eq!(private_error(text), KeyError::NotPem);
    }
    for end in (27..text.len() - 26).step_by(7) {
        assert!(matches!(private_error(&text[..end]), KeyError::DamagedPem { .. }));
    }
}

#[test]
fn debug_output_does_not_show_the_private_key() {
    for &curve in CURVES {
        let text = format!("{:?}", key(1, curve));
        let fingerprint = key(1, curve).public_key().fingerprint();
        assert!(text.contains(&fingerprint));
        // Nothing else in it is longer than a word.
        let rest = text.replace(&fingerprint, "");
        assert!(
            rest.split(|c: char| !c.is_alphanumeric())
                .all(|word| word.len() < 16)
        );
    }
}

/// The PEM text of DER octets.
fn pem(label: &str, der: &[u8]) -> String {
    pkcs8::der::pem::encode_string(label, pkcs8::LineEnding::LF, der).expect("a label")
}

fn decoded(text: &str) -> (String, Vec<u8>) {
    let (label, der) = pkcs8::der::pem::decode_vec(text.as_bytes()).expect("a fixture");
    (label.to_owned(), der)
}

/// Reads the text in every way; whatever is accepted is a valid key, which survives being written.
fn read_every_way(text: &str) {
    for key in [
        SigningKey::from_pem(text),
        SigningKey::from_encrypted_pem(text, PASSPHRASE),
    ]
    .into_iter()
    .flatten()
    {
        let again = SigningKey::from_pem(&key.to_pem()).expect("our own key");
        assert_eq!(again.public_key(), key.public_key());
    }
    if let Ok(key) = PublicKey::from_pem(text) {
        assert_eq!(PublicKey::from_pem(&key.to_pem()), Ok(key));
    }
}

const FIXTURES: &[&str] = &[
    key_file!("p256"),
    key_file!("b163"),
    key_file!("p256.sec1"),
    key_file!("b163.sec1"),
    key_file!("p256.locked"),
    key_file!("b163.locked"),
    key_file!("p256.public"),
    key_file!("b163.public"),
    key_file!("b163.compressed.public"),
    key_file!("p256.locked-scrypt"),
];

#[test]
fn truncated_or_extended_der_is_refused() {
    for &text in FIXTURES {
        let (label, der) = decoded(text);
        let refused = |der: &[u8]| {
            let text = pem(&label, der);
            SigningKey::from_pem(&text).is_err()
                && SigningKey::from_encrypted_pem(&text, PASSPHRASE).is_err()
                && PublicKey::from_pem(&text).is_err()
        };
        for length in 0..der.len() {
            assert!(refused(&der[..length]), "{label}: {length} octets");
        }
        let mut extended = der.clone();
        extended.push(0);
        assert!(refused(&extended), "{label}: an octet too many");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn no_text_makes_the_reader_panic(text in "(-----BEGIN |-----END |-----|PRIVATE KEY|PUBLIC KEY|EC |ENCRYPTED |\n|\r|[A-Za-z0-9+/=]{1,8}|\\PC){0,24}") {
        read_every_way(&text);
    }

    #[test]
    fn no_der_makes_the_reader_panic(der in proptest::collection::vec(any::<u8>(), 0..120), wrapped in any::<bool>()) {
        let der = if wrapped { [&[0x30, der.len() as u8][..], &der].concat() } else { der };
        for label in ["PRIVATE KEY", "EC PRIVATE KEY", "ENCRYPTED PRIVATE KEY", "PUBLIC KEY"] {
            read_every_way(&pem(label, &der));
        }
    }

    #[test]
    fn no_mutated_key_makes_the_reader_panic(
        fixture in 0..FIXTURES.len(),
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0u8..3), 1..4),
    ) {
        let (label, mut der) = decoded(FIXTURES[fixture]);
        for (at, octet, how) in changes {
            let at = at.index(der.len());
            match how {
                0 => der[at] = octet,
                1 => der.insert(at, octet),
                _ => drop(der.remove(at)),
            }
        }
        read_every_way(&pem(&label, &der));
    }
}
