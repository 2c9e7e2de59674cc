//! One original, many recipients.

use std::sync::Arc;

use job::Job;
use mesh::shapes;
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use sigmark::{Curve, Embedder, Outcome, Prepared, SigmarkError, SigningKey, Verifier, mark::MarkError};

fn embedder() -> Embedder {
    let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([4; 32]));
    Embedder::new(&key)
        .message("© 2026 Studio")
        .original_name("ball.obj")
}

#[test]
fn a_copy_is_what_its_recipient_alone_would_have_got() {
    let (mesh, job) = (shapes::bumpy_sphere(4, 9), Job::default());
    let prepared = embedder().prepare(&mesh, &job).unwrap();
    let names = ["order 4711", "order 4712", ""];
    // From several threads, and whoever comes first.
    let made = |prepared: &Prepared, name: &str| prepared.embed_for(name, &job).unwrap();
    let copies = Job::new(3)
        .map(names.len(), 1, |i| made(&prepared, names[i]))
        .unwrap();
    let cold = embedder()
        .prepare_in(&Arc::new(embedder().cut(&mesh, &job).unwrap()))
        .unwrap();
    for (name, copy) in names.iter().zip(&copies) {
        let alone = embedder().recipient(*name).embed(&mesh, &job).unwrap();
        for other in [&alone, &made(&prepared, name), &made(&cold, name)] {
            assert!(copy.positions() == other.positions(), "{name}");
            assert!(copy.certificate() == other.certificate(), "{name}");
        }
        assert_eq!(copy.certificate().statement(), &prepared.statement_for(name));
    }
    for (i, copy) in copies.iter().enumerate() {
        let verifier = Verifier::new(&mesh, copy.certificate(), copy.certificate().public_key()).unwrap();
        for (j, suspect) in copies.iter().enumerate() {
            let outcome = verifier.verify(suspect.mesh(), &job).unwrap().outcome;
            assert_eq!(outcome == Outcome::Verified, i == j, "{outcome:?}");
        }
    }
}

#[test]
fn what_is_prepared_is_foretold_and_refused_as_a_single_copy_is() {
    let (mesh, job) = (shapes::bumpy_sphere(4, 9), Job::default());
    let original = Arc::new(embedder().cut(&mesh, &job).unwrap());
    let prepared = embedder().prepare_in(&original).unwrap();
    assert_eq!(prepared.prediction(), embedder().predict(&original).unwrap());
    let refused = embedder().chip_rate(0).prepare(&mesh, &job);
    assert!(
        matches!(refused, Err(SigmarkError::Mark(MarkError::EmptyLayout { .. }))),
        "{refused:?}"
    );
}
