//! The JSON of a certificate, field by field, as `docs/certificate.md` describes it.

use base64::{Engine, engine::general_purpose::STANDARD as BASE64};
use mhb_core::LaplacianKind;
use serde::{Deserialize, Serialize};

use super::{Certificate, CertificateError, Contents, MOST_STAMPS, PackedLabels, VERSION};
use crate::{
    claim::{
        keys::PublicKey,
        statement::{Carrier, OriginalRecord, Statement},
    },
    payload::{GeometryDigest, PayloadKind, RigDigest, Scheme, Signature},
};

const FORMAT: &str = "sigmark-certificate";

/// What tells whether a text is a certificate, and of which version. Everything else is passed over.
#[derive(Deserialize)]
struct Header {
    format: Option<String>,
    version: Option<u64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Document {
    format: String,
    version: u64,
    public_key: String,
    message: String,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    recipient: String,
    original: OriginalDocument,
    mark: MarkDocument,
    seal: String,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    stamps: Vec<String>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OriginalDocument {
    #[serde(default, skip_serializing_if = "String::is_empty")]
    name: String,
    digest: GeometryDigest,
    vertices: usize,
    triangles: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rig: Option<RigDigest>,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    sketch: String,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MarkDocument {
    scheme: Scheme,
    payload: PayloadKind,
    signature: String,
    carrier: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    chip_rate: Option<usize>,
    #[serde(with = "LaplacianName")]
    laplacian: LaplacianKind,
    labels: PackedLabels,
    patches: Vec<PatchDocument>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PatchDocument {
    vertices: usize,
    functions: usize,
    alpha: f64,
    last_eigenvalue: f64,
}

/// The names of Laplacians.
#[derive(Serialize, Deserialize)]
#[non_exhaustive]
#[serde(remote = "LaplacianKind", rename_all = "kebab-case")]
enum LaplacianName {
    Cotangent,
    Intrinsic,
}

fn malformed(error: impl std::fmt::Display) -> CertificateError {
    CertificateError::Malformed(error.to_string())
}

impl Document {
    /// Parses a text. Only one that does not fit is looked at again, for what is to be said of it.
    pub(super) fn parse(text: &str) -> Result<Self, CertificateError> {
        let parsed = serde_json::from_str::<Self>(text);
        let (format, version) = match &parsed {
            Ok(document) => (Some(document.format.clone()), Some(document.version)),
            Err(error) => {
                let header: Header = serde_json::from_str(text).map_err(|_| malformed(error))?;
                (header.format, header.version)
            }
        };
        match (format.as_deref() == Some(FORMAT), version) {
            (false, _) => Err(malformed(format_args!(
                "the field \"format\" is not \"{FORMAT}\""
            ))),
            (true, Some(found)) if found < VERSION => Err(CertificateError::Outdated { found }),
            (true, Some(found)) if found > VERSION => Err(CertificateError::Version { found }),
            _ => parsed.map_err(malformed),
        }
    }

    pub(super) fn of(certificate: &Certificate) -> Self {
        let Contents {
            statement,
            name,
            signature,
            eigenvalues,
            sketch,
        } = &certificate.contents;
        let OriginalRecord {
            digest,
            vertices,
            triangles,
            rig,
        } = statement.original;
        let patches = certificate
            .patch_sizes
            .iter()
            .zip(&statement.functions)
            .zip(&statement.alphas)
            .zip(eigenvalues);
        Self {
            format: FORMAT.into(),
            version: VERSION,
            public_key: statement.public_key.to_pem(),
            message: statement.message.clone(),
            recipient: statement.recipient.clone(),
            original: OriginalDocument {
                name: name.clone(),
                digest,
                vertices,
                triangles,
                rig,
                sketch: sketch.clone(),
            },
            mark: MarkDocument {
                scheme: statement.scheme,
                payload: statement.payload,
                signature: signature.to_hex(),
                carrier: statement.carrier.name().into(),
                chip_rate: statement.carrier.chip_rate(),
                laplacian: statement.laplacian,
                labels: statement.labels.clone(),
                patches: patches
                    .map(
                        |(((&vertices, &functions), &alpha), &last_eigenvalue)| PatchDocument {
                            vertices,
                            functions,
                            alpha,
                            last_eigenvalue,
                        },
                    )
                    .collect(),
            },
            seal: certificate.seal.to_hex(),
            stamps: certificate
                .stamps
                .iter()
                .map(|stamp| BASE64.encode(stamp))
                .collect(),
        }
    }

    /// What the certificate says, and how many vertices it says that each patch has.
    pub(super) fn contents(&mut self) -> Result<(Contents, Vec<usize>), CertificateError> {
        let mark = &mut self.mark;
        let patches = std::mem::take(&mut mark.patches);
        let statement = Statement {
            public_key: PublicKey::from_pem(&self.public_key).map_err(malformed)?,
            message: std::mem::take(&mut self.message),
            recipient: std::mem::take(&mut self.recipient),
            original: OriginalRecord {
                digest: self.original.digest,
                vertices: self.original.vertices,
                triangles: self.original.triangles,
                rig: self.original.rig,
            },
            scheme: mark.scheme,
            payload: mark.payload,
            carrier: Carrier::named(&mark.carrier, mark.chip_rate).ok_or_else(|| CertificateError::Field {
                field: "carrier",
                problem: format!(
                    "is {:?}, {} a chip rate; it is \"pooled-harmonics\" without one, or \"harmonics\" with one",
                    mark.carrier,
                    if mark.chip_rate.is_some() { "with" } else { "without" }
                ),
            })?,
            laplacian: mark.laplacian,
            labels: mark.labels.clone(),
            functions: patches.iter().map(|patch| patch.functions).collect(),
            alphas: patches.iter().map(|patch| patch.alpha).collect(),
        };
        let contents = Contents {
            statement,
            name: std::mem::take(&mut self.original.name),
            signature: Signature::from_hex(mark.scheme, &mark.signature).map_err(malformed)?,
            eigenvalues: patches.iter().map(|patch| patch.last_eigenvalue).collect(),
            sketch: std::mem::take(&mut self.original.sketch),
        };
        Ok((contents, patches.iter().map(|patch| patch.vertices).collect()))
    }

    pub(super) fn seal(&self) -> Result<Signature, CertificateError> {
        Signature::from_hex(self.mark.scheme, &self.seal).map_err(|_| CertificateError::Seal)
    }

    /// They are not sealed, so anybody can add some.
    pub(super) fn stamps(&self) -> Result<Vec<Vec<u8>>, CertificateError> {
        if self.stamps.len() > MOST_STAMPS {
            return Err(CertificateError::Field {
                field: "stamps",
                problem: format!("has {}, more than {MOST_STAMPS}", self.stamps.len()),
            });
        }
        let decoded = self.stamps.iter().map(|stamp| BASE64.decode(stamp));
        decoded
            .collect::<Result<_, _>>()
            .map_err(|error| CertificateError::Field {
                field: "stamps",
                problem: format!("is not base64 ({error})"),
            })
    }
}
