//! Models that their own joints and morph targets posed: read as they were before, by what was signed with them.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use decimation::{Decimator, decimate};
use job::Job;
use mesh::{BoundingBox, Rig, TriMesh, Vec3, shapes};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use registration::MatchedBy;
use sigmark::{
    Curve, Embedder, Outcome, Signed, SigningKey, Verdict, Verifier,
    claim::{Tracer, statistics::p_of_chosen},
    mark::{JointEstimator, Reader, ReadingMethod},
};

const JOINTS: u32 = 6;

fn key() -> SigningKey {
    SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([4; 32]))
}

/// A column with bumps, and joints up along it that share the vertices between them.
fn rigged() -> (TriMesh, Rig) {
    let mesh = shapes::bumpy_torus(90, 50, 3);
    let bounds = mesh.bounding_box();
    let weights = |p: &[f64; 3]| {
        let at = (p[0] - bounds.min[0]) / bounds.size()[0] * f64::from(JOINTS - 1);
        let joint = (at.floor() as u32).min(JOINTS - 2);
        let share = at - f64::from(joint);
        vec![(joint, 1.0 - share), (joint + 1, share)]
    };
    let rig = Rig::new(&mesh.positions().iter().map(weights).collect::<Vec<_>>());
    (mesh, rig)
}

/// Where a chain of joints takes a mesh that bends by so much at each of them.
fn posed(mesh: &TriMesh, rig: &Rig, angle: f64) -> TriMesh {
    let bounds = mesh.bounding_box();
    let turned = |joint: u32, v: usize| {
        let pivot = bounds.min[0] + bounds.size()[0] * f64::from(joint) / f64::from(JOINTS - 1);
        let (sin, cos) = (angle * f64::from(joint)).sin_cos();
        let Vec3([x, y, z]) = mesh.point(v) - Vec3([pivot, 0.0, 0.0]);
        Vec3([cos * x - sin * z + pivot, y, sin * x + cos * z])
    };
    let place = |v: usize| {
        let weights = rig.weights_of(v).iter();
        let sum: Vec3 = weights.map(|&(joint, weight)| turned(joint, v) * weight).sum();
        (sum * 2.5).into()
    };
    mesh.with_positions((0..mesh.vertex_count()).map(place).collect())
        .unwrap()
}

/// A long body with bumps, and four joints along it, each with a part that it moves alone.
fn limbed() -> (TriMesh, Rig) {
    let mesh = shapes::bumpy_sphere(5, 7);
    let long = |&[x, y, z]: &[f64; 3]| [4.0 * x, y, 0.8 * z + 0.1 * x * y];
    let mesh = mesh
        .with_positions(mesh.positions().iter().map(long).collect())
        .unwrap();
    let bounds = mesh.bounding_box();
    let weights = |p: &[f64; 3]| {
        let at = (p[0] - bounds.min[0]) / bounds.size()[0] * 4.0;
        let joint = (at - 0.5).floor().clamp(0.0, 2.0);
        let share = (3.0 * (at - joint - 1.0) + 0.5).clamp(0.0, 1.0);
        vec![(joint as u32, 1.0 - share), (joint as u32 + 1, share)]
    };
    let rig = Rig::new(&mesh.positions().iter().map(weights).collect::<Vec<_>>());
    (mesh, rig)
}

/// That body, each joint turned by 23 degrees against the one before.
fn turned(mesh: &TriMesh, rig: &Rig) -> TriMesh {
    let bounds = mesh.bounding_box();
    let (sin, cos) = 0.4_f64.sin_cos();
    let turned = |joint: u32, p: Vec3| {
        (0..joint).rev().fold(p, |p, before| {
            let pivot = Vec3::X * (bounds.min[0] + bounds.size()[0] * f64::from(before + 1) / 4.0);
            let Vec3([x, y, z]) = p - pivot;
            pivot + Vec3([cos * x - sin * z, y, sin * x + cos * z])
        })
    };
    let place = |v: usize| {
        let weights = rig.weights_of(v).iter();
        let sum: Vec3 = weights
            .map(|&(joint, weight)| turned(joint, mesh.point(v)) * weight)
            .sum();
        (sum * 0.3).into()
    };
    mesh.with_positions((0..mesh.vertex_count()).map(place).collect())
        .unwrap()
}

fn signed() -> (TriMesh, Rig, Signed) {
    let (mesh, rig) = rigged();
    let signed = signed_with(&mesh, Some(&rig));
    (mesh, rig, signed)
}

fn signed_with(mesh: &TriMesh, rig: Option<&Rig>) -> Signed {
    let key = key();
    let embedder = Embedder::new(&key).rig(rig);
    let signed = embedder.embed(mesh, &Job::default()).unwrap();
    signed.original().keep_bases(&Job::default()).unwrap();
    signed
}

fn judged(rig: Option<Rig>, signed: &Signed, suspect: &TriMesh) -> Verdict {
    let certificate = signed.certificate();
    let verifier = Verifier::with_original(signed.original(), certificate, certificate.public_key());
    let verifier = verifier.unwrap().with_rig(rig);
    verifier.verify(suspect, &Job::default()).unwrap()
}

#[test]
fn a_posed_copy_is_verified_in_any_order_of_its_vertices() {
    let (_, rig, signed) = signed();
    for angle in [0.35, 0.5] {
        let suspect = shapes::shuffled(&posed(signed.mesh(), &rig, angle), 5);
        let verdict = judged(Some(rig.clone()), &signed, &suspect);
        // Local frames read it, too; by the rig more is left.
        assert_eq!(
            (verdict.outcome, verdict.matched_by),
            (Outcome::Verified, MatchedBy::Rig)
        );
        assert!(verdict.overlap > 0.99 && verdict.mismatch.is_none());
        assert!(verdict.is_evidence() && !verdict.is_for_owner_alone());
    }
    let suspect = posed(signed.mesh(), &rig, 0.35);
    let without = judged(None, &signed, &suspect);
    assert!(without.is_evidence() && without.matched_by == MatchedBy::LocalFrames);
}

#[test]
fn what_was_not_posed_is_read_as_ever_and_counts_both_ways() {
    let (_, rig, signed) = signed();
    let with = judged(Some(rig), &signed, signed.mesh());
    let without = judged(None, &signed, signed.mesh());
    assert_eq!(with.matched_by, MatchedBy::Connectivity);
    assert_eq!(with.p_value, 2.0 * without.p_value);
    assert!(with.is_evidence());
}

#[test]
fn a_posed_copy_is_found_after_it_was_decimated_or_cut() {
    let (mesh, rig) = limbed();
    let signed = signed_with(&mesh, Some(&rig));
    let suspect = turned(signed.mesh(), &rig);
    let decimated = decimate(&suspect, 8000, Decimator::ALL[0], &Job::default()).unwrap();
    let verdict = judged(Some(rig.clone()), &signed, &decimated);
    assert_eq!(verdict.matched_by, MatchedBy::RigSurface);
    assert!(
        verdict.is_evidence() && verdict.p_value < 1e-12,
        "{}",
        verdict.p_value
    );

    // What a cut left has its vertices.
    let kept = suspect.triangles()[..suspect.triangle_count() / 2].to_vec();
    let cut = TriMesh::new(suspect.positions().to_vec(), kept).unwrap();
    let verdict = judged(Some(rig.clone()), &signed, &shapes::shuffled(&cut, 2));
    assert_eq!(verdict.matched_by, MatchedBy::Rig);
    assert!(
        verdict.is_evidence() && verdict.p_value < 1e-12,
        "{}",
        verdict.p_value
    );
    assert!(verdict.coverage < 0.7, "{}", verdict.coverage);

    // Without a mark there is nothing to be found, and on a rig that was not signed nobody is brought back.
    let unmarked = decimate(
        &posed(&mesh, &rig, 0.35),
        5000,
        Decimator::ALL[0],
        &Job::default(),
    )
    .unwrap();
    assert!(!judged(Some(rig.clone()), &signed, &unmarked).outcome.is_found());
    let plain = signed_with(&mesh, None);
    let suspect = turned(plain.mesh(), &rig);
    let decimated = decimate(&suspect, 8000, Decimator::ALL[0], &Job::default()).unwrap();
    assert!(!judged(Some(rig), &plain, &decimated).outcome.is_found());
}

/// The forger's chair: who may choose a rig once he knows his bits makes an unmarked model bear them. So a rig counts that was signed, and bits follow from a hash over that signature's statement: with the same rig
/// signed first, they are others.
#[test]
fn a_rig_that_was_made_for_the_bits_is_passed_over_or_too_late() {
    let (mesh, rig, signed) = signed();
    let suspect = posed(&mesh, &rig, FORGED);
    let forged = forged_for(&mesh, &rig, &signed, &suspect);
    let certificate = signed.certificate();
    assert!(certificate.binds(&rig) && !certificate.binds(&forged));
    // The attack would work: brought back by that rig, an unmarked model has the mark.
    let reader = Reader::new(&mesh).unwrap();
    let found = reader.find(&suspect, &Job::default()).unwrap();
    let unposed = found.unposed(&forged, &Job::default()).unwrap().unwrap();
    let plain = signed_with(&mesh, None);
    let verdict_on =
        |signed: &Signed, rig: &Rig, suspect: &TriMesh| judged(Some(rig.clone()), signed, suspect);
    let method = ReadingMethod::joint(JointEstimator::new(signed.layout()).into());
    let bits = certificate.bits();
    let reading = unposed.read(&method, &bits, &Job::default()).unwrap();
    let p = p_of_chosen(&bits, &reading);
    assert!(p < 1e-6, "{p}");

    // Made after the signature: not used.
    let after = verdict_on(&signed, &forged, &suspect);
    assert!(!after.outcome.is_found() && after.matched_by != MatchedBy::Rig);
    // Of a claim that binds no rig: not used.
    assert!(!plain.certificate().binds(&forged) && !plain.certificate().binds(&rig));
    assert!(!verdict_on(&plain, &forged, &suspect).outcome.is_found());
    // Signed: used, and the bits are others now.
    let again = signed_with(&mesh, Some(&forged));
    assert!(again.certificate().binds(&forged));
    let before = verdict_on(&again, &forged, &suspect);
    assert!(!before.outcome.is_found(), "{}", before.p_value);
    // An unmarked model has no mark in any pose.
    assert!(!verdict_on(&signed, &rig, &suspect).outcome.is_found());
}

/// A rig of which the weights are bent until an unmarked model in this pose comes back with a mark.
fn forged_for(mesh: &TriMesh, rig: &Rig, signed: &Signed, suspect: &TriMesh) -> Rig {
    let bounds = mesh.bounding_box();
    let weights = |v: usize| {
        let own = rig.weights_of(v);
        let wanted = signed.mesh().point(v);
        // Of the two joints' shares those that put the marked vertex nearest to where the unmarked one is seen.
        let at = |share: f64| {
            let [(a, _), (b, _)] = [own[0], *own.last().unwrap()];
            let there = posed_point(&bounds, wanted, &[(a, 1.0 - share), (b, share)], FORGED);
            (there - suspect.point(v)).squared()
        };
        let share = own.last().unwrap().1;
        let best = (0..=200).map(|i| (share - 0.05 + 5e-4 * f64::from(i)).clamp(0.0, 1.0));
        let best = best.min_by(|a, b| at(*a).total_cmp(&at(*b))).unwrap();
        vec![(own[0].0, 1.0 - best), (own.last().unwrap().0, best)]
    };
    Rig::new(&(0..mesh.vertex_count()).map(weights).collect::<Vec<_>>())
}

/// How far the forger's joints turn.
const FORGED: f64 = 0.6;

/// Where joints along a mesh of these bounds take one point.
fn posed_point(bounds: &BoundingBox, point: Vec3, weights: &[(u32, f64)], angle: f64) -> Vec3 {
    let turned = |&(joint, weight): &(u32, f64)| {
        let pivot = bounds.min[0] + bounds.size()[0] * f64::from(joint) / f64::from(JOINTS - 1);
        let (sin, cos) = (angle * f64::from(joint)).sin_cos();
        let Vec3([x, y, z]) = point - Vec3([pivot, 0.0, 0.0]);
        Vec3([cos * x - sin * z + pivot, y, sin * x + cos * z]) * weight
    };
    weights.iter().map(turned).sum::<Vec3>() * 2.5
}

#[test]
fn another_model_of_the_same_triangles_is_not_found_by_any_pose() {
    let (_, rig, signed) = signed();
    let other = shapes::bumpy_torus(90, 50, 8);
    let verdict = judged(Some(rig.clone()), &signed, &posed(&other, &rig, 0.3));
    assert!(!verdict.outcome.is_found());
}

/// The forger's chair. A mark can be copied onto any figure of the same triangles. One that the original's joints could make by stretching, as bodies of one template are, counts as a pose; it can't be told that it was not made of a signed copy.
#[test]
fn a_mark_that_was_copied_onto_a_figure_of_other_proportions_is_found_there() {
    let (mesh, rig, signed) = signed();
    let figure = |girths: [f64; 6]| {
        let place = |v: usize| {
            let copied = Vec3(signed.mesh().positions()[v]) - mesh.point(v);
            let weights = rig.weights_of(v).iter();
            let wide: f64 = weights
                .map(|&(joint, weight)| girths[joint as usize] * weight)
                .sum();
            let Vec3([x, y, z]) = mesh.point(v);
            (Vec3([x, wide * y, wide * z]) + copied).into()
        };
        let places = (0..mesh.vertex_count()).map(place).collect();
        mesh.with_positions(places).unwrap()
    };
    let other = figure([1.6, 0.7, 1.3, 0.6, 1.5, 0.8]);
    let verdict = judged(Some(rig.clone()), &signed, &other);
    assert_eq!(
        (verdict.outcome, verdict.matched_by),
        (Outcome::Verified, MatchedBy::Rig)
    );
    // Local frames bear as much, but not three times more.
    let bare = judged(None, &signed, &other);
    assert!(bare.outcome.is_found() && bare.matched_by == MatchedBy::LocalFrames);
    let bare = judged(None, &signed, &figure([4.0, 0.4, 2.2, 0.2, 3.5, 0.5]));
    assert!(!bare.outcome.is_found() && bare.mismatch.is_some());
}

#[test]
fn a_posed_copy_names_its_buyer() {
    let ((mesh, rig), job) = (rigged(), Job::default());
    let key = key();
    let embedder = Embedder::new(&key).rig(Some(&rig));
    let prepared = embedder.prepare(&mesh, &job).unwrap();
    let mut tracer = Tracer::new(&mesh, &key.public_key())
        .unwrap()
        .with_rig(Some(rig.clone()));
    let mut copies = Vec::new();
    for buyer in ["Anna", "Bert", "Carl"] {
        let copy = prepared.embed_for(buyer, &job).unwrap();
        tracer.add(&copy.certificate().clone().into()).unwrap();
        copies.push(copy.mesh().clone());
    }
    let trace = tracer.trace(posed(&copies[2], &rig, 0.3), &job).unwrap();
    let named: Vec<usize> = trace.accused.iter().map(|accused| accused.candidate).collect();
    assert_eq!((named, trace.matched_by), (vec![2], MatchedBy::Rig));
    let nobody = tracer.trace(posed(&mesh, &rig, 0.3), &job).unwrap();
    assert!(nobody.accused.is_empty());
}
