//! Scenes of several parts, of which one turns up alone, two together, one scaled, or all somewhere else.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use job::Job;
use mesh::{Similarity, TriMesh, components, shapes};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use registration::MatchedBy;
use sigmark::{Curve, Embedder, Outcome, SigningKey, Verdict, Verifier};

/// Five parts of 1 500 to 2 600 vertices, two of which are alike.
fn scene() -> TriMesh {
    let wheel = shapes::bumpy_torus(60, 30, 2);
    shapes::disjoint_union(&[
        shapes::bumpy_sphere(4, 1),
        shapes::translated(&wheel, [6.0, 0.0, 0.0]),
        shapes::translated(&wheel, [6.0, 8.0, 0.0]),
        shapes::translated(&shapes::bumpy_block(1, 8, 3), [0.0, 9.0, 0.0]),
        shapes::translated(&shapes::bumpy_torus(50, 40, 5), [-8.0, 0.0, 0.0]),
    ])
}

struct Signed {
    marked: TriMesh,
    verifier: Verifier,
}

fn signed() -> Signed {
    let (scene, job) = (scene(), Job::default());
    let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([7; 32]));
    let signed = Embedder::new(&key)
        .message("a scene")
        .embed(&scene, &job)
        .unwrap();
    Signed {
        marked: scene.with_positions(signed.positions().to_vec()).unwrap(),
        verifier: Verifier::new(&scene, signed.certificate(), &key.public_key()).unwrap(),
    }
}

impl Signed {
    fn verify(&self, suspect: &TriMesh) -> Verdict {
        self.verifier.verify(suspect, &Job::default()).unwrap()
    }
}

/// The connected parts of a mesh, by number.
fn parts(mesh: &TriMesh) -> Vec<TriMesh> {
    let of_vertex = components(mesh).of_vertex;
    (0..components(mesh).count as u32)
        .map(|part| {
            let of_part = mesh
                .triangles()
                .iter()
                .filter(|corners| of_vertex[corners[0] as usize] == part);
            let triangles: Vec<[u32; 3]> = of_part.copied().collect();
            mesh::Welded::new(mesh.positions(), &triangles)
                .unwrap()
                .into_mesh()
        })
        .collect()
}

fn turned(by: f64, scale: f64, translation: [f64; 3]) -> Similarity {
    Similarity {
        scale,
        translation,
        ..Similarity::from_quaternion([1.0, by, -0.4, 0.2])
    }
}

fn names(verdict: &Verdict) -> Vec<usize> {
    let mut parts: Vec<usize> = verdict.parts.iter().map(|part| part.part).collect();
    parts.sort_unstable();
    parts
}

#[test]
fn a_part_alone_tells_whose_the_scene_is_and_which_part_it_was() {
    let signed = signed();
    for (part, alone) in parts(&signed.marked).iter().enumerate() {
        let alone = shapes::shuffled(&shapes::moved(alone, &turned(0.8, 3.0, [5.0, 1.0, 0.0])), 3);
        let verdict = signed.verify(&alone);
        assert!(
            verdict.outcome.is_found() && verdict.p_value < 1e-12,
            "part {part}: {verdict:?}"
        );
        assert_eq!(
            names(&verdict),
            [part],
            "of two wheels that are alike, the bits say which"
        );
        assert_eq!(verdict.marked_parts, 5);
    }
}

/// Where it lies, it says nothing: its bits are those of the other wheel.
#[test]
fn a_wheel_with_other_triangles_in_the_place_of_the_other_is_read_as_itself() {
    let signed = signed();
    let wheel = shapes::flipped(&shapes::divided(&parts(&signed.marked)[2]), 5);
    for place in [[0.0; 3], [0.0, -8.0, 0.0]] {
        let verdict = signed.verify(&shapes::translated(&wheel, place));
        assert!(
            verdict.outcome.is_found() && verdict.p_value < 1e-12,
            "{verdict:?}"
        );
        assert_eq!(names(&verdict), [2]);
    }
}

#[test]
fn parts_that_all_went_different_ways_are_read_together() {
    let signed = signed();
    let apart: Vec<TriMesh> = parts(&signed.marked)
        .iter()
        .enumerate()
        .map(|(i, part)| {
            shapes::moved(
                part,
                &turned(0.4 * i as f64, 1.0 + 0.3 * i as f64, [9.0 * i as f64, 0.0, 3.0]),
            )
        })
        .collect();
    let apart = shapes::disjoint_union(&apart);
    // In the file's order its vertices are recognised, too, and say that it is another shape.
    for suspect in [shapes::shuffled(&apart, 5), apart] {
        let verdict = signed.verify(&suspect);
        assert!(verdict.is_evidence(), "{verdict:?}");
        assert_eq!(verdict.matched_by, MatchedBy::Parts);
        assert_eq!(names(&verdict), [0, 1, 2, 3, 4]);
        let is_whole = |part: &sigmark::FoundPart| part.transform.is_some() && part.seen > 0.9;
        assert!(verdict.parts.iter().all(is_whole));
    }
}

#[test]
fn a_part_that_was_scaled_alone_does_not_hide_the_others() {
    let signed = signed();
    let mut apart = parts(&signed.marked);
    apart[0] = shapes::moved(&apart[0], &turned(0.0, 1.7, [0.0; 3]));
    let verdict = signed.verify(&shapes::disjoint_union(&apart));
    assert!(verdict.is_evidence(), "{verdict:?}");
    assert!(names(&verdict).len() >= 4);
}

#[test]
fn two_parts_in_another_scene_are_found_there() {
    let signed = signed();
    let own = parts(&signed.marked);
    let moved = |part: &TriMesh, x: f64| shapes::moved(part, &turned(x, 0.5, [x, 40.0, 0.0]));
    let suspect = shapes::disjoint_union(&[
        shapes::bumpy_sphere(4, 77),
        moved(&own[3], 20.0),
        shapes::bumpy_torus(70, 30, 78),
        moved(&own[0], 60.0),
        shapes::cube(3.0),
    ]);
    let verdict = signed.verify(&suspect);
    assert!(
        verdict.outcome.is_found() && verdict.p_value < 1e-12,
        "{verdict:?}"
    );
    assert_eq!(names(&verdict), [0, 3]);
    assert!(verdict.overlap < 0.8, "most of it is not ours");
}

#[test]
fn parts_without_the_mark_prove_nothing() {
    let signed = signed();
    let unmarked = scene();
    for suspect in [
        shapes::disjoint_union(
            &parts(&unmarked)
                .iter()
                .enumerate()
                .map(|(i, part)| shapes::moved(part, &turned(i as f64, 2.0, [30.0 * i as f64, 0.0, 0.0])))
                .collect::<Vec<_>>(),
        ),
        parts(&unmarked)[1].clone(),
    ] {
        let verdict = signed.verify(&suspect);
        assert!(
            !verdict.outcome.is_found() && verdict.p_value > 1e-4,
            "{verdict:?}"
        );
    }
    let strangers = shapes::disjoint_union(&[shapes::bumpy_sphere(4, 50), shapes::bumpy_torus(60, 30, 51)]);
    assert!(matches!(
        signed.verify(&strangers).outcome,
        Outcome::NotFound { .. }
    ));
}
