use super::{LARGEST, MOST_STAMPS, VERSION};
use crate::payload::SignatureError;

/// Why a certificate is not accepted, or could not be issued.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CertificateError {
    /// Not JSON, or JSON of another shape.
    #[error("not a Sigmark certificate ({0}); use the .cert.json file that `sigmark embed` wrote")]
    Malformed(String),
    /// Longer than any certificate.
    #[error(
        "{found} bytes are no Sigmark certificate, which has at most {LARGEST}; use the .cert.json file that `sigmark embed` wrote, \
         or sign with a shorter message"
    )]
    TooLarge {
        /// How long it is.
        found: usize,
    },
    /// Of an older version.
    #[error(
        "the certificate has version {found}: {}; sign the original again with this program", why_outdated(*found)
    )]
    Outdated {
        /// The version that it says it has.
        found: u64,
    },
    /// From a later generation of the program.
    #[error(
        "the certificate has version {found}, but this program reads version {VERSION}; use the Sigmark that wrote it"
    )]
    Version {
        /// The version that it says it has.
        found: u64,
    },
    /// A value that no signer writes.
    #[error(
        "the certificate's field \"{field}\" {problem}; ask the signer for the certificate as it was issued"
    )]
    Field {
        /// The field's name.
        field: &'static str,
        /// What is wrong with it.
        problem: String,
    },
    /// The signature is not one over what the certificate states.
    #[error(
        "the certificate's signature is not one by its key over what it states: it was edited, damaged or forged; \
         ask the signer for the certificate as it was issued"
    )]
    Statement,
    /// The signature is, but another part was edited.
    #[error(
        "the certificate's seal does not match its contents: it was edited or damaged; \
         ask the signer for the certificate as it was issued"
    )]
    Seal,
    /// No more time stamps are read.
    #[error(
        "the certificate has {MOST_STAMPS} time stamps already, and is not read with more; take out those that nobody needs"
    )]
    Stamps,
    /// The key does not suit the scheme.
    #[error(transparent)]
    Signature(#[from] SignatureError),
}

fn why_outdated(version: u64) -> &'static str {
    match version {
        7.. => "this program signs what poses the original with it, so that a mark is read in any pose",
        5.. => "this program writes the signature as a codeword",
        4 => "this program knows more of the original by its certificate",
        3 => "this program lays marks out otherwise",
        _ => {
            "a rival could forge such ones, since their signatures do not cover the public key, the patches and the strengths"
        }
    }
}
