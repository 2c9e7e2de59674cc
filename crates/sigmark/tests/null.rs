//! p-values where there is no mark: P(p ≤ a) ≤ a, whatever the suspect is, symmetric shapes and strangers' marks included.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use std::sync::Arc;

use job::Job;
use mesh::{Rig, TriMesh, Vec3, shapes};
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use sigmark::{
    claim::statistics::{p_of_chosen, p_value},
    mark::{
        ChipPlan, JointEstimator, MarkLayout, Original, Pool, Reader, ReadingMethod, Readings, SoftBits,
        Strength, Wanted,
    },
};

/// Fewer than a signature's: enough, and much faster.
const BITS: usize = 192;
const TRIALS_A_SUSPECT: u64 = 1000;
const LEVELS: [f64; 4] = [0.1, 0.01, 1e-3, 1e-4];

/// Where a reader stops who is easily content.
const ENOUGH: f64 = 0.1;

/// A mesh that is cut for so many bits.
fn layout(mesh: &TriMesh) -> Arc<MarkLayout> {
    let original = Original::pooled(mesh.clone(), BITS, Pool::default(), &Job::default()).unwrap();
    original.keep_bases(&Job::default()).unwrap();
    let plan = ChipPlan::pooled(BITS, [8; 32]);
    Arc::new(MarkLayout::with_strength(Arc::new(original), plan, Strength::default()).unwrap())
}

/// The mesh with a stranger's mark.
fn marked_by_a_stranger(layout: &MarkLayout) -> TriMesh {
    let bits = random_bits(&mut ChaCha20Rng::from_seed([9; 32]));
    let original = layout.original();
    let written = layout.write(&bits, &Job::default()).unwrap();
    original
        .mesh()
        .with_positions(written.positions(original))
        .unwrap()
}

fn random_bits(rng: &mut ChaCha20Rng) -> Vec<bool> {
    (0..BITS).map(|_| rng.next_u32() & 1 == 1).collect()
}

/// None bears the mark that is looked for.
fn suspects(layout: &MarkLayout, another: &TriMesh) -> Vec<TriMesh> {
    let mesh = layout.original().mesh();
    let theirs = marked_by_a_stranger(layout);
    vec![
        shapes::scaled(mesh, 3.0),
        shapes::mirrored(mesh),
        shapes::jittered(mesh, 0.3, 1),
        shapes::flipped(&theirs, 2),
        theirs,
        another.clone(),
    ]
}

/// The p-values of random bits, as the verifier computes them that reads everything, and as the one that stops at `ENOUGH`; none where the suspect does not lie on the original.
fn p_values(layout: &Arc<MarkLayout>, suspect: &TriMesh, seed: u64) -> Option<[Vec<f64>; 2]> {
    let job = Job::default();
    let reader = Reader::new(layout.original().mesh()).unwrap();
    let found = reader.find(suspect, &job).unwrap();
    if found.alignment().is_some_and(|alignment| !alignment.aligned) {
        return None;
    }
    let method = ReadingMethod::joint(JointEstimator::new(layout).into());
    let readings = found.readings(&method, &job).unwrap();
    let mut rng = ChaCha20Rng::seed_from_u64(seed);
    let p = (0..TRIALS_A_SUSPECT).map(|_| {
        let bits = random_bits(&mut rng);
        let is_enough = |soft: &SoftBits, tries| tries as f64 * p_value(&bits, &soft.weights()) <= ENOUGH;
        let all = readings.best(&bits, &job).unwrap();
        let stopped = readings.best(Wanted::until(&bits, &is_enough), &job).unwrap();
        assert_eq!(all.tries, stopped.tries);
        (p_of_chosen(&bits, &all), p_of_chosen(&bits, &stopped))
    });
    let (all, stopped) = p.collect();
    Some([all, stopped])
}

/// P(X ≥ k) for X ~ Binomial(n, p).
fn at_least(k: usize, n: usize, p: f64) -> f64 {
    let odds = (p / (1.0 - p)).ln();
    let (mut log_term, mut below) = (n as f64 * (-p).ln_1p(), 0.0);
    for i in 0..k {
        below += log_term.exp();
        log_term += ((n - i) as f64 / (i + 1) as f64).ln() + odds;
    }
    1.0 - below
}

/// No count of small p-values is one that chance would exceed in less than one of a thousand cases.
fn assert_bounded(p: &[f64], what: &str) {
    for level in LEVELS {
        let count = p.iter().filter(|&&p| p <= level).count();
        let likely = at_least(count, p.len(), level);
        assert!(likely >= 1e-3, "{what}: {count} of {} at most {level}", p.len());
    }
}

#[test]
fn small_p_values_are_as_rare_without_a_mark_as_they_say() {
    let (sphere, torus) = (shapes::icosphere(2), shapes::torus(20, 14, 2.0, 0.8));
    let models = [
        ("sphere", sphere.clone(), shapes::bumped(&sphere, 0.01, 8)),
        ("torus", torus.clone(), shapes::torus(22, 16, 2.0, 0.8)),
        (
            "bumpy sphere",
            shapes::bumpy_sphere(3, 9),
            shapes::bumpy_sphere(3, 10),
        ),
        ("bumpy torus", shapes::bumpy_torus(40, 20, 2), torus),
    ];
    let (mut all, mut all_stopped) = (Vec::new(), Vec::new());
    for (seed, (name, mesh, another)) in models.iter().enumerate() {
        let layout = layout(mesh);
        for (number, suspect) in suspects(&layout, another).iter().enumerate() {
            let seed = 100 * seed + number;
            if let Some([p, stopped]) = p_values(&layout, suspect, seed as u64) {
                assert_bounded(&p, &format!("{name}, suspect {number}"));
                assert_bounded(&stopped, &format!("{name}, suspect {number}, stopped"));
                all.extend(p);
                all_stopped.extend(stopped);
            }
        }
    }
    assert!(all.len() >= 18_000, "only {} trials", all.len());
    assert_bounded(&all, "all");
    assert_bounded(&all_stopped, "all, stopped");
}

/// Rigs as a claimant may choose them before he signs: a few joints, one for every few vertices, and ones with many morph targets.
fn rigs(mesh: &TriMesh) -> Vec<Rig> {
    let mut rng = ChaCha20Rng::seed_from_u64(3);
    let mut random = || f64::from(rng.next_u32()) / f64::from(u32::MAX);
    let count = mesh.vertex_count();
    let halves = |v: usize| {
        let share = (0.5 + 0.3 * mesh.point(v).0[0]).clamp(0.0, 1.0);
        vec![(0, share), (1, 1.0 - share)]
    };
    let few = Rig::new(&(0..count).map(halves).collect::<Vec<_>>());
    let mut any = |_| (0..3).map(|_| ((random() * 60.0) as u32, random())).collect();
    let many = Rig::new(&(0..count).map(&mut any).collect::<Vec<_>>());
    let mut target = |_| {
        (0..count as u32)
            .map(|v| (v, [0; 3].map(|_| random() - 0.5)))
            .collect()
    };
    let morphs = few
        .clone()
        .with_targets((0..40).map(&mut target).collect::<Vec<_>>());
    vec![few, many, morphs]
}

/// A mesh with its joints turned by up to a radian, and its targets taken by up to a tenth.
fn posed(mesh: &TriMesh, rig: &Rig, seed: u64) -> TriMesh {
    let mut rng = ChaCha20Rng::seed_from_u64(seed);
    let mut random = || 2.0 * f64::from(rng.next_u32()) / f64::from(u32::MAX) - 1.0;
    let mut points: Vec<Vec3> = (0..mesh.vertex_count()).map(|v| mesh.point(v)).collect();
    for target in rig.targets() {
        let share = 0.1 * random();
        target
            .iter()
            .for_each(|&(v, offset)| points[v as usize] += Vec3(offset) * share);
    }
    let joints: Vec<(f64, usize)> = (0..rig.joints()).map(|j| (random(), j % 3)).collect();
    let turned = |Vec3(p): Vec3, (angle, axis): (f64, usize)| {
        let ([a, b], (sin, cos)) = ([(axis + 1) % 3, (axis + 2) % 3], angle.sin_cos());
        let mut turned = p;
        (turned[a], turned[b]) = (cos * p[a] - sin * p[b], sin * p[a] + cos * p[b]);
        Vec3(turned)
    };
    let place = |v: usize| {
        let moved = rig.weights_of(v).iter();
        let sum: Vec3 = moved
            .map(|&(j, weight)| turned(points[v], joints[j as usize]) * weight)
            .sum();
        sum.into()
    };
    mesh.with_positions((0..points.len()).map(place).collect())
        .unwrap()
}

#[test]
fn small_p_values_are_as_rare_in_other_poses_whatever_rig_undoes_them() {
    let job = Job::default();
    let mesh = shapes::bumpy_torus(40, 20, 2);
    let layout = layout(&mesh);
    let reader = Reader::new(&mesh).unwrap();
    let method = ReadingMethod::joint(JointEstimator::new(&layout).into());
    let (mut all, mut seed) = (Vec::new(), 0);
    for rig in rigs(&mesh) {
        for unmarked in [
            mesh.clone(),
            shapes::jittered(&mesh, 0.1, 1),
            marked_by_a_stranger(&layout),
        ] {
            seed += 1;
            let found = reader.find(posed(&unmarked, &rig, seed), &job).unwrap();
            let unposed = found.unposed(&rig, &job).unwrap().unwrap();
            let ways = [found.readings(&method, &job), unposed.readings(&method, &job)].map(Result::unwrap);
            let mut rng = ChaCha20Rng::seed_from_u64(seed);
            let p = (0..TRIALS_A_SUSPECT).map(|_| {
                let bits = random_bits(&mut rng);
                let p_of = |way: &Readings<'_>| p_of_chosen(&bits, &way.best(&bits, &job).unwrap());
                (2.0 * ways.iter().map(p_of).fold(1.0, f64::min)).min(1.0)
            });
            let p: Vec<f64> = p.collect();
            assert_bounded(&p, &format!("pose {seed}"));
            all.extend(p);
        }
    }
    assert_eq!(all.len(), 9000);
    assert_bounded(&all, "all");
}
