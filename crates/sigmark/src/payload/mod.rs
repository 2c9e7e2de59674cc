//! Which bits a mark holds: today those of a signature.

mod digest;
mod error;
mod scheme;
mod signature;

pub use digest::GeometryDigest;
pub use error::SignatureError;
pub use scheme::{Curve, Scheme, UnknownScheme};
pub use signature::Signature;
