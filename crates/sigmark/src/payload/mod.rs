//! Which bits a mark holds: a codeword for a signature, permuted so that nobody can choose one of its bits, or for a tag of it.

mod digest;
mod encoding;
mod error;
mod permutation;
mod scheme;
mod signature;

pub use digest::{GeometryDigest, RigDigest};
pub use encoding::{Payload, PayloadKind};
pub use error::SignatureError;
pub use permutation::Permutation;
pub use scheme::{Curve, Scheme, UnknownScheme};
pub use signature::Signature;
