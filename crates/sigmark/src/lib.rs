//! Cryptographic signatures in the shape of a mesh.
//!
//! Wang, Feng and Miao, "A robust confirmable watermarking algorithm for 3D mesh based on manifold harmonics analysis",
//! The Visual Computer 28 (2012). Each patch of the mesh is expanded in its manifold harmonics H; bit t of an ECDSA
//! signature, s″ = ±1, moves low-frequency coefficients by α s″ φ (eqs. 11–14):
//!
//! x′ = x + α φ Σₖ s″ₖ Hᵏ  (eq. 26).
//!
//! Whoever has the original reads the bits back from the difference of the coefficients, after taking the suspect onto
//! the original (eqs. 15–17), and checks them against a public key (eqs. 19, 20).
//!
//! ```
//! use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
//! use job::Job;
//! use sigmark::{Curve, Embedder, Outcome, SigningKey, Verifier};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let (original, job) = (mesh::shapes::bumpy_sphere(4, 1), Job::default());
//! let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([7; 32])); // for real keys: the system's generator
//! let signed = Embedder::new(&key).message("© 2026 Studio, order 4711").embed(&original, &job)?;
//!
//! let public_key = key.public_key();
//! let verdict = Verifier::new(&original, signed.certificate(), &public_key)?.verify(signed.mesh(), &job)?;
//! assert_eq!(verdict.outcome, Outcome::Verified);
//! # Ok(())
//! # }
//! ```
//!
//! # Three floors
//! - [`mark`]: bits in a shape, and back. It knows neither keys nor certificates.
//! - [`payload`]: which bits those are: a codeword for a signature, or for a tag of one.
//! - [`claim`]: who says what about which original: keys, certificates, p-values and verdicts; and [whose copy](claim::trace) a suspect is.
//!
//! Each knows only those above it in this list.
//!
//! # Conventions
//! Bits are `bool`, most significant first. Axes 0, 1, 2 are x, y, z. α belongs to patches of unit area, distances are
//! fractions of the diagonal of the original's bounding box. Transforms take the suspect to the original. Patches are
//! connected; the bits are spread over all of them, and each has as many manifold harmonics as its area deserves. Parts of a model with
//! room for fewer than three useful harmonics stay unmarked.
//!
//! # Costs
//! Nearly all time goes into the manifold harmonics: see [`mhb_core`]. Memory is that of one basis a thread, 8 m bytes a
//! vertex of a patch with m of them; who reads keeps up to a gigabyte. An untouched copy is read from a few patches. Reading a suspect by its surface
//! takes #V (3 m)² operations more, once or twice for each pose that is tried.
//!
//! # Features
//! `paper`: the paper's own signature scheme, ECDSA on the binary curve B-163 with SHA-1. For reproduction only.
//!
//! # What it does not do
//! It never reads files, prints, or draws random numbers. The mark is non-blind: without the original nothing can be read.

pub mod claim;
pub mod mark;
pub mod payload;

pub use claim::{
    Certificate, CertificateError, Compared, Dispute, Embedder, FoundPart, Mismatch, Outcome, Precedence,
    Prediction, Prepared, ReadBack, SigmarkError, Signed, Statement, Verdict, Verifier,
    keys::{KeyError, PublicKey, SigningKey},
};
pub use mark::Strength;
pub use payload::{Curve, GeometryDigest, PayloadKind, Scheme, Signature, SignatureError};
