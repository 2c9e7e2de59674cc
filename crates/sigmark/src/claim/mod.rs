//! Who says what about which original: keys, statements, certificates, p-values, verdicts, disputes.

mod certificate;
mod decoder;
mod dispute;
mod embed;
mod error;
pub mod keys;
mod marked_part;
mod prediction;
mod prepared;
mod statement;
pub mod statistics;
pub mod trace;
mod verdict;
mod verify;

pub use certificate::{
    Certificate, CertificateError, CertificateReader, Issued, LARGEST, PackedLabels, VERSION,
};
pub use dispute::{Dispute, Precedence, Read, Tie};
pub use embed::{Embedder, ReadBack, Signed};
pub use error::SigmarkError;
pub use prediction::{Prediction, QUOTED_NOISE, bits_for};
pub use prepared::Prepared;
pub use statement::{Carrier, OriginalRecord, Statement};
pub use trace::{Accused, Trace, Tracer};
pub use verdict::{Compared, EVIDENCE, FoundPart, Mismatch, Outcome, STRANGERS_TRIES, Verdict};
pub use verify::Verifier;
