//! An original that was written anew by another program: recognised, read for its owner, and no ground for a claim.

#![allow(clippy::unwrap_used)]

use job::Job;
use mesh::{TriMesh, shapes};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use sigmark::{Compared, Curve, Embedder, Outcome, SigmarkError, Signed, SigningKey, Verifier};

fn original() -> TriMesh {
    shapes::disjoint_union(&[
        shapes::bumpy_sphere(5, 1),
        shapes::translated(&shapes::bumpy_sphere(4, 2), [3.0, 1.0, 0.5]),
        shapes::translated(&shapes::tetrahedron(), [0.0, 0.0, 4.0]),
    ])
}

fn signed(mesh: &TriMesh) -> Signed {
    let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([7; 32]));
    let embedder = Embedder::new(&key).message("mine");
    embedder.embed(mesh, &Job::default()).unwrap()
}

/// z upward became y upward, metres became millimetres, coordinates have so many steps along the longest edge.
fn exported(mesh: &TriMesh, steps: f64, seed: u64) -> TriMesh {
    let moved = mesh
        .positions()
        .iter()
        .map(|[x, y, z]| [1e3 * x, 1e3 * z, -1e3 * y]);
    let step = 1e3 * mesh.bounding_box().size().into_iter().fold(0.0, f64::max) / steps;
    let rounded = moved.map(|p| p.map(|x| (x / step).round() * step));
    shapes::shuffled(&mesh.with_positions(rounded.collect()).unwrap(), seed)
}

#[test]
fn the_same_geometry_reads_the_mark_and_is_no_evidence() {
    let (mesh, job) = (original(), Job::default());
    let signed = signed(&mesh);
    let certificate = signed.certificate();
    let key = certificate.public_key();
    let of_original = Verifier::new(&mesh, certificate, key).unwrap();
    assert_eq!(
        of_original.verify(signed.mesh(), &job).unwrap().compared_with,
        Compared::Original
    );
    for (steps, seed) in [(1e7, 1), (2f64.powi(14), 2)] {
        let given = exported(&mesh, steps, seed);
        assert!(matches!(
            Verifier::new(&given, certificate, key).unwrap_err(),
            SigmarkError::AnotherOriginal { .. }
        ));
        let verifier = Verifier::for_owner(&given, certificate, key).unwrap();
        let suspect = shapes::scaled(signed.mesh(), 0.1);
        let verdict = verifier.verify(&suspect, &job).unwrap();
        assert_eq!(verdict.outcome, Outcome::Verified, "{steps}: {verdict:?}");
        assert!(matches!(verdict.compared_with, Compared::SameGeometry { residual } if residual < 6e-5));
        assert!(!verdict.is_evidence() && verdict.p_dispute() == 1.0);
        // It leads onto the given file, and parts are told by that file's vertices.
        let transform = verdict.transform.unwrap();
        let moved = transform.apply_all(suspect.positions());
        let there = given.bounding_box();
        let here = mesh::BoundingBox::of(&moved);
        for axis in 0..3 {
            let apart = (here.min[axis] - there.min[axis]).abs() + (here.max[axis] - there.max[axis]).abs();
            assert!(apart < 1e-2 * there.diagonal(), "{here:?} {there:?}");
        }
        let components = mesh::components(&given);
        assert_eq!(verdict.parts.len(), 2);
        for part in &verdict.parts {
            assert_eq!(components.of_vertex[part.vertex] as usize, part.part);
        }
    }
}

#[test]
fn a_signed_copy_and_another_shape_are_no_originals() {
    let mesh = original();
    let signed = signed(&mesh);
    let (certificate, key) = (signed.certificate(), signed.certificate().public_key());
    let smooth = shapes::jittered(&mesh, 0.05, 1);
    for other in [
        signed.mesh().clone(),
        shapes::shuffled(signed.mesh(), 3),
        exported(signed.mesh(), 1e7, 4),
        smooth,
        shapes::bumpy_sphere(5, 1),
    ] {
        let error = Verifier::for_owner(&other, certificate, key).unwrap_err();
        assert!(matches!(error, SigmarkError::AnotherOriginal { .. }), "{error}");
    }
}
