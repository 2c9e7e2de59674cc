use std::io::{Read, Write};

use base64::{Engine, engine::general_purpose::STANDARD as BASE64};
use flate2::{Compression, read::ZlibDecoder, write::ZlibEncoder};
use mhb_core::LaplacianKind;
use serde::{Deserialize, Serialize};

use super::{
    Coverage,
    keys::{PublicKey, SigningKey},
};
use crate::payload::{GeometryDigest, Scheme, Signature, SignatureError};

/// What a verifier needs besides the original and the public key: which signature was written, how, and into what.
///
/// A JSON file, described in `docs/certificate.md`. All of it is sealed: a second signature by the same key covers every
/// other field, so that nobody edits one unnoticed. A certificate holds the signature that is hidden in the mesh. Who has
/// both it and the original can remove the mark: it is for the owner and the trusted third party, not for the public.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    message: String,
    public_key: PublicKey,
    original: OriginalRecord,
    mark: MarkRecord,
    seal: Signature,
}

/// The original as the certificate knows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OriginalRecord {
    /// Digest of its welded geometry.
    pub digest: GeometryDigest,
    /// #V after welding.
    pub vertices: usize,
    /// #F after welding.
    pub triangles: usize,
}

/// The mark as the certificate knows it.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkRecord {
    /// What the signature covers.
    pub coverage: Coverage,
    /// The signature that was written, with its scheme.
    pub signature: Signature,
    /// c.
    pub chip_rate: usize,
    /// Which Laplacian gave the harmonics.
    pub laplacian: LaplacianKind,
    /// Which vertices make which patch.
    pub labels: PackedLabels,
    /// The patches, by their numbers.
    pub patches: Vec<PatchRecord>,
}

/// Patch labels of all vertices, packed: 32-bit little-endian integers, compressed by zlib, in base64.
///
/// With them a certificate outlives the rule by which patches are cut.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PackedLabels(String);

impl PackedLabels {
    /// Packs labels.
    pub fn pack(labels: &[u32]) -> Self {
        let bytes: Vec<u8> = labels.iter().flat_map(|label| label.to_le_bytes()).collect();
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::best());
        // Writing to memory does not fail.
        let packed = packed
            .write_all(&bytes)
            .and_then(|()| packed.finish())
            .unwrap_or_default();
        Self(BASE64.encode(packed))
    }

    /// The labels of a mesh of `vertices` vertices; nothing more is unpacked.
    ///
    /// # Errors
    /// When the text is damaged or holds another number of labels.
    pub fn unpack(&self, vertices: usize) -> Result<Vec<u32>, CertificateError> {
        let damaged =
            || CertificateError::Malformed(format!("the field \"labels\" does not hold {vertices} labels"));
        let packed = BASE64.decode(&self.0).map_err(|_| damaged())?;
        let mut bytes = Vec::new();
        let most = 4 * vertices as u64 + 1;
        ZlibDecoder::new(&packed[..])
            .take(most)
            .read_to_end(&mut bytes)
            .map_err(|_| damaged())?;
        if bytes.len() != 4 * vertices {
            return Err(damaged());
        }
        Ok(bytes
            .chunks_exact(4)
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect())
    }
}

/// A patch as the certificate knows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatchRecord {
    /// How many vertices it has.
    pub vertices: usize,
    /// α in the scale-free convention.
    pub alpha: f64,
    /// The highest eigenvalue of the basis at unit area: tells whether another program computes the same basis.
    pub last_eigenvalue: f64,
}

/// Why a certificate is not accepted, or could not be issued.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CertificateError {
    /// Not JSON, or JSON of another shape.
    #[error("not a Sigmark certificate ({0}); use the .cert.json file that `sigmark embed` wrote")]
    Malformed(String),
    /// From another generation of the program.
    #[error(
        "the certificate has version {found}, but this program reads version {VERSION}; use the Sigmark that wrote it"
    )]
    Version {
        /// The version that it says it has.
        found: u64,
    },
    /// A field was edited, or the file damaged.
    #[error(
        "the certificate's seal does not match its contents: it was edited or damaged; \
         ask the signer for the certificate as it was issued"
    )]
    Seal,
    /// The key does not suit the scheme.
    #[error(transparent)]
    Signature(#[from] SignatureError),
}

/// The version of the certificate format that this library writes and reads.
pub const VERSION: u32 = 2;

const FORMAT: &str = "sigmark-certificate";

/// The JSON, field by field.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    format: String,
    version: u32,
    message: String,
    public_key: String,
    original: OriginalRecord,
    mark: MarkDocument,
    seal: String,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MarkDocument {
    scheme: Scheme,
    coverage: Coverage,
    signature: String,
    chip_rate: usize,
    #[serde(with = "LaplacianName")]
    laplacian: LaplacianKind,
    labels: PackedLabels,
    patches: Vec<PatchRecord>,
}

/// The names of Laplacians.
#[derive(Serialize, Deserialize)]
#[non_exhaustive]
#[serde(remote = "LaplacianKind", rename_all = "kebab-case")]
enum LaplacianName {
    Cotangent,
    Intrinsic,
}

impl Certificate {
    /// Fills in and seals a certificate.
    pub(crate) fn issue(
        key: &SigningKey,
        message: String,
        original: OriginalRecord,
        mark: MarkRecord,
    ) -> Result<Self, CertificateError> {
        // The mark's own signature holds the seal's place until it is made: the sealed bytes leave the seal out.
        let seal = mark.signature;
        let mut certificate = Self {
            message,
            public_key: key.public_key(),
            original,
            mark,
            seal,
        };
        certificate.seal = key.sign(certificate.mark.signature.scheme(), &certificate.sealed_bytes()?)?;
        Ok(certificate)
    }

    /// Reads a certificate and checks its version and its seal.
    ///
    /// # Errors
    /// When the text is no certificate, of another version, or edited since it was issued.
    pub fn from_json(text: &str) -> Result<Self, CertificateError> {
        let malformed = |error: &dyn std::fmt::Display| CertificateError::Malformed(error.to_string());
        let value: serde_json::Value = serde_json::from_str(text).map_err(|e| malformed(&e))?;
        if value.get("format").and_then(serde_json::Value::as_str) != Some(FORMAT) {
            return Err(malformed(&format!("the field \"format\" is not \"{FORMAT}\"")));
        }
        match value.get("version").and_then(serde_json::Value::as_u64) {
            Some(version) if version == u64::from(VERSION) => {}
            Some(found) => return Err(CertificateError::Version { found }),
            None => return Err(malformed(&"the field \"version\" is not a whole number")),
        }
        // From the text again: only there does the parser know in which line an error lies.
        let document: Document = serde_json::from_str(text).map_err(|e| malformed(&e))?;
        let scheme = document.mark.scheme;
        let certificate = Self {
            message: document.message,
            public_key: PublicKey::from_pem(&document.public_key).map_err(|e| malformed(&e))?,
            original: document.original,
            mark: MarkRecord {
                coverage: document.mark.coverage,
                signature: Signature::from_hex(scheme, &document.mark.signature)
                    .map_err(|e| malformed(&e))?,
                chip_rate: document.mark.chip_rate,
                laplacian: document.mark.laplacian,
                labels: document.mark.labels,
                patches: document.mark.patches,
            },
            seal: Signature::from_hex(scheme, &document.seal).map_err(|_| CertificateError::Seal)?,
        };
        let sealed = certificate.sealed_bytes()?;
        certificate
            .public_key
            .verify(&sealed, &certificate.seal)
            .map_err(|_| CertificateError::Seal)?;
        Ok(certificate)
    }

    /// The JSON text, indented for people, with a final newline.
    ///
    /// # Errors
    /// None that a certificate made by this library can cause.
    pub fn to_json(&self) -> Result<String, CertificateError> {
        let document = self.document(self.seal.to_hex());
        let text = serde_json::to_string_pretty(&document)
            .map_err(|e| CertificateError::Malformed(e.to_string()))?;
        Ok(text + "\n")
    }

    /// What the signer asserts.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The key that checks both the mark and the seal.
    pub fn public_key(&self) -> &PublicKey {
        &self.public_key
    }

    /// The mesh that was signed.
    pub fn original(&self) -> &OriginalRecord {
        &self.original
    }

    /// How it was marked.
    pub fn mark(&self) -> &MarkRecord {
        &self.mark
    }

    /// The bytes that the signature in the shape signs.
    pub fn signed_bytes(&self) -> Vec<u8> {
        self.mark
            .coverage
            .signed_bytes(&self.message, &self.original.digest)
    }

    /// What the seal signs: the text `sigmark certificate` and a zero byte, then the certificate as compact JSON, fields in
    /// the order of the schema, with an empty seal.
    fn sealed_bytes(&self) -> Result<Vec<u8>, CertificateError> {
        let json = serde_json::to_vec(&self.document(String::new()))
            .map_err(|e| CertificateError::Malformed(e.to_string()))?;
        Ok([b"sigmark certificate\0", &json[..]].concat())
    }

    fn document(&self, seal: String) -> Document {
        Document {
            format: FORMAT.into(),
            version: VERSION,
            message: self.message.clone(),
            public_key: self.public_key.to_pem(),
            original: self.original.clone(),
            mark: MarkDocument {
                scheme: self.mark.signature.scheme(),
                coverage: self.mark.coverage,
                signature: self.mark.signature.to_hex(),
                chip_rate: self.mark.chip_rate,
                laplacian: self.mark.laplacian,
                labels: self.mark.labels.clone(),
                patches: self.mark.patches.clone(),
            },
            seal,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn numbers_read_back_exactly(alpha in proptest::num::f64::NORMAL, last_eigenvalue in 0.0..1e5f64) {
            let record = PatchRecord { vertices: 7, alpha, last_eigenvalue };
            let json = serde_json::to_string(&record).unwrap();
            prop_assert_eq!(serde_json::from_str::<PatchRecord>(&json).unwrap(), record);
        }
    }

    proptest! {
        #[test]
        fn labels_unpack_to_what_was_packed(labels in proptest::collection::vec(0u32..40, 1..300)) {
            let packed = PackedLabels::pack(&labels);
            prop_assert_eq!(packed.unpack(labels.len()).unwrap(), labels.clone());
            prop_assert!(packed.unpack(labels.len() + 1).is_err());
            prop_assert!(packed.unpack(labels.len() - 1).is_err());
            prop_assert!(PackedLabels(packed.0[1..].into()).unpack(labels.len()).is_err());
        }
    }
}
