//! Certificates: what is read is written alike, and whatever a signer signs is judged without a panic.

use std::sync::LazyLock;

use job::Job;
use mesh::{TriMesh, shapes};
use mhb_core::LaplacianKind;
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use sigmark::claim::{Carrier, CertificateReader, Issued, PackedLabels};
use sigmark::{
    Certificate, Curve, Embedder, Outcome, PayloadKind, Scheme, Signature, Signed, SigningKey, Statement,
    Verifier,
};

/// Reads the text of a certificate.
pub(crate) fn check_text(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let alone = Certificate::from_json(text);
    // Who reads many reads each as who reads one.
    let among = CertificateReader::new().read(text).and_then(Issued::check);
    assert_eq!(alone.as_ref().ok(), among.as_ref().ok());
    if let Ok(certificate) = alone {
        check_fixpoint(&certificate);
    }
}

fn check_fixpoint(certificate: &Certificate) {
    let written = certificate.to_json().expect("what was read is not too long");
    let again = Certificate::from_json(&written).expect("a certificate that we wrote ourselves");
    assert_eq!(again, *certificate);
    assert_eq!(again.to_json().expect("as before"), written);
    assert!(
        certificate.confirms(&certificate.payload().message(certificate.signature())),
        "its signature was checked"
    );
    let hash = certificate.statement().hash();
    assert_eq!(hash.expect("it was checked"), *certificate.statement_hash());
}

/// To judge by a certificate takes a thousand times as long as to read it, so that besides the seeds one of so many inputs is enough,
/// told by its digest.
const JUDGED_OF: u8 = 8;

/// A certificate as somebody may issue it who chooses every field, and signs it with a key of his own.
pub(crate) fn check_issued(bytes: &[u8]) {
    let statement = Choices(bytes).statement(HONEST.certificate().statement());
    let Ok(hash) = statement.hash() else {
        return;
    };
    let key = key();
    let sign = |bytes: &[u8]| key.sign(statement.scheme, bytes);
    let Ok(signature) = sign(&statement.signed_bytes(&hash)) else {
        return;
    };
    let eigenvalues = Choices(bytes).eigenvalues(HONEST.certificate().last_eigenvalues());
    let name = HONEST.certificate().original_name();
    let mut value = document(&statement, &signature.to_hex(), &eigenvalues);
    let mut sealed = [b"sigmark seal v6\0", &hash[..], &components(&signature)].concat();
    sealed.extend(eigenvalues.iter().flat_map(|value| value.to_le_bytes()));
    sealed.extend(Sha256::digest(
        value["original"]["sketch"].as_str().unwrap_or_default(),
    ));
    sealed.extend(name.bytes());
    let seal = sign(&sealed).expect("it signed a moment ago");
    value["seal"] = seal.to_hex().into();

    let certificate = match Certificate::from_json(&value.to_string()) {
        Ok(certificate) => certificate,
        Err(error) => {
            assert!(!bytes.is_empty(), "what nobody changed is refused: {error}");
            return;
        }
    };
    check_fixpoint(&certificate);
    let plan = statement.plan(hash).expect("it was checked");
    assert_eq!(plan.bits(), certificate.bits().len());
    if Sha256::digest(bytes)[0] % JUDGED_OF == 0 || choices().iter().any(|seed| seed == bytes) {
        judge(&certificate);
    }
}

/// Bits that stand in a shape belong to one statement alone.
fn judge(certificate: &Certificate) {
    let Ok(verifier) = Verifier::new(&ORIGINAL, certificate, certificate.public_key()) else {
        return;
    };
    let verifier = verifier.paper_profile(true);
    if let Ok(verdict) = verifier.verify(HONEST.mesh().clone(), &Job::default()) {
        let is_honest = certificate.statement() == HONEST.certificate().statement();
        assert_eq!(verdict.outcome == Outcome::Verified, is_honest);
    }
}

/// What a signer chooses, byte by byte; without any more, it is as in the honest certificate.
struct Choices<'a>(&'a [u8]);

impl Choices<'_> {
    fn next(&mut self) -> u8 {
        match self.0.split_first() {
            Some((&first, rest)) => {
                self.0 = rest;
                first
            }
            None => 0,
        }
    }

    /// A number as it is, a little off, or anything.
    fn real(&mut self, honest: f64) -> f64 {
        match self.next() {
            0 => honest,
            1 => honest * (1.0 + f64::from(self.next()) / 256.0),
            2 => f64::from(self.next()) * f64::MAX / 255.0,
            3 => f64::MIN_POSITIVE * f64::from(self.next()),
            _ => f64::from_le_bytes(std::array::from_fn(|_| self.next())),
        }
    }

    fn count(&mut self, honest: usize) -> usize {
        match self.next() {
            0 => honest,
            1 => honest + usize::from(self.next()),
            2 => honest.saturating_sub(self.next().into()),
            3 => self.next().into(),
            _ => usize::MAX / (1 + usize::from(self.next())),
        }
    }

    /// The last eigenvalues stand first among the choices.
    fn eigenvalues(&mut self, honest: &[f64]) -> Vec<f64> {
        honest.iter().map(|&value| finite(self.real(value))).collect()
    }

    fn statement(&mut self, honest: &Statement) -> Statement {
        self.eigenvalues(HONEST.certificate().last_eigenvalues());
        let mut statement = honest.clone();
        for alpha in &mut statement.alphas {
            *alpha = finite(self.real(*alpha));
        }
        for functions in &mut statement.functions {
            *functions = self.count(*functions);
        }
        if self.next() & 1 == 1 {
            statement.carrier = Carrier::Harmonics {
                chip_rate: self.count(1),
            };
        }
        if self.next() & 1 == 1 {
            statement.laplacian = LaplacianKind::Intrinsic;
        }
        if self.next() & 1 == 1 {
            statement.scheme = Scheme::EcdsaP256Sha1;
        }
        let kinds = PayloadKind::ALL;
        let here = kinds.iter().position(|&kind| kind == statement.payload);
        statement.payload = kinds[(here.unwrap_or(0) + usize::from(self.next())) % kinds.len()];
        if self.next() & 1 == 1 {
            statement.original.vertices = self.count(statement.original.vertices);
        }
        let labels = statement.labels.unpack(HONEST.mesh().vertex_count());
        let mut labels = labels.expect("the labels of an honest certificate");
        // Few edits, so that the patches often stay whole.
        for _ in 0..self.next() {
            let at = usize::from(self.next()) + 256 * usize::from(self.next());
            let count = labels.len();
            labels[at % count] = u32::from(self.next() % 4);
        }
        statement.labels = PackedLabels::pack(&labels);
        statement.message = String::from_utf8_lossy(self.0).into_owned();
        statement
    }
}

/// r, then s, on P-256.
fn components(signature: &Signature) -> Vec<u8> {
    let digits = signature.to_hex();
    let byte = |at: usize| u8::from_str_radix(&digits[at..at + 2], 16).expect("hexadecimal digits");
    (0..digits.len()).step_by(2).map(byte).collect()
}

/// JSON has no other numbers.
fn finite(x: f64) -> f64 {
    if x.is_finite() { x } else { 0.0 }
}

/// The JSON of a certificate that is not sealed.
fn document(statement: &Statement, signature: &str, eigenvalues: &[f64]) -> Value {
    let honest = HONEST.certificate().to_json().expect("it was issued");
    let mut value: Value = serde_json::from_str(&honest).expect("it is JSON");
    value["public_key"] = statement.public_key.to_pem().into();
    value["message"] = statement.message.as_str().into();
    value["original"]["vertices"] = statement.original.vertices.into();
    let mark = &mut value["mark"];
    mark["scheme"] = statement.scheme.name().into();
    mark["payload"] = statement.payload.name().into();
    mark["signature"] = signature.into();
    mark["carrier"] = statement.carrier.name().into();
    if let Some(chip_rate) = statement.carrier.chip_rate() {
        mark["chip_rate"] = chip_rate.into();
    }
    mark["laplacian"] = match statement.laplacian {
        LaplacianKind::Intrinsic => "intrinsic",
        _ => "cotangent",
    }
    .into();
    mark["labels"] = serde_json::to_value(&statement.labels).expect("a text");
    let labels = statement.labels.unpack(HONEST.mesh().vertex_count());
    let labels = labels.unwrap_or_default();
    let patches = (1..)
        .zip(&statement.functions)
        .zip(&statement.alphas)
        .zip(eigenvalues);
    let patches = patches.map(|(((number, functions), alpha), eigenvalue)| {
        let vertices = labels.iter().filter(|&&label| label == number).count();
        json!({"vertices": vertices, "functions": functions, "alpha": alpha, "last_eigenvalue": eigenvalue})
    });
    mark["patches"] = patches.collect();
    value
}

fn key() -> SigningKey {
    SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([7; 32]))
}

/// As small as a mesh with room for all bits may be.
static ORIGINAL: LazyLock<TriMesh> = LazyLock::new(|| shapes::bumpy_torus(24, 16, 3));

static HONEST: LazyLock<Signed> = LazyLock::new(|| {
    let embedded = Embedder::new(&key())
        .original_name("model.obj")
        .embed(&ORIGINAL, &Job::default());
    embedded.expect("a mesh with room for a signature")
});

/// Certificates with and without what may be left out, by keys of both curves.
pub(crate) fn certificates() -> Vec<Vec<u8>> {
    let issue = |embedder: Embedder| {
        let signed = embedder.embed(&ORIGINAL, &Job::default());
        let signed = signed.expect("a mesh with room for a signature");
        signed.certificate().clone()
    };
    let key = key();
    let plain = issue(Embedder::new(&key));
    let full = Embedder::new(&key)
        .message("© 2026 Studio, order 4711 \u{1F600}")
        .recipient("a buyer")
        .original_name("model.obj");
    let stamped = issue(full).with_stamp(vec![0x30, 0x03, 1, 2, 3]);
    let all = [plain, stamped.expect("it had none")];
    let text = |certificate: &Certificate| certificate.to_json().expect("it was issued").into_bytes();
    all.iter().map(text).collect()
}

/// Choices of every kind.
pub(crate) fn choices() -> Vec<Vec<u8>> {
    let patches = HONEST.certificate().last_eigenvalues().len();
    // Three numbers a patch, then carrier, Laplacian, scheme, payload, vertices, the number of edited labels, and the edits.
    let with = |behind: &[u8]| [&vec![0; 3 * patches], behind].concat();
    vec![
        Vec::new(),
        vec![1; 6 * patches],
        with(&[0, 1]),
        with(&[0, 0, 1]),
        with(&[1, 0]),
        with(&[1, 0, 0, 0, 1]),
        with(&[0, 0, 0, 1]),
        with(&[0, 0, 0, 2]),
        with(&[0, 0, 0, 0, 1, 1, 1]),
        with(&[0, 0, 0, 0, 0, 2, 0, 0, 0, 9, 1, 1]),
        with(b"\0\0\0\0\0\0another message"),
    ]
}
