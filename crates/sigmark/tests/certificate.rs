//! A certificate says what was signed, and nobody edits it unnoticed.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use job::Job;
use mesh::{TriMesh, shapes};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use serde_json::{Value, json};
use sigmark::{
    Certificate, CertificateError, Curve, Embedder, GeometryDigest, PayloadKind, Scheme, SigmarkError,
    SigningKey,
    claim::{Carrier, LARGEST, PackedLabels, VERSION},
    mark::MOST_FUNCTIONS,
};

fn mesh() -> TriMesh {
    shapes::bumpy_sphere(4, 9)
}

fn key(seed: u8) -> SigningKey {
    SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([seed; 32]))
}

fn certificate(seed: u8) -> Certificate {
    let key = key(seed);
    let embedder = Embedder::new(&key)
        .message("order 4711")
        .original_name("model.obj")
        .chip_rate(1);
    embedder
        .embed(&mesh(), &Job::default())
        .unwrap()
        .certificate()
        .clone()
}

fn refusal(value: &Value) -> CertificateError {
    Certificate::from_json(&value.to_string()).unwrap_err()
}

#[test]
fn it_reads_back() {
    let certificate = certificate(1).with_stamp(vec![1, 2, 3]).unwrap();
    let json = certificate.to_json().unwrap();
    assert_eq!(Certificate::from_json(&json).unwrap(), certificate);
    assert_eq!(Certificate::from_json(&json).unwrap().to_json().unwrap(), json);
    assert_eq!(certificate.message(), "order 4711");
    assert_eq!(certificate.original_name(), "model.obj");
    assert_eq!(
        certificate.statement().original.digest,
        GeometryDigest::of(&mesh())
    );
    let message = certificate.payload().message(certificate.signature());
    assert!(certificate.confirms(&message));
    assert!(!certificate.confirms(&certificate.signature().bits()));
}

#[test]
fn every_edit_is_noticed() {
    let json = certificate(1).to_json().unwrap();
    let mut value: Value = serde_json::from_str(&json).unwrap();
    let other: Value = serde_json::from_str(&certificate(2).to_json().unwrap()).unwrap();
    let elsewhere = GeometryDigest::of(&shapes::tetrahedron()).to_string();
    let edits = [
        ("/message", json!("order 4712")),
        ("/recipient", json!("a buyer")),
        ("/public_key", other["public_key"].clone()),
        ("/original/name", json!("other.obj")),
        ("/original/vertices", json!(7)),
        ("/original/vertices", json!(1u64 << 63)),
        ("/original/triangles", json!(7)),
        ("/original/digest", json!(elsewhere)),
        ("/mark/scheme", json!("ecdsa-p256-sha1")),
        ("/mark/payload", json!("plain-signature")),
        ("/mark/signature", json!("0".repeat(128))),
        ("/mark/signature", other["mark"]["signature"].clone()),
        ("/mark/carrier", json!("something-else")),
        ("/mark/carrier", json!("harmonics")),
        ("/mark/patches/0/functions", json!(2)),
        ("/mark/patches/0/functions", json!(0)),
        ("/mark/patches/0/functions", json!(1u64 << 60)),
        ("/mark/patches/0/functions", json!(u64::MAX)),
        ("/mark/laplacian", json!("intrinsic")),
        ("/mark/labels", json!("eJwDAAAAAAE=")),
        ("/mark/patches", json!([])),
        ("/mark/patches/0/alpha", json!(0.5)),
        ("/mark/patches/0/alpha", json!(-1e-4)),
        ("/mark/patches/0/vertices", json!(2561)),
        ("/mark/patches/0/last_eigenvalue", json!(1.0)),
        ("/seal", json!("0".repeat(128))),
        ("/seal", other["seal"].clone()),
    ];
    for (pointer, edited) in edits {
        if pointer == "/recipient" {
            value["recipient"] = "".into();
        }
        let old = std::mem::replace(value.pointer_mut(pointer).unwrap(), edited.clone());
        let error = refusal(&value);
        // What h or the seal covers is noticed by them at the latest.
        assert!(
            !matches!(error, CertificateError::Version { .. }),
            "{pointer} {edited}: {error}"
        );
        *value.pointer_mut(pointer).unwrap() = old;
        assert!(Certificate::from_json(&value.to_string()).is_ok());
    }
    value["stamps"] = vec!["AA=="; 101].into();
    assert!(matches!(
        refusal(&value),
        CertificateError::Field { field: "stamps", .. }
    ));
    value["extra"] = true.into();
    assert!(matches!(refusal(&value), CertificateError::Malformed(_)));
    for cut in (0..json.len() - 2)
        .step_by(97)
        .filter(|&cut| json.is_char_boundary(cut))
    {
        assert!(Certificate::from_json(&json[..cut]).is_err());
    }
}

/// Labels are hashed one by one, and pack a thousand to one: their number is looked at first.
#[test]
fn a_certificate_of_more_vertices_than_any_mesh_has_is_refused_before_its_labels_are_unpacked() {
    let mut value: Value = serde_json::from_str(&certificate(1).to_json().unwrap()).unwrap();
    for vertices in [(1u64 << 27) + 1, u32::MAX.into(), 1 << 63] {
        value["original"]["vertices"] = vertices.into();
        assert!(matches!(
            refusal(&value),
            CertificateError::Field {
                field: "vertices",
                ..
            }
        ));
    }
}

/// (r, d − s) is a valid signature where (r, s) is, but not the one that stands in the shape.
#[test]
fn a_signature_that_is_valid_but_another_is_refused_by_the_seal() {
    let mut value: Value = serde_json::from_str(&certificate(1).to_json().unwrap()).unwrap();
    let order = "ffffffff00000000ffffffffffffffffbce6faada7179e84f3b9cac2fc632551";
    let byte = |hex: &str, i: usize| i32::from(u8::from_str_radix(&hex[2 * i..2 * i + 2], 16).unwrap());
    let signature = value["mark"]["signature"].as_str().unwrap().to_owned();
    let (r, s) = signature.split_at(64);
    let (mut borrow, mut negated) = (0, [0; 32]);
    for i in (0..32).rev() {
        let difference = byte(order, i) - byte(s, i) - borrow;
        borrow = i32::from(difference < 0);
        negated[i] = difference.rem_euclid(256);
    }
    let negated: String = negated.iter().map(|byte| format!("{byte:02x}")).collect();
    value["mark"]["signature"] = format!("{r}{negated}").into();
    assert!(matches!(refusal(&value), CertificateError::Seal));
}

#[test]
fn older_and_newer_versions_are_refused_with_the_reason() {
    let mut value: Value = serde_json::from_str(&certificate(1).to_json().unwrap()).unwrap();
    for version in [0, 1, 2] {
        value["version"] = version.into();
        assert!(matches!(refusal(&value), CertificateError::Outdated { found } if found == version));
        // Their fields were others.
        let old = json!({ "format": "sigmark-certificate", "version": version, "coverage": "message" });
        assert!(matches!(refusal(&old), CertificateError::Outdated { found } if found == version));
    }
    value["version"] = (VERSION + 1).into();
    assert!(matches!(refusal(&value), CertificateError::Version { .. }));
    value["format"] = "other".into();
    assert!(matches!(refusal(&value), CertificateError::Malformed(_)));
}

#[test]
fn what_is_too_long_is_neither_read_nor_issued() {
    let long = format!("{{\"format\": \"{}\"}}", "x".repeat(LARGEST));
    assert!(matches!(
        Certificate::from_json(&long),
        Err(CertificateError::TooLarge { .. })
    ));
    let key = key(1);
    let embedder = Embedder::new(&key).message("m".repeat(LARGEST)).chip_rate(1);
    assert!(matches!(
        embedder.embed(&mesh(), &Job::default()),
        Err(SigmarkError::Certificate(CertificateError::TooLarge { .. }))
    ));
}

/// More functions than a patch has room for are refused with the certificate, before a basis is computed for them.
#[test]
fn functions_beyond_a_patch_are_refused_before_any_work() {
    let mut value: Value = serde_json::from_str(&certificate(1).to_json().unwrap()).unwrap();
    let vertices = value["mark"]["patches"][0]["vertices"].as_u64().unwrap();
    value["mark"]["patches"][0]["functions"] = (vertices / 2 + 1).into();
    assert!(matches!(
        refusal(&value),
        CertificateError::Field { field: "patches", .. }
    ));
    // Nor are more than can be computed with, whatever the patch has room for.
    value["mark"]["patches"][0]["functions"] = (MOST_FUNCTIONS + 1).into();
    let refused = refusal(&value).to_string();
    assert!(refused.contains("at most 2048"), "{refused}");
}

/// Whoever reads a mark of another scheme reads pooled chips: the paper's carrier has other numbers of them.
#[test]
fn the_papers_carrier_is_refused_for_every_other_scheme() {
    let mut statement = certificate(1).statement().clone();
    statement.payload = PayloadKind::Tag;
    statement.carrier = Carrier::Harmonics { chip_rate: 1 };
    // Room for just the 256 bits of a tag's codeword.
    (statement.functions, statement.alphas) = (vec![87], vec![1e-5]);
    statement.labels = PackedLabels::pack(&vec![1; statement.original.vertices]);
    for scheme in [Scheme::EcdsaP256Sha256, Scheme::EcdsaP256Sha1] {
        statement.scheme = scheme;
        assert!(matches!(
            statement.hash(),
            Err(CertificateError::Field { field: "carrier", .. })
        ));
    }
    // The numbers suit it, but for that.
    statement.carrier = Carrier::PooledHarmonics;
    assert!(statement.hash().is_ok());
}

#[cfg(feature = "paper")]
#[test]
fn marks_of_the_papers_profile_are_read_only_if_that_is_asked_for() {
    let key = SigningKey::generate(Curve::B163, &mut ChaCha20Rng::from_seed([3; 32]));
    let signed = Embedder::new(&key)
        .message("W")
        .chip_rate(1)
        .embed(&mesh(), &Job::default())
        .unwrap();
    let certificate = Certificate::from_json(&signed.certificate().to_json().unwrap()).unwrap();
    assert_eq!(certificate.bits(), certificate.signature().bits());
    let public_key = key.public_key();
    let verifier = sigmark::Verifier::new(&mesh(), &certificate, &public_key).unwrap();
    assert!(matches!(
        verifier.verify(signed.mesh(), &Job::default()),
        Err(SigmarkError::PaperProfile)
    ));
    let verdict = verifier
        .paper_profile(true)
        .verify(signed.mesh(), &Job::default())
        .unwrap();
    assert_eq!(verdict.outcome, sigmark::Outcome::Verified);
    assert!(!verdict.binds_original && !verdict.is_evidence() && verdict.p_dispute() == 1.0);
}
