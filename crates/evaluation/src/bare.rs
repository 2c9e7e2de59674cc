//! What is shown on a machine without Python: that the build works, and what is missing for more.

use anyhow::{Error, Result, bail, ensure};
use job::Job;
use mesh::shapes;
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use sigmark::{Curve, Embedder, Outcome, SigningKey, Verifier};

use crate::attacks::random_similarity;

/// Signs a made-up surface, moves it and verifies it; nothing is written. Fails in any case, since there are no tables: its last line is
/// the remedy.
pub(crate) fn run(missing: &Error) -> Result<()> {
    eprintln!("No Python for the attacks: {missing:#}.");
    eprintln!("Signing a made-up surface only.");
    signed_and_verified()?;
    bail!("without the attacks there are no tables, and nothing was written\n{missing}")
}

fn signed_and_verified() -> Result<()> {
    let surface = shapes::bumpy_sphere(5, 1);
    let job = Job::default();
    let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::seed_from_u64(2012));
    let signed = Embedder::new(&key).embed(&surface, &job)?;
    let suspect = shapes::moved(signed.mesh(), &random_similarity(&surface, 1));
    let public_key = key.public_key();
    let verdict = Verifier::new(&surface, signed.certificate(), &public_key)?.verify(&suspect, &job)?;
    println!(
        "{} vertices, moved at random: ER {:.2} %",
        surface.vertex_count(),
        100.0 * verdict.extraction_rate.unwrap_or(f64::NAN)
    );
    ensure!(
        verdict.outcome == Outcome::Verified,
        "the signature was not read back from the marked surface"
    );
    println!("VERIFIED");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn without_python_it_does_what_it_can_and_fails_with_the_remedy_as_its_last_line() {
        let missing = anyhow!("No such file or directory").context("install Python 3.11 or later");
        let said = format!("{:#}", run(&missing).unwrap_err());
        assert!(said.contains("no tables"), "{said}");
        assert_eq!(said.lines().last(), Some("install Python 3.11 or later"));
    }
}
