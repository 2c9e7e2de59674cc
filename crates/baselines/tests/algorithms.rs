//! What every algorithm promises, and what sets the rivals apart.

#![allow(clippy::unwrap_used)]

use std::collections::{HashMap, HashSet};

use baselines::{
    Adapted, Algorithm, AlgorithmId, BaselineError, Lbf, Mhb, Prepared, Rbf, Reference, Subject, entries,
};
use job::Job;
use mesh::{TriMesh, shapes};
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};
use sigmark::mark::{MarkError, PatchCount, Patches, Registered, extraction_rate};

const BITS: usize = 30;
const FUNCTIONS: usize = 80;

/// A shape whose coordinates are far from zero, as multiplicative marks need.
fn model() -> TriMesh {
    shapes::translated(&shapes::bumpy_sphere(4, 1), [3.0, 2.0, -4.0])
}

fn cut(mesh: &TriMesh, patches: usize) -> Patches {
    Patches::cut(mesh, FUNCTIONS, PatchCount::Exactly(patches), &Job::default()).unwrap()
}

fn prepare(algorithm: &dyn Algorithm, mesh: &TriMesh, patches: &Patches) -> Box<dyn Prepared> {
    let subject = Subject {
        mesh,
        patches,
        bits: BITS,
    };
    algorithm.prepare(&subject, &Job::default()).unwrap()
}

fn embed(prepared: &dyn Prepared, alpha: f64) -> Vec<[f64; 3]> {
    prepared.embed(&signature(), alpha, &Job::default()).unwrap()
}

fn signature() -> Vec<bool> {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    (0..BITS).map(|_| random.next_u32() & 1 == 1).collect()
}

fn registered(positions: impl IntoIterator<Item = Option<[f64; 3]>>) -> Registered {
    Registered::by_vertices(positions.into_iter().collect())
}

fn rate(prepared: &dyn Prepared, suspect: &Registered, alpha: f64) -> f64 {
    let soft = prepared.extract(suspect, alpha, &Job::default()).unwrap();
    extraction_rate(&signature(), &soft.hard())
}

fn difference(a: &[[f64; 3]], b: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let pairs = a.iter().zip(b);
    pairs
        .map(|(a, b)| std::array::from_fn(|axis| a[axis] - b[axis]))
        .collect()
}

fn largest(field: &[[f64; 3]]) -> f64 {
    field.iter().flatten().fold(0.0, |most, x| x.abs().max(most))
}

fn squares(field: &[[f64; 3]]) -> f64 {
    field.iter().flatten().map(|x| x * x).sum()
}

#[test]
fn every_algorithm_reads_what_it_wrote() {
    let mesh = model();
    let patches = cut(&mesh, 2);
    for algorithm in entries(FUNCTIONS) {
        let prepared = prepare(algorithm.as_ref(), &mesh, &patches);
        for alpha in [1e-4, 1e-2] {
            let suspect = registered(embed(prepared.as_ref(), alpha).into_iter().map(Some));
            assert_eq!(
                rate(prepared.as_ref(), &suspect, alpha),
                1.0,
                "{}",
                algorithm.name()
            );
        }
    }
}

#[test]
fn every_mark_is_affine_in_its_strength() {
    let mesh = model();
    let patches = cut(&mesh, 2);
    for algorithm in entries(FUNCTIONS) {
        let prepared = prepare(algorithm.as_ref(), &mesh, &patches);
        let [none, one, three] = [0.0, 1e-3, 3e-3].map(|alpha| embed(prepared.as_ref(), alpha));
        let (one, three) = (difference(&one, &none), difference(&three, &none));
        let tripled: Vec<[f64; 3]> = one.iter().map(|d| d.map(|x| 3.0 * x)).collect();
        assert!(largest(&one) > 0.0);
        assert!(
            largest(&difference(&three, &tripled)) < 1e-13,
            "{}",
            algorithm.name()
        );
    }
}

#[test]
fn no_result_depends_on_the_number_of_threads() {
    let mesh = model();
    let patches = cut(&mesh, 2);
    let subject = Subject {
        mesh: &mesh,
        patches: &patches,
        bits: BITS,
    };
    for algorithm in entries(FUNCTIONS) {
        let [one, three] = [1, 3].map(|threads| {
            let job = &Job::new(threads);
            let prepared = algorithm.prepare(&subject, job).unwrap();
            let marked = prepared.embed(&signature(), 1e-3, job).unwrap();
            let suspect = registered(marked.iter().copied().map(Some));
            (marked, prepared.extract(&suspect, 1e-3, job).unwrap())
        });
        assert_eq!(one, three, "{}", algorithm.name());
    }
}

#[test]
fn one_patch_that_was_seen_is_enough() {
    let mesh = model();
    let patches = cut(&mesh, 2);
    for algorithm in entries(FUNCTIONS) {
        let prepared = prepare(algorithm.as_ref(), &mesh, &patches);
        if prepared.patches() == 1 {
            continue; // RBFs spread each bit over the whole mesh.
        }
        let marked = embed(prepared.as_ref(), 1e-3);
        let halves = marked.iter().zip(patches.labels());
        let half = registered(halves.map(|(&p, &label)| (label == 1).then_some(p)));
        assert_eq!(rate(prepared.as_ref(), &half, 1e-3), 1.0, "{}", algorithm.name());
    }
}

#[test]
fn lbfs_without_compensation_lose_what_m_eigenvectors_do_not_span() {
    let mesh = shapes::bumpy_sphere(3, 1);
    let patches = cut(&mesh, 1);
    let energies = [FUNCTIONS, 2 * FUNCTIONS, mesh.vertex_count()].map(|functions| {
        let prepared = prepare(&Lbf::new(functions), &mesh, &patches);
        assert_eq!(prepared.functions(), functions);
        squares(&difference(&embed(prepared.as_ref(), 0.0), mesh.positions()))
    });
    assert!(energies[0] > energies[1] && energies[1] > 1e-6, "{energies:?}");
    // All eigenvectors span everything, as far as they are orthonormal: to 1e-9.
    assert!(energies[2] < 1e-18 * squares(mesh.positions()), "{energies:?}");

    let truncated = prepare(&Lbf::new(FUNCTIONS), &mesh, &patches);
    let compensated = prepare(&Lbf::new(FUNCTIONS).compensated(), &mesh, &patches);
    assert_eq!(embed(compensated.as_ref(), 0.0), mesh.positions());
    let [lost, marked, kept] = [
        embed(truncated.as_ref(), 0.0),
        embed(truncated.as_ref(), 1e-3),
        embed(compensated.as_ref(), 1e-3),
    ];
    let marks = difference(&difference(&marked, &lost), &difference(&kept, mesh.positions()));
    assert!(largest(&marks) < 1e-8, "the same mark, as Theorem 1 says");
}

#[test]
fn lbfs_write_each_bit_along_all_axes() {
    let mesh = model();
    let prepared = prepare(&Lbf::new(FUNCTIONS), &mesh, &cut(&mesh, 1));
    let mark = difference(&embed(prepared.as_ref(), 1e-3), &embed(prepared.as_ref(), 0.0));
    let phi = mesh.bounding_box().size();
    for d in &mark {
        let shares = [d[0] / phi[0], d[1] / phi[1], d[2] / phi[2]];
        assert!((shares[0] - shares[1]).abs() < 1e-14 && (shares[1] - shares[2]).abs() < 1e-14);
    }
    // Unit eigenvectors: each of the l chips adds (α φ)² to the sum of squares.
    let expected: f64 = phi.iter().map(|edge| BITS as f64 * (1e-3 * edge).powi(2)).sum();
    assert!((squares(&mark) / expected - 1.0).abs() < 1e-7);
}

#[test]
fn lbfs_see_the_connectivity_alone() {
    let mesh = model();
    let patches = cut(&mesh, 1);
    // The same triangles and bounding box, another shape.
    let [low, high] = [f64::min, f64::max]
        .map(|end| [0, 1, 2].map(|axis| mesh.positions().iter().map(|p| p[axis]).reduce(end).unwrap()));
    let bent = mesh.positions().iter().map(|p| {
        [0, 1, 2].map(|axis| {
            let t = (p[axis] - low[axis]) / (high[axis] - low[axis]);
            low[axis] + (high[axis] - low[axis]) * t * t
        })
    });
    let bent = mesh.with_positions(bent.collect()).unwrap();
    let bent_patches = Patches::from_labels(&bent, patches.labels()).unwrap();
    let [mark, bent_mark] = [(&mesh, &patches), (&bent, &bent_patches)].map(|(mesh, patches)| {
        let prepared = prepare(&Lbf::new(FUNCTIONS).compensated(), mesh, patches);
        difference(&embed(prepared.as_ref(), 1e-3), mesh.positions())
    });
    assert!(largest(&difference(&mark, &bent_mark)) < 1e-12);
}

#[test]
fn rbfs_multiply_coefficients_of_raw_coordinates() {
    let mesh = model();
    let patches = cut(&mesh, 1);
    let mark = |mesh: &TriMesh| {
        let prepared = prepare(&Rbf::default(), mesh, &patches);
        assert_eq!((prepared.patches(), prepared.functions()), (1, BITS / 3));
        difference(&embed(prepared.as_ref(), 0.01), mesh.positions())
    };
    // |x̃′ − x̃| = α |x̃|: the mark's energy is α² times that of the coordinates in the span of the basis.
    let points = mesh.positions();
    let basis = baselines::radial_basis(points, BITS / 3, baselines::Kernel::Linear).unwrap();
    let mut energy = 0.0;
    for axis in 0..3 {
        for column in basis.col_iter() {
            let coefficient: f64 = column.iter().zip(points).map(|(u, p)| u * p[axis]).sum();
            energy += (0.01 * coefficient).powi(2);
        }
    }
    assert!((squares(&mark(&mesh)) / energy - 1.0).abs() < 1e-10);

    let doubled = mark(&shapes::scaled(&mesh, 2.0));
    let twice: Vec<[f64; 3]> = mark(&mesh).iter().map(|d| d.map(|x| 2.0 * x)).collect();
    assert!(largest(&difference(&doubled, &twice)) < 1e-9);

    let farther = mark(&shapes::translated(&mesh, [10.0, 0.0, 0.0]));
    assert!(
        squares(&farther) > 2.0 * squares(&mark(&mesh)),
        "the origin matters"
    );
}

#[test]
fn an_rbf_mark_does_not_depend_on_the_order_of_vertices() {
    let mesh = model();
    let other = shapes::shuffled(&mesh, 9);
    let [marked, other_marked] = [&mesh, &other].map(|mesh| {
        let prepared = prepare(&Rbf::default(), mesh, &cut(mesh, 1));
        embed(prepared.as_ref(), 0.01)
    });
    assert!(largest(&difference(&in_order_of(&mesh, &other, &other_marked), &marked)) < 1e-9);
}

#[test]
fn a_truncation_does_not_depend_on_the_order_of_vertices() {
    let mesh = model();
    let other = shapes::shuffled(&mesh, 9);
    let [left, other_left] = [&mesh, &other].map(|mesh| {
        let prepared = prepare(&Lbf::new(FUNCTIONS), mesh, &cut(mesh, 1));
        embed(prepared.as_ref(), 0.0)
    });
    assert!(largest(&difference(&in_order_of(&mesh, &other, &other_left), &left)) < 1e-6);
}

/// Values of a mesh's vertices in the order of another with the same positions.
fn in_order_of(mesh: &TriMesh, other: &TriMesh, values: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let key = |p: &[f64; 3]| p.map(f64::to_bits);
    let of: HashMap<_, _> = other.positions().iter().map(key).zip(values).collect();
    mesh.positions().iter().map(|p| *of[&key(p)]).collect()
}

#[test]
fn adapted_marks_weigh_the_same_in_every_basis() {
    let mesh = model();
    let patches = cut(&mesh, 1);
    let size = mesh.bounding_box().size();
    // 3 l chips, l along each axis, each of root mean square α φ.
    let expected: f64 = size.iter().map(|phi| BITS as f64 * (1e-3 * phi).powi(2)).sum();
    for algorithm in [Adapted::laplacian(), Adapted::radial()] {
        let prepared = prepare(&algorithm, &mesh, &patches);
        let mark = difference(&embed(prepared.as_ref(), 1e-3), mesh.positions());
        let mean_square = squares(&mark) / mesh.vertex_count() as f64;
        assert!(
            (mean_square / expected - 1.0).abs() < 1e-7,
            "{}",
            algorithm.name()
        );
        assert_eq!(algorithm.reference(), Reference::Original);
    }
}

#[test]
fn bad_input_is_refused() {
    let mesh = model();
    let patches = cut(&mesh, 1);
    for algorithm in entries(FUNCTIONS) {
        let prepared = prepare(algorithm.as_ref(), &mesh, &patches);
        let bits = prepared.embed(&[true; BITS + 1], 1e-3, &Job::default());
        assert!(matches!(
            bits,
            Err(BaselineError::Bits {
                given: 31,
                wanted: 30
            })
        ));
        for alpha in [-1.0, f64::NAN, f64::INFINITY] {
            let strength = prepared.embed(&signature(), alpha, &Job::default());
            assert!(matches!(strength, Err(BaselineError::Alpha { .. })));
        }
        let short = prepared.extract(&registered([None]), 1e-3, &Job::default());
        assert!(matches!(
            short,
            Err(BaselineError::Mark(MarkError::Vertices { given: 1, .. }))
        ));
    }
    let prepare = |algorithm: &dyn Algorithm, bits| {
        let subject = Subject {
            mesh: &mesh,
            patches: &patches,
            bits,
        };
        algorithm.prepare(&subject, &Job::default())
    };
    for algorithm in entries(FUNCTIONS) {
        assert!(matches!(
            prepare(algorithm.as_ref(), 0),
            Err(BaselineError::Mark(_))
        ));
    }
    let narrow = prepare(&Lbf::new(FUNCTIONS), FUNCTIONS);
    assert!(matches!(
        narrow,
        Err(BaselineError::TooFewFunctions { least: 81, .. })
    ));
    let wide = prepare(&Lbf::new(1_000_000), BITS);
    assert!(matches!(wide, Err(BaselineError::Spectrum { patch: 0, .. })));
    assert!(prepare(&Mhb::default(), 1_000_000).is_err());
}

#[test]
fn the_table_begins_with_the_papers_three() {
    let ids: Vec<AlgorithmId> = entries(FUNCTIONS).iter().map(|a| a.id()).collect();
    assert_eq!(ids[..3], [AlgorithmId::MHB, AlgorithmId::LBF, AlgorithmId::RBF]);
    assert_eq!(ids.iter().collect::<HashSet<_>>().len(), ids.len(), "{ids:?}");
    let marked = entries(FUNCTIONS)
        .iter()
        .filter(|a| a.reference() == Reference::Marked)
        .count();
    assert_eq!(marked, 1, "the paper aligns RBFs alone with the marked mesh");
}
