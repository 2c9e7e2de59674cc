//! Which bits a mark holds: today those of a signature, permuted so that nobody can choose one of them.

mod digest;
mod encoding;
mod error;
mod permutation;
mod scheme;
mod signature;

pub use digest::GeometryDigest;
pub use encoding::{Payload, PayloadKind};
pub use error::SignatureError;
pub use permutation::Permutation;
pub use scheme::{Curve, Scheme, UnknownScheme};
pub use signature::Signature;
