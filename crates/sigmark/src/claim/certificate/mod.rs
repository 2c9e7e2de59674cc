mod document;
mod error;
mod labels;
mod several;

pub use error::CertificateError;
pub(super) use labels::LabelsSummary;
pub use labels::PackedLabels;
pub use several::{CertificateReader, Issued};

use mesh::{Rig, TriMesh};
use sha2::{Digest, Sha256};

use super::{
    keys::{PublicKey, SigningKey},
    statement::{Checked, Statement},
};
use crate::{
    mark::{Sketch, SoftBits},
    payload::{Payload, RigDigest, Signature},
};
use document::Document;

/// The version of the certificate format that this library writes and reads.
pub const VERSION: u64 = 8;

/// The longest text of a certificate, in bytes.
pub const LARGEST: usize = 16 << 20;

/// No certificate is read with more time stamps; nobody asks for so many.
pub(super) const MOST_STAMPS: usize = 100;

/// What a verifier needs besides the original and the public key: a [`Statement`], the signature over it that stands in the shape, and
/// what the verifier's own computation is compared with.
///
/// A JSON file, described in `docs/certificate.md`. What is signed is never its text: the signature covers the statement's hash, a seal
/// by the same key the rest. There is no certificate without a valid signature and seal. It holds the signature that is hidden in the mesh:
/// who has both it and the original can remove the mark. It is for the owner and the trusted third party, not for the public.
#[derive(Clone, Debug)]
pub struct Certificate {
    contents: Contents,
    hash: [u8; 32],
    payload: Payload,
    patch_sizes: Vec<usize>,
    seal: Signature,
    stamps: Vec<Vec<u8>>,
}

impl PartialEq for Certificate {
    /// By all that stands in it; what else it keeps follows from that.
    fn eq(&self, other: &Self) -> bool {
        self.contents == other.contents && self.seal == other.seal && self.stamps == other.stamps
    }
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
            payload: contents.statement.coded(hash)?,
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
        let certificate = Self::unchecked(text, Statement::checked)?;
        certificate.check()?;
        Ok(certificate)
    }

    /// Reads a certificate whose signature and seal are not checked, given what checks and hashes its statement.
    fn unchecked(
        text: &str,
        checked: impl FnOnce(&Statement) -> Result<Checked, CertificateError>,
    ) -> Result<Self, CertificateError> {
        if text.len() > LARGEST {
            return Err(CertificateError::TooLarge { found: text.len() });
        }
        let mut document = Document::parse(text)?;
        let (contents, sizes_said) = document.contents()?;
        let Checked { hash, patch_sizes } = checked(&contents.statement)?;
        if sizes_said != patch_sizes {
            return Err(CertificateError::Field {
                field: "patches",
                problem: "has other numbers of vertices than \"labels\"".into(),
            });
        }
        Ok(Self {
            payload: contents.statement.coded(hash)?,
            contents,
            hash,
            patch_sizes,
            seal: document.seal()?,
            stamps: document.stamps()?,
        })
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

    /// Whether the original was signed with this rig, and so a mark is read by it.
    pub fn binds(&self, rig: &Rig) -> bool {
        // Most have none, and to hash one takes its time.
        let bound = self.contents.statement.original.rig;
        bound.is_some_and(|bound| bound == RigDigest::of(rig))
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

    /// The signature over the statement, which the [bits](Self::bits) in the shape are made of.
    pub fn signature(&self) -> &Signature {
        &self.contents.signature
    }

    /// h, the [hash](Statement::hash) of the statement.
    pub fn statement_hash(&self) -> &[u8; 32] {
        &self.hash
    }

    /// The bits that stand in the shape: for all but the paper's marks a codeword.
    pub fn bits(&self) -> Vec<bool> {
        self.payload.bits(&self.contents.signature)
    }

    /// What the bits in the shape hold, and how.
    pub fn payload(&self) -> &Payload {
        &self.payload
    }

    /// Whether a payload that was read from a shape is the mark's: it holds a valid signature over the statement, or is the tag of the one that the certificate has.
    pub fn confirms(&self, message: &[bool]) -> bool {
        let Contents {
            statement, signature, ..
        } = &self.contents;
        if message == self.payload.message(signature) {
            return true;
        }
        let signed = statement.signed_bytes(&self.hash);
        let read = self.payload.signature(message);
        read.is_some_and(|read| statement.public_key.verify(&signed, &read).is_ok())
    }

    /// Whether the payload is among those which soft bits say most likely, in lists of these lengths.
    pub fn is_read(&self, soft: &SoftBits, lists: &[usize]) -> bool {
        let message = self.payload.message(&self.contents.signature);
        self.payload.read(soft, lists, |read| read == message).is_some()
    }

    /// The highest eigenvalue of each patch's basis, at unit area.
    pub fn last_eigenvalues(&self) -> &[f64] {
        &self.contents.eigenvalues
    }

    /// What the original's geometry is recognised by in another file, if there is a sketch, a mesh has as many vertices and triangles at least, and the sketch has the patches
    /// of the statement. It is unpacked for such a mesh alone, so that a small text can't ask for much memory.
    pub fn sketch_for(&self, mesh: &TriMesh) -> Option<Sketch> {
        let Contents {
            statement, sketch, ..
        } = &self.contents;
        let record = statement.original;
        if mesh.vertex_count() < record.vertices || mesh.triangle_count() < record.triangles {
            return None;
        }
        let sketch = Sketch::from_text(sketch, record.vertices, record.triangles, &statement.functions)?;
        let mut sizes = vec![0; self.patch_sizes.len()];
        for &label in sketch.labels().iter().filter(|&&label| label > 0) {
            *sizes.get_mut(label as usize - 1)? += 1;
        }
        (sizes == self.patch_sizes).then_some(sketch)
    }

    /// SHA-256 over a domain, h, the signature and the seal (r, then s, 32 bytes each): what a time stamp covers.
    pub fn digest(&self) -> [u8; 32] {
        let mut hash = Sha256::new_with_prefix(b"sigmark certificate v6\0");
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
    ///
    /// # Errors
    /// [`CertificateError::Stamps`], where it has as many as are read.
    pub fn with_stamp(mut self, reply: Vec<u8>) -> Result<Self, CertificateError> {
        if self.stamps.len() >= MOST_STAMPS {
            return Err(CertificateError::Stamps);
        }
        self.stamps.push(reply);
        Ok(self)
    }

    /// The signature in the shape, then what is sealed, and the seal.
    pub(super) fn parts(&self) -> (Signature, Vec<u8>, Signature) {
        let sealed = self.contents.sealed_bytes(&self.hash);
        (self.contents.signature, sealed, self.seal)
    }

    /// Whether signature and seal are those of the key that it names.
    pub(super) fn check(&self) -> Result<(), CertificateError> {
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
            b"sigmark seal v6\0",
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
