//! Small models: what they have room for, what is read of them, and that it was foretold.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use std::sync::Arc;

use job::Job;
use mesh::{Similarity, TriMesh, shapes};
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use sigmark::{
    Curve, Embedder, Outcome, PayloadKind, Signed, SigningKey, Strength, Verdict, Verifier,
    claim::statistics::margin,
    mark::{Detector, JointEstimator, MarkError, MarkLayout, Registered},
};

fn embedder() -> Embedder {
    Embedder::new(&SigningKey::generate(
        Curve::P256,
        &mut ChaCha20Rng::from_seed([1; 32]),
    ))
}

fn judge(signed: &Signed, suspect: &TriMesh) -> Verdict {
    let certificate = signed.certificate();
    let verifier = Verifier::with_original(signed.original(), certificate, certificate.public_key());
    verifier.unwrap().verify(suspect, &Job::default()).unwrap()
}

/// Each coordinate off by a uniform amount of up to `share` of the bounding box's edge, as the paper's noise.
fn noisy(mesh: &TriMesh, share: f64, seed: u8) -> TriMesh {
    let mut rng = ChaCha20Rng::from_seed([seed; 32]);
    let edges = mesh.bounding_box().size();
    let mut off =
        |axis: usize| share * edges[axis] * (2.0 * (f64::from(rng.next_u32()) / f64::from(u32::MAX)) - 1.0);
    let moved = mesh
        .positions()
        .iter()
        .map(|p| std::array::from_fn(|axis| p[axis] + off(axis)));
    mesh.with_positions(moved.collect()).unwrap()
}

/// Coordinates as whole numbers of steps, of which the box has so many.
fn quantised(mesh: &TriMesh, bits: i32) -> TriMesh {
    let bounds = mesh.bounding_box();
    let (steps, edges) = (2f64.powi(bits) - 1.0, bounds.size());
    let of = |p: &[f64; 3]| {
        std::array::from_fn(|axis| {
            let step = edges[axis] / steps;
            bounds.min[axis] + step * ((p[axis] - bounds.min[axis]) / step).round()
        })
    };
    mesh.with_positions(mesh.positions().iter().map(of).collect())
        .unwrap()
}

fn moved(mesh: &TriMesh) -> TriMesh {
    let away = Similarity {
        scale: 0.03,
        translation: [4.0, -1.0, 2.0],
        ..Similarity::from_quaternion([0.3, -0.5, 0.7, 0.1])
    };
    shapes::shuffled(&shapes::moved(mesh, &away), 3)
}

/// Eighty parts of which none has room for a tenth of a signature.
fn scene() -> TriMesh {
    let part = |i: usize| {
        let at = [1.7 * (i % 9) as f64, 1.9 * (i / 9) as f64, 0.3 * (i % 4) as f64];
        let scale = 0.5 + 0.05 * (i % 7) as f64;
        shapes::translated(&shapes::scaled(&shapes::bumpy_block(0, 2, i as u64), scale), at)
    };
    shapes::disjoint_union(&(0..80).map(part).collect::<Vec<_>>())
}

#[test]
fn a_mark_of_a_thousand_vertices_outlasts_moving_rounding_and_noise() {
    for mesh in [
        shapes::bumpy_torus(40, 25, 3),
        shapes::jittered(&shapes::rectangle(33, 30, 2.0, 1.5), 0.3, 5),
        scene(),
    ] {
        assert!(mesh.vertex_count() >= 1000, "{}", mesh.vertex_count());
        let signed = embedder().embed(&mesh, &Job::default()).unwrap();
        let suspect = quantised(&moved(&noisy(signed.mesh(), 1e-3, 7)), 14);
        let verdict = judge(&signed, &suspect);
        assert!(verdict.p_value < 1e-12, "{verdict:?}");
        // Rounding alone takes no bit.
        let rounded = judge(&signed, &quantised(&moved(signed.mesh()), 14));
        assert_eq!(rounded.outcome, Outcome::Verified, "{rounded:?}");
    }
}

#[test]
fn a_whole_signature_fits_from_some_hundred_vertices_on() {
    let fits = |payload, mesh: TriMesh| {
        let signed = embedder().payload(payload).embed(&mesh, &Job::default());
        signed.map(|signed| judge(&signed, &moved(signed.mesh())).outcome)
    };
    // 344 vertices in one closed piece: 172 harmonics, two vertices each.
    let whole = Some(PayloadKind::Signature);
    assert_eq!(
        fits(whole, shapes::bumpy_torus(43, 8, 3)).unwrap(),
        Outcome::Verified
    );
    let refused = fits(whole, shapes::bumpy_torus(42, 8, 3)).unwrap_err();
    assert!(
        refused.to_string().contains("there is room for 501 chips"),
        "{refused}"
    );
    assert!(matches!(
        refused,
        sigmark::SigmarkError::Mark(MarkError::Room {
            found: 501,
            least: 512
        })
    ));
    // A tag fits into a quarter of that, and is taken there.
    let mesh = shapes::bumpy_torus(12, 8, 3);
    assert_eq!(fits(None, mesh).unwrap(), Outcome::Verified);
    let refused = fits(None, shapes::bumpy_torus(10, 8, 3)).unwrap_err();
    assert!(
        matches!(
            refused,
            sigmark::SigmarkError::Mark(MarkError::Room { least: 128, .. })
        ),
        "{refused}"
    );
}

#[test]
fn every_part_of_a_scene_takes_part() {
    let signed = embedder().embed(&scene(), &Job::default()).unwrap();
    assert_eq!(signed.original().patches().len(), 80);
    assert_eq!(signed.original().patches().unmarked_vertices(), 0);
    assert_eq!(judge(&signed, &moved(signed.mesh())).outcome, Outcome::Verified);
}

/// T₀ of the joint estimate of marked positions at so much noise, mean of four draws; vertices are where they were.
fn margin_under(noise: f64, layout: &Arc<MarkLayout>, bits: &[bool], marked: &TriMesh) -> f64 {
    let of_draw = |seed| {
        let noisy = noisy(marked, noise, seed);
        let seen = noisy.positions().iter().copied().map(Some).collect();
        let soft = JointEstimator::new(layout).detect(&Registered::by_vertices(seen), &Job::default());
        margin(bits, soft.unwrap().values())
    };
    (0..4).map(of_draw).sum::<f64>() / 4.0
}

/// T₀ of what is read is about what was foretold before anything was written: less where bits have one chip or two, which noise takes unequally.
#[test]
fn what_noise_leaves_was_foretold() {
    for (mesh, noise) in [
        (shapes::jittered(&shapes::bumpy_block(1, 12, 5), 0.2, 4), 5e-3),
        (shapes::flipped(&shapes::bumpy_sphere(4, 2), 3), 3e-3),
        (shapes::flipped(&shapes::bumpy_torus(60, 40, 6), 7), 4e-3),
    ] {
        let embedder = embedder().strength(Strength::Distortion(1e-3));
        let original = Arc::new(embedder.cut(&mesh, &Job::default()).unwrap());
        let foretold = embedder.predict(&original).unwrap();
        let signed = embedder.embed_in(&original, &Job::default()).unwrap();
        assert!((signed.layout().margin(noise) * noise / (foretold.margin * 1e-3) - 1.0).abs() < 1e-9);
        let read = margin_under(
            noise,
            signed.layout(),
            &signed.certificate().bits(),
            signed.mesh(),
        );
        let ratio = read / (foretold.margin * 1e-3 / noise);
        assert!((0.5..1.2).contains(&ratio), "{ratio}");
    }
}

/// Where the mark would turn triangles too far it is taken back, and what is foretold then is what is left, with what is missing as noise.
#[test]
fn what_levelling_leaves_was_foretold() {
    for (mesh, noise) in [
        (shapes::flipped(&shapes::bumpy_sphere(4, 2), 3), 3e-2),
        (shapes::flipped(&shapes::bumpy_torus(60, 40, 6), 7), 4e-2),
    ] {
        let strength = Strength::Level(6e-3);
        let signed = embedder()
            .strength(strength)
            .embed(&mesh, &Job::default())
            .unwrap();
        let (layout, bits) = (signed.layout(), signed.certificate().bits());
        let mut written = layout.write(&bits, &Job::default()).unwrap();
        let levelled = layout.level_slivers(&mut written, strength);
        let marked = mesh.with_positions(written.positions(layout.original())).unwrap();
        assert_eq!(&marked, signed.mesh());
        let [whole, foretold] = [layout.margin(noise), layout.margin_levelled(noise, &levelled)];
        let read = margin_under(noise, layout, &bits, &marked);
        assert!(foretold < 0.9 * whole, "{foretold} of {whole}");
        assert!((0.5..1.2).contains(&(read / foretold)), "{read} for {foretold}");
    }
}
