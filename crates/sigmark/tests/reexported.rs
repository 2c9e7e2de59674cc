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

/// Reads a mark with a file that was given in place of the original.
fn is_read_with(given: &TriMesh, signed: &Signed) {
    let certificate = signed.certificate();
    let verifier = Verifier::for_owner(given, certificate, certificate.public_key()).unwrap();
    let verdict = verifier.verify(signed.mesh(), &Job::default()).unwrap();
    assert_eq!(verdict.outcome, Outcome::Verified, "{verdict:?}");
    assert!(matches!(verdict.compared_with, Compared::SameGeometry { residual } if residual < 6e-5));
    let components = mesh::components(given);
    for part in &verdict.parts {
        assert_eq!(components.of_vertex[part.vertex] as usize, part.part);
    }
}

#[test]
fn copies_of_parts_that_were_written_out_are_passed_over() {
    let mesh = original();
    let signed = signed(&mesh);
    let part = shapes::bumpy_sphere(4, 2);
    // Inside the box of the original; and outside, so that only unit and axes tell the pose.
    for away in [[0.0, 0.0, 2.0], [-9.0, 2.0, 0.0]] {
        let written_out = shapes::disjoint_union(&[shapes::translated(&part, away), mesh.clone()]);
        is_read_with(&exported(&written_out, 1e7, 3), &signed);
    }
}

#[test]
fn seams_that_another_program_split_are_closed() {
    let mesh = original();
    let signed = signed(&mesh);
    let split = shapes::jittered(&shapes::exploded(&mesh), 1e-8, 5);
    assert!(split.vertex_count() > 2 * mesh.vertex_count());
    is_read_with(&split, &signed);
}

#[test]
fn parts_that_another_program_moved_apart_by_a_rounding_touch_again() {
    // Two cubes on each other: in the original they have a face's corners in common.
    let cube = shapes::cube(2.0);
    let tower = |up: f64| shapes::disjoint_union(&[cube.clone(), shapes::translated(&cube, [0.0, 0.0, up])]);
    let welded = mesh::Welded::new(tower(2.0).positions(), tower(2.0).triangles()).unwrap();
    let touching = shapes::disjoint_union(&[
        shapes::bumpy_sphere(5, 1),
        shapes::translated(welded.mesh(), [3.0, 0.0, 0.0]),
    ]);
    let apart = shapes::disjoint_union(&[
        shapes::bumpy_sphere(5, 1),
        shapes::translated(&tower(2.0 + 1e-7), [3.0, 0.0, 0.0]),
    ]);
    assert_eq!(touching.vertex_count() + 4, apart.vertex_count());
    is_read_with(&apart, &signed(&touching));
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
