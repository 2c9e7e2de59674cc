//! ECDSA on the binary curve NIST B-163 (sect163r2), for reproducing the paper.
//!
//! <div class="warning">
//!
//! **Not for production.** The group gives about 80 bits of security, and nothing here is constant-time: how long an
//! operation takes depends on the private key and the nonce, of which intermediate values stay in memory.
//!
//! </div>
//!
//! The curve is `y² + xy = x³ + a x² + b` over GF(2¹⁶³) (FIPS 186-4, D.1.3). All constants can be printed with
//! `openssl ecparam -name sect163r2 -param_enc explicit -text -noout`.

mod curve;
mod ecdsa;
mod field;

pub(super) use curve::AffinePoint;
pub(super) use ecdsa::{SecretScalar, order, sign, verifies};
