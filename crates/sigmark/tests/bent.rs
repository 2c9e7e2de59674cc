//! Models that something bent, twisted, dragged or posed, and nobody knows what: read in the frames of their own surroundings.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use std::{
    f64::consts::PI,
    sync::{Arc, OnceLock},
};

use job::Job;
use mesh::{TriMesh, Vec3, shapes};
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use registration::MatchedBy;
use sigmark::{
    Curve, Embedder, Outcome, PayloadKind, Signed, SigningKey, Verdict, Verifier,
    claim::{Mismatch, Tracer, statistics::p_of_chosen},
    mark::{ChipPlan, JointEstimator, MarkLayout, Original, Pool, Reader, ReadingMethod, Strength},
};

fn key() -> SigningKey {
    SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([4; 32]))
}

fn original() -> TriMesh {
    shapes::bumpy_torus(120, 70, 3)
}

fn signed() -> &'static Signed {
    static SIGNED: OnceLock<Signed> = OnceLock::new();
    SIGNED.get_or_init(|| sign(&original()))
}

/// With the harmonics kept, since many suspects are asked about.
fn sign(mesh: &TriMesh) -> Signed {
    let signed = Embedder::new(&key()).embed(mesh, &Job::default()).unwrap();
    signed.original().keep_bases(&Job::default()).unwrap();
    signed
}

fn judged_by(signed: &Signed, suspect: &TriMesh) -> Verdict {
    let certificate = signed.certificate();
    let verifier = Verifier::with_original(signed.original(), certificate, certificate.public_key());
    verifier.unwrap().verify(suspect, &Job::default()).unwrap()
}

fn judged(suspect: &TriMesh) -> Verdict {
    judged_by(signed(), suspect)
}

fn deformed(mesh: &TriMesh, to: impl Fn(Vec3) -> Vec3) -> TriMesh {
    let place = |v: usize| to(mesh.point(v)).into();
    mesh.with_positions((0..mesh.vertex_count()).map(place).collect())
        .unwrap()
}

/// From one end to the other by so much.
fn twisted(mesh: &TriMesh, angle: f64) -> TriMesh {
    let bounds = mesh.bounding_box();
    deformed(mesh, |Vec3([x, y, z])| {
        let (sin, cos) = ((x - bounds.min[0]) / bounds.size()[0] * angle).sin_cos();
        Vec3([x, cos * y - sin * z, sin * y + cos * z])
    })
}

/// From one end to the other by so much, upward.
fn arched(mesh: &TriMesh, angle: f64) -> TriMesh {
    let radius = mesh.bounding_box().size()[0] / angle;
    deformed(mesh, |Vec3([x, y, z])| {
        let (sin, cos) = (x / radius).sin_cos();
        Vec3([(radius - z) * sin, y, radius - (radius - z) * cos])
    })
}

/// By a cage of 3 × 3 × 3 knots, as editors have it, whose knots went anywhere by so much of the diagonal.
fn caged(mesh: &TriMesh, amount: f64, seed: u8) -> TriMesh {
    let mut random = ChaCha20Rng::from_seed([seed; 32]);
    let mut uniform = || f64::from(random.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
    let bounds = mesh.bounding_box();
    let knots: [Vec3; 27] =
        std::array::from_fn(|_| Vec3([uniform(), uniform(), uniform()]) * (amount * bounds.diagonal()));
    let bernstein = |t: f64| [(1.0 - t).powi(2), 2.0 * t * (1.0 - t), t * t];
    deformed(mesh, |p| {
        let [a, b, c] = [0, 1, 2].map(|i| bernstein((p[i] - bounds.min[i]) / bounds.size()[i]));
        let weight = |k: usize| a[k / 9] * b[k / 3 % 3] * c[k % 3];
        p + (0..27).map(|k| knots[k] * weight(k)).sum::<Vec3>()
    })
}

/// What lies around a vertex, dragged as proportional editing does.
fn dragged(mesh: &TriMesh, at: usize, by: Vec3, radius: f64) -> TriMesh {
    let centre = mesh.point(at);
    deformed(mesh, |p| {
        let near = (1.0 - (p - centre).norm() / radius).max(0.0);
        p + by * (near * near * (3.0 - 2.0 * near))
    })
}

/// By six joints in a row, whose weights nobody has kept.
fn posed(mesh: &TriMesh, angle: f64) -> TriMesh {
    let bounds = mesh.bounding_box();
    deformed(mesh, |Vec3([x, y, z])| {
        let at = (x - bounds.min[0]) / bounds.size()[0] * 5.0;
        let turned = |joint: f64| {
            let pivot = bounds.min[0] + bounds.size()[0] * joint / 5.0;
            let (sin, cos) = (angle * joint).sin_cos();
            Vec3([
                cos * (x - pivot) - sin * z + pivot,
                y,
                sin * (x - pivot) + cos * z,
            ])
        };
        // Smooth at the ends, as bone heat is.
        let share = at.fract();
        let share = share * share * (3.0 - 2.0 * share);
        turned(at.floor()) * (1.0 - share) + turned(at.floor() + 1.0) * share
    })
}

/// Coordinates as files with 14 bits for each keep them.
fn rounded(mesh: &TriMesh) -> TriMesh {
    let bounds = mesh.bounding_box();
    let step = Vec3(bounds.size()) * (1.0 / 16383.0);
    deformed(mesh, |p| {
        Vec3(std::array::from_fn(|i| {
            ((p[i] - bounds.min[i]) / step[i]).round() * step[i] + bounds.min[i]
        }))
    })
}

fn is_verified_evidence(what: &str, suspect: &TriMesh) {
    let verdict = judged(suspect);
    assert_eq!(
        (verdict.outcome, verdict.matched_by),
        (Outcome::Verified, MatchedBy::LocalFrames),
        "{what}: {:?} {}",
        verdict.margin,
        verdict.p_value
    );
    assert!(verdict.is_evidence() && !verdict.is_for_owner_alone(), "{what}");
    assert!(verdict.overlap > 0.8 && verdict.mismatch.is_none(), "{what}");
}

#[test]
fn a_copy_that_was_bent_twisted_or_dragged_is_verified_and_is_evidence() {
    let mesh = signed().mesh();
    let diagonal = mesh.bounding_box().diagonal();
    is_verified_evidence("twist by 180°", &twisted(mesh, PI));
    is_verified_evidence("bend by 90°", &arched(mesh, PI / 2.0));
    is_verified_evidence("a cage", &caged(mesh, 0.15, 1));
    is_verified_evidence(
        "a drag",
        &dragged(mesh, 5, Vec3([0.1 * diagonal; 3]), 0.5 * diagonal),
    );
    is_verified_evidence("joints", &posed(mesh, 0.3));
}

#[test]
fn order_unit_hand_and_rounding_make_no_difference_to_a_bent_copy() {
    let bent = arched(&twisted(signed().mesh(), 1.0), 1.0);
    is_verified_evidence("shuffled", &shapes::shuffled(&bent, 5));
    is_verified_evidence("in another unit", &shapes::scaled(&bent, 1e-3));
    is_verified_evidence("mirrored", &shapes::mirrored(&bent));
    is_verified_evidence("rounded", &rounded(&bent));
}

/// As game models have them: few vertices, each far from the others.
fn low_poly() -> TriMesh {
    shapes::bumpy_torus(26, 14, 3)
}

/// Three pulls, each by a tenth of the diagonal.
fn pulled(mesh: &TriMesh) -> TriMesh {
    let diagonal = mesh.bounding_box().diagonal();
    let by = |way: [f64; 3]| Vec3(way) * (0.1 * diagonal / Vec3(way).norm());
    let pulls = [
        (0.0, by([0.2, 0.3, 1.0])),
        (0.1, by([-1.0, 0.4, 0.5])),
        (0.2, by([0.3, -1.0, 0.6])),
    ];
    pulls.into_iter().fold(mesh.clone(), |mesh, (at, by)| {
        let at = (at * mesh.vertex_count() as f64) as usize;
        dragged(&mesh, at, by, 0.25 * diagonal)
    })
}

/// Waves along one line, which leave nothing where it was.
fn waved(mesh: &TriMesh) -> TriMesh {
    let diagonal = mesh.bounding_box().diagonal();
    let way = Vec3([0.6, 0.0, 0.8]) * (0.04 * diagonal);
    deformed(mesh, |p| {
        let Vec3([x, y, z]) = p * (10.0 / diagonal);
        p + way * (y.sin() + (1.3 * x - z).cos())
    })
}

/// One side held, the other turned, and the rest as rigid as possible.
fn by_handles(mesh: &TriMesh, turn: Vec3) -> TriMesh {
    let (centre, size) = (mesh.bounding_box().centre(), mesh.bounding_box().size());
    let held = |v: usize| {
        let p = mesh.point(v) - Vec3(centre);
        let there = if p[0] > 0.0 { shapes::turned(p, turn) } else { p };
        (p[0].abs() > 0.4 * size[0]).then(|| there + Vec3(centre))
    };
    let held: Vec<Option<Vec3>> = (0..mesh.vertex_count()).map(held).collect();
    shapes::dragged(mesh, &held)
}

#[test]
fn a_low_poly_copy_that_was_bent_or_pulled_is_found() {
    let mesh = low_poly();
    let signed = Embedder::new(&key())
        .payload(Some(PayloadKind::Tag))
        .embed(&mesh, &Job::default())
        .unwrap();
    let certificate = signed.certificate();
    let verifier = Verifier::new(&mesh, certificate, certificate.public_key()).unwrap();
    let copy = signed.mesh();
    for (what, suspect) in [
        ("twist by 90°", twisted(copy, PI / 2.0)),
        ("bend by 90°", arched(copy, PI / 2.0)),
        ("pulls", pulled(copy)),
        ("waves", waved(copy)),
        ("handles by 60°", by_handles(copy, Vec3([PI / 3.0, 0.0, 0.0]))),
        (
            "handles by 120°",
            by_handles(copy, Vec3([2.0 * PI / 3.0, 0.0, 0.0])),
        ),
    ] {
        let verdict = verifier.verify(&suspect, &Job::default()).unwrap();
        let p = verdict.p_value;
        assert!(verdict.outcome.is_found() && p < 1e-12, "{what}: {p}");
        assert_eq!(verdict.matched_by, MatchedBy::LocalFrames, "{what}");
    }
}

#[test]
fn what_nothing_bent_is_read_as_ever_and_counts_no_more() {
    let mesh = signed().mesh();
    for suspect in [
        mesh.clone(),
        shapes::jittered(mesh, 0.2, 3),
        shapes::scaled(mesh, 3.0),
    ] {
        let found = Reader::new(original())
            .unwrap()
            .find(&suspect, &Job::default())
            .unwrap();
        let layout = layout(&original(), 512);
        assert!(found.in_local_frames(&layout, &Job::default()).unwrap().is_none());
    }
    // Twice for two rules of reading, four times where something may have been bent.
    let plain = judged(mesh);
    assert_eq!(plain.matched_by, MatchedBy::Connectivity);
}

/// A sphere as somebody begins with it, and what he makes of it.
fn sculpted(turn: f64) -> TriMesh {
    deformed(&shapes::icosphere(4), |p| {
        let Vec3([x, y, z]) = p;
        let height = (3.0 * x + turn).sin() + (4.0 * y - turn).cos() * z + (5.0 * z + 2.0 * turn).sin() * x;
        p * (1.0 + 0.12 * height)
    })
}

/// Whoever begins with such a sphere has these triangles, and one model lies on another in sixty ways.
#[test]
fn of_maps_between_sculpted_spheres_a_few_are_tried_and_the_right_one_is_among_them() {
    let original = sculpted(0.0);
    let signed = Embedder::new(&key()).embed(&original, &Job::default()).unwrap();
    let certificate = signed.certificate();
    let verifier = Verifier::new(&original, certificate, certificate.public_key()).unwrap();
    let posed = shapes::shuffled(&arched(&twisted(signed.mesh(), 1.0), 1.0), 7);
    let verdict = verifier.verify(&posed, &Job::default()).unwrap();
    assert_eq!(verdict.matched_by, MatchedBy::LocalFrames);
    assert!(verdict.p_value < 1e-12, "{}", verdict.p_value);

    let (reader, layout) = (Reader::new(&original).unwrap(), layout(&original, 192));
    let found = reader.find(sculpted(1.0), &Job::default()).unwrap();
    assert!(found.poses() > 8, "{}", found.poses());
    assert_eq!(
        found
            .in_local_frames(&layout, &Job::default())
            .unwrap()
            .unwrap()
            .poses(),
        8
    );
}

/// A mesh that is cut for so many bits.
fn layout(mesh: &TriMesh, bits: usize) -> MarkLayout {
    let original = Original::pooled(mesh.clone(), bits, Pool::default(), &Job::default()).unwrap();
    let plan = ChipPlan::pooled(bits, [8; 32]);
    MarkLayout::with_strength(original.into(), plan, Strength::default()).unwrap()
}

const BITS: usize = 192;

fn random_bits(random: &mut ChaCha20Rng) -> Vec<bool> {
    (0..BITS).map(|_| random.next_u32() & 1 == 1).collect()
}

/// Asks suspects, none of which has them, for words at random.
fn are_found_by_chance_alone(layout: &Arc<MarkLayout>, suspects: &[TriMesh], random: &mut ChaCha20Rng) {
    const TRIALS: u64 = 400;
    layout.original().keep_bases(&Job::default()).unwrap();
    let reader = Reader::new(layout.original().mesh()).unwrap();
    let method = ReadingMethod::joint(JointEstimator::new(layout).into());
    let mut below = [0_u64; 3];
    for suspect in suspects {
        let found = reader.find(suspect, &Job::default()).unwrap();
        let bent = found.in_local_frames(layout, &Job::default()).unwrap().unwrap();
        let readings = bent.readings(&method, &Job::default()).unwrap();
        for _ in 0..TRIALS {
            let bits = random_bits(random);
            let reading = readings.best(&bits, &Job::default()).unwrap();
            let p = p_of_chosen(&bits, &reading);
            for (count, level) in below.iter_mut().zip([0.1, 0.01, 1e-3]) {
                *count += u64::from(p <= level);
            }
        }
    }
    let trials = suspects.len() as u64 * TRIALS;
    // Four standard deviations of a binomial.
    for (count, level) in below.into_iter().zip([0.1, 0.01, 1e-3]) {
        let expected = level * trials as f64;
        assert!(
            count as f64 <= expected + 4.0 * expected.sqrt(),
            "{count} of {trials} below {level}"
        );
    }
}

#[test]
fn bits_that_are_not_there_are_found_by_chance_alone_in_bent_suspects() {
    let mesh = shapes::bumpy_sphere(4, 1);
    let layout = Arc::new(layout(&mesh, BITS));
    let mut random = ChaCha20Rng::from_seed([6; 32]);
    let strangers = layout.write(&random_bits(&mut random), &Job::default()).unwrap();
    let strangers = mesh
        .with_positions(strangers.positions(layout.original()))
        .unwrap();
    let suspects = [
        twisted(&mesh, PI),
        arched(&mesh, PI / 2.0),
        caged(&mesh, 0.2, 2),
        posed(&mesh, 0.4),
        caged(&strangers, 0.1, 3),
        twisted(&rounded(&strangers), PI / 2.0),
    ];
    are_found_by_chance_alone(&layout, &suspects, &mut random);
}

/// Which frames leave most of a mark is judged without looking at bits.
#[test]
fn bits_that_are_not_there_are_found_by_chance_alone_in_bent_low_poly_suspects() {
    let mesh = low_poly();
    let layout = Arc::new(layout(&mesh, BITS));
    let mut random = ChaCha20Rng::from_seed([9; 32]);
    let strangers = layout.write(&random_bits(&mut random), &Job::default()).unwrap();
    let strangers = mesh
        .with_positions(strangers.positions(layout.original()))
        .unwrap();
    let suspects = [
        twisted(&mesh, PI / 2.0),
        arched(&strangers, PI),
        pulled(&mesh),
        pulled(&strangers),
        waved(&mesh),
        waved(&strangers),
        by_handles(&mesh, Vec3([1.0, 0.5, 0.0])),
        by_handles(&strangers, Vec3([2.0, 0.0, 0.0])),
    ];
    are_found_by_chance_alone(&layout, &suspects, &mut random);
}

/// The forger's chair. Parts that were moved as a whole are read alone, but not asked alone whether it is the same shape: half of the original in a thing that is another elsewhere.
#[test]
fn half_of_the_original_in_another_shape_is_not_found() {
    let mesh = signed().mesh();
    let length = mesh.bounding_box().size()[0];
    let other = deformed(mesh, |Vec3([x, y, z])| {
        let t = (0.5 + 4.0 * x / length).clamp(0.0, 1.0);
        let flat = 1.0 - 0.9 * t * t * (3.0 - 2.0 * t);
        Vec3([x, flat * y, flat * z + 0.3 * (3.0 * x).sin() * t])
    });
    let verdict = judged(&other);
    assert!(!verdict.outcome.is_found());
    assert!(matches!(verdict.mismatch, Some(Mismatch::Shape { .. })));
}

/// The forger's chair. Which maps are tried is his choice where he makes the suspect: whichever they are, the best of eight readings is chosen, and counted.
#[test]
fn bits_that_are_not_there_are_found_by_chance_alone_under_the_maps_that_stretch_least() {
    let layout = Arc::new(layout(&sculpted(0.0), BITS));
    let mut random = ChaCha20Rng::from_seed([7; 32]);
    let suspects = [
        sculpted(1.0),
        arched(&sculpted(0.0), PI / 2.0),
        shapes::shuffled(&sculpted(2.0), 3),
    ];
    are_found_by_chance_alone(&layout, &suspects, &mut random);
}

/// Of a mesh what lies on one side of a slanted cut, in another order.
fn cut(mesh: &TriMesh, share: f64) -> TriMesh {
    let height = |p: [f64; 3]| p[0] + 0.3 * p[1];
    let mut heights: Vec<f64> = mesh.positions().iter().copied().map(height).collect();
    let most = *heights
        .select_nth_unstable_by((share * mesh.vertex_count() as f64) as usize, f64::total_cmp)
        .1;
    let is_left = |corners: &&[u32; 3]| {
        let mut corners = corners.iter();
        corners.all(|&v| height(mesh.positions()[v as usize]) < most)
    };
    let left = mesh.triangles().iter().filter(is_left).copied().collect();
    shapes::shuffled(&TriMesh::new(mesh.positions().to_vec(), left).unwrap(), 5)
}

#[test]
fn half_of_a_bent_copy_is_read_at_the_vertices_that_are_left() {
    let mesh = signed_body().mesh();
    let by_frames = MatchedBy::LocalFrames;
    let bent = [
        // Its surface lies so near that it is read as it is.
        (
            "twisted a little",
            cut(&twisted(mesh, 0.3), 0.5),
            MatchedBy::Surroundings,
        ),
        ("twisted", cut(&twisted(mesh, 2.0), 0.5), by_frames),
        (
            "arched, in loose triangles",
            shapes::exploded(&cut(&arched(mesh, 2.0), 0.5)),
            by_frames,
        ),
    ];
    for (what, bent, matched_by) in bent {
        let verdict = judged_by(signed_body(), &bent);
        assert_eq!(
            (verdict.outcome, verdict.matched_by),
            (Outcome::Verified, matched_by),
            "{what}: {:?} {}",
            verdict.margin,
            verdict.p_value
        );
        assert!(
            verdict.is_evidence() && (0.3..0.6).contains(&verdict.coverage),
            "{what}"
        );
    }
    let unmarked = judged_by(signed_body(), &cut(&twisted(&body(), 2.0), 0.5));
    assert!(!unmarked.outcome.is_found());
}

/// The mark, put on another mesh of the same triangles.
fn copied_onto(other: &TriMesh) -> TriMesh {
    let (mesh, signed) = (original(), signed().mesh());
    let place = |v: usize| (other.point(v) + signed.point(v) - mesh.point(v)).into();
    let places = (0..mesh.vertex_count()).map(place).collect();
    other.with_positions(places).unwrap()
}

/// The forger's chair. A mark can be copied onto any mesh with these triangles. What is no smooth deformation of the original, or one that stretches a fifth of it to more than 2½ times or less than two fifths, is another shape; of what is one, it can't be told that it was not bent out of a signed copy.
#[test]
fn a_mark_that_was_copied_onto_another_shape_is_found_there_only_if_that_is_the_original_bent() {
    let mesh = original();
    let stretched = deformed(&mesh, |Vec3([x, y, z])| Vec3([x, 0.3 * y, z * (1.0 + 2.0 * x)]));
    let flat = deformed(&mesh, |Vec3([x, y, _])| Vec3([x, y, 0.0]));
    let sphere = deformed(&mesh, Vec3::unit);
    for (what, other) in [("stretched", stretched), ("flat", flat), ("round", sphere)] {
        let verdict = judged(&copied_onto(&other));
        assert!(
            !verdict.outcome.is_found() && !verdict.is_evidence(),
            "{what}: {verdict:?}"
        );
        assert!(matches!(verdict.mismatch, Some(Mismatch::Shape { .. })), "{what}");
    }
    is_verified_evidence("bumps", &copied_onto(&shapes::bumped(&mesh, 0.2, 9)));
}

/// The forger's chair: shapes are judged by what is left of them.
#[test]
fn in_half_of_another_shape_a_copied_mark_is_found_only_if_that_half_is_the_originals_bent() {
    let mesh = original();
    let flat = deformed(&mesh, |Vec3([x, y, _])| Vec3([x, y, 0.0]));
    let thin = deformed(&mesh, |Vec3([x, y, z])| Vec3([x, 0.1 * y, z]));
    for (what, other) in [("flat", flat), ("thin", thin)] {
        let verdict = judged(&cut(&copied_onto(&other), 0.5));
        assert!(
            !verdict.outcome.is_found() && !verdict.is_evidence(),
            "{what}: {:?} {} {}",
            verdict.matched_by,
            verdict.p_value,
            verdict.overlap
        );
    }
    // Four fifths of what is left of this one are not stretched too far beside each other, as they are not of the whole: it can't be told from half of a bent copy.
    let stretched = deformed(&mesh, |Vec3([x, y, z])| Vec3([x, 0.3 * y, z * (1.0 + 2.0 * x)]));
    let verdict = judged(&cut(&copied_onto(&stretched), 0.5));
    let seen = format!("{:?} {} {}", verdict.matched_by, verdict.p_value, verdict.overlap);
    assert!(
        verdict.outcome.is_found() && verdict.matched_by == MatchedBy::LocalFrames,
        "{seen}"
    );
    assert!(
        (0.8..0.9).contains(&verdict.overlap) && verdict.mismatch.is_none(),
        "{seen}"
    );
}

/// The forger's chair. Who knows a mark's bits and has a model without it may bend that so that it looks marked, as far as a smooth map of space can: what is smooth is nobody's bits.
#[test]
fn a_smooth_map_that_imitates_a_mark_is_taken_for_a_bend() {
    let (mesh, signed) = (original(), signed().mesh());
    let mark: Vec<Vec3> = (0..mesh.vertex_count())
        .map(|v| signed.point(v) - mesh.point(v))
        .collect();
    let imitated = nearest_cubic(&mesh, &mark);
    for times in [1.0, 30.0] {
        let place = |v: usize| (mesh.point(v) + imitated[v] * times).into();
        let suspect = mesh
            .with_positions((0..mesh.vertex_count()).map(place).collect())
            .unwrap();
        let verdict = judged(&twisted(&suspect, 1.0));
        assert!(
            !verdict.outcome.is_found(),
            "{times}: {:?} {}",
            verdict.margin,
            verdict.p_value
        );
    }
}

/// The polynomial of degree 3 of a place that is nearest to a field, at the vertices of a mesh (Gauss–Seidel on the normal equations).
fn nearest_cubic(mesh: &TriMesh, field: &[Vec3]) -> Vec<Vec3> {
    let monomials = |Vec3([x, y, z]): Vec3| -> Vec<f64> {
        let powers =
            (0..4).flat_map(|i| (0..4 - i).flat_map(move |j| (0..4 - i - j).map(move |k| (i, j, k))));
        powers
            .map(|(i, j, k)| x.powi(i) * y.powi(j) * z.powi(k))
            .collect()
    };
    let rows: Vec<Vec<f64>> = (0..mesh.vertex_count())
        .map(|v| monomials(mesh.point(v)))
        .collect();
    let count = rows[0].len();
    let mut rest = field.to_vec();
    for _ in 0..200 {
        for k in 0..count {
            let squares: f64 = rows.iter().map(|row| row[k] * row[k]).sum();
            let product: Vec3 = rows.iter().zip(&rest).map(|(row, r)| *r * row[k]).sum();
            let step = product * (1.0 / squares);
            for (row, r) in rows.iter().zip(&mut rest) {
                *r -= step * row[k];
            }
        }
    }
    field.iter().zip(rest).map(|(f, r)| *f - r).collect()
}

#[test]
fn a_bent_copy_names_its_buyer() {
    let (mesh, key, job) = (original(), key(), Job::default());
    let prepared = Embedder::new(&key).prepare(&mesh, &job).unwrap();
    let mut tracer = Tracer::new(&mesh, &key.public_key()).unwrap();
    let mut copies = Vec::new();
    for buyer in ["Anna", "Bert", "Carl"] {
        let copy = prepared.embed_for(buyer, &job).unwrap();
        tracer.add(&copy.certificate().clone().into()).unwrap();
        copies.push(copy.mesh().clone());
    }
    let trace = tracer.trace(twisted(&copies[2], 1.5), &job).unwrap();
    let named: Vec<usize> = trace.accused.iter().map(|accused| accused.candidate).collect();
    assert_eq!((named, trace.matched_by), (vec![2], MatchedBy::LocalFrames));
    assert!(
        tracer
            .trace(twisted(&mesh, 1.5), &job)
            .unwrap()
            .accused
            .is_empty()
    );
}

/// Other triangles, about so many times as many.
fn with_other_vertices(mesh: &TriMesh, share: f64) -> TriMesh {
    let target = (mesh.triangle_count() as f64 * share) as usize;
    decimation::decimate(mesh, target, decimation::Decimator::Queue, &Job::default()).unwrap()
}

/// Long, and smooth.
fn body() -> TriMesh {
    let long = |Vec3([x, y, z])| Vec3([4.0 * x, y, 0.8 * z + 0.1 * x * y]);
    deformed(&shapes::bumpy_sphere(5, 7), long)
}

fn signed_body() -> &'static Signed {
    static SIGNED: OnceLock<Signed> = OnceLock::new();
    SIGNED.get_or_init(|| sign(&body()))
}

/// What is said of a mesh beside the body, once it has half of the triangles.
fn judged_as_body(mesh: &TriMesh) -> Verdict {
    judged_by(signed_body(), &with_other_vertices(mesh, 0.5))
}

#[test]
fn a_copy_that_was_bent_and_then_decimated_is_found_by_its_surface() {
    let verdict = judged_as_body(&arched(signed_body().mesh(), PI / 3.0));
    assert_eq!(
        verdict.matched_by,
        MatchedBy::BentSurface,
        "{:?} {}",
        verdict.margin,
        verdict.p_value
    );
    // So smooth a body of ten thousand vertices tells less than a scan does.
    assert!(verdict.outcome.is_found(), "{}", verdict.p_value);
    assert!(
        verdict.transform.is_none() && verdict.overlap > 0.8,
        "{}",
        verdict.overlap
    );
    let unmarked = judged_as_body(&arched(&body(), PI / 3.0));
    assert!(
        matches!(unmarked.outcome, Outcome::NotFound { .. }),
        "{}",
        unmarked.p_value
    );
}

/// The forger's chair: the mark on a body that grows to three times the width at one end. No pose makes that of it.
#[test]
fn a_mark_that_was_carried_onto_another_shape_is_not_found_by_its_surface() {
    let bounds = body().bounding_box();
    let widened = deformed(signed_body().mesh(), |Vec3([x, y, z])| {
        let along = (x - bounds.min[0]) / bounds.size()[0];
        Vec3([x, y * (1.0 + 2.0 * along), z * (1.0 + 2.0 * along)])
    });
    let verdict = judged_as_body(&widened);
    assert!(
        matches!(verdict.outcome, Outcome::NotFound { .. }) && verdict.overlap < 0.8,
        "{:?} {}",
        verdict.matched_by,
        verdict.overlap
    );
}
