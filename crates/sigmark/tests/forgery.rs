//! The forger's chair. A stranger has one published marked mesh S and no original; he is free in key, nonce, message, "original", patches
//! and strengths. Each attack is carried out twice: against the construction of certificates of version 2, where it has to work, and
//! against today's, where it must not.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too
#![allow(clippy::print_stdout)] // the run over real meshes shows its figures

use std::{
    io::{Read, Write},
    sync::Arc,
};

use base64::{Engine, engine::general_purpose::STANDARD as BASE64};
use flate2::{Compression, read::ZlibDecoder, write::ZlibEncoder};
use job::Job;
use mesh::{TriMesh, shapes};
use p256::{
    NistP256, NonZeroScalar, Scalar, SecretKey,
    elliptic_curve::{PrimeField, ops::Reduce},
    pkcs8::{EncodePrivateKey, LineEnding},
};
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use sigmark::{
    Certificate, CertificateError, Dispute, Embedder, GeometryDigest, Precedence, Scheme, SigmarkError,
    Signature, Signed, SigningKey, Strength, Verdict, Verifier,
    claim::{
        EVIDENCE,
        statistics::{p_of_chosen, p_value},
    },
    mark::{
        ChipPlan, JointEstimator, MarkLayout, Original, Patch, PatchBasis, Pool, Reader, ReadingMethod,
        correlation,
    },
    payload::{Payload, PayloadKind, Permutation},
};

const SCHEME: Scheme = Scheme::EcdsaP256Sha256;

/// Five shapes with room for 512 bits.
fn meshes() -> [TriMesh; 5] {
    [
        shapes::bumpy_sphere(4, 9),
        shapes::bumpy_torus(60, 36, 2),
        shapes::jittered(&shapes::bumpy_sphere(4, 3), 0.2, 4),
        shapes::bumped(&shapes::torus(48, 40, 2.0, 0.8), 0.05, 5),
        shapes::flipped(&shapes::bumpy_torus(50, 40, 6), 7),
    ]
}

/// From hardly there to the default.
const STRENGTHS: [f64; 2] = [3e-6, 4e-4];

fn job() -> Job {
    Job::default()
}

/// Somebody with a key, and with all the arithmetic of it.
struct Person {
    secret: SecretKey,
    key: SigningKey,
}

impl Person {
    fn new(secret: SecretKey) -> Self {
        let pem = secret.to_pkcs8_pem(LineEnding::LF).unwrap();
        let key = SigningKey::from_pem(&pem).unwrap();
        Self { secret, key }
    }

    fn numbered(seed: u8) -> Self {
        Self::new(SecretKey::from_slice(&Sha256::digest([seed])).unwrap())
    }

    fn embedder(&self, strength: f64) -> Embedder {
        Embedder::new(&self.key)
            .chip_rate(1)
            .strength(Strength::Distortion(strength))
    }

    /// ECDSA with a nonce of one's own choice.
    fn sign(&self, nonce: &NonZeroScalar, message: &[u8]) -> Signature {
        let digest = Sha256::digest(message);
        let d = self.secret.to_nonzero_scalar();
        let (signature, _) = ecdsa::hazmat::sign_prehashed::<NistP256>(&d, nonce, &digest).unwrap();
        let hex: String = signature
            .to_bytes()
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        Signature::from_hex(SCHEME, &hex).unwrap()
    }

    /// The key under which a signature, whose nonce is known, is one over another message: d′ = (s k − h′) / r.
    fn substituted(signature: &Signature, nonce: &NonZeroScalar, message: &[u8]) -> Self {
        let [r, s] = components(signature);
        let h = <Scalar as Reduce<_>>::reduce(&Sha256::digest(message));
        let key = (s * **nonce - h) * r.invert().unwrap();
        Self::new(SecretKey::from_slice(&key.to_repr()).unwrap())
    }
}

fn components(signature: &Signature) -> [Scalar; 2] {
    let bytes = halves(signature);
    bytes.map(|half| Scalar::from_repr(half.into()).unwrap())
}

fn halves(signature: &Signature) -> [[u8; 32]; 2] {
    let hex = signature.to_hex();
    let byte = |i: usize| u8::from_str_radix(&hex[2 * i..2 * i + 2], 16).unwrap();
    [std::array::from_fn(byte), std::array::from_fn(|i| byte(32 + i))]
}

fn from_halves(halves: [[u8; 32]; 2]) -> Signature {
    let hex: String = halves
        .as_flattened()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    Signature::from_hex(SCHEME, &hex).unwrap()
}

fn nonce(seed: u32) -> NonZeroScalar {
    let bytes = Sha256::digest([b"nonce", &seed.to_le_bytes()[..]].concat());
    SecretKey::from_slice(&bytes).unwrap().to_nonzero_scalar()
}

/// The victim's marked mesh.
fn published(mesh: &TriMesh) -> TriMesh {
    let signed = Person::numbered(1).embedder(4e-4).embed(mesh, &job()).unwrap();
    signed.mesh().clone()
}

fn cut(mesh: &TriMesh) -> Arc<Original> {
    let mut pool = Pool::default();
    pool.repetitions = Some(1);
    let original = Original::pooled(mesh.clone(), 512, pool, &job()).unwrap();
    original.keep_bases(&job()).unwrap();
    Arc::new(original)
}

/// A mark in an order that everybody knows.
fn in_known_order(original: &Arc<Original>, strength: f64) -> Arc<MarkLayout> {
    let plan = ChipPlan::pooled(512, [0; 32]);
    let strength = Strength::Distortion(strength);
    Arc::new(MarkLayout::with_strength(Arc::clone(original), plan, strength).unwrap())
}

/// S − W: the mesh of which a mark of these bits would make S. W depends on the harmonics of that mesh, so it is found in steps.
fn inverted(published: &Arc<Original>, bits: &[bool], strength: f64) -> Arc<Original> {
    let mut original = Arc::clone(published);
    for _ in 0..2 {
        let layout = in_known_order(&original, strength);
        let mark = layout.write(bits, &job()).unwrap().displacement;
        let pairs = published.mesh().positions().iter().zip(mark);
        let positions = pairs
            .map(|(p, d)| std::array::from_fn(|axis| p[axis] - d[axis]))
            .collect();
        original = cut(&published.mesh().with_positions(positions).unwrap());
    }
    original
}

/// Certificates of version 2: the bits in the shape were r ‖ s of a signature over digest and message.
mod old {
    use super::*;

    pub(crate) fn signed_bytes(original: &TriMesh) -> Vec<u8> {
        let digest = GeometryDigest::of(original);
        [b"sigmark mark v1\0", &digest.as_bytes()[..]].concat()
    }

    /// Bits and p of a claim that the suspect bears these bits in the original's layout.
    pub(crate) fn read(
        original: &Arc<Original>,
        strength: f64,
        bits: &[bool],
        suspect: &TriMesh,
    ) -> (Vec<bool>, f64) {
        let layout = in_known_order(original, strength);
        let method = ReadingMethod::joint(Arc::new(JointEstimator::new(&layout)));
        let found = Reader::new(original.mesh())
            .unwrap()
            .find(suspect, &job())
            .unwrap();
        let reading = found.read(&method, bits, &job()).unwrap();
        let p = p_of_chosen(bits, &reading);
        (reading.soft.hard(), p)
    }
}

/// The claim that a person makes on an original of his own choice.
fn claim(person: &Person, original: &Arc<Original>, strength: f64) -> Certificate {
    let signed = person.embedder(strength).embed_in(original, &job()).unwrap();
    signed.certificate().clone()
}

fn judge(original: &Arc<Original>, certificate: &Certificate, suspect: &TriMesh) -> Verdict {
    let verifier = Verifier::with_original(original, certificate, certificate.public_key()).unwrap();
    verifier.verify(suspect, &job()).unwrap()
}

fn assert_not_found(verdict: &Verdict, what: &str) {
    assert!(
        !verdict.outcome.is_found() && verdict.p_value > 1e-6,
        "{what}: {verdict:?}"
    );
}

/// A certificate as its issuer can make it, who may choose every byte: other fields, another signature, and a seal that fits them.
fn issued(
    person: &Person,
    certificate: &Certificate,
    edits: &[(&str, Value)],
) -> Result<Certificate, CertificateError> {
    let mut value: Value = serde_json::from_str(&certificate.to_json().unwrap()).unwrap();
    for (pointer, edited) in edits {
        *value.pointer_mut(pointer).unwrap() = edited.clone();
    }
    let text = |pointer: &str| value.pointer(pointer).unwrap().as_str().unwrap().to_owned();
    let signature = Signature::from_hex(SCHEME, &text("/mark/signature"))?;
    let mut sealed = [b"sigmark seal v6\0", &certificate.statement_hash()[..]].concat();
    sealed.extend(halves(&signature).as_flattened());
    for patch in value["mark"]["patches"].as_array().unwrap() {
        sealed.extend(patch["last_eigenvalue"].as_f64().unwrap().to_le_bytes());
    }
    let sketch = value["original"]["sketch"].as_str().unwrap_or_default();
    sealed.extend(Sha256::digest(sketch));
    value["seal"] = person.key.sign(SCHEME, &sealed)?.to_hex().into();
    Certificate::from_json(&value.to_string())
}

fn with_signature(
    person: &Person,
    claim: &Certificate,
    signature: &Signature,
) -> Result<Certificate, CertificateError> {
    issued(person, claim, &[("/mark/signature", signature.to_hex().into())])
}

/// Who is about to come second spoils his own certificate, in what is sealed and not stated.
#[test]
fn a_claim_that_can_not_be_read_takes_nothing_from_the_other() {
    let (owner, thief) = (Person::numbered(1), Person::numbered(2));
    let original = cut(&shapes::bumpy_sphere(4, 9));
    let signed = owner.embedder(4e-4).embed_in(&original, &job()).unwrap();
    let stolen = cut(signed.mesh());
    let honest = claim(&thief, &stolen, 4e-4);
    let spoiled = issued(
        &thief,
        &honest,
        &[("/mark/patches/0/last_eigenvalue", json!(1e6))],
    )
    .unwrap();
    let verifier = |original: &Arc<Original>, certificate: &Certificate| {
        Verifier::new(original.mesh(), certificate, certificate.public_key()).unwrap()
    };
    let owners = verifier(&original, signed.certificate());
    for certificate in [&honest, &spoiled] {
        let thiefs = verifier(&stolen, certificate);
        let dispute = Dispute::between(&owners, &thiefs, None, &job()).unwrap();
        assert_eq!(dispute.outcome, Precedence::First);
        assert_eq!(dispute.second_in_first.is_err(), certificate == &spoiled);
    }
}

/// He takes a mark W of his own off S and calls the rest his original; W's bits are a signature of his over something else. What does he
/// say is the signature in S?
fn claim_what_a_mark_was_taken_off(mesh: &TriMesh, strength: f64) {
    let forger = Person::numbered(2);
    let first = forger.sign(&nonce(1), b"anything");
    let s = published(mesh);
    let s_cut = cut(&s);
    let original = inverted(&s_cut, &first.bits(), strength);
    let honest = claim(&forger, &original, strength);
    let verdict = judge(&original, &honest, &s);
    println!("an honest claim on S − W: p {:.1e}", verdict.p_value);
    assert_not_found(&verdict, "an honest claim on S − W");
    let (read, p) = old::read(&original, strength, &first.bits(), &s);
    println!("old construction: p {p:.1e}");
    paste_the_bits(&forger, &honest, &first);
    // Nobody checked the signature. A few bits are wrong, since the steps to S − W are few.
    let agreeing = read.iter().zip(first.bits()).filter(|(a, b)| **a == *b).count();
    assert!(agreeing > 450 && p < EVIDENCE, "old, {strength}: {agreeing}, {p}");
    solve_for_the_key(&honest, &original, strength, &first);
    keep_the_nonce(&forger, &honest, &original, strength, &first, &s);
}

/// W's bits as they are, or the signature whose permuted bits they are.
fn paste_the_bits(forger: &Person, honest: &Certificate, bits: &Signature) {
    let permutation = Permutation::keyed(*honest.statement_hash());
    for pasted in [from_halves(permutation.invert(halves(bits))), *bits] {
        let refused = with_signature(forger, honest, &pasted);
        assert!(matches!(refused, Err(CertificateError::Statement)));
    }
}

/// The key under which W's bits are a signature over the original S − W: d′ = (s k − h′) / r.
fn solve_for_the_key(honest: &Certificate, original: &Arc<Original>, strength: f64, first: &Signature) {
    let signed = old::signed_bytes(original.mesh());
    let his = Person::substituted(first, &nonce(1), &signed);
    assert_eq!(
        his.key.public_key().verify(&signed, first),
        Ok(()),
        "old, {strength}"
    );

    // The key is part of what is signed: for any key that he solves for, there is another hash.
    let signed = honest.statement().signed_bytes(honest.statement_hash());
    let his = Person::substituted(first, &nonce(1), &signed);
    let claimed = claim(&his, original, strength);
    assert_ne!(claimed.statement_hash(), honest.statement_hash());
    let refused = with_signature(&his, &claimed, first);
    assert!(matches!(refused, Err(CertificateError::Statement)));
}

/// A signature over the original S − W with the nonce of W: r, half of the bits, was known before there was that original.
fn keep_the_nonce(
    forger: &Person,
    honest: &Certificate,
    original: &Arc<Original>,
    strength: f64,
    first: &Signature,
    s: &TriMesh,
) {
    let signature = forger.sign(&nonce(1), &old::signed_bytes(original.mesh()));
    assert_eq!(halves(&signature)[0], halves(first)[0]);
    let (_, p) = old::read(original, strength, &signature.bits(), s);
    assert!(p < 1e-12, "old, {strength}: {p}");

    let signed = honest.statement().signed_bytes(honest.statement_hash());
    let valid = with_signature(forger, honest, &forger.sign(&nonce(1), &signed)).unwrap();
    let verdict = judge(original, &valid, s);
    println!(
        "a signature with the nonce of W: p {:.1e}, old {p:.1e}",
        verdict.p_value
    );
    assert_not_found(&verdict, "a signature with the nonce of W");
}

#[test]
fn a_faint_mark_that_was_taken_off_is_no_claim() {
    for mesh in [0, 2, 4] {
        claim_what_a_mark_was_taken_off(&meshes()[mesh], STRENGTHS[0]);
    }
}

#[test]
fn a_mark_of_full_strength_that_was_taken_off_is_no_claim() {
    for mesh in [0, 1, 3] {
        claim_what_a_mark_was_taken_off(&meshes()[mesh], STRENGTHS[1]);
    }
}

/// The same on meshes of files, from the faintest mark to the default.
#[test]
#[ignore = "wants a folder of meshes and three minutes: SIGMARK_MESHES=DIR cargo test -p sigmark --test all forgery -- --ignored"]
fn marks_that_were_taken_off_real_meshes_are_no_claims() {
    let folder = std::env::var("SIGMARK_MESHES").expect("SIGMARK_MESHES names a folder of meshes");
    let mut files: Vec<_> = std::fs::read_dir(&folder)
        .expect("a folder")
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_file())
        .collect();
    files.sort();
    let small = files
        .iter()
        .filter_map(|path| Some((path, mesh_io::Asset::open(path).ok()?)))
        .filter(|(_, asset)| (10_000..50_000).contains(&asset.mesh().vertex_count()));
    let mut tried = 0;
    for (path, asset) in small {
        for strength in STRENGTHS {
            println!("{}, {strength:e} of the diagonal", path.display());
            claim_what_a_mark_was_taken_off(asset.mesh(), strength);
        }
        tried += 1;
    }
    assert!(
        tried >= 5,
        "{folder} has {tried} meshes of 10 000 to 50 000 vertices"
    );
}

/// Of signatures with nonces of one's choice none comes nearer to bits that were fixed before than chance would let it.
#[test]
fn a_free_nonce_gains_no_more_than_chance() {
    const TRIES: u32 = 1 << 11;
    let forger = Person::numbered(2);
    let s = cut(&meshes()[0]);
    let honest = claim(&forger, &s, 4e-4);
    let signed = honest.statement().signed_bytes(honest.statement_hash());
    let mut rng = ChaCha20Rng::from_seed([3; 32]);
    let target: Vec<bool> = (0..512).map(|_| rng.next_u32() & 1 == 1).collect();
    let agreeing = |bits: &[bool]| bits.iter().zip(&target).filter(|(a, b)| a == b).count();
    let permutation = Permutation::keyed(*honest.statement_hash());
    let best = (0..TRIES).map(|seed| {
        let signature = forger.sign(&nonce(seed), &signed);
        agreeing(&from_halves(permutation.apply(halves(&signature))).bits())
    });
    // Binomial, n = 512: 2 048 tries exceed 256 + 5 · 11.3 with a probability of about 10⁻³.
    let best = best.max().unwrap();
    assert!((280..=312).contains(&best), "{best}");
}

/// The same with codewords, whose bits depend on each other: who keeps a statement and grinds nonces has one coset of the code before him, and who takes another statement has
/// another. Neither comes nearer to what was read of a suspect than coins would.
#[test]
fn nonces_and_statements_gain_no_more_than_chance_with_codewords() {
    const TRIES: usize = 4096;
    let mut rng = ChaCha20Rng::from_seed([4; 32]);
    let mut random = || {
        let mut bytes = [0; 32];
        rng.fill_bytes(&mut bytes);
        bytes
    };
    for kind in [PayloadKind::Signature, PayloadKind::Tag] {
        // Few nonces to a statement, and all nonces to one.
        for nonces in [16, TRIES] {
            let mut target: Vec<f64> = Vec::new();
            while target.len() < 2048 {
                target.extend(random().map(|byte| f64::from(byte) - 127.5));
            }
            let mut below = [0; 3];
            for _ in 0..TRIES / nonces {
                let payload = Payload::new(kind, SCHEME, random(), 3072).unwrap();
                for _ in 0..nonces {
                    let bits = payload.bits(&from_halves([random(), random()]));
                    let p = p_value(&bits, &target);
                    for (count, level) in below.iter_mut().zip([0.1, 0.01, 0.001]) {
                        *count += usize::from(p <= level);
                    }
                }
            }
            // Means of 410, 41 and 4 at most; three standard deviations more are 468, 60 and 10.
            assert!(
                below[0] <= 468 && below[1] <= 60 && below[2] <= 10,
                "{kind:?} {below:?}"
            );
        }
    }
}

/// A genuine signature over S with a little noise; then each patch is made as strong as its bits agree with S by chance. The forger tries a
/// few messages: chance alone says p = 1/8 for the best of eight.
#[test]
fn strengths_and_patches_can_not_be_chosen_after_the_bits() {
    const MESSAGES: usize = 8;
    let forger = Person::numbered(2);
    let s = shapes::bumpy_torus(200, 100, 4);
    let noisy = shapes::jittered(&s, 0.02, 8);
    let mut pool = Pool::default();
    (pool.repetitions, pool.patches) = (Some(44), Some(44));
    let original = Original::pooled(noisy, 512, pool, &job()).unwrap();
    original.keep_bases(&job()).unwrap();
    let original = Arc::new(original);
    let claims = (0..MESSAGES).map(|message| {
        let embedder = forger.embedder(4e-4).message(message.to_string());
        embedder.embed_in(&original, &job()).unwrap()
    });
    let steered = claims.map(|claimed| (steered(&claimed, &s), claimed));
    let ((best, honest), claimed) = steered.min_by(|a, b| a.0.0.total_cmp(&b.0.0)).unwrap();
    assert!(
        best < 1e-4 && honest > 1e-2,
        "steering itself works: {best}, {honest}"
    );

    let certificate = claimed.certificate();
    for (pointer, edited) in [
        ("/mark/patches/0/alpha", json!(1e-9)),
        ("/mark/patches/3/alpha", json!(2e-4)),
    ] {
        let refused = issued(&forger, certificate, &[(pointer, edited)]);
        assert!(matches!(refused, Err(CertificateError::Statement)), "{pointer}");
    }
    let honest = judge(&original, certificate, &s);
    assert_not_found(&honest, "an honest claim on S and noise");
}

/// p of a claim on S with each patch as strong as it agrees with S, and with all of one strength.
fn steered(claimed: &Signed, s: &TriMesh) -> (f64, f64) {
    let (layout, original) = (claimed.layout(), claimed.original());
    let bits = claimed.certificate().bits();
    let pairs = s.positions().iter().zip(original.mesh().positions());
    let moved: Vec<[f64; 3]> = pairs
        .map(|(s, n)| std::array::from_fn(|axis| s[axis] - n[axis]))
        .collect();
    let of_patch = |index: usize, patch: &Patch, basis: &PatchBasis| {
        let coefficients = basis.transform(&patch.gather(&moved));
        let mut said = vec![0.0; bits.len()];
        for (chip, received) in layout
            .chips(index)
            .iter()
            .zip(layout.received(index, &coefficients))
        {
            said[chip.bit] += received;
        }
        let norm = said.iter().map(|x| x * x).sum::<f64>().sqrt();
        said.iter().map(|x| x / norm).collect()
    };
    let said: Vec<Vec<f64>> = original.map_bases(of_patch, &job()).unwrap();
    let p = |strength: &dyn Fn(f64) -> f64| {
        let strengths = said.iter().map(|soft| strength(correlation(&bits, soft)));
        let mut sum = vec![0.0; bits.len()];
        for (strength, soft) in strengths.zip(&said) {
            sum.iter_mut().zip(soft).for_each(|(sum, x)| *sum += strength * x);
        }
        p_value(&bits, &sum)
    };
    (p(&|t| t.max(0.0)), p(&|_| 1.0))
}

/// Whatever field its issuer edits once the bits are known, however he seals: the signature is not over it.
#[test]
fn a_signer_can_change_nothing_of_his_statement() {
    let forger = Person::numbered(2);
    let original = cut(&meshes()[0]);
    let claimed = claim(&forger, &original, 4e-4);
    let other = claim(&Person::numbered(3), &original, 4e-4);
    let other: Value = serde_json::from_str(&other.to_json().unwrap()).unwrap();
    let digest = GeometryDigest::of(&meshes()[1]).to_string();
    let value: Value = serde_json::from_str(&claimed.to_json().unwrap()).unwrap();
    let alpha = value["mark"]["patches"][0]["alpha"].as_f64().unwrap();
    let functions = value["mark"]["patches"][0]["functions"].as_u64().unwrap();
    for (pointer, edited) in [
        ("/message", json!("another")),
        ("/original/digest", json!(digest)),
        ("/original/triangles", json!(5)),
        ("/mark/laplacian", json!("intrinsic")),
        ("/mark/patches/0/functions", json!(functions + 1)),
        ("/mark/scheme", json!("ecdsa-p256-sha1")),
        (
            "/mark/patches/0/alpha",
            json!(f64::from_bits(alpha.to_bits() + 1)),
        ),
    ] {
        let refused = issued(&forger, &claimed, &[(pointer, edited)]);
        assert!(
            matches!(refused, Err(CertificateError::Statement)),
            "{pointer}: {refused:?}"
        );
    }
    // One vertex less in the patch.
    let mut labels = original.patches().labels().to_vec();
    assert_ne!(std::mem::take(&mut labels[0]), 0);
    let labels = serde_json::to_value(sigmark::claim::PackedLabels::pack(&labels)).unwrap();
    let patch = original.patches().labels()[0] as usize - 1;
    let vertices = json!(original.patches()[patch].vertices().len() - 1);
    let count = format!("/mark/patches/{patch}/vertices");
    let edits = [("/mark/labels", labels), (&*count, vertices)];
    assert!(matches!(
        issued(&forger, &claimed, &edits),
        Err(CertificateError::Statement)
    ));
    // The paper's carrier, which takes other numbers of functions.
    let mut papers = value.clone();
    papers["mark"]["carrier"] = "harmonics".into();
    papers["mark"]["chip_rate"] = 1.into();
    assert!(Certificate::from_json(&papers.to_string()).is_err());
    // Another's key, and another's signature with it.
    let edits = [
        ("/public_key", other["public_key"].clone()),
        ("/mark/signature", other["mark"]["signature"].clone()),
    ];
    assert!(issued(&forger, &claimed, &edits).is_err());
}

/// Files that say that the signature is over the message alone are not read as anything stronger.
#[test]
fn no_claim_can_be_downgraded() {
    let forger = Person::numbered(2);
    let original = cut(&meshes()[0]);
    let mut value: Value = serde_json::from_str(&claim(&forger, &original, 4e-4).to_json().unwrap()).unwrap();
    value["mark"]["payload"] = "plain-signature".into();
    let refused = Certificate::from_json(&value.to_string());
    assert!(matches!(
        refused,
        Err(CertificateError::Field { field: "payload", .. })
    ));
    value["mark"]["payload"] = "signature".into();
    value["mark"]["coverage"] = "message".into();
    assert!(matches!(
        Certificate::from_json(&value.to_string()),
        Err(CertificateError::Malformed(_))
    ));
}

/// The paper's profile is forged as ever, with any signature of a message; nobody who has not asked for it gets to hear so.
#[cfg(feature = "paper")]
#[test]
fn a_forged_claim_of_the_papers_profile_is_refused_unless_asked_for() {
    let forger = SigningKey::generate(sigmark::Curve::B163, &mut ChaCha20Rng::from_seed([5; 32]));
    let faint = Strength::Distortion(2e-5); // the fainter, the nearer one step comes to S − W
    let embedder = Embedder::new(&forger).message("mine").strength(faint);
    let s = published(&meshes()[0]);
    let marked = embedder.embed(&s, &job()).unwrap();
    let pairs = s.positions().iter().zip(marked.positions());
    let taken_off = pairs
        .map(|(s, m)| std::array::from_fn(|i| 2.0 * s[i] - m[i]))
        .collect();
    let original = s.with_positions(taken_off).unwrap();
    let claimed = embedder.embed(&original, &job()).unwrap();
    let verifier = Verifier::new(&original, claimed.certificate(), &forger.public_key()).unwrap();
    assert!(matches!(
        verifier.verify(&s, &job()),
        Err(SigmarkError::PaperProfile)
    ));
    let verdict = verifier.paper_profile(true).verify(&s, &job()).unwrap();
    assert!(
        verdict.outcome == sigmark::Outcome::Verified && !verdict.is_evidence() && verdict.p_dispute() == 1.0
    );
}

/// Originals, keys and messages of two genuine claims can't be exchanged.
#[test]
fn parts_of_two_genuine_claims_do_not_fit_together() {
    let (anna, bert) = (Person::numbered(3), Person::numbered(4));
    let originals = [cut(&meshes()[0]), cut(&meshes()[1])];
    let claims = [
        claim(&anna, &originals[0], 4e-4),
        claim(&bert, &originals[1], 4e-4),
    ];
    assert!(matches!(
        Verifier::new(originals[1].mesh(), &claims[0], claims[0].public_key()),
        Err(SigmarkError::AnotherOriginal { .. })
    ));
    assert!(matches!(
        Verifier::new(originals[0].mesh(), &claims[0], claims[1].public_key()),
        Err(SigmarkError::AnotherKey { .. })
    ));
    let json = claims
        .each_ref()
        .map(|claim| serde_json::from_str::<Value>(&claim.to_json().unwrap()).unwrap());
    for part in ["public_key", "original", "mark", "seal"] {
        let mut mixed = json[0].clone();
        mixed[part] = json[1][part].clone();
        assert!(Certificate::from_json(&mixed.to_string()).is_err(), "{part}");
    }
}

/// A tenth as thick.
fn squeezed(mesh: &TriMesh) -> TriMesh {
    let squeezed = mesh.positions().iter().map(|&[x, y, z]| [x, 0.1 * y, z]);
    mesh.with_positions(squeezed.collect()).unwrap()
}

/// A mark that was copied onto another mesh of the same connectivity does not make that mesh the owner's: its bits may be read there,
/// but the shape is another. What is a smooth deformation of the owner's is none: `bent.rs` says what is read there.
#[test]
fn a_mark_that_was_copied_onto_another_shape_is_not_found_there() {
    let owner = Person::numbered(1);
    let mesh = &meshes()[0];
    let original = cut(mesh);
    let signed = owner.embedder(4e-4).embed_in(&original, &job()).unwrap();
    let others = [shapes::icosphere(4), shapes::bumpy_sphere(4, 77), squeezed(mesh)];
    for (i, other) in others.iter().enumerate() {
        let marks = signed.positions().iter().zip(mesh.positions());
        let positions = marks.zip(other.positions());
        let positions = positions.map(|((s, o), p)| std::array::from_fn(|axis| p[axis] + s[axis] - o[axis]));
        let copied = other.with_positions(positions.collect()).unwrap();
        let verdict = judge(&original, signed.certificate(), &copied);
        assert!(
            !verdict.outcome.is_found() && !verdict.is_evidence(),
            "shape {i}: {verdict:?}"
        );
    }
}

/// The sketch of a certificate with other bytes in it; its issuer can seal what he likes.
fn with_sketch(person: &Person, certificate: &Certificate, edit: impl Fn(&mut Vec<u8>)) -> Certificate {
    let value: Value = serde_json::from_str(&certificate.to_json().unwrap()).unwrap();
    let text = value["original"]["sketch"].as_str().unwrap();
    let mut bytes = Vec::new();
    let packed = BASE64.decode(text).unwrap();
    ZlibDecoder::new(&packed[..]).read_to_end(&mut bytes).unwrap();
    edit(&mut bytes);
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::best());
    packed.write_all(&bytes).unwrap();
    let text = BASE64.encode(packed.finish().unwrap());
    issued(person, certificate, &[("/original/sketch", text.into())]).unwrap()
}

/// He chooses the signs of harmonics, or larger patches than anybody may ask for, where the statement does not bind them.
#[test]
fn a_sketch_that_was_chosen_is_no_evidence_and_asks_for_no_other_patches() {
    let mesh = shapes::bumpy_sphere(4, 1);
    let forger = Person::numbered(2);
    let signed = forger.embedder(4e-4).patches(3).embed(&mesh, &job()).unwrap();
    let (certificate, key) = (signed.certificate(), signed.certificate().public_key());
    let other_file = shapes::scaled(&mesh, 10.0);

    let functions: usize = certificate.statement().functions.iter().sum();
    let chosen = with_sketch(&forger, certificate, |bytes| {
        let signs = bytes.len() - functions;
        bytes[signs..].iter_mut().step_by(2).for_each(|sign| *sign ^= 1);
    });
    for certificate in [certificate, &chosen] {
        let verifier = Verifier::for_owner(&other_file, certificate, key).unwrap();
        let verdict = verifier.verify(signed.mesh(), &job()).unwrap();
        assert!(
            !verdict.is_evidence() && verdict.p_dispute() == 1.0,
            "{verdict:?}"
        );
        assert!(Verifier::new(&other_file, certificate, key).is_err());
    }
    // With the very file a sketch plays no part.
    let verdict = Verifier::new(&mesh, &chosen, key)
        .unwrap()
        .verify(signed.mesh(), &job());
    assert!(verdict.unwrap().is_evidence());

    let labels = 4 * mesh.vertex_count();
    for label in [0u32, 1, 7, u32::MAX] {
        let grown = with_sketch(&forger, certificate, |bytes| {
            let end = bytes.len() - functions;
            let labels = bytes[end - labels..end].as_chunks_mut::<4>().0;
            labels.iter_mut().for_each(|own| *own = label.to_le_bytes());
        });
        let error = Verifier::for_owner(&other_file, &grown, key).unwrap_err();
        assert!(
            matches!(error, SigmarkError::AnotherOriginal { .. }),
            "{label}: {error}"
        );
    }
}
