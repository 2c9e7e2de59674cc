mod document;
mod error;
mod labels;

pub use error::CertificateError;
pub use labels::PackedLabels;

use mesh::TriMesh;
use sha2::{Digest, Sha256};

use super::{
    keys::{PublicKey, SigningKey},
    statement::{Checked, Statement},
};
use crate::{
    mark::Sketch,
    payload::{Payload, Signature},
};
use document::Document;

/// The version of the certificate format that this library writes and reads.
pub const VERSION: u64 = 5;

/// The longest text of a certificate, in bytes.
pub const LARGEST: usize = 16 << 20;

/// What a verifier needs besides the original and the public key: a [`Statement`], the signature over it that stands in the shape, and
/// what the verifier's own computation is compared with.
///
/// A JSON file, described in `docs/certificate.md`. What is signed is never its text: the signature covers the statement's hash, a seal
/// by the same key the rest. There is no certificate without a valid signature and seal. It holds the signature that is hidden in the mesh:
/// who has both it and the original can remove the mark. It is for the owner and the trusted third party, not for the public.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    contents: Contents,
    hash: [u8; 32],
    patch_sizes: Vec<usize>,
    seal: Signature,
    stamps: Vec<Vec<u8>>,
}

/// What is sealed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Contents {
    pub(super) statement: Statement,
    /// The file name of the original, or nothing: a help to find it.
    pub(super) name: String,
    pub(super) signature: Signature,
    /// The last eigenvalue of each patch's basis at unit area: tells whether another program computes the same basis.
    pub(super) eigenvalues: Vec<f64>,
    /// The text of a [`Sketch`] of the original, or nothing where there is none.
    pub(super) sketch: String,
}

impl Certificate {
    /// Fills in and seals a certificate.
    pub(super) fn issue(key: &SigningKey, contents: Contents) -> Result<Self, CertificateError> {
        let Checked { hash, patch_sizes } = contents.statement.checked()?;
        let seal = key.sign(contents.statement.scheme, &contents.sealed_bytes(&hash))?;
        let certificate = Self {
            contents,
            hash,
            patch_sizes,
            seal,
            stamps: Vec::new(),
        };
        certificate.check()?;
        certificate.to_json()?;
        Ok(certificate)
    }

    /// Reads a certificate and checks its values, its signature and its seal. It costs little time and memory whatever the text is.
    ///
    /// # Errors
    /// When the text is no certificate, of another version, damaged, edited, or not signed by the key that it names.
    pub fn from_json(text: &str) -> Result<Self, CertificateError> {
        if text.len() > LARGEST {
            return Err(CertificateError::TooLarge { found: text.len() });
        }
        let mut document = Document::parse(text)?;
        let (contents, sizes_said) = document.contents()?;
        let Checked { hash, patch_sizes } = contents.statement.checked()?;
        if sizes_said != patch_sizes {
            return Err(CertificateError::Field {
                field: "patches",
                problem: "has other numbers of vertices than \"labels\"".into(),
            });
        }
        let certificate = Self {
            contents,
            hash,
            patch_sizes,
            seal: document.seal()?,
            stamps: document.stamps()?,
        };
        certificate.check()?;
        Ok(certificate)
    }

    /// The JSON text, indented for people, with a final newline.
    ///
    /// # Errors
    /// [`CertificateError::TooLarge`], when it could not be read back.
    pub fn to_json(&self) -> Result<String, CertificateError> {
        let text = serde_json::to_string_pretty(&Document::of(self))
            .map_err(|e| CertificateError::Malformed(e.to_string()))?;
        match text.len() < LARGEST {
            true => Ok(text + "\n"),
            false => Err(CertificateError::TooLarge {
                found: text.len() + 1,
            }),
        }
    }

    /// What is signed.
    pub fn statement(&self) -> &Statement {
        &self.contents.statement
    }

    /// The key that checks both the signature and the seal.
    pub fn public_key(&self) -> &PublicKey {
        &self.contents.statement.public_key
    }

    /// What the signer asserts.
    pub fn message(&self) -> &str {
        &self.contents.statement.message
    }

    /// The file name that the original had, or nothing.
    pub fn original_name(&self) -> &str {
        &self.contents.name
    }

    /// The signature over the statement, whose [bits](Self::bits) are in the shape.
    pub fn signature(&self) -> &Signature {
        &self.contents.signature
    }

    /// h, the [hash](Statement::hash) of the statement.
    pub fn statement_hash(&self) -> &[u8; 32] {
        &self.hash
    }

    /// The bits that stand in the shape: for all but the paper's marks F_h(r ‖ s).
    pub fn bits(&self) -> Vec<bool> {
        self.payload().bits(&self.contents.signature)
    }

    /// Whether bits that were read from a shape hold a valid signature over the statement.
    pub fn confirms(&self, bits: &[bool]) -> bool {
        let Contents { statement, .. } = &self.contents;
        let read = self.payload().signature(bits);
        let signed = statement.signed_bytes(&self.hash);
        read.and_then(|read| statement.public_key.verify(&signed, &read))
            .is_ok()
    }

    /// The highest eigenvalue of each patch's basis, at unit area.
    pub fn last_eigenvalues(&self) -> &[f64] {
        &self.contents.eigenvalues
    }

    /// What the original's geometry is recognised by in another file, if there is a sketch, a mesh has as many vertices and triangles, and the sketch has the patches
    /// of the statement. It is unpacked for such a mesh alone, so that a small text can't ask for much memory.
    pub fn sketch_for(&self, mesh: &TriMesh) -> Option<Sketch> {
        let Contents {
            statement, sketch, ..
        } = &self.contents;
        let record = statement.original;
        if (mesh.vertex_count(), mesh.triangle_count()) != (record.vertices, record.triangles) {
            return None;
        }
        let sketch = Sketch::from_text(sketch, record.vertices, &statement.functions)?;
        let mut sizes = vec![0; self.patch_sizes.len()];
        for &label in sketch.labels().iter().filter(|&&label| label > 0) {
            *sizes.get_mut(label as usize - 1)? += 1;
        }
        (sizes == self.patch_sizes).then_some(sketch)
    }

    /// SHA-256 over a domain, h, the signature and the seal (r, then s, 32 bytes each): what a time stamp covers.
    pub fn digest(&self) -> [u8; 32] {
        let mut hash = Sha256::new_with_prefix(b"sigmark certificate v5\0");
        hash.update(self.hash);
        for signature in [&self.contents.signature, &self.seal] {
            hash.update(signature.r());
            hash.update(signature.s());
        }
        hash.finalize().into()
    }

    /// Replies of time stamping authorities (RFC 3161, DER) over the [digest](Self::digest), unchecked.
    pub fn stamps(&self) -> &[Vec<u8>] {
        &self.stamps
    }

    /// The same certificate with one more reply of a time stamping authority.
    pub fn with_stamp(mut self, reply: Vec<u8>) -> Self {
        self.stamps.push(reply);
        self
    }

    pub(super) fn payload(&self) -> Payload {
        self.contents.statement.payload(self.hash)
    }

    fn check(&self) -> Result<(), CertificateError> {
        let Contents {
            statement, signature, ..
        } = &self.contents;
        let signed = statement.signed_bytes(&self.hash);
        statement
            .public_key
            .verify(&signed, signature)
            .map_err(|_| CertificateError::Statement)?;
        let sealed = self.contents.sealed_bytes(&self.hash);
        statement
            .public_key
            .verify(&sealed, &self.seal)
            .map_err(|_| CertificateError::Seal)
    }
}

impl Contents {
    /// What the seal signs: a domain, h, the signature (r, then s, 32 bytes each), the last eigenvalues, SHA-256 of the sketch's text, and the
    /// original's name.
    fn sealed_bytes(&self, hash: &[u8; 32]) -> Vec<u8> {
        let eigenvalues: Vec<[u8; 8]> = self.eigenvalues.iter().map(|value| value.to_le_bytes()).collect();
        [
            b"sigmark seal v5\0",
            &hash[..],
            self.signature.r(),
            self.signature.s(),
            eigenvalues.as_flattened(),
            &Sha256::digest(&self.sketch)[..],
            self.name.as_bytes(),
        ]
        .concat()
    }
}
