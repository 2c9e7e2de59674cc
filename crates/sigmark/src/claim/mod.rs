//! Who says what about which original: keys, statements, certificates, p-values, verdicts.

mod certificate;
mod embed;
mod error;
pub mod keys;
mod statement;
pub mod statistics;
mod verdict;
mod verify;

pub use certificate::{
    Certificate, CertificateError, MarkRecord, OriginalRecord, PackedLabels, PatchRecord, VERSION,
};
pub use embed::{Embedder, Signed};
pub use error::SigmarkError;
pub use statement::Coverage;
pub use verdict::{Mismatch, Outcome, Verdict};
pub use verify::Verifier;
