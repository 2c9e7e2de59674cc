//! What each part of the joint estimate is worth.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use decimation::{Decimator, decimate};
use job::Job;
use mesh::{Similarity, TriMesh, shapes};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use sigmark::{
    Curve, Embedder, Signed, SigningKey,
    claim::statistics::margin,
    mark::{JointEstimator, JointModel, Reader},
};

/// By about a twentieth of a degree, and a thousandth of the size.
fn nearly_nothing() -> Similarity {
    Similarity {
        scale: 1.0005,
        translation: [1e-3, 0.0, -5e-4],
        ..Similarity::from_quaternion([1.0, 4e-4, 0.0, -3e-4])
    }
}

/// T₀ of a suspect's surface under a pose, by an estimate that knows so much.
fn margin_of(signed: &Signed, suspect: &TriMesh, pose: &Similarity, model: JointModel) -> f64 {
    let job = Job::default();
    let suspect = Reader::new(signed.original().mesh()).unwrap().surface(suspect);
    let sampled = suspect.sample(pose, &job).unwrap();
    let estimator = JointEstimator::new(signed.layout()).with_model(model);
    let estimate = estimator.estimate(&sampled, &job).unwrap();
    margin(&signed.certificate().bits(), &estimate.soft.weights())
}

#[test]
fn each_part_of_the_estimate_reads_more() {
    let (mesh, job) = (shapes::bumpy_sphere(4, 9), Job::default());
    let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([1; 32]));
    let signed = Embedder::new(&key).embed(&mesh, &job).unwrap();
    signed.original().keep_bases(&job).unwrap();

    let of = |suspect: &TriMesh, pose: &Similarity, model| margin_of(&signed, suspect, pose, model);
    let divided = shapes::flipped(signed.mesh(), 7);
    let [plain, aware] =
        [JointModel::Bits, JointModel::Interference].map(|model| of(&divided, &nearly_nothing(), model));
    assert!(aware > 2.0 * plain, "misaligned: {plain} {aware}");

    let coarse = decimate(signed.mesh(), mesh.triangle_count() / 4, Decimator::ALL[0], &job).unwrap();
    let models = [
        JointModel::Bits,
        JointModel::Interference,
        JointModel::Shape,
        JointModel::Noise,
    ];
    let margins = models.map(|model| of(&coarse, &Similarity::IDENTITY, model));
    assert!(margins[3] > margins[0], "decimated: {margins:?}");
    assert_eq!(JointModel::default(), JointModel::Noise);
}
