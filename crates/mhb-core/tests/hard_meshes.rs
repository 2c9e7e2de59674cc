//! Meshes as they are found: slivers, degenerate triangles, non-manifold places, far from the origin.

use job::Job;
use mesh::{TriMesh, shapes};
use mhb_core::{Laplacian, LaplacianKind, Mass, Spectrum, SpectrumError, SpectrumOptions};
use proptest::prelude::*;

const KINDS: [LaplacianKind; 2] = [LaplacianKind::Cotangent, LaplacianKind::Intrinsic];

fn compute(mesh: &TriMesh, count: usize, laplacian: LaplacianKind) -> Result<Spectrum, SpectrumError> {
    Spectrum::compute(
        mesh,
        &SpectrumOptions {
            count,
            laplacian,
            ..Default::default()
        },
        &Job::default(),
    )
}

/// What every result must satisfy, however bad the mesh.
fn check(spectrum: &Spectrum) {
    assert!(spectrum.eigenvalues().windows(2).all(|pair| pair[0] <= pair[1]));
    let h = spectrum.eigenfunctions();
    let weighted = faer::Mat::from_fn(h.nrows(), h.ncols(), |i, k| spectrum.mass()[i] * h[(i, k)]);
    let defect = (h.transpose() * weighted - faer::Mat::<f64>::identity(h.ncols(), h.ncols())).norm_max();
    assert!(defect < 1e-10, "orthonormal to {defect:e} only");
}

/// A bumpy sphere with the given triangles added.
fn sphere_with(level: u32, extra: impl Fn(&[[f64; 3]]) -> (Vec<[f64; 3]>, Vec<[u32; 3]>)) -> TriMesh {
    let sphere = shapes::bumpy_sphere(level, 1);
    let (vertices, triangles) = extra(sphere.positions());
    let positions = [sphere.positions(), &vertices].concat();
    TriMesh::new(positions, [sphere.triangles(), &triangles].concat()).expect("valid")
}

#[test]
fn slivers_down_to_an_angle_of_1e_6_have_a_spectrum() {
    for angle in [1e-2, 1e-4, 1e-6] {
        for kind in KINDS {
            let spectrum = compute(&shapes::book_of_slivers(400, angle), 40, kind).unwrap();
            check(&spectrum);
        }
    }
}

#[test]
fn triangle_areas_may_differ_by_twelve_orders_of_magnitude() {
    // Each new vertex at the centroid of the smallest triangle so far: the area falls by three every time.
    let mut positions = shapes::bumpy_sphere(3, 1).positions().to_vec();
    let mut triangles = shapes::bumpy_sphere(3, 1).triangles().to_vec();
    for _ in 0..26 {
        let [a, b, c] = triangles[0];
        let at = |v: u32| positions[v as usize];
        let centre = std::array::from_fn(|axis| (at(a)[axis] + at(b)[axis] + at(c)[axis]) / 3.0);
        let new = positions.len() as u32;
        positions.push(centre);
        triangles[0] = [a, b, new];
        triangles.extend([[b, c, new], [c, a, new]]);
    }
    let mesh = TriMesh::new(positions, triangles).unwrap();
    let areas: Vec<f64> = (0..mesh.triangle_count())
        .map(|t| mesh.triangle_area(t))
        .collect();
    let (least, greatest) = (
        areas.iter().copied().fold(f64::MAX, f64::min),
        areas.iter().copied().fold(0.0, f64::max),
    );
    assert!(greatest / least > 1e12);
    for kind in KINDS {
        let clean = compute(&shapes::bumpy_sphere(3, 1), 30, kind).unwrap();
        let spectrum = compute(&mesh, 30, kind).unwrap();
        check(&spectrum);
        for (a, b) in spectrum.eigenvalues().iter().zip(clean.eigenvalues()).skip(1) {
            assert!((a / b - 1.0).abs() < 0.02, "{kind:?}: {a} {b}");
        }
    }
}

#[test]
fn duplicated_zero_area_and_non_manifold_triangles_leave_a_spectrum() {
    let duplicated = sphere_with(3, |_| {
        (Vec::new(), shapes::bumpy_sphere(3, 1).triangles()[..40].to_vec())
    });
    let collinear = sphere_with(3, |p| {
        let middle = std::array::from_fn(|axis| (p[0][axis] + p[1][axis]) / 2.0);
        (vec![middle], vec![[0, 1, p.len() as u32]])
    });
    let coincident = sphere_with(3, |p| {
        (vec![p[5], p[5]], vec![[5, p.len() as u32, p.len() as u32 + 1]])
    });
    let fins = sphere_with(4, |p| {
        let tips: Vec<[f64; 3]> = (0..50).map(|k| p[k].map(|x| 1.2 * x)).collect();
        let sphere = shapes::bumpy_sphere(4, 1);
        let fins = (0..50).map(|k| {
            let [a, b, _] = sphere.triangles()[k];
            [a, b, (p.len() + k) as u32]
        });
        (tips, fins.collect())
    });
    for mesh in [
        duplicated,
        collinear,
        coincident,
        fins,
        shapes::book(7),
        shapes::moebius_strip(500),
        shapes::soup(300, 2),
    ] {
        for kind in KINDS {
            check(&compute(&mesh, mesh.vertex_count().min(30), kind).unwrap());
        }
    }
}

#[test]
fn far_from_the_origin_the_spectrum_is_the_same_to_the_accuracy_of_the_coordinates() {
    let mesh = shapes::bumpy_sphere(4, 5);
    let far = shapes::translated(&mesh, [1e6, -1e6, 1e6]);
    let (near, far) = (
        compute(&mesh, 50, KINDS[0]).unwrap(),
        compute(&far, 50, KINDS[0]).unwrap(),
    );
    check(&far);
    for (a, b) in near.eigenvalues().iter().zip(far.eigenvalues()).skip(1) {
        assert!((a / b - 1.0).abs() < 1e-7);
    }
}

#[test]
fn more_components_than_pairs_asked_for_give_zeros() {
    let spectrum = compute(&shapes::soup(400, 3), 100, KINDS[0]).unwrap();
    check(&spectrum);
    assert!(spectrum.eigenvalues().iter().all(|l| *l == 0.0));
}

#[test]
fn on_a_delaunay_mesh_the_intrinsic_laplacian_is_the_cotangent_laplacian() {
    let mesh = shapes::icosphere(3);
    let [a, b] = KINDS.map(|kind| Laplacian::of(&mesh, kind, Mass::Lumped).unwrap());
    for ((x, i), (y, j)) in a.stiffness().iter().zip(b.stiffness().iter()) {
        assert!(i == j && (x - y).abs() < 1e-11);
    }
    assert!(a.mass().iter().zip(b.mass()).all(|(x, y)| (x - y).abs() < 1e-14));
}

#[test]
fn intrinsic_weights_are_never_negative_and_keep_the_area() {
    let bad = [
        shapes::jittered(&shapes::rectangle(20, 20, 1.0, 1.0), 0.4, 3),
        shapes::book_of_slivers(100, 1e-3),
        shapes::book(5),
        shapes::bumpy_block(2, 4, 1),
        shapes::cylinder(12, 40, 1.0, 1.0),
    ];
    for mesh in bad {
        let laplacian = Laplacian::of(&mesh, LaplacianKind::Intrinsic, Mass::Lumped).unwrap();
        let largest = laplacian
            .stiffness()
            .data()
            .iter()
            .fold(0.0, |a: f64, x| a.max(x.abs()));
        assert!(
            laplacian
                .stiffness()
                .iter()
                .all(|(&s, (i, j))| i == j || s <= 1e-9 * largest)
        );
        let area: f64 = laplacian.mass().iter().sum();
        assert!((area / mesh.area() - 1.0).abs() < 1e-3, "{area} {}", mesh.area());
    }
}

#[test]
fn a_flat_mesh_has_one_intrinsic_laplacian_however_its_edges_are_flipped() {
    let mesh = shapes::jittered(&shapes::rectangle(16, 12, 2.0, 1.0), 0.2, 3);
    let flat = mesh
        .with_positions(mesh.positions().iter().map(|p| [p[0], p[1], 0.0]).collect())
        .unwrap();
    let flipped = shapes::flipped(&flat, 5);
    assert_ne!(flat, flipped);
    let [a, b] = [flat, flipped].map(|mesh| compute(&mesh, 40, LaplacianKind::Intrinsic).unwrap());
    for (x, y) in a.eigenvalues().iter().zip(b.eigenvalues()).skip(1) {
        assert!((x / y - 1.0).abs() < 1e-9, "{x} {y}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn random_soups_of_triangles_have_a_spectrum_or_a_clear_error(
        positions in prop::collection::vec(prop::array::uniform3(-3i8..4), 4..40),
        picks in prop::collection::vec(prop::array::uniform3(0usize..1000), 1..80),
        intrinsic in any::<bool>(),
    ) {
        let n = positions.len();
        let triangles: Vec<[u32; 3]> = picks
            .into_iter()
            .map(|pick| pick.map(|v| (v % n) as u32))
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .collect();
        let positions = positions.into_iter().map(|p| p.map(f64::from)).collect();
        if let Ok(mesh) = TriMesh::new(positions, triangles) {
            match compute(&mesh, n.min(10), KINDS[usize::from(intrinsic)]) {
                Ok(spectrum) => check(&spectrum),
                Err(SpectrumError::Mass { vertex, .. }) => {
                    prop_assert!(mesh.triangles().iter().flatten().all(|&v| v as usize != vertex));
                }
                Err(SpectrumError::Area { .. }) => prop_assert!(mesh.area() < 1e-6),
                Err(other) => prop_assert!(false, "{other}"),
            }
        }
    }
}
