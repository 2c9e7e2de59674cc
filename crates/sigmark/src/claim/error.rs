use crate::{
    claim::certificate::CertificateError,
    mark::MarkError,
    payload::{PayloadKind, Scheme, SignatureError},
};

/// Why a mesh could not be signed, or a suspect not be judged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SigmarkError {
    /// The certificate describes other patches or another Laplacian.
    #[error(
        "the certificate describes other patches, or another Laplacian, than the original was prepared with; prepare it as the certificate says"
    )]
    AnotherCut,
    /// The certificate is for another mesh.
    #[error(
        "this is not the original that the certificate was made for (digest {found} here, {expected} in the certificate); \
         use the very file that was signed, not a converted or edited copy"
    )]
    AnotherOriginal {
        /// The certificate's digest.
        expected: String,
        /// This mesh's digest.
        found: String,
    },
    /// The certificate was issued by another key.
    #[error(
        "the certificate was issued by the key {certificate}, not by the given public key {given}; use the public key of the signer"
    )]
    AnotherKey {
        /// Fingerprint of the certificate's key.
        certificate: String,
        /// Fingerprint of the key that was given.
        given: String,
    },
    /// Marks of a scheme hold no such payload.
    #[error(
        "marks of {scheme} hold no payload of the kind {:?}; ask for none, and the one that suits the key is taken", payload.name()
    )]
    Payload {
        /// What was asked for.
        payload: PayloadKind,
        /// The scheme of the signature.
        scheme: Scheme,
    },
    /// No probability, or one by which everything would be found.
    #[error("the largest p-value that counts is a number from 0, and below 1: {0} is not")]
    Bound(f64),
    /// The mark is of the paper's profile, and that was not asked for.
    #[error(
        "the mark is of the paper's profile: its signature is over the message alone, so that anybody who has the model could claim it"
    )]
    PaperProfile,
    /// A certificate can't be read.
    #[error(transparent)]
    Certificate(#[from] CertificateError),
    /// Keys and signatures.
    #[error(transparent)]
    Signature(#[from] SignatureError),
    /// Writing or reading the mark.
    #[error(transparent)]
    Mark(MarkError),
    /// Threads could not be started, or the observer asked to stop.
    #[error(transparent)]
    Job(#[from] job::JobError),
}

/// # Errors
/// [`SigmarkError::Bound`].
pub(super) fn check_bound(p: f64) -> Result<(), SigmarkError> {
    match (0.0..1.0).contains(&p) {
        true => Ok(()),
        false => Err(SigmarkError::Bound(p)),
    }
}

impl From<MarkError> for SigmarkError {
    /// A job that could not be done is always [`SigmarkError::Job`].
    fn from(error: MarkError) -> Self {
        match error {
            MarkError::Job(error) => Self::Job(error),
            error => Self::Mark(error),
        }
    }
}
