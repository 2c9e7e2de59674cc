//! Whose copy was it? A model is sold to many, and one or several of them give it away.

#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use job::Job;
use mesh::{Similarity, TriMesh, Welded, components, shapes};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use registration::MatchedBy;
use sigmark::{
    Certificate, Curve, Embedder, SigningKey, Verifier,
    claim::{CertificateReader, Trace, Tracer},
    mark::Original,
};

const BUYERS: usize = 24;

/// What colluders make of the coordinates that each has, the least first.
type Rule<'a> = &'a dyn Fn(&mut [f64]) -> f64;

fn key(number: u8) -> SigningKey {
    SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([number; 32]))
}

struct Shop {
    original: Arc<Original>,
    copies: Vec<TriMesh>,
    certificates: Vec<Certificate>,
}

impl Shop {
    fn new(mesh: &TriMesh, buyers: usize) -> Self {
        let job = Job::default();
        let embedder = Embedder::new(&key(1)).message("© 2026 Studio");
        let original = Arc::new(embedder.cut(mesh, &job).unwrap());
        original.keep_bases(&job).unwrap();
        let sell = |buyer: usize| {
            let embedder = embedder.clone().recipient(format!("order {buyer}"));
            let signed = embedder.embed_in(&original, &job).unwrap();
            (signed.mesh().clone(), signed.certificate().clone())
        };
        let (copies, certificates) = (0..buyers).map(sell).unzip();
        Self {
            original,
            copies,
            certificates,
        }
    }

    fn tracer(&self) -> Tracer {
        let mut tracer = Tracer::new(self.original.mesh(), &key(1).public_key()).unwrap();
        for (i, certificate) in self.certificates.iter().enumerate() {
            assert_eq!(tracer.add(&certificate.clone().into()).unwrap(), i);
        }
        tracer
    }

    /// Each coordinate as some rule makes it of the colluders' own.
    fn made_of(&self, colluders: &[usize], rule: impl Fn(&mut [f64]) -> f64) -> TriMesh {
        let original = self.original.mesh();
        let coordinate = |v: usize, axis: usize| {
            let mut own: Vec<f64> = colluders
                .iter()
                .map(|&c| self.copies[c].positions()[v][axis])
                .collect();
            own.sort_by(f64::total_cmp);
            rule(&mut own)
        };
        let positions = (0..original.vertex_count()).map(|v| std::array::from_fn(|axis| coordinate(v, axis)));
        original.with_positions(positions.collect()).unwrap()
    }
}

fn named(trace: &Trace) -> Vec<usize> {
    let mut named: Vec<usize> = trace.accused.iter().map(|accused| accused.candidate).collect();
    named.sort_unstable();
    named
}

fn model() -> TriMesh {
    shapes::bumpy_sphere(5, 3)
}

#[test]
fn a_leaked_copy_names_its_buyer_and_nobody_else() {
    let shop = Shop::new(&model(), BUYERS);
    let tracer = shop.tracer();
    for leak in [0, 7, BUYERS - 1] {
        let moved = shapes::translated(&shapes::scaled(&shop.copies[leak], 3.0), [5.0, 0.0, -1.0]);
        let trace = tracer.trace(&moved, &Job::default()).unwrap();
        assert_eq!(named(&trace), [leak]);
        assert!(trace.accused[0].p_value < 1e-100, "{:?}", trace.accused);
        assert_eq!(trace.candidates, BUYERS);
    }
}

#[test]
fn who_gave_copies_together_are_named_one_after_the_other() {
    let shop = Shop::new(&model(), BUYERS);
    let tracer = shop.tracer();
    let mean = |own: &mut [f64]| own.iter().sum::<f64>() / own.len() as f64;
    let middle = |own: &mut [f64]| own[own.len() / 2];
    let ends = |own: &mut [f64]| 0.5 * (own[0] + own[own.len() - 1]);
    // The end that is farther from the middle.
    let minority = |own: &mut [f64]| {
        let (low, high) = (own[0], own[own.len() - 1]);
        let middle = own[own.len() / 2];
        if middle - low > high - middle { low } else { high }
    };
    let rules: [(&str, Rule<'_>); 4] = [
        ("mean", &mean),
        ("median", &middle),
        ("min-max", &ends),
        ("minority", &minority),
    ];
    for (name, rule) in rules {
        let colluders = [2, 11, 19];
        let trace = tracer
            .trace(shop.made_of(&colluders, rule), &Job::default())
            .unwrap();
        let named = named(&trace);
        assert!(named.len() >= 2, "{name}: {:?}", trace.accused);
        assert!(
            named.iter().all(|c| colluders.contains(c)),
            "{name}: {:?}",
            trace.accused
        );
    }
    let twelve: Vec<usize> = (0..12).collect();
    let trace = tracer
        .trace(shop.made_of(&twelve, mean), &Job::default())
        .unwrap();
    assert!(named(&trace).len() >= 5, "{:?}", trace.accused);
    assert!(named(&trace).iter().all(|&c| c < 12));
}

/// A model of parts is taken apart, and each part goes another way; two parts are alike.
#[test]
fn parts_that_were_moved_alone_name_the_buyer() {
    let wheel = shapes::bumpy_torus(60, 30, 2);
    let scene = shapes::disjoint_union(&[
        shapes::bumpy_sphere(4, 1),
        shapes::translated(&wheel, [6.0, 0.0, 0.0]),
        shapes::translated(&wheel, [6.0, 8.0, 0.0]),
    ]);
    let shop = Shop::new(&scene, BUYERS);
    let taken_apart = |mesh: &TriMesh| {
        let of_vertex = components(mesh).of_vertex;
        let moved = |(v, position): (usize, &[f64; 3])| {
            let part = f64::from(of_vertex[v]);
            let turn = Similarity::from_quaternion([1.0, 0.3 * part, -0.4, 0.2]);
            turn.apply([position[0] + 20.0 * part, position[1], position[2]])
        };
        let positions = mesh.positions().iter().enumerate().map(moved).collect();
        shapes::shuffled(&mesh.with_positions(positions).unwrap(), 5)
    };
    let tracer = shop.tracer();
    let trace = tracer
        .trace(taken_apart(&shop.copies[9]), &Job::default())
        .unwrap();
    assert_eq!(named(&trace), [9]);
    assert_eq!(trace.matched_by, MatchedBy::Parts);
    assert!(
        trace.accused[0].p_value < 1e-30 && trace.overlap > 0.9,
        "{trace:?}"
    );
    assert!(trace.poses >= 2, "the wheels may have changed places: {trace:?}");
    let trace = tracer.trace(taken_apart(&scene), &Job::default()).unwrap();
    assert!(!trace.is_found(), "{trace:?}");
}

#[test]
fn a_floor_or_a_triangle_far_away_hides_no_buyer() {
    let shop = Shop::new(&model(), BUYERS);
    let tracer = shop.tracer();
    let floor = shapes::translated(&shapes::rectangle(1, 1, 60.0, 60.0), [-30.0, -30.0, -2.0]);
    let far_away = shapes::translated(&shapes::tetrahedron(), [1e7, 0.0, 3e5]);
    let both = shapes::disjoint_union(&[floor.clone(), far_away.clone()]);
    for added in [floor, far_away, both] {
        let beside = |mesh: &TriMesh| {
            // With other vertices and without a quarter, so that the copy is no part that is put back by itself.
            let kept = mesh
                .triangles()
                .iter()
                .filter(|corners| corners.iter().all(|&v| mesh.positions()[v as usize][0] < 0.5));
            let kept: Vec<[u32; 3]> = kept.copied().collect();
            let copy = Welded::new(mesh.positions(), &kept).unwrap().into_mesh();
            shapes::disjoint_union(&[shapes::divided(&copy), added.clone()])
        };
        let trace = tracer.trace(beside(&shop.copies[5]), &Job::default()).unwrap();
        assert_eq!(named(&trace), [5]);
        let trace = tracer.trace(beside(&model()), &Job::default()).unwrap();
        assert!(!trace.is_found(), "{:?}", trace.accused);
    }
}

#[test]
fn nobody_is_named_for_what_no_buyer_had() {
    let shop = Shop::new(&model(), BUYERS);
    let job = Job::default();
    let tracer = shop.tracer();
    let embedder = Embedder::new(&key(1)).message("© 2026 Studio");
    let to_another = embedder
        .clone()
        .recipient("order 4711")
        .embed_in(&shop.original, &job)
        .unwrap();
    let by_another = Embedder::new(&key(2)).embed_in(&shop.original, &job).unwrap();
    let unmarked = shop.original.mesh();
    for suspect in [
        unmarked,
        to_another.mesh(),
        by_another.mesh(),
        &shapes::bumpy_sphere(4, 4),
        &shapes::tetrahedron(),
    ] {
        let trace = tracer.trace(suspect, &job).unwrap();
        assert!(!trace.is_found(), "{:?}", trace.accused);
    }
    let trace = tracer.trace(shapes::tetrahedron(), &job).unwrap();
    assert!(trace.mismatch.is_some());
}

/// What is read of the copy of one agrees with that of no other by more than chance allows.
#[test]
fn innocents_agree_as_fair_coins_do() {
    use sigmark::claim::trace::Pattern;
    let shop = Shop::new(&shapes::bumpy_sphere(4, 3), 2);
    let suspect = shop.made_of(&[0, 1], |own| own[0]);
    let read = shop.tracer().read(&suspect, &Job::default()).unwrap();
    let residue = &read.residues()[0][0];
    let bits = shop.certificates[0].bits().len();
    let of = |i: u64| {
        let mut rng = ChaCha20Rng::seed_from_u64(i);
        use rand_chacha::rand_core::Rng;
        let mut hash = [0; 32];
        rng.fill_bytes(&mut hash);
        let bits = (0..bits).map(|_| rng.next_u32() & 1 == 1).collect();
        residue.correlation(&Pattern { hash, bits })
    };
    let correlations: Vec<f64> = (0..2000).map(of).collect();
    let mean = correlations.iter().sum::<f64>() / 2000.0;
    let square = correlations.iter().map(|t| t * t).sum::<f64>() / 2000.0;
    // Standard deviations of mean and square are 0.022 and 0.032.
    assert!(
        mean.abs() < 0.11 && (square - 1.0).abs() < 0.16,
        "{mean} {square}"
    );
    assert!(correlations.iter().all(|&t| t < 5.0));
}

#[test]
fn certificates_that_were_edited_name_nobody() {
    let shop = Shop::new(&model(), 3);
    let job = Job::default();
    let reader = CertificateReader::new();
    let mut tracer = Tracer::new(shop.original.mesh(), &key(1).public_key()).unwrap();
    // The name of another in the place of his who gave the copy away: then its hash is another, and it is another pattern.
    for certificate in &shop.certificates {
        let text = certificate.to_json().unwrap();
        let edited = text.replace("order 1", "order 9");
        tracer.add(&reader.read(&edited).unwrap()).unwrap();
    }
    let trace = tracer.trace(&shop.copies[1], &job).unwrap();
    assert!(!trace.is_found() && trace.unsigned.is_empty());
    // His own mark was not asked for, and nobody is told so that it is not in there.
    assert_eq!(trace.altered, [1]);
    // The same statement with another seal is the same pattern, and is refused when it would be named.
    let mut tracer = Tracer::new(shop.original.mesh(), &key(1).public_key()).unwrap();
    let text = shop.certificates[1].to_json().unwrap();
    let other = shop.certificates[0].to_json().unwrap();
    let seal = |text: &str| {
        let value: serde_json::Value = serde_json::from_str(text).unwrap();
        value["seal"].as_str().unwrap().to_owned()
    };
    let edited = reader.read(&text.replace(&seal(&text), &seal(&other))).unwrap();
    assert!(tracer.add(&edited).is_err(), "the first of a layout is checked");
    tracer.add(&reader.read(&other).unwrap()).unwrap();
    tracer.add(&edited).unwrap();
    let trace = tracer.trace(&shop.copies[1], &job).unwrap();
    assert!(!trace.is_found());
    assert_eq!((trace.unsigned, trace.altered), (vec![1], Vec::new()));
    // Beside the true one it shields nobody, whichever comes first.
    tracer.add(&reader.read(&text).unwrap()).unwrap();
    let trace = tracer.trace(&shop.copies[1], &job).unwrap();
    assert_eq!((named(&trace), trace.candidates), (vec![2], 2));
}

#[test]
fn certificates_of_other_originals_and_keys_are_refused() {
    let shop = Shop::new(&shapes::bumpy_sphere(4, 3), 1);
    let issued = shop.certificates[0].clone().into();
    assert!(
        Tracer::new(&shapes::bumpy_sphere(4, 5), &key(1).public_key())
            .unwrap()
            .add(&issued)
            .is_err()
    );
    assert!(
        Tracer::new(shop.original.mesh(), &key(2).public_key())
            .unwrap()
            .add(&issued)
            .is_err()
    );
}

#[test]
fn of_what_was_bent_and_cut_a_trace_sees_as_much_as_a_verdict() {
    let shop = Shop::new(&shapes::bumpy_sphere(4, 3), 2);
    let copy = &shop.copies[1];
    let bent = copy.positions().iter().map(|&[x, y, z]| {
        let (sin, cos) = (1.2 * x).sin_cos();
        [x, y * cos - z * sin, y * sin + z * cos]
    });
    let bent: Vec<[f64; 3]> = bent.collect();
    let is_kept = |corners: &&[u32; 3]| corners.iter().all(|&v| copy.positions()[v as usize][0] > -0.3);
    let kept: Vec<[u32; 3]> = copy.triangles().iter().filter(is_kept).copied().collect();
    let suspect = Welded::new(&bent, &kept).unwrap().into_mesh();

    let job = Job::default();
    let trace = shop.tracer().trace(&suspect, &job).unwrap();
    let certificate = &shop.certificates[1];
    let verifier = Verifier::new(shop.original.mesh(), certificate, certificate.public_key()).unwrap();
    let verdict = verifier.verify(&suspect, &job).unwrap();
    assert_eq!(named(&trace), [1]);
    assert_eq!(
        (trace.matched_by, verdict.matched_by),
        (MatchedBy::LocalFrames, MatchedBy::LocalFrames)
    );
    assert!(verdict.coverage < 0.8, "{verdict:?}");
    assert_eq!(
        (trace.overlap, trace.coverage),
        (verdict.overlap, verdict.coverage)
    );
}
