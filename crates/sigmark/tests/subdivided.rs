//! Models that were subdivided: as whole, or after something else was done to them.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use std::{f64::consts::FRAC_PI_2, sync::OnceLock};

use decimation::{Decimator, decimate};
use job::Job;
use mesh::{Edges, Subdivision, TriMesh, Vec3, shapes, undivided};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use registration::MatchedBy;
use sigmark::{Curve, Embedder, Outcome, Signed, SigningKey, Verdict, Verifier};

const RULES: [Subdivision; 2] = [Subdivision::Midpoint, Subdivision::Loop];

fn original() -> TriMesh {
    shapes::bumpy_torus(100, 60, 3)
}

fn sign(mesh: &TriMesh) -> Signed {
    let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([4; 32]));
    Embedder::new(&key).embed(mesh, &Job::default()).unwrap()
}

fn signed() -> &'static Signed {
    static SIGNED: OnceLock<Signed> = OnceLock::new();
    SIGNED.get_or_init(|| sign(&original()))
}

fn judged_by(original: &TriMesh, signed: &Signed, suspect: &TriMesh) -> Verdict {
    let certificate = signed.certificate();
    let verifier = Verifier::new(original, certificate, certificate.public_key()).unwrap();
    verifier.verify(suspect, &Job::default()).unwrap()
}

fn judged(suspect: &TriMesh) -> Verdict {
    judged_by(&original(), signed(), suspect)
}

/// In other units, with vertices and triangles in another order.
fn exported(mesh: &TriMesh) -> TriMesh {
    shapes::scaled(&shapes::shuffled(mesh, 5), 100.0)
}

#[test]
fn a_subdivided_copy_has_all_vertices_that_it_was_made_of() {
    for rule in RULES {
        let once = rule.of(signed().mesh());
        for suspect in [exported(&once), exported(&rule.of(&once))] {
            let verdict = judged(&suspect);
            assert_eq!(
                (verdict.outcome, verdict.matched_by),
                (Outcome::Verified, MatchedBy::Connectivity),
                "{rule:?}"
            );
        }
        assert!(!judged(&exported(&rule.of(&original()))).outcome.is_found());
    }
}

/// What little of a mark a coarse copy has is not smoothed away by the rule that made it fine.
#[test]
fn a_decimated_copy_that_was_subdivided_tells_as_much_as_before() {
    let coarse = decimate(signed().mesh(), 1800, Decimator::Queue, &Job::default()).unwrap();
    let before = judged(&exported(&coarse)).margin.unwrap();
    for rule in RULES {
        let after = judged(&exported(&rule.of(&coarse))).margin.unwrap();
        assert!(before > 7.0 && after > 0.95 * before, "{after} of {before}");
    }
}

#[test]
fn a_bent_copy_that_was_subdivided_is_read_in_local_frames() {
    let bounds = signed().mesh().bounding_box();
    let twisted = |v: usize| {
        let Vec3([x, y, z]) = signed().mesh().point(v);
        let (sin, cos) = ((x - bounds.min[0]) / bounds.size()[0] * FRAC_PI_2).sin_cos();
        [x, cos * y - sin * z, sin * y + cos * z]
    };
    let positions = (0..signed().mesh().vertex_count()).map(twisted).collect();
    let bent = signed().mesh().with_positions(positions).unwrap();
    let verdict = judged(&exported(&Subdivision::Loop.of(&bent)));
    assert_eq!(verdict.matched_by, MatchedBy::LocalFrames);
    assert!(verdict.p_value < 1e-12, "{}", verdict.p_value);
}

/// Its tiles are its own: what was written on all vertices is read at all of them.
#[test]
fn of_an_original_that_was_subdivided_itself_nothing_is_undone() {
    let original = Subdivision::Loop.of(&shapes::bumpy_torus(50, 30, 3));
    let signed = sign(&original);
    let (copy, finer) = (
        exported(signed.mesh()),
        exported(&Subdivision::Loop.of(signed.mesh())),
    );
    for suspect in [copy, shapes::jittered(&exported(signed.mesh()), 0.001, 1), finer] {
        let verdict = judged_by(&original, &signed, &suspect);
        assert_eq!(
            (verdict.outcome, verdict.matched_by),
            (Outcome::Verified, MatchedBy::Connectivity)
        );
    }
}

/// By the rule √3 without its smoothing: three triangles around the middle of each, and the edges that were there before turned.
fn by_root_3(mesh: &TriMesh) -> TriMesh {
    let count = mesh.vertex_count();
    let edges = Edges::of(mesh);
    let middles =
        (0..mesh.triangle_count()).map(|t| (mesh.corners(t).into_iter().sum::<Vec3>() / 3.0).into());
    let mut triangles = Vec::new();
    for (t, (corners, sides)) in mesh.triangles().iter().zip(edges.of_triangle()).enumerate() {
        for (&corner, &side) in corners.iter().zip(sides) {
            let beyond = edges
                .triangles(side as usize)
                .iter()
                .map(|&s| s as usize)
                .find(|&s| s != t);
            triangles.push([corner, (count + beyond.unwrap()) as u32, (count + t) as u32]);
        }
    }
    let positions = mesh.positions().iter().copied().chain(middles).collect();
    TriMesh::new(positions, triangles).unwrap()
}

/// What is cut into tiles by chance, nearly where a rule has it, has more to say than what it would have been made of.
#[test]
fn another_rule_on_an_original_that_was_subdivided_is_no_subdivision_in_four() {
    let original = Subdivision::Loop.of(&shapes::bumpy_torus(50, 30, 3));
    let signed = sign(&original);
    let suspect = exported(&by_root_3(signed.mesh()));
    let undone = undivided(&suspect).unwrap();
    assert!((1e-4..0.03).contains(&undone.residual), "{}", undone.residual);
    let verdict = judged_by(&original, &signed, &suspect);
    assert_eq!(
        (verdict.outcome, verdict.matched_by),
        (Outcome::Verified, MatchedBy::Surface)
    );
    let of_undone = judged_by(&original, &signed, &undone.mesh);
    assert!(verdict.margin > of_undone.margin, "{:?}", of_undone.margin);
}

/// One of two parts, with all of its tiles.
#[test]
fn a_part_of_an_original_that_was_subdivided_keeps_its_vertices() {
    let part = |seed| Subdivision::Midpoint.of(&shapes::bumpy_torus(50, 30, seed));
    let (first, second) = (part(3), shapes::translated(&part(4), [9.0, 0.0, 0.0]));
    let original = shapes::disjoint_union(&[first.clone(), second]);
    let signed = sign(&original);
    let alone = TriMesh::new(
        signed.mesh().positions()[..first.vertex_count()].to_vec(),
        signed.mesh().triangles()[..first.triangle_count()].to_vec(),
    );
    let verdict = judged_by(&original, &signed, &exported(&alone.unwrap()));
    assert_eq!(
        (verdict.outcome, verdict.matched_by),
        (Outcome::Verified, MatchedBy::Surroundings)
    );
}
