//! Digital signatures of watermarks by elliptic curves (ECDSA), and the keys that make and check them.
//!
//! Section 4.2.2 of the paper. With `A` the base point of order `d`, `k_d` the private key, `K_e = k_d A` the public key,
//! `W` the watermark, `h = H(W)` and a nonce `k` with `R = k A`, the signature `S = r || s` is
//!
//! - `r = x_R mod d` (eq. 9),
//! - `s = k⁻¹ (h + k_d r) mod d` (eq. 10),
//!
//! and it is confirmed (eqs. 19 and 20) when `x_R' = r mod d`, where `R' = (h s⁻¹) A + (r s⁻¹) K_e`.
//! The paper draws the nonce at random; here RFC 6979 derives it from key and message, so that signing needs no randomness
//! and signing twice gives the same bits.
//!
//! ```
//! use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
//! use sigmark::{Scheme, SigningKey};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut rng = ChaCha20Rng::from_seed([7; 32]); // for real keys: the operating system's generator
//! let scheme = Scheme::default();
//! let key = SigningKey::generate(scheme.curve(), &mut rng);
//! let signature = key.sign(scheme, "© 2026 Studio".as_bytes())?;
//! assert_eq!(signature.bits().len(), scheme.bits()); // what is embedded
//! key.public_key().verify("© 2026 Studio".as_bytes(), &signature)?;
//! assert!(key.public_key().verify("© 2026 Thief".as_bytes(), &signature).is_err());
//! # Ok(())
//! # }
//! ```
//!
//! **Conventions.** Integers and bit strings are big-endian. A signature of `l` bits is `r`, then `s`, in `l/2` bits each.
//! Keys are PEM files as OpenSSL writes them; a private key may be locked by a passphrase.
//!
//! **Costs.** Signing and verifying take about a millisecond on either curve; locking or opening a private key takes a few
//! tenths of a second, on purpose.
//!
//! **Security.** P-256 rests on RustCrypto's constant-time arithmetic. B-163, behind the feature `paper`, is for reproducing the paper only:
//! about 80 bits of security, and arithmetic whose running time depends on the private key. SHA-1 admits collisions:
//! who may choose the watermark's text before it is signed can have two texts that share one signature.

#[cfg(feature = "paper")]
mod b163;
mod der;
mod error;
mod p256;
mod pair;
mod pem;

pub use error::KeyError;
pub use pair::{PublicKey, SigningKey};
