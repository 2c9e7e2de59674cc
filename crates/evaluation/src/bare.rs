//! What is shown on a machine without Python: that the build works, and what is missing for more.

use anyhow::{Error, Result, bail};
use job::Job;
use mesh::shapes;
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use sigmark::{Curve, Embedder, Outcome, SigningKey, Verifier};

use crate::meshes::random_similarity;

/// Signs a made-up surface, moves it and verifies it; nothing is written.
pub(crate) fn run(missing: &Error) -> Result<()> {
    eprintln!("No Python for the attacks: {missing:#}.");
    eprintln!("Signing a made-up surface only; nothing is written to results/.");
    let surface = shapes::bumpy_sphere(5, 1);
    let job = Job::default();
    let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::seed_from_u64(2012));
    let signed = Embedder::new(&key).chip_rate(1).embed(&surface, &job)?;
    let suspect = shapes::moved(signed.mesh(), &random_similarity(&surface, 1));
    let public_key = key.public_key();
    let verdict = Verifier::new(&surface, signed.certificate(), &public_key)?.verify(&suspect, &job)?;
    println!(
        "{} vertices, moved at random: ER {:.2} %",
        surface.vertex_count(),
        100.0 * verdict.extraction_rate.unwrap_or(f64::NAN)
    );
    if verdict.outcome != Outcome::Verified {
        bail!("the signature was not read back from the marked surface");
    }
    println!("VERIFIED");
    Ok(())
}
