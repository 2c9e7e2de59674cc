//! Suspects that lost the original's vertices: cropped, coarser, finer, with other triangles, in any position.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use std::sync::{Arc, OnceLock};

use decimation::{Decimator, decimate};
use job::{Job, JobError, Observer};
use mesh::{Edges, Similarity, TriMesh, Vec3, Welded, shapes};
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use registration::{AlignOptions, MatchedBy};
use sigmark::{
    Curve, Embedder, Mismatch, Outcome, PayloadKind, SigmarkError, Signed, SigningKey, Verdict, Verifier,
    claim::{
        Tracer,
        statistics::{binomial_tail, margin, read_and_wrong},
    },
    mark::{CoefficientDetector, Detector, JointEstimate, JointEstimator, Reader, ReadingMethod, Registered},
};

fn original() -> TriMesh {
    shapes::bumpy_sphere(4, 9)
}

/// [`original`] with its owner's mark.
fn signed() -> &'static Signed {
    static SIGNED: OnceLock<Signed> = OnceLock::new();
    SIGNED.get_or_init(|| {
        let signed = sign(&original(), 1);
        signed.original().keep_bases(&Job::default()).unwrap();
        signed
    })
}

fn sign(mesh: &TriMesh, seed: u8) -> Signed {
    embedder(seed).embed(mesh, &Job::default()).unwrap()
}

fn embedder(seed: u8) -> Embedder {
    let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([seed; 32]));
    Embedder::new(&key).payload(Some(PayloadKind::Signature))
}

fn judge(original: &TriMesh, signed: &Signed, suspect: &TriMesh) -> Verdict {
    let certificate = signed.certificate();
    assert_eq!(signed.original().mesh().positions(), original.positions());
    let verifier = Verifier::with_original(signed.original(), certificate, certificate.public_key());
    verifier.unwrap().verify(suspect, &Job::default()).unwrap()
}

/// Turned by about 150°, a hundredth of the size, some diagonals away.
fn away() -> Similarity {
    Similarity {
        scale: 0.01,
        translation: [0.2, -0.1, 0.15],
        ..Similarity::from_quaternion([0.25, 0.4, -0.8, 0.3])
    }
}

/// What lies on one side of a plane that leaves `share` of the vertices.
fn cropped(mesh: &TriMesh, share: f64) -> TriMesh {
    let height = |p: &[f64; 3]| p[0] + 0.4 * p[1] - 0.2 * p[2];
    let mut heights: Vec<f64> = mesh.positions().iter().map(height).collect();
    heights.sort_by(f64::total_cmp);
    let bound = heights[(share * heights.len() as f64) as usize];
    let kept = (0..mesh.triangle_count()).filter(|&t| mesh.corners(t).iter().all(|p| height(&p.0) < bound));
    let kept: Vec<[u32; 3]> = kept.map(|t| mesh.triangles()[t]).collect();
    Welded::new(mesh.positions(), &kept).unwrap().into_mesh()
}

/// Every triangle in four, and one of these in three: the same surface with other vertices and triangles, of which nobody can tell what they were before.
fn divided(mesh: &TriMesh) -> TriMesh {
    let fine = shapes::divided(mesh);
    let [a, b, c] = fine.triangles()[0];
    let centre = fine.corners(0).into_iter().sum::<Vec3>() / 3.0;
    let added = fine.vertex_count() as u32;
    let positions = fine.positions().iter().copied().chain([centre.into()]).collect();
    let split = [[a, b, added], [b, c, added], [c, a, added]];
    let triangles = split
        .into_iter()
        .chain(fine.triangles()[1..].iter().copied())
        .collect();
    TriMesh::new(positions, triangles).unwrap()
}

/// A quarter of an icosphere's vertices, those of the level below, with the triangles of that level.
fn coarser(mesh: &TriMesh, level: u32) -> TriMesh {
    let net = shapes::icosphere(level - 1);
    TriMesh::new(
        mesh.positions()[..net.vertex_count()].to_vec(),
        net.triangles().to_vec(),
    )
    .unwrap()
}

/// With a triangle more: at `far` on the first axis, its corners `size` apart on the others, or on a line.
fn with_a_stray(mesh: &TriMesh, far: f64, size: f64, is_line: bool) -> TriMesh {
    let third = if is_line {
        [far, 2.0 * size, 0.0]
    } else {
        [far, 0.0, size]
    };
    let stray = vec![[far, 0.0, 0.0], [far, size, 0.0], third];
    let stray = TriMesh::new(stray, vec![[0, 1, 2]]).unwrap();
    shapes::disjoint_union(&[mesh.clone(), stray])
}

#[test]
fn a_triangle_beside_a_copy_or_far_away_hides_nothing() {
    let (mesh, signed) = (original(), signed());
    let cut = cropped(signed.mesh(), 0.6);
    let finer = divided(&cut);
    // As large as a floor; so far away that nobody sees it; as a line.
    let strays = [
        (30.0, 30.0, false),
        (1e3, 1e-3, false),
        (1e6, 1.0, false),
        (1e38, 1e38, true),
    ];
    for (far, size, is_line) in strays {
        for copy in [&cut, &finer] {
            let verdict = judge(&mesh, signed, &with_a_stray(copy, far, size, is_line));
            assert_eq!(
                verdict.outcome,
                Outcome::Verified,
                "{far}, {size}, {}",
                copy.vertex_count()
            );
        }
    }
}

#[test]
fn dust_beside_a_copy_is_no_other_way_to_read_it() {
    let (mesh, signed) = (original(), signed());
    let copy = divided(signed.mesh());
    let beside = |size: f64| {
        let ball = shapes::scaled(&shapes::icosphere(3), size);
        shapes::disjoint_union(&[copy.clone(), shapes::translated(&ball, [1.8, 0.0, 0.0])])
    };
    let [alone, dusty, with_a_ball] = [&copy, &beside(0.02), &beside(0.3)].map(|suspect| {
        let verdict = judge(&mesh, signed, suspect);
        assert_eq!(verdict.outcome, Outcome::Verified);
        verdict.tries
    });
    assert_eq!(alone, dusty);
    assert!(with_a_ball > alone, "{with_a_ball}, {alone}");
    // What is small, but has many vertices, may be the copy, and the rest a shell around it.
    let small = shapes::scaled(&shapes::icosphere(5), 0.02);
    let dense = shapes::disjoint_union(&[copy, shapes::translated(&small, [1.8, 0.0, 0.0])]);
    assert!(judge(&mesh, signed, &dense).tries > alone);
}

#[test]
fn a_cropped_copy_is_found_among_other_models() {
    let (mesh, signed) = (original(), signed());
    let copy = cropped(signed.mesh(), 0.6);
    let beside = |mesh: &TriMesh, i: u32| shapes::translated(mesh, [3.0 * f64::from(i), 0.0, 0.0]);
    let larger = beside(&shapes::scaled(&shapes::bumpy_torus(100, 40, 2), 3.0), 5);
    let twin = beside(&shapes::mirrored(&copy), 1);
    let dust = (0..400).map(|i| beside(&shapes::scaled(&shapes::tetrahedron(), 0.01), i % 20));
    let points = (0..5000).map(|i| [0.01 * f64::from(i), 4.0, 0.0]).collect();
    let line = TriMesh::new(points, (0..4998).map(|i| [i, i + 1, i + 2]).collect()).unwrap();
    let floor = shapes::translated(&shapes::rectangle(1, 1, 60.0, 60.0), [-30.0, -30.0, -2.0]);
    let among = [vec![larger], vec![twin], dust.collect(), vec![line, floor]];
    for mut models in among {
        models.push(copy.clone());
        let verdict = judge(&mesh, signed, &shapes::disjoint_union(&models));
        assert_eq!(verdict.outcome, Outcome::Verified);
        assert!(verdict.tries >= 3, "each part is a way: {}", verdict.tries);
    }
}

#[test]
fn a_cropped_copy_is_verified_by_the_vertices_that_are_left() {
    let (mesh, signed) = (original(), signed());
    let cut = cropped(signed.mesh(), 0.5);
    for suspect in [shapes::shuffled(&cut, 2), shapes::mirrored(&cut)] {
        let verdict = judge(&mesh, signed, &shapes::moved(&suspect, &away()));
        assert_eq!(
            (verdict.outcome, verdict.matched_by),
            (Outcome::Verified, MatchedBy::Surroundings)
        );
        assert!(verdict.overlap > 0.99 && (verdict.coverage - 0.5).abs() < 0.1);
        assert!((verdict.missing - 0.5).abs() < 0.05, "{}", verdict.missing);
    }
}

#[test]
fn the_same_surface_with_other_vertices_is_verified() {
    let (mesh, signed) = (original(), signed());
    let suspect = shapes::moved(&divided(signed.mesh()), &away());
    for suspect in [
        suspect.clone(),
        shapes::mirrored(&suspect),
        shapes::inside_out(&suspect),
    ] {
        let verdict = judge(&mesh, signed, &suspect);
        assert_eq!(
            (verdict.outcome, verdict.matched_by),
            (Outcome::Verified, MatchedBy::Surface)
        );
        assert!(verdict.missing == 0.0 && verdict.residual.unwrap() < 1e-3);
        let scale = verdict.transform.unwrap().scale;
        assert!((0.01 * scale - 1.0).abs() < 1e-4, "{scale}");
        // Nothing happened to the surface but the mark.
        let model = verdict.attack_model.unwrap();
        assert!(model.mark > 0.95, "{model:?}");
        let all = model.mark
            + model.misalignment
            + model.offset
            + model.smoothing
            + model.tessellation_bias
            + model.bending
            + model.noise;
        assert!((all - 1.0).abs() < 1e-12, "{model:?}");
    }
}

#[test]
fn half_of_the_surface_with_other_vertices_is_verified() {
    let mesh = shapes::bumpy_block(2, 8, 3);
    // T₀ is 30 to 50 here, as keys draw their chips; the signature takes 34.
    let signed = sign(&mesh, 4);
    let suspect = shapes::moved(&divided(&cropped(signed.mesh(), 0.5)), &away());
    let verdict = judge(&mesh, &signed, &suspect);
    assert_eq!(verdict.outcome, Outcome::Verified, "{verdict:?}");
    // Of the half that was seen, most.
    assert!(verdict.extraction_rate.unwrap() > 0.8, "{verdict:?}");
}

#[test]
fn a_coarser_net_over_a_quarter_of_the_vertices_is_detected() {
    let mesh = shapes::bumped(&shapes::jittered(&shapes::icosphere(5), 0.15, 4), 0.25, 4);
    let signed = sign(&mesh, 1);
    let suspect = shapes::moved(&coarser(signed.mesh(), 5), &away());
    let verdict = judge(&mesh, &signed, &suspect);
    assert!(
        matches!(verdict.outcome, Outcome::Verified | Outcome::Detected { .. }),
        "{verdict:?}"
    );
}

#[test]
fn noise_on_other_vertices_leaves_the_mark_detectable() {
    let (mesh, signed) = (original(), signed());
    let fine = divided(signed.mesh());
    let mut random = ChaCha20Rng::from_seed([5; 32]);
    let amplitude = 0.002 * mesh.bounding_box().diagonal();
    let noisy = fine
        .positions()
        .iter()
        .map(|p| p.map(|x| x + amplitude * (2.0 * f64::from(random.next_u32()) / f64::from(u32::MAX) - 1.0)));
    let noisy = fine.with_positions(noisy.collect()).unwrap();
    let verdict = judge(&mesh, signed, &shapes::moved(&noisy, &away()));
    assert!(
        matches!(verdict.outcome, Outcome::Verified | Outcome::Detected { .. }),
        "{verdict:?}"
    );
}

#[test]
fn attacked_copies_without_the_mark_or_with_another_prove_nothing() {
    let (mesh, signed) = (original(), signed());
    let theirs = sign(&mesh, 2);
    for suspect in [
        cropped(&mesh, 0.5),
        divided(theirs.mesh()),
        divided(&cropped(&mesh, 0.5)),
        shapes::flipped(theirs.mesh(), 3),
    ] {
        let verdict = judge(&mesh, signed, &shapes::moved(&suspect, &away()));
        assert!(matches!(verdict.outcome, Outcome::NotFound { .. }), "{verdict:?}");
        assert!(verdict.p_value > 1e-4 && verdict.mismatch.is_none());
    }
}

#[test]
fn another_model_does_not_align_whatever_its_size() {
    let (mesh, signed) = (original(), signed());
    for other in [
        shapes::bumpy_torus(30, 20, 1),
        shapes::scaled(&shapes::bumpy_block(1, 3, 2), 1000.0),
    ] {
        let verdict = judge(&mesh, signed, &other);
        assert_eq!(verdict.outcome, Outcome::NotFound { p: 1.0 });
        assert!(
            matches!(verdict.mismatch, Some(Mismatch::Surface { overlap, .. }) if overlap == verdict.overlap)
        );
        assert!(verdict.overlap < 0.8 && verdict.missing == 1.0 && verdict.transform.is_none());
    }
}

/// Two equal pieces, each where half a turn about z takes the other.
fn pair() -> TriMesh {
    let piece = shapes::translated(&shapes::bumpy_sphere(3, 2), [1.5, 0.2, 0.1]);
    let half_turn = Similarity::from_quaternion([0.0, 0.0, 0.0, 1.0]);
    shapes::disjoint_union(&[piece.clone(), shapes::moved(&piece, &half_turn)])
}

/// The p-value of one reading, from what a verdict says of it; no soft bit being zero.
fn p_of_one_reading(verdict: &Verdict) -> f64 {
    let by_correlation = (-0.5 * verdict.correlation.powi(2)).exp();
    let by_bits = binomial_tail(verdict.bits, verdict.bits - verdict.bit_errors.unwrap());
    2.0 * by_correlation.min(by_bits)
}

#[test]
fn a_symmetric_shape_with_other_vertices_is_tried_in_its_poses_and_pays_for_them() {
    let signed = embedder(1).chip_rate(1).embed(&pair(), &Job::default()).unwrap();
    let suspect = shapes::moved(&divided(signed.mesh()), &away());
    let verdict = judge(&pair(), &signed, &suspect);
    assert!(verdict.poses > 1, "{verdict:?}");
    assert!(
        verdict.outcome.is_found() && verdict.p_value < 1e-6,
        "{verdict:?}"
    );
    // It might have been read by its two pieces together, and by either alone.
    let tries = verdict.p_value / p_of_one_reading(&verdict);
    assert!((tries / (4 * verdict.poses) as f64 - 1.0).abs() < 1e-9, "{tries}");
}

#[test]
fn a_symmetric_shape_that_is_read_twice_pays_for_two_readings_in_every_pose() {
    let signed = embedder(1).chip_rate(1).embed(&pair(), &Job::default()).unwrap();
    let mut rng = ChaCha20Rng::seed_from_u64(4);
    let far = 0.01 * signed.mesh().bounding_box().diagonal();
    let noisy = signed.positions().iter();
    let noisy = noisy.map(|p| p.map(|x| x + far * (f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5)));
    let noisy = signed.mesh().with_positions(noisy.collect()).unwrap();
    let verdict = judge(&pair(), &signed, &shapes::shuffled(&noisy, 3));
    assert_eq!(verdict.matched_by, MatchedBy::Connectivity);
    assert!(
        verdict.poses > 1 && verdict.bit_errors.unwrap() > 0,
        "{verdict:?}"
    );
    // Each of the M poses is read by the paper's rule, and the best one again: it might have been any; and so might its pieces.
    let tries = verdict.p_value / p_of_one_reading(&verdict);
    assert!((tries / (8 * verdict.poses) as f64 - 1.0).abs() < 1e-9, "{tries}");
}

#[test]
fn the_triangles_of_the_original_on_another_shape_are_another_shape() {
    let original = original();
    let flat = original.positions().iter().map(|&[x, y, _]| [x, y, 0.0]);
    let flat = original.with_positions(flat.collect()).expect("a valid mesh");
    let verdict = judge(&original, signed(), &flat);
    assert!(matches!(verdict.outcome, Outcome::NotFound { .. }) && verdict.overlap < 0.8);
    assert!(matches!(verdict.mismatch, Some(Mismatch::Shape { in_place, least }) if in_place < least));
}

/// Both detectors on a registered suspect: the shares of bits that the paper's rule and the joint estimate read.
fn rates(signed: &Signed, registered: &Registered) -> [f64; 2] {
    let (paper, joint) = detectors(signed);
    [&paper as &dyn Detector, &joint].map(|detector| {
        let soft = detector.detect(registered, &Job::default()).unwrap();
        let [read, wrong] = read_and_wrong(&signed.certificate().bits(), &soft.weights());
        1.0 - wrong as f64 / read as f64
    })
}

/// As [`rates`], T₀.
fn margins(signed: &Signed, registered: &Registered) -> [f64; 2] {
    let (paper, joint) = detectors(signed);
    [&paper as &dyn Detector, &joint].map(|detector| {
        let soft = detector.detect(registered, &Job::default()).unwrap();
        margin(&signed.certificate().bits(), &soft.weights())
    })
}

fn detectors(signed: &Signed) -> (CoefficientDetector, JointEstimator) {
    (
        CoefficientDetector::new(signed.layout()),
        JointEstimator::new(signed.layout()),
    )
}

/// The suspect's surface under a transform.
fn sampled(original: &TriMesh, suspect: &TriMesh, transform: &Similarity) -> Registered {
    let suspect = Reader::new(original).unwrap().surface(suspect);
    suspect.sample(transform, &Job::default()).unwrap()
}

#[test]
fn the_alignment_that_is_found_reads_as_many_bits_as_the_true_one() {
    let (mesh, signed) = (original(), signed());
    for suspect in [divided(signed.mesh()), shapes::flipped(signed.mesh(), 7)] {
        let moved = shapes::moved(&suspect, &away());
        let verdict = judge(&mesh, signed, &moved);
        let [paper, least_squares] = rates(signed, &sampled(&mesh, &moved, &away().inverse()));
        assert!(least_squares >= paper, "{least_squares} {paper}");
        assert!(
            (verdict.extraction_rate.unwrap() - least_squares).abs() <= 0.02,
            "{verdict:?}"
        );
    }
}

#[test]
fn least_squares_reads_what_misalignment_hides_from_the_paper_rule() {
    let signed = signed();
    let off = Similarity {
        scale: 1.0 + 1e-3,
        translation: [1e-3, -2e-3, 1e-3],
        ..Similarity::from_quaternion([1.0, 3e-4, -2e-4, 4e-4])
    };
    let suspect = shapes::divided(signed.mesh());
    let [_, aligned] = rates(signed, &sampled(&original(), &suspect, &Similarity::IDENTITY));
    let [paper, least_squares] = rates(signed, &sampled(&original(), &suspect, &off));
    assert!(
        aligned == 1.0 && least_squares > 0.99,
        "{aligned} {least_squares}"
    );
    assert!(paper < least_squares, "{paper}");

    let method = ReadingMethod::joint(Arc::new(detectors(signed).1));
    let suspect = Reader::new(original()).unwrap().surface(&suspect);
    let better = suspect.read(&method, &off, &Job::default()).unwrap().transform;
    // A hundredth of how far it was off. The mark is noise to the pose, and what it hides differs between processors: on one of them 1.09e-5.
    assert!((better.scale - 1.0).abs() < 1e-5, "{better:?}");
    assert!(better.translation.iter().all(|t| t.abs() < 2e-5), "{better:?}");
}

#[test]
fn with_every_vertex_known_least_squares_and_the_paper_rule_agree() {
    let signed = signed();
    let registered = Registered::by_vertices(signed.positions().iter().copied().map(Some).collect());
    let soft = detectors(signed).1.detect(&registered, &Job::default()).unwrap();
    for (&x, bit) in soft.values().iter().zip(signed.certificate().bits()) {
        let certain = JointEstimate::MOST_CERTAIN;
        // Some bits have no chip.
        assert!(x == 0.0 || x == if bit { certain } else { -certain }, "{x}");
    }
}

/// As many times: every vertex goes a share of the way to the mean of its neighbours.
fn smoothed(mesh: &TriMesh, shares: &[f64]) -> TriMesh {
    let mut neighbours = vec![Vec::new(); mesh.vertex_count()];
    for &[a, b] in Edges::of(mesh).vertices() {
        neighbours[a as usize].push(b as usize);
        neighbours[b as usize].push(a as usize);
    }
    let mut positions = mesh.positions().to_vec();
    for share in shares {
        let step = |(p, near): (&[f64; 3], &Vec<usize>)| {
            std::array::from_fn(|i| {
                let mean = near.iter().map(|&w| positions[w][i]).sum::<f64>() / near.len() as f64;
                p[i] + share * (mean - p[i])
            })
        };
        positions = positions.iter().zip(&neighbours).map(step).collect();
    }
    mesh.with_positions(positions).unwrap()
}

/// Most vertices lie farther from their places than another shape's may.
#[test]
fn a_copy_that_was_smoothed_until_it_shrank_is_no_other_shape() {
    let mesh = shapes::bumpy_torus(60, 24, 3);
    let signed = sign(&mesh, 1);
    let verdict = judge(&mesh, &signed, &smoothed(signed.mesh(), &[0.9; 12]));
    assert!(verdict.residual.unwrap() > 2.0 * AlignOptions::default().tolerance);
    assert!(verdict.outcome.is_found() && verdict.overlap > 0.99);
}

/// The forger's chair: what is taken out of a shape as smoothing must not make another of the same triangles the original.
#[test]
fn a_mark_that_was_copied_onto_another_shape_and_smoothed_is_not_found_there() {
    let (mesh, signed) = (original(), signed());
    let flat_with_mark = |v: usize| {
        let ([x, y, z], [_, _, of_original]) = (signed.positions()[v], mesh.positions()[v]);
        [x, y, z - of_original]
    };
    let flat = mesh.with_positions((0..mesh.vertex_count()).map(flat_with_mark).collect());
    for steps in [0, 4, 12] {
        let suspect = smoothed(flat.as_ref().unwrap(), &vec![0.9; steps]);
        let verdict = judge(&mesh, signed, &suspect);
        assert!(!verdict.outcome.is_found() && verdict.overlap < 0.8, "{steps}");
        assert!(
            matches!(verdict.mismatch, Some(Mismatch::Shape { .. })),
            "{steps}"
        );
    }
}

/// Its bits can be read off, every one of them; nobody who is told so may take it for evidence.
#[test]
fn what_is_read_of_a_mark_on_another_shape_counts_for_nothing() {
    let (mesh, signed) = (original(), signed());
    let marks = signed.positions().iter().zip(mesh.positions());
    let flat = marks.map(|([x, y, z], [_, _, of_original])| [*x, *y, z - of_original]);
    let copied = mesh.with_positions(flat.collect()).unwrap();
    let beside = shapes::translated(&shapes::bumpy_torus(30, 20, 1), [9.0, 0.0, 0.0]);
    let elsewhere = shapes::disjoint_union(&[beside, shapes::tetrahedron()]);
    for suspect in [copied, elsewhere] {
        let verdict = judge(&mesh, signed, &suspect);
        assert!(verdict.mismatch.is_some());
        assert_eq!(verdict.outcome, Outcome::NotFound { p: 1.0 });
        assert_eq!((verdict.p_value, verdict.p_dispute()), (1.0, 1.0));
        assert_eq!((verdict.tries, verdict.bits, verdict.patches_read), (1, 0, 0));
        assert_eq!((verdict.extraction_rate, verdict.bit_errors), (None, None));
        assert_eq!((verdict.margin, verdict.correlation), (None, 0.0));
        assert!(verdict.soft.is_none() && verdict.attack_model.is_none());
    }
}

#[test]
fn what_is_not_found_holds_against_no_stranger_however_little_its_owner_lets_count() {
    let (mesh, signed) = (original(), signed());
    let suspect = shapes::jittered(signed.mesh(), 0.1, 3);
    let certificate = signed.certificate();
    let verifier = Verifier::new(&mesh, certificate, certificate.public_key()).unwrap();
    let verdict = verifier.p_bound(0.0).verify(&suspect, &Job::default()).unwrap();
    assert!(
        !verdict.outcome.is_found() && verdict.p_value < 1e-30,
        "{verdict:?}"
    );
    assert_eq!(verdict.p_dispute(), 1.0);
}

/// By a bound of 1 everything would be found, and everybody be named.
#[test]
fn what_is_no_bound_on_a_probability_of_being_wrong_is_refused() {
    let (mesh, signed, job) = (original(), signed(), Job::default());
    let (certificate, key) = (signed.certificate(), signed.certificate().public_key());
    for bound in [1.0, 2.0, -1e-9, f64::INFINITY, f64::NAN] {
        let verifier = Verifier::new(&mesh, certificate, key).unwrap().p_bound(bound);
        let refused = verifier.verify(&mesh, &job).unwrap_err();
        assert!(matches!(refused, SigmarkError::Bound(_)), "{bound}: {refused}");
        let mut tracer = Tracer::new(&mesh, key).unwrap().p_bound(bound);
        tracer.add(&certificate.clone().into()).unwrap();
        let refused = tracer.trace(&mesh, &job).unwrap_err();
        assert!(matches!(refused, SigmarkError::Bound(_)), "{bound}: {refused}");
    }
}

#[test]
fn steps_of_smoothing_are_taken_out_whatever_their_strength() {
    let mesh = shapes::bumped(&shapes::jittered(&shapes::icosphere(4), 0.3, 4), 0.3, 4);
    let signed = sign(&mesh, 1);
    signed.original().keep_bases(&Job::default()).unwrap();
    let laplacian = [0.5; 8];
    let taubin = [0.6, -0.62, 0.6, -0.62, 0.6, -0.62];
    for shares in [&laplacian[..], &taubin] {
        let suspect = smoothed(signed.mesh(), shares);
        let verdict = judge(&mesh, &signed, &shapes::moved(&suspect, &away()));
        assert_eq!(verdict.outcome, Outcome::Verified);

        let registered = Registered::by_vertices(suspect.positions().iter().copied().map(Some).collect());
        let [paper, read] = rates(&signed, &registered);
        assert!(read > 0.99 && paper < 0.95, "{read} {paper}");
        let estimate = detectors(&signed)
            .1
            .estimate(&registered, &Job::default())
            .unwrap();
        let model = estimate.attack_model;
        assert!(model.smoothing > 0.5 && model.misalignment < 0.1, "{model:?}");
    }
}

/// A stretch by 2 % along x, a twist by 5° about it, a bend by 10°: no vertex lies where a similarity would have it.
fn bent(mesh: &TriMesh) -> [TriMesh; 3] {
    let bounds = mesh.bounding_box();
    let (centre, length) = (bounds.centre(), bounds.size()[0]);
    let of = |f: &dyn Fn([f64; 3]) -> [f64; 3]| {
        let positions = mesh.positions().iter();
        let positions = positions.map(|p| f(std::array::from_fn(|axis| p[axis] - centre[axis])));
        mesh.with_positions(positions.collect()).unwrap()
    };
    let (twist, bend) = (5f64.to_radians(), 10f64.to_radians());
    let radius = length / bend;
    [
        of(&|[x, y, z]| [1.02 * x, y, z]),
        of(&|[x, y, z]| {
            let (sin, cos) = (twist * x / length).sin_cos();
            [x, cos * y - sin * z, sin * y + cos * z]
        }),
        of(&|[x, y, z]| {
            let (sin, cos) = (x / radius).sin_cos();
            [sin * (radius - y), radius - cos * (radius - y), z]
        }),
    ]
}

#[test]
fn stretched_twisted_and_bent_copies_are_verified_with_vertices_and_without() {
    let (mesh, signed) = (original(), signed());
    for suspect in bent(signed.mesh()) {
        let verdict = judge(&mesh, signed, &shapes::moved(&suspect, &away()));
        assert_eq!(
            (verdict.outcome, verdict.matched_by),
            (Outcome::Verified, MatchedBy::Connectivity),
            "{verdict:?}"
        );
        assert!(verdict.attack_model.unwrap().bending > 0.1, "{verdict:?}");
    }
    let [stretched, twisted, _] = bent(signed.mesh());
    for suspect in [stretched, twisted] {
        let verdict = judge(&mesh, signed, &shapes::moved(&divided(&suspect), &away()));
        assert_eq!(verdict.outcome, Outcome::Verified, "{verdict:?}");
    }
    // Nothing is taken for bent that is not: a small model's lowest harmonics would pay for it.
    let verdict = judge(&mesh, signed, &shapes::moved(&divided(signed.mesh()), &away()));
    assert_eq!(verdict.attack_model.unwrap().bending, 0.0);
}

/// A mesh that grew by a distance along its normals.
fn grown(mesh: &TriMesh, by: f64) -> TriMesh {
    let moved = mesh.positions().iter().zip(mesh.vertex_normals());
    let moved = moved.map(|(p, n)| std::array::from_fn(|axis| p[axis] + by * n[axis]));
    mesh.with_positions(moved.collect()).unwrap()
}

/// A sheet is made solid, a print comes out too large, a shell is hollowed: what is seen lies beside the original everywhere.
#[test]
fn surfaces_that_were_given_a_thickness_are_verified() {
    let sheet = cropped(&original(), 0.6);
    let signed = sign(&sheet, 3);
    let thickness = 0.003 * sheet.bounding_box().diagonal();
    let [outer, inner] = [0.5, -0.5].map(|side| grown(&divided(signed.mesh()), side * thickness));
    let solid = shapes::disjoint_union(&[outer.clone(), shapes::inside_out(&inner)]);
    for suspect in [solid, outer, inner] {
        let verdict = judge(&sheet, &signed, &shapes::moved(&suspect, &away()));
        assert_eq!(verdict.outcome, Outcome::Verified, "{verdict:?}");
        assert!(verdict.attack_model.unwrap().offset > 0.5, "{verdict:?}");
    }
}

#[test]
fn where_collapses_of_edges_put_vertices_is_foretold() {
    let mesh = shapes::bumped(&shapes::jittered(&shapes::icosphere(4), 0.3, 4), 0.3, 4);
    let (signed, job) = (sign(&mesh, 1), Job::default());
    let (bits, estimator) = (signed.certificate().bits(), detectors(&signed).1);
    let stranger = sign(&mesh, 2);
    for decimator in Decimator::ALL {
        let suspect = decimate(signed.mesh(), mesh.triangle_count() / 5, decimator, &job).unwrap();
        let told = sampled(&mesh, &suspect, &Similarity::IDENTITY);
        let mut untold = Registered::by_vertices(told.positions.clone());
        untold.along.clone_from(&told.along);
        untold.tessellation_bias.clone_from(&told.tessellation_bias);
        untold.suspect_vertices = told.suspect_vertices;
        let [with, without] = [&told, &untold]
            .map(|seen| margin(&bits, &estimator.estimate(seen, &job).unwrap().soft.weights()));
        assert!(with > 1.2 * without, "{decimator:?}: {with} {without}");
        // What is foretold says nothing of bits that are not there.
        let soft = estimator.estimate(&told, &job).unwrap().soft;
        let chance = margin(&stranger.certificate().bits(), &soft.weights());
        assert!(chance.abs() < 4.0, "{decimator:?}: {chance}");
    }
    // What is as fine as the original was not decimated.
    let seen = sampled(&mesh, signed.mesh(), &Similarity::IDENTITY);
    assert!(seen.quadric_bias.iter().all(|bias| *bias == [0.0; 2]));
}

/// What tells regions are marks of random bits, which say nothing of bits that are not there.
#[test]
fn a_copy_of_few_triangles_is_another_keys_by_chance_alone() {
    let mesh = shapes::bumped(&shapes::jittered(&shapes::icosphere(5), 0.3, 4), 0.3, 4);
    let (signed, job) = (sign(&mesh, 1), Job::default());
    let few = mesh.triangle_count() / 15;
    let suspect = decimate(signed.mesh(), few, Decimator::Threshold, &job).unwrap();
    let own = judge(&mesh, &signed, &suspect);
    assert!(own.outcome.is_found() && own.margin.unwrap() > 10.0, "{own:?}");
    for seed in 2..6 {
        let stranger = judge(&mesh, &sign(&mesh, seed), &suspect);
        assert!(!stranger.outcome.is_found(), "{stranger:?}");
        assert!(stranger.margin.unwrap().abs() < 4.0, "{stranger:?}");
    }
}

#[test]
fn tessellation_bias_is_what_flat_triangles_alone_do() {
    let original = shapes::icosphere(5);
    let suspect = coarser(&original, 5);
    let sampled = |suspect: &TriMesh| sampled(&original, suspect, &Similarity::IDENTITY);
    let seen = sampled(&suspect);
    let mut deepest: f64 = 0.0;
    for (v, bias) in seen.tessellation_bias.iter().enumerate() {
        // The vertices lie on the original, so there is nothing else; and the sphere is unit, its normals the positions.
        let [p, q] = [seen.positions[v].unwrap(), original.positions()[v]];
        let offset: f64 = (0..3).map(|i| (p[i] - q[i]) * q[i]).sum();
        assert!((bias - offset).abs() < 1e-6, "{bias} {offset}");
        deepest = deepest.max(-bias);
    }
    assert!(deepest > 1e-4);

    // Vertices off the original leave them as they are, to first order.
    let grown = sampled(&shapes::scaled(&suspect, 1.001));
    for (bias, before) in grown.tessellation_bias.iter().zip(&seen.tessellation_bias) {
        assert!((bias - before).abs() < 0.05 * deepest, "{bias} {before}");
    }
}

/// What both detectors read when every vertex is found again, moved by what is added: T₀ of the paper's rule and
/// of least squares.
fn margins_of_vertices(signed: &Signed, added: impl FnMut(&[f64; 3]) -> [f64; 3]) -> [f64; 2] {
    let registered = Registered::by_vertices(signed.positions().iter().map(added).map(Some).collect());
    margins(signed, &registered)
}

#[test]
fn noise_in_proportion_to_the_bounding_box_hides_no_more_from_least_squares() {
    // The paper's noise follows the box.
    let round = original();
    let positions = round.positions().iter().map(|&[x, y, z]| [3.0 * x, y, 0.5 * z]);
    let mesh = TriMesh::new(positions.collect(), round.triangles().to_vec()).unwrap();
    let signed = sign(&mesh, 1);
    let mut rng = ChaCha20Rng::seed_from_u64(7);
    let mut random = || f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5;
    let size = signed.mesh().bounding_box();
    let [paper, least_squares] = margins_of_vertices(&signed, |p| {
        std::array::from_fn(|i| p[i] + 4e-3 * (size.max[i] - size.min[i]) * random())
    });
    assert!(least_squares > 1.1 * paper, "{least_squares} {paper}");
}

/// Every other triangle in three, by its centre, `times` times over: new triangles are followed by old ones.
fn crowded(mesh: &TriMesh, times: usize) -> TriMesh {
    let (mut positions, mut triangles) = (mesh.positions().to_vec(), mesh.triangles().to_vec());
    for _ in 0..times {
        for t in (0..triangles.len()).step_by(2) {
            let [a, b, c] = triangles[t];
            let [p, q, r] = triangles[t].map(|v| positions[v as usize]);
            let centre = positions.len() as u32;
            positions.push(std::array::from_fn(|i| (p[i] + q[i] + r[i]) / 3.0));
            triangles[t] = [a, b, centre];
            triangles.extend([[b, c, centre], [c, a, centre]]);
        }
    }
    TriMesh::new(positions, triangles).unwrap()
}

#[test]
fn where_triangles_are_uneven_every_vertex_counts_alike() {
    let signed = sign(&crowded(&original(), 2), 1);
    let mut rng = ChaCha20Rng::seed_from_u64(8);
    let far = 0.01 * signed.mesh().bounding_box().diagonal();
    let noisy = signed.positions().iter();
    let noisy = noisy.map(|p| p.map(|x| x + far * (f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5)));
    let registered = Registered::by_vertices(noisy.map(Some).collect());
    let [paper, least_squares] = margins(&signed, &registered);
    assert!(least_squares > 1.3 * paper, "{least_squares} {paper}");
}

#[test]
fn vertices_that_are_far_off_count_for_little() {
    let signed = signed();
    let mut rng = ChaCha20Rng::seed_from_u64(6);
    let mut random = || f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5;
    let far = 0.01 * signed.mesh().bounding_box().diagonal();
    let mut number = 0;
    let [paper, least_squares] = margins_of_vertices(signed, |p| {
        number += 1;
        let size = if number % 20 == 0 { far } else { 1e-3 * far };
        p.map(|x| x + size * random())
    });
    assert!(least_squares > 10.0 * paper, "{least_squares} {paper}");
}

#[test]
fn nothing_seen_is_nothing_read() {
    let (mesh, signed) = (original(), signed());
    let registered = Registered::by_vertices(vec![None; mesh.vertex_count()]);
    let soft = detectors(signed).1.detect(&registered, &Job::default()).unwrap();
    assert!(soft.values().iter().all(|&x| x == 0.0));
    assert_eq!(registered.missing(), 1.0);
}

#[test]
fn the_verdict_does_not_depend_on_the_number_of_threads() {
    let (mesh, signed) = (original(), signed());
    let suspect = shapes::moved(&divided(&cropped(signed.mesh(), 0.6)), &away());
    let certificate = signed.certificate();
    let [one, three] = [1, 3].map(|threads| {
        let verifier = Verifier::new(&mesh, certificate, certificate.public_key()).unwrap();
        let verdict = verifier.verify(&suspect, &Job::new(threads)).unwrap();
        (verdict.correlation, verdict.transform, verdict.residual)
    });
    assert_eq!(one, three);
}

#[test]
fn an_observer_can_stop_the_alignment() {
    struct Stop;
    impl Observer for Stop {
        fn cancelled(&self) -> bool {
            true
        }
    }
    let (mesh, signed) = (original(), signed());
    let certificate = signed.certificate();
    let verifier = Verifier::new(&mesh, certificate, certificate.public_key()).unwrap();
    let stopped = verifier.verify(divided(signed.mesh()), &Job::default().observed_by(Stop));
    assert!(matches!(stopped, Err(SigmarkError::Job(JobError::Cancelled))));
}
