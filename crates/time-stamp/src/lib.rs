//! Time stamps: an authority's signed word that a digest existed at a time, asked for and checked offline.
//!
//! RFC 3161, as RFC 5816 amends it, over SHA-256. A [`Query`] goes to an authority, by whatever way the caller has; its reply is read
//! as a [`Stamp`], and [`Stamp::verify`] checks it against the authorities that the caller trusts, its [`Roots`].
//!
//! ```
//! use sha2::{Digest, Sha256};
//! use time_stamp::{Query, Roots, Stamp, StampError};
//!
//! let digest = Sha256::digest("a model").into();
//! let query = Query::new(digest).nonce(0x5eed); // in earnest: a number from the operating system's generator
//! assert_eq!(query.to_der()?.len(), 63); // this is sent to an authority, which sends back:
//! let reply = include_bytes!("../tests/data/reply.tsr");
//! let roots = Roots::from_pem(include_str!("../tests/data/root.pem"))?;
//!
//! let stamped = Stamp::from_reply(reply)?.verify(&digest, &roots)?;
//! assert_eq!(stamped.time.to_string(), "2026-11-22 14:53:28 UTC");
//! assert_eq!(stamped.authority, "CN=Example Time Stamps,O=Example");
//!
//! let other = Sha256::digest("another model").into();
//! assert!(matches!(Stamp::from_reply(reply)?.verify(&other, &roots), Err(StampError::AnotherDigest(_))));
//! # Ok::<(), StampError>(())
//! ```
//!
//! # What is checked
//! That the authority granted the stamp; that it is of exactly this digest by SHA-256; that one signer signed it, with his
//! certificate named among what he signed (RFC 5816); that this certificate is one for time stamps alone (RFC 3161 section 2.3); that
//! a chain of certificates leads from it to a root (RFC 5280 section 6.1), and that all of them were valid when the stamp was made.
//! Signatures are RSA from 2048 bits, with either padding, or ECDSA on P-256 or P-384, with SHA-256, SHA-384 or SHA-512.
//!
//! # What is not
//! - **Revocation.** Nothing is fetched, so an authority whose key was stolen and whose certificate was withdrawn since looks as
//!   good as before. Whoever has to know asks the authority for its list (RFC 3161 section 4, RFC 5280 section 6.3).
//! - **The authority's clock**: the time is its word, within [`Stamped::accuracy`] if it says how exact it is. A stamp in a leap
//!   second is refused, as there is no such time since 1970.
//! - **Policies and names.** Every certificate policy will do. A certificate with name constraints is refused, as is one with a
//!   critical extension that is not understood.
//!
//! # Conventions
//! Digests are SHA-256, 32 bytes. Messages are DER; messages in BER alone are refused, and so are bytes behind the end. Nothing is
//! drawn at random, fetched, or read from a clock or a file. Nothing panics, whatever the bytes. More than [`MOST_BYTES`] are not read.
//!
//! # Costs
//! About a millisecond for each certificate between the stamp and the root.

mod attributes;
mod certificate;
mod chain;
mod error;
mod message;
mod query;
mod signature;
mod stamp;
mod status;
mod time;

pub use chain::Roots;
pub use error::StampError;
pub use query::Query;
pub use stamp::{Stamp, Stamped};
pub use time::Time;

/// More bytes than this are not read: stamps have a few thousand.
pub const MOST_BYTES: usize = 1 << 20;

fn check_size(bytes: usize) -> Result<(), StampError> {
    match bytes <= MOST_BYTES {
        true => Ok(()),
        false => Err(StampError::TooLarge { bytes }),
    }
}
