//! What the paper claims of the mark, and what a user expects of a verdict.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use std::sync::Arc;

use job::{Job, JobError, Observer};
use mesh::{Similarity, TriMesh, shapes};
use mhb_core::{LaplacianKind, Spectrum, SpectrumOptions};
use proptest::prelude::*;
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use sigmark::{
    Certificate, Curve, Embedder, Mismatch, Outcome, PayloadKind, Scheme, SigmarkError, Signed, SigningKey,
    Strength, Verdict, Verifier,
    claim::statistics::p_value,
    mark::{
        ChipLayout, ChipPlan, CoefficientDetector, Detector, MarkError, MarkLayout, Original, Patch,
        PatchBasis, PatchCount, Pool, Registered,
    },
};

fn key(curve: Curve, seed: u8) -> SigningKey {
    SigningKey::generate(curve, &mut ChaCha20Rng::from_seed([seed; 32]))
}

fn sign(mesh: &TriMesh, seed: u8) -> Signed {
    Embedder::new(&key(Curve::P256, seed))
        .message("order 4711")
        .embed(mesh, &Job::default())
        .unwrap()
}

fn judge(original: &TriMesh, signed: &Signed, suspect: &TriMesh) -> Verdict {
    let certificate = signed.certificate();
    Verifier::new(original, certificate, certificate.public_key())
        .unwrap()
        .paper_profile(true)
        .verify(suspect, &Job::default())
        .unwrap()
}

/// Bits, and how they lie: as often in every patch as a chip rate says, or pooled over all patches.
#[derive(Clone, Debug)]
struct Laid {
    bits: Vec<bool>,
    /// c; none for a pooled mark.
    rate: Option<usize>,
}

impl Laid {
    fn pooled(bits: usize) -> Self {
        let bits = (0..bits).map(|i| i * i % 7 < 3).collect();
        Self { bits, rate: None }
    }

    fn plan(&self) -> ChipPlan {
        let bits = self.bits.len();
        match self.rate {
            Some(rate) => ChipPlan::EveryPatch(ChipLayout::new(bits, rate).unwrap()),
            None => ChipPlan::pooled(bits, [3; 32]),
        }
    }

    /// The mesh cut into some patches, pooled ones of unequal numbers of harmonics.
    fn cut(&self, mesh: &TriMesh, patches: usize, job: &Job) -> Original {
        let bits = self.bits.len();
        let count = PatchCount::Exactly(patches);
        match self.rate {
            Some(rate) => {
                let functions = ChipLayout::new(bits, rate).unwrap().functions();
                Original::cut(mesh.clone(), functions, count, job).unwrap()
            }
            None => {
                let mut pool = Pool::default();
                (pool.patches, pool.repetitions) = (Some(patches), Some(2));
                Original::pooled(mesh.clone(), bits, pool, job).unwrap()
            }
        }
    }

    /// A mark of one strength in all patches.
    fn mark(&self, original: Original, alpha: f64) -> Arc<MarkLayout> {
        let alphas = vec![alpha; original.patches().len()];
        Arc::new(MarkLayout::new(Arc::new(original), self.plan(), alphas).unwrap())
    }

    fn displacement(&self, original: &Original, alpha: f64, threads: usize) -> Vec<[f64; 3]> {
        let mark = self.mark(original.clone(), alpha);
        mark.write(&self.bits, &Job::new(threads)).unwrap().displacement
    }
}

fn laid() -> impl Strategy<Value = Laid> {
    let bits = prop::collection::vec(any::<bool>(), 6..40);
    (bits, prop::option::of(1usize..4)).prop_map(|(bits, rate)| Laid { bits, rate })
}

fn farthest(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let distance = |(p, q): (&[f64; 3], &[f64; 3])| (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>().sqrt();
    a.iter().zip(b).map(distance).fold(0.0, f64::max)
}

/// Closed, open, of higher genus, irregular, in pieces.
fn surface() -> impl Strategy<Value = TriMesh> {
    (0..6, 0..1000u64).prop_map(|(kind, seed)| match kind {
        0 => shapes::bumpy_sphere(3, seed),
        1 => shapes::bumpy_torus(30, 20, seed),
        2 => shapes::bumpy_block(2, 4, seed),
        3 => shapes::jittered(&shapes::rectangle(20, 24, 2.0, 1.0), 0.3, seed),
        4 => shapes::flipped(&shapes::bumpy_sphere(3, seed), seed),
        _ => shapes::disjoint_union(&[
            shapes::bumpy_sphere(3, seed),
            shapes::translated(&shapes::bumpy_torus(30, 20, seed + 1), [9.0, 0.0, 0.0]),
        ]),
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// The mark written by the steps of the paper with m₂ functions, compensation included (eqs. 6–8, 12–14), is the one
    /// written with the least number m₁, whether that is the same in all patches or not.
    #[test]
    fn theorem_1_the_marked_mesh_does_not_depend_on_how_many_functions_are_computed(
        mesh in surface(),
        laid in laid(),
        patches in 1usize..4,
        alpha in 1e-6f64..1e-2,
        more in 1usize..40,
    ) {
        let least = laid.cut(&mesh, patches, &Job::default());
        let marked: Vec<[f64; 3]> = mesh.positions().iter().zip(laid.displacement(&least, alpha, 1))
            .map(|(p, d)| std::array::from_fn(|i| p[i] + d[i])).collect();
        let mark = laid.mark(least.clone(), alpha);

        least.map_bases(|index, patch, basis| {
            let free = patch.at_border().iter().filter(|&&held| !held).count();
            let count = (least.functions()[index] + more).min(free);
            let options = SpectrumOptions { count, ..SpectrumOptions::default() };
            let spectrum = Spectrum::with_fixed(patch.mesh(), patch.at_border(), &options, &Job::default()).unwrap();
            let positions = patch.mesh().positions();
            let difference = spectrum.reconstruction_difference(positions);
            let mut coefficients = spectrum.transform_positions(positions);
            // α belongs to unit area: coefficients in the model's own measure are √area times larger.
            let modulation = mark.modulation(index, &laid.bits);
            for (row, added) in coefficients.iter_mut().zip(modulation) {
                for axis in 0..3 {
                    row[axis] += basis.area().sqrt() * added[axis];
                }
            }
            let rebuilt: Vec<[f64; 3]> = spectrum.inverse_transform_positions(&coefficients).iter().zip(&difference)
                .map(|(p, d)| std::array::from_fn(|i| p[i] + d[i])).collect();
            let gap = farthest(&rebuilt, &patch.gather(&marked));
            assert!(gap <= 1e-9 * mesh.bounding_box().diagonal(), "{gap:e}");
        }, &Job::default()).unwrap();
    }

    #[test]
    fn without_an_attack_every_sum_is_that_of_its_chips(mesh in surface(), laid in laid(), patches in 1usize..4) {
        // eq. 16: c α φ s″ where patches and axes are alike
        let mark = laid.mark(laid.cut(&mesh, patches, &Job::default()), 1e-4);
        let added = mark.write(&laid.bits, &Job::default()).unwrap().displacement;
        let positions = mesh.positions().iter().zip(&added)
            .map(|(p, d)| Some(std::array::from_fn(|i| p[i] + d[i]))).collect();
        let detector = CoefficientDetector::new(&mark);
        let soft = detector.detect(&Registered::by_vertices(positions), &Job::default()).unwrap();
        let mut expected = vec![0.0; laid.bits.len()];
        for i in 0..mark.original().patches().len() {
            for chip in mark.chips(i) {
                let added = mark.amplitude(i)[chip.axis];
                expected[chip.bit] += if laid.bits[chip.bit] { added } else { -added };
            }
        }
        let tolerance = 1e-10 * mesh.bounding_box().diagonal();
        for (q, e) in soft.values().iter().zip(&expected) {
            prop_assert!((q - e).abs() <= tolerance, "{q} {e}");
        }
    }

    #[test]
    fn the_mark_is_the_same_with_one_thread_and_with_two(mesh in surface(), laid in laid()) {
        let [one, two] = [1, 2].map(|threads| {
            let original = laid.cut(&mesh, 3, &Job::new(threads));
            laid.displacement(&original, 1e-3, threads)
        });
        prop_assert_eq!(one, two);
    }

    #[test]
    fn the_mark_grows_with_the_model(mesh in surface(), laid in laid(), exponent in -6i32..7) {
        let factor = 10f64.powi(exponent);
        let of = |mesh: &TriMesh| laid.displacement(&laid.cut(mesh, 2, &Job::default()), 1e-3, 1);
        let small: Vec<[f64; 3]> = of(&mesh).iter().map(|d| d.map(|x| factor * x)).collect();
        let gap = farthest(&of(&shapes::scaled(&mesh, factor)), &small);
        prop_assert!(gap <= 1e-6 * 1e-3 * factor * mesh.bounding_box().diagonal(), "{gap:e}");
    }
}

#[test]
fn pooled_patches_of_unequal_size_have_unequal_numbers_of_harmonics() {
    let mesh = shapes::disjoint_union(&[
        shapes::bumpy_sphere(3, 1),
        shapes::translated(&shapes::bumpy_torus(40, 30, 2), [9.0, 0.0, 0.0]),
    ]);
    let cut = Laid::pooled(96).cut(&mesh, 3, &Job::default());
    let least = cut.functions().iter().min();
    assert!(cut.functions().iter().max() > least, "{:?}", cut.functions());
}

/// Patches above the size up to which eigenproblems are solved densely, where one patch has all threads and several have one each.
#[test]
fn the_mark_of_large_patches_is_the_same_with_one_thread_and_with_three() {
    let mesh = shapes::bumpy_torus(80, 40, 6);
    let laid = Laid::pooled(96);
    for patches in [1, 3] {
        let [one, three] = [1, 3].map(|threads| {
            let original = laid.cut(&mesh, patches, &Job::new(threads));
            let patches = original.patches().iter();
            assert!(patches.into_iter().all(|patch| patch.vertices().len() > 640));
            laid.displacement(&original, 1e-3, threads)
        });
        assert_eq!(one, three);
    }
}

/// Blocks, bands, tolerance: other paths through the solver, other roundings, the same mark.
#[test]
fn the_mark_does_not_depend_on_the_solver_s_settings() {
    let laid = Laid::pooled(96);
    for mesh in [
        shapes::bumpy_sphere(4, 3),
        shapes::icosphere(4),
        shapes::bumpy_torus(60, 40, 2),
    ] {
        let layout = laid.mark(laid.cut(&mesh, 3, &Job::default()), 1e-4);
        let original = layout.original();
        let mark = laid.displacement(original, 1e-4, 1);
        for (block, band, tolerance) in [(16, 31, 1e-10), (8, 500, 1e-10), (8, 60, 1e-12)] {
            let settings = SpectrumOptions {
                block,
                band,
                tolerance,
                ..SpectrumOptions::default()
            };
            let size = farthest(&mark, &vec![[0.0; 3]; mark.len()]);
            let gap = |index: usize, patch: &Patch, basis: &PatchBasis| {
                let fixed = patch.at_border();
                let settings = SpectrumOptions {
                    count: original.functions()[index],
                    ..settings.clone()
                };
                let spectrum = Spectrum::with_fixed(patch.mesh(), fixed, &settings, &Job::default()).unwrap();
                let unit = basis.area().sqrt();
                let coefficients = layout.modulation(index, &laid.bits);
                let other = spectrum.inverse_transform_positions(&coefficients);
                let other: Vec<[f64; 3]> = other.into_iter().map(|row| row.map(|x| unit * x)).collect();
                farthest(&patch.gather(&mark), &other)
            };
            let gaps = original.map_bases(gap, &Job::default()).unwrap();
            let gap = gaps.into_iter().fold(0.0, f64::max);
            assert!(
                gap <= 1e-6 * size,
                "{block}, {band}, {tolerance:e}: {:e}",
                gap / size
            );
        }
    }
}

#[test]
fn a_certificate_says_which_laplacian_gave_the_harmonics() {
    let mesh = shapes::bumpy_torus(48, 32, 5);
    let key = key(Curve::P256, 9);
    let embed = |kind| {
        Embedder::new(&key)
            .chip_rate(1)
            .laplacian(kind)
            .embed(&mesh, &Job::default())
            .unwrap()
    };
    let [cotangent, intrinsic] = [LaplacianKind::Cotangent, LaplacianKind::Intrinsic].map(embed);
    assert_ne!(cotangent.positions(), intrinsic.positions());
    let json = intrinsic.certificate().to_json().unwrap();
    let certificate = Certificate::from_json(&json).unwrap();
    assert_eq!(certificate.statement().laplacian, LaplacianKind::Intrinsic);
    let public_key = key.public_key();
    let verifier = Verifier::new(&mesh, &certificate, &public_key).unwrap();
    let verdict = verifier.verify(intrinsic.mesh(), &Job::default()).unwrap();
    assert_eq!(verdict.outcome, Outcome::Verified);
    assert!(matches!(
        Verifier::with_original(cotangent.original(), &certificate, &public_key),
        Err(SigmarkError::AnotherCut)
    ));
}

#[test]
fn the_distortion_is_what_was_asked_for() {
    let mesh = shapes::bumpy_sphere(4, 3);
    for target in [1e-5, 4e-4, 1e-3] {
        let signed = Embedder::new(&key(Curve::P256, 1))
            .strength(Strength::Distortion(target))
            .patches(1) // without triangles between patches, which have no mass
            .embed(&mesh, &Job::default())
            .unwrap();
        let mass = mhb_core::lumped_mass(&mesh).unwrap();
        let square: f64 = mesh
            .positions()
            .iter()
            .zip(signed.positions())
            .zip(&mass)
            .map(|((p, q), m)| m * (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>())
            .sum();
        let rms = (square / mass.iter().sum::<f64>()).sqrt() / mesh.bounding_box().diagonal();
        assert!((rms / target - 1.0).abs() < 1e-6, "{rms:e} {target:e}");
        assert!((signed.layout().distortion_rms() / target - 1.0).abs() < 1e-9);
    }
}

#[cfg(feature = "paper")]
#[test]
fn the_papers_alpha_is_ours_times_the_root_of_the_area() {
    let mesh = shapes::scaled(&shapes::bumpy_sphere(4, 3), 0.2);
    let paper = key(Curve::B163, 1);
    let area: f64 = mhb_core::lumped_mass(&mesh).unwrap().iter().sum();
    let by = |strength| {
        Embedder::new(&paper)
            .strength(strength)
            .embed(&mesh, &Job::default())
            .unwrap()
    };
    let (printed, ours) = (
        by(Strength::PaperAlpha(1e-5)),
        by(Strength::Alpha(1e-5 / area.sqrt())),
    );
    assert!(farthest(printed.positions(), ours.positions()) < 1e-15);
    assert!((printed.layout().alpha() - 1e-5 / area.sqrt()).abs() < 1e-18);
}

#[test]
fn a_signed_mesh_is_verified_wherever_and_in_whatever_order_it_turns_up() {
    for mesh in [
        shapes::bumpy_sphere(4, 9),
        shapes::bumpy_torus(60, 24, 2),
        shapes::jittered(&shapes::rectangle(40, 40, 3.0, 2.0), 0.3, 5),
    ] {
        let signed = sign(&mesh, 1);
        let turned = Similarity {
            scale: 37.0,
            translation: [1e3, -20.0, 5.0],
            ..Similarity::from_quaternion([0.3, -0.5, 0.7, 0.1])
        };
        let marked = signed.mesh();
        for suspect in [
            marked.clone(),
            shapes::moved(marked, &turned),
            shapes::shuffled(marked, 4),
            shapes::shuffled(&shapes::moved(marked, &turned), 6),
            shapes::mirrored(marked),
            shapes::inside_out(marked),
        ] {
            let verdict = judge(&mesh, &signed, &suspect);
            assert_eq!(verdict.outcome, Outcome::Verified);
            assert_eq!(
                (verdict.extraction_rate, verdict.bit_errors, verdict.overlap),
                (Some(1.0), Some(0), 1.0)
            );
            assert!(verdict.attack_model.is_none());
            assert!(verdict.p_value < 1e-100);
        }
    }
}

#[test]
fn a_symmetric_shape_is_verified_in_every_pose_that_its_connectivity_allows() {
    let mesh = shapes::icosphere(4);
    let signed = sign(&mesh, 1);
    for seed in 0..3 {
        let suspect = shapes::shuffled(signed.mesh(), seed);
        assert_eq!(judge(&mesh, &signed, &suspect).outcome, Outcome::Verified);
    }
    assert!(matches!(
        judge(&mesh, &signed, &shapes::shuffled(&mesh, 1)).outcome,
        Outcome::NotFound { .. }
    ));
}

#[test]
fn an_unmarked_mesh_a_mesh_marked_by_another_and_another_model_are_not_found() {
    let mesh = shapes::bumpy_sphere(4, 9);
    let signed = sign(&mesh, 1);
    for suspect in [&mesh, sign(&mesh, 2).mesh(), &shapes::scaled(&mesh, 2.0)] {
        let verdict = judge(&mesh, &signed, suspect);
        assert!(matches!(verdict.outcome, Outcome::NotFound { .. }), "{verdict:?}");
        assert!(verdict.p_value > 1e-6);
    }
    let other = judge(&mesh, &signed, &shapes::bumpy_torus(50, 24, 1));
    assert_eq!(other.outcome, Outcome::NotFound { p: 1.0 });
    assert!(other.overlap < 0.8 && other.transform.is_none());
    assert!(matches!(other.mismatch, Some(Mismatch::Surface { .. })));
}

#[test]
fn a_mark_half_drowned_in_noise_is_detected_though_not_read() {
    use rand_chacha::rand_core::Rng;
    let mesh = shapes::bumpy_sphere(4, 9);
    let signed = sign(&mesh, 1);
    let mut rng = ChaCha20Rng::from_seed([5; 32]);
    let amplitude = 0.009 * mesh.bounding_box().diagonal();
    let noisy = signed
        .positions()
        .iter()
        .map(|p| p.map(|x| x + amplitude * (f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5)))
        .collect();
    let verdict = judge(&mesh, &signed, &mesh.with_positions(noisy).unwrap());
    assert!(
        matches!(verdict.outcome, Outcome::Detected { p } if p < 1e-6),
        "{verdict:?}"
    );
    assert!(verdict.bit_errors.unwrap() > 0);
}

#[test]
fn every_scheme_signs_and_verifies() {
    let mesh = shapes::bumpy_sphere(4, 9);
    for (curve, scheme) in [
        (Curve::P256, Scheme::EcdsaP256Sha256),
        (Curve::P256, Scheme::EcdsaP256Sha1),
        #[cfg(feature = "paper")]
        (Curve::B163, Scheme::EcdsaB163Sha1),
    ] {
        let signed = Embedder::new(&key(curve, 3))
            .scheme(scheme)
            .chip_rate(1)
            .embed(&mesh, &Job::default())
            .unwrap();
        assert_eq!(judge(&mesh, &signed, signed.mesh()).outcome, Outcome::Verified);
        assert_eq!(signed.certificate().bits().len(), scheme.bits());
    }
}

#[cfg(feature = "paper")]
#[test]
fn a_scheme_of_another_curve_than_the_keys_is_refused() {
    let mesh = shapes::bumpy_sphere(4, 9);
    let mismatch = Embedder::new(&key(Curve::P256, 3))
        .scheme(Scheme::EcdsaB163Sha1)
        .embed(&mesh, &Job::default());
    assert!(matches!(mismatch, Err(SigmarkError::Signature(_))));
}

#[test]
fn bases_are_computed_once_for_many_receivers() {
    let mesh = shapes::bumpy_sphere(4, 9);
    let (key, first) = (key(Curve::P256, 1), sign(&mesh, 1));
    let original = first.original();
    original.keep_bases(&Job::default()).unwrap();
    let embedder = Embedder::new(&key).message("order 4711");
    let again = embedder.embed_in(original, &Job::default()).unwrap();
    assert_eq!(again.positions(), first.positions());
    let second = embedder
        .clone()
        .message("order 4712")
        .embed_in(original, &Job::default())
        .unwrap();
    assert_ne!(second.positions(), first.positions());
    let certificate = second.certificate();
    let verifier = Verifier::with_original(original, certificate, certificate.public_key()).unwrap();
    assert_eq!(
        verifier.verify(second.mesh(), &Job::default()).unwrap().outcome,
        Outcome::Verified
    );
    assert!(matches!(
        verifier.verify(first.mesh(), &Job::default()).unwrap().outcome,
        Outcome::NotFound { .. }
    ));
    // Harmonics that were cut for few bits have no room for a tag.
    let mut pool = Pool::default();
    pool.repetitions = Some(1);
    let small = Original::pooled(mesh, 96, pool, &Job::default()).unwrap();
    let refused = embedder.embed_in(&Arc::new(small), &Job::default());
    assert!(matches!(
        refused,
        Err(SigmarkError::Mark(MarkError::Room {
            found: 96,
            least: 128
        }))
    ));
}

/// Whatever patches there are, with half more chips than the payload has bits: they hold all of it.
#[test]
fn a_run_of_patches_carries_the_whole_signature() {
    let mesh = shapes::bumpy_torus(120, 80, 4);
    let embedder = Embedder::new(&key(Curve::P256, 1)).chip_rate(4).patches(16);
    let signed = embedder.embed(&mesh, &Job::default()).unwrap();
    assert_eq!(signed.certificate().statement().alphas.len(), 16);
    let turned = shapes::shuffled(&shapes::scaled(signed.mesh(), 3.0), 1);
    assert_eq!(judge(&mesh, &signed, &turned).outcome, Outcome::Verified);

    // Seven patches of sixteen have 896 of 2048 chips; the others are as they were.
    for first in [0, 3, 9] {
        let mut positions: Vec<_> = mesh.positions().iter().copied().map(Some).collect();
        for patch in &signed.original().patches()[first..first + 7] {
            for &v in patch.vertices() {
                positions[v as usize] = Some(signed.positions()[v as usize]);
            }
        }
        let suspect = Registered::by_vertices(positions);
        let detector = CoefficientDetector::new(signed.layout());
        let soft = detector.detect(&suspect, &Job::default()).unwrap();
        assert!(signed.certificate().is_read(&soft, &[32]));
    }
}

/// An untouched copy is read from few patches; what was not looked at needs no harmonics. The looks that there may be are counted in p.
#[test]
fn a_copy_that_nobody_touched_takes_one_look() {
    let mesh = shapes::bumpy_torus(120, 80, 4);
    let embedder = Embedder::new(&key(Curve::P256, 1)).chip_rate(4).patches(16);
    let signed = embedder.embed(&mesh, &Job::default()).unwrap();
    let certificate = signed.certificate();
    let verifier = Verifier::new(&mesh, certificate, certificate.public_key()).unwrap();
    let verdict = verifier.verify(signed.mesh(), &Job::default()).unwrap();
    assert_eq!(verdict.outcome, Outcome::Verified);
    assert!((6..=8).contains(&verdict.patches_read), "{verdict:?}");
    assert!(
        verdict.bit_errors == Some(0) && (768..1100).contains(&verdict.bits),
        "{verdict:?}"
    );
    // 2 rules × 2 looks × 1 map, over all bits that these patches carry.
    let least = 2.0 * 4.0 * 2f64.powi(-(verdict.bits as i32));
    assert!(
        (verdict.p_value / least - 1.0).abs() < 1e-9,
        "{:e}",
        verdict.p_value
    );
    // What was computed is kept for the next suspect.
    struct NoHarmonics;
    impl Observer for NoHarmonics {
        fn stage(&self, stage: &dyn job::Stage) {
            assert_ne!(stage.name(), "harmonics");
        }
    }
    let job = Job::default().observed_by(NoHarmonics);
    verifier.verify(shapes::shuffled(signed.mesh(), 2), &job).unwrap();
}

/// Who asks for no more than a probability looks at fewer patches, and is told one that all looks are counted in. What is not enough is looked at whole.
#[test]
fn reading_ends_where_a_probability_was_asked_for_that_all_looks_are_counted_in() {
    let mesh = shapes::bumpy_torus(120, 80, 4);
    let embedder = Embedder::new(&key(Curve::P256, 1)).chip_rate(6).patches(24);
    let signed = embedder.embed(&mesh, &Job::default()).unwrap();
    let worn = shapes::jittered(signed.mesh(), 0.3, 3);
    let certificate = signed.certificate();
    let judged = |enough| {
        let verifier = Verifier::new(&mesh, certificate, certificate.public_key()).unwrap();
        verifier.enough(enough).verify(&worn, &Job::default()).unwrap()
    };
    let (all, soon, late) = (judged(None), judged(Some(1e-6)), judged(Some(1e-300)));
    assert!(
        all.patches_read == 24 && all.outcome.is_found(),
        "{:?}",
        all.outcome
    );
    assert!(
        soon.patches_read < 24 && soon.p_value <= 1e-6,
        "{:?}",
        soon.outcome
    );
    assert_eq!(soon.outcome, Outcome::Detected { p: soon.p_value });
    // 2 rules × 2 looks × 1 map.
    assert_eq!((soon.tries, all.tries), (4, 4));
    let once = p_value(&certificate.bits(), &soon.soft.as_ref().unwrap().weights());
    assert!((soon.p_value / (4.0 * once) - 1.0).abs() < 1e-12);
    assert_eq!((late.patches_read, late.p_value), (all.patches_read, all.p_value));
    // A bound that detects nothing is no reason to stop.
    let verifier = Verifier::new(&mesh, certificate, certificate.public_key()).unwrap();
    let strict = verifier.p_bound(1e-300).enough(Some(0.5));
    assert_eq!(strict.verify(&worn, &Job::default()).unwrap().patches_read, 24);
}

#[test]
fn what_rounding_leaves_is_read_back_with_bases_and_without() {
    let mesh = shapes::bumpy_sphere(4, 9);
    let signed = sign(&mesh, 1);
    let read = |grid: f64| {
        let rounded: Vec<[f64; 3]> = signed
            .positions()
            .iter()
            .map(|p| p.map(|x| (x / grid).round() * grid))
            .collect();
        signed.read_back(&rounded, &Job::default()).unwrap()
    };
    assert_eq!(read(1e-7).extraction_rate, 1.0);
    // Too coarse for the bound, fine enough in truth.
    assert!(read(2e-4).is_sound() && read(2e-4).extraction_rate > 0.99);
    assert!(!read(0.2).is_sound() && read(0.2).extraction_rate < 0.9);
}

#[test]
fn bits_that_have_no_chip_are_not_missed() {
    let mesh = shapes::bumpy_sphere(2, 3);
    let embedder = Embedder::new(&key(Curve::P256, 1)).payload(Some(PayloadKind::Tag));
    let signed = embedder.embed(&mesh, &Job::default()).unwrap();
    let chips: usize = (0..signed.original().patches().len())
        .map(|patch| signed.layout().chips(patch).len())
        .sum();
    assert!(chips < signed.certificate().bits().len(), "{chips} chips");
    let step = 1e-3 * mesh.bounding_box().diagonal();
    let moved = signed.positions().iter().map(|&[x, y, z]| [x, y, z + 0.1 * step]);
    for positions in [signed.positions().to_vec(), moved.collect()] {
        let read = signed.read_back(&positions, &Job::default()).unwrap();
        assert!(read.is_sound() && read.extraction_rate > 0.99, "{read:?}");
    }
}

#[test]
fn what_is_lost_in_one_patch_of_many_is_no_reason_to_compute_bases() {
    struct Stopped;
    impl Observer for Stopped {
        fn cancelled(&self) -> bool {
            true
        }
    }
    let mesh = shapes::bumpy_torus(120, 80, 4);
    let signed = Embedder::new(&key(Curve::P256, 1))
        .chip_rate(6)
        .patches(24)
        .embed(&mesh, &Job::default())
        .unwrap();
    let without_patches = |lost: usize| {
        let mut positions = signed.positions().to_vec();
        for patch in signed.original().patches().iter().take(lost) {
            patch
                .vertices()
                .iter()
                .for_each(|&v| positions[v as usize][0] += 1.0);
        }
        signed.read_back(&positions, &Job::default().observed_by(Stopped))
    };
    let read = without_patches(1).unwrap();
    assert!(read.is_sound());
    assert_eq!(without_patches(0).unwrap().extraction_rate, 1.0);
    // Too much to be without: all bases are asked for.
    assert!(without_patches(20).is_err());
}

#[test]
fn small_pieces_ride_along_unmarked() {
    let large = shapes::bumpy_sphere(4, 9);
    let mesh = shapes::disjoint_union(&[shapes::translated(&shapes::tetrahedron(), [7.0, 0.0, 0.0]), large]);
    let signed = sign(&mesh, 1);
    assert_eq!(signed.original().patches().unmarked_vertices(), 4);
    assert_eq!(signed.positions()[..4], mesh.positions()[..4]);
    assert_eq!(judge(&mesh, &signed, signed.mesh()).outcome, Outcome::Verified);
}

#[test]
fn original_certificate_and_key_must_belong_together() {
    let mesh = shapes::bumpy_sphere(4, 9);
    let signed = sign(&mesh, 1);
    let certificate = signed.certificate();
    let foreign = key(Curve::P256, 2).public_key();
    assert!(matches!(
        Verifier::new(&mesh, certificate, &foreign),
        Err(SigmarkError::AnotherKey { .. })
    ));
    let error = Verifier::new(signed.mesh(), certificate, certificate.public_key()).unwrap_err();
    assert!(matches!(error, SigmarkError::AnotherOriginal { .. }));
}

#[test]
fn strengths_out_of_bounds_are_refused() {
    let mesh = shapes::bumpy_sphere(4, 9);
    let key = key(Curve::P256, 1);
    let refusal = |strength| {
        Embedder::new(&key)
            .strength(strength)
            .embed(&mesh, &Job::default())
            .unwrap_err()
    };
    for value in [0.0, -1e-4, f64::NAN, f64::INFINITY] {
        for strength in [
            Strength::Distortion(value),
            Strength::Alpha(value),
            Strength::PaperAlpha(value),
        ] {
            assert!(matches!(
                refusal(strength),
                SigmarkError::Mark(MarkError::NotPositive { .. })
            ));
        }
    }
    for strength in [
        Strength::Distortion(0.5),
        Strength::Alpha(1.0),
        Strength::PaperAlpha(1e3),
    ] {
        assert!(
            matches!(refusal(strength), SigmarkError::Mark(MarkError::TooStrong { most, .. }) if most > 0.0)
        );
    }
    assert!(matches!(
        Embedder::new(&key).chip_rate(0).embed(&mesh, &Job::default()),
        Err(SigmarkError::Mark(MarkError::EmptyLayout { .. }))
    ));
}

#[test]
fn an_observer_can_stop_the_work() {
    struct Stop;
    impl Observer for Stop {
        fn cancelled(&self) -> bool {
            true
        }
    }
    let mesh = shapes::bumpy_sphere(4, 9);
    assert!(matches!(
        Embedder::new(&key(Curve::P256, 1)).embed(&mesh, &Job::default().observed_by(Stop)),
        Err(SigmarkError::Job(JobError::Cancelled))
    ));
}
