//! Spectra that are known in closed form, and the identities that every spectrum obeys.

use std::f64::consts::{PI, TAU};
use std::sync::{Arc, Mutex, PoisonError};

use job::{Job, JobError, Observer, Stage};
use mesh::{TriMesh, shapes};
use mhb_core::{Laplacian, LaplacianKind, Mass, Spectrum, SpectrumError, SpectrumOptions};
use sprs::{CsMat, TriMat};

fn options(count: usize) -> SpectrumOptions {
    SpectrumOptions {
        count,
        ..Default::default()
    }
}

fn spectrum(mesh: &TriMesh, count: usize) -> Spectrum {
    Spectrum::compute(mesh, &options(count), &Job::default()).expect("the mesh has a spectrum")
}

/// Largest relative error of eigenvalues 1, 2, … against the exact ones.
fn worst_error(found: &[f64], exact: &[f64]) -> f64 {
    found
        .iter()
        .zip(exact)
        .skip(1)
        .map(|(a, b)| (a / b - 1.0).abs())
        .fold(0.0, f64::max)
}

/// Largest entry of HᵀDH − I.
fn orthonormality_defect(spectrum: &Spectrum) -> f64 {
    let h = spectrum.eigenfunctions();
    let weighted = faer::Mat::from_fn(h.nrows(), h.ncols(), |i, k| spectrum.mass()[i] * h[(i, k)]);
    let gram = h.transpose() * weighted;
    let identity = faer::Mat::<f64>::identity(h.ncols(), h.ncols());
    (gram - identity).norm_max()
}

/// Largest difference of the eigenfunctions, each scaled by √D, over the columns that both have.
fn basis_difference(a: &Spectrum, b: &Spectrum) -> f64 {
    let columns = a.eigenvalues().len().min(b.eigenvalues().len());
    let square = |k: usize| -> f64 {
        let pairs = a.eigenfunction(k).iter().zip(b.eigenfunction(k));
        pairs
            .zip(a.mass())
            .map(|((x, y), mass)| (x - y).powi(2) * mass)
            .sum()
    };
    (0..columns).map(square).fold(0.0, f64::max).sqrt()
}

#[test]
fn the_sphere_has_eigenvalues_l_l_plus_1_with_multiplicity_2l_plus_1_and_errors_of_second_order() {
    let exact: Vec<f64> = (0..7)
        .flat_map(|l| vec![f64::from(l * (l + 1)); 2 * l as usize + 1])
        .collect();
    let errors: Vec<f64> = [3, 4, 5]
        .into_iter()
        .map(|level| {
            let found = spectrum(&shapes::icosphere(level), exact.len());
            worst_error(found.eigenvalues(), &exact)
        })
        .collect();
    assert!(errors[2] < 4e-3, "{errors:?}");
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((1.8..2.2).contains(&order), "order {order}, errors {errors:?}");
    }
}

#[test]
fn a_flat_rectangle_has_the_neumann_spectrum_with_errors_of_second_order() {
    let (width, height) = (2.0, 1.3);
    let mut exact: Vec<f64> = (0..12)
        .flat_map(|p| {
            (0..12).map(move |q| (f64::from(p) * PI / width).powi(2) + (f64::from(q) * PI / height).powi(2))
        })
        .collect();
    exact.sort_by(f64::total_cmp);
    let [coarse, fine] = [1, 2].map(|k| {
        let found = spectrum(&shapes::rectangle(40 * k, 26 * k, width, height), 30);
        worst_error(found.eigenvalues(), &exact)
    });
    let order = (coarse / fine).log2();
    assert!(
        fine < 0.01 && (1.8..2.2).contains(&order),
        "order {order}, error {fine}"
    );
}

/// The Laplacian of a flat torus of sides a and b, a grid of nx by ny right triangles: in the plane this has weight
/// dy/dx on horizontal edges, dx/dy on vertical ones and none on diagonals, and mass dx·dy.
fn flat_torus(nx: usize, ny: usize, a: f64, b: f64) -> Laplacian {
    let (dx, dy) = (a / nx as f64, b / ny as f64);
    let n = nx * ny;
    let mut entries = TriMat::new((n, n));
    for x in 0..nx {
        for y in 0..ny {
            let i = x * ny + y;
            for (j, weight) in [((x + 1) % nx * ny + y, dy / dx), (x * ny + (y + 1) % ny, dx / dy)] {
                entries.add_triplet(i, i, weight);
                entries.add_triplet(j, j, weight);
                entries.add_triplet(i, j, -weight);
                entries.add_triplet(j, i, -weight);
            }
        }
    }
    Laplacian::new(entries.to_csr(), vec![dx * dy; n]).expect("a Laplacian")
}

#[test]
fn a_flat_torus_has_exactly_its_discrete_spectrum_with_all_multiplicities() {
    let (nx, ny, a, b) = (36, 30, 1.2, 1.0);
    let (dx, dy) = (a / 36.0, b / 30.0);
    let mut exact: Vec<f64> = (0..nx)
        .flat_map(|p| (0..ny).map(move |q| (p as f64 / nx as f64, q as f64 / ny as f64)))
        .map(|(p, q)| (2.0 * (PI * p).sin() / dx).powi(2) + (2.0 * (PI * q).sin() / dy).powi(2))
        .collect();
    exact.sort_by(f64::total_cmp);
    let found = Spectrum::of_laplacian(&flat_torus(nx, ny, a, b), &options(150), &Job::default()).unwrap();
    assert!(worst_error(found.eigenvalues(), &exact) < 1e-10);
    assert!(orthonormality_defect(&found) < 1e-10);
    assert!(found.eigenvalues().windows(4).any(|l| l[3] - l[0] < 1e-9 * l[3]));
    let continuous = TAU.powi(2) / (a * a);
    assert!((found.eigenvalues()[1] / continuous - 1.0).abs() < 4e-3);
}

#[test]
fn rows_of_the_stiffness_sum_to_zero_and_rows_of_the_full_mass_to_the_lumped_mass() {
    let mesh = shapes::bumpy_torus(24, 12, 5);
    let laplacian = Laplacian::of(&mesh, LaplacianKind::Cotangent, Mass::Full).unwrap();
    let (s, b, d) = (
        laplacian.stiffness(),
        laplacian.full_mass().unwrap(),
        laplacian.mass(),
    );
    let row_sums = |m: &CsMat<f64>| {
        m.outer_iterator()
            .map(|r| r.data().iter().sum())
            .collect::<Vec<f64>>()
    };
    let largest = s.data().iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    assert!(row_sums(s).iter().all(|sum| sum.abs() < 1e-14 * largest));
    assert!(
        row_sums(b)
            .iter()
            .zip(d)
            .all(|(sum, mass)| (sum - mass).abs() < 1e-14 * mass)
    );
    let area: f64 = d.iter().sum();
    assert!((area / mesh.area() - 1.0).abs() < 1e-13);
}

#[test]
fn the_stiffness_measures_the_gradient_of_a_linear_function() {
    let mesh = shapes::rectangle(7, 5, 3.0, 2.0);
    let f: Vec<f64> = mesh.positions().iter().map(|p| 2.0 * p[0] - 0.5 * p[1]).collect();
    let laplacian = Laplacian::cotangent(&mesh).unwrap();
    let energy: f64 = laplacian
        .stiffness()
        .iter()
        .map(|(&s, (i, j))| s * f[i] * f[j])
        .sum();
    assert!((energy - 6.0 * 4.25).abs() < 1e-12);
}

#[test]
fn eigenfunctions_are_orthonormal_whatever_path_computes_them() {
    for mesh in [
        shapes::bumpy_sphere(2, 1),
        shapes::bumpy_sphere(4, 1),
        shapes::bumpy_block(2, 6, 3),
    ] {
        let found = spectrum(&mesh, 120);
        assert!(orthonormality_defect(&found) < 1e-10);
        assert!(
            found.residuals().iter().all(|r| *r < 1e-8),
            "{:?}",
            found.residuals()
        );
        let constant = 1.0 / mesh.area().sqrt();
        assert!(
            found
                .eigenfunction(0)
                .iter()
                .all(|h| (h / constant - 1.0).abs() < 1e-12)
        );
    }
}

#[test]
fn parseval_holds_and_the_inverse_transform_plus_the_difference_gives_the_mesh_back() {
    let mesh = shapes::bumpy_sphere(3, 7);
    let all = spectrum(&mesh, mesh.vertex_count());
    let f = mesh.positions().iter().map(|p| [p[0] * p[1] - p[2], 0.0, 0.0]);
    let f: Vec<[f64; 3]> = f.collect();
    let energy: f64 = f.iter().zip(all.mass()).map(|([x, ..], mass)| x * x * mass).sum();
    let spectral: f64 = all.transform_positions(&f).iter().map(|[c, ..]| c * c).sum();
    assert!((spectral / energy - 1.0).abs() < 1e-12);

    let some = spectrum(&mesh, 60);
    let reconstructed = some.inverse_transform_positions(&some.transform_positions(mesh.positions()));
    let difference = some.reconstruction_difference(mesh.positions());
    for ((p, q), d) in mesh.positions().iter().zip(&reconstructed).zip(&difference) {
        for axis in 0..3 {
            assert!((q[axis] + d[axis] - p[axis]).abs() < 1e-14);
        }
    }
    assert!(difference.iter().flatten().any(|d| d.abs() > 1e-4));
}

#[test]
fn eigenvalues_scale_as_the_inverse_square_and_eigenfunctions_as_the_inverse() {
    let mesh = shapes::bumpy_torus(40, 20, 3);
    let unit = spectrum(&mesh, 60);
    for s in [1e-6, 1e-3, 1e3, 1e6] {
        let scaled = spectrum(&shapes::scaled(&mesh, s), 60);
        for k in 1..60 {
            assert!((scaled.eigenvalues()[k] * s * s / unit.eigenvalues()[k] - 1.0).abs() < 1e-9);
            let pairs = scaled.eigenfunction(k).iter().zip(unit.eigenfunction(k));
            let largest = unit.eigenfunction(k).iter().fold(0.0, |a: f64, x| a.max(x.abs()));
            assert!(pairs.map(|(a, b)| (a * s - b).abs()).fold(0.0, f64::max) < 1e-6 * largest);
        }
    }
}

#[test]
fn the_sparse_solver_agrees_with_a_dense_one() {
    let mesh = shapes::bumpy_torus(40, 24, 9);
    let laplacian = Laplacian::of(&mesh, LaplacianKind::Cotangent, Mass::Full).unwrap();
    let n = mesh.vertex_count();
    let dense = |sparse: &CsMat<f64>| {
        let mut a = faer::Mat::<f64>::zeros(n, n);
        for (&value, (i, j)) in sparse {
            a[(i, j)] = value;
        }
        a
    };
    let s = dense(laplacian.stiffness());
    let d = faer::Mat::from_fn(n, n, |i, j| if i == j { laplacian.mass()[i] } else { 0.0 });
    let b = dense(laplacian.full_mass().unwrap());
    for (mass, matrix) in [(Mass::Lumped, d), (Mass::Full, b)] {
        let factor = matrix.llt(faer::Side::Lower).unwrap();
        let mut a = s.clone();
        factor.L().solve_lower_triangular_in_place(a.as_mut());
        factor
            .L()
            .solve_lower_triangular_in_place(a.as_mut().transpose_mut());
        let exact = a.self_adjoint_eigenvalues(faer::Side::Lower).unwrap();
        let found =
            Spectrum::compute(&mesh, &SpectrumOptions { mass, ..options(200) }, &Job::default()).unwrap();
        assert!(worst_error(found.eigenvalues(), &exact) < 1e-10);
        let h = found.eigenfunctions();
        let defect = h.transpose() * &matrix * h - faer::Mat::<f64>::identity(200, 200);
        assert!(defect.norm_max() < 1e-10);
    }
}

#[test]
fn with_full_mass_the_transform_of_an_eigenfunction_is_a_unit_vector() {
    for mesh in [shapes::bumpy_sphere(2, 3), shapes::bumpy_sphere(4, 3)] {
        let settings = SpectrumOptions {
            mass: Mass::Full,
            ..options(60)
        };
        let found = Spectrum::compute(&mesh, &settings, &Job::default()).unwrap();
        for k in [0, 7, 59] {
            let function: Vec<[f64; 3]> = found.eigenfunction(k).iter().map(|&h| [h, 0.0, 0.0]).collect();
            for (i, [c, ..]) in found.transform_positions(&function).iter().enumerate() {
                assert!((c - f64::from(u8::from(i == k))).abs() < 1e-10);
            }
        }
        assert!(found.residuals().iter().all(|r| *r < 1e-8));
    }
}

#[test]
fn every_component_adds_one_zero_and_copies_repeat_every_eigenvalue() {
    let one = shapes::bumpy_sphere(3, 2);
    let single = spectrum(&one, 25);
    let copies: Vec<TriMesh> = (0..11)
        .map(|k| shapes::translated(&one, [4.0 * f64::from(k), 0.0, 0.0]))
        .collect();
    let found = spectrum(&shapes::disjoint_union(&copies), 11 * 25);
    assert!(found.eigenvalues()[..11].iter().all(|l| *l == 0.0));
    for k in 1..25 {
        for copy in 0..11 {
            assert!((found.eigenvalues()[11 * k + copy] / single.eigenvalues()[k] - 1.0).abs() < 1e-9);
        }
    }
    assert!(orthonormality_defect(&found) < 1e-10);
}

#[test]
fn fewer_pairs_than_components_are_constants_that_cost_no_column_a_component() {
    // A column for each of these components would be 7 GB.
    let found = spectrum(&shapes::soup(17_000, 1), 10);
    assert_eq!(found.eigenvalues(), [0.0; 10]);
    assert!(found.residuals().iter().all(|r| *r < 1e-10));
    assert!(orthonormality_defect(&found) < 1e-10);
    let [proof] = found.inertia() else {
        panic!("{:?}", found.inertia())
    };
    assert!(proof.shift < 0.0 && proof.below == 0);
}

#[test]
fn constants_do_not_depend_on_how_many_pairs_are_asked_for() {
    for (pieces, piece) in [(30, shapes::cube(1.0)), (3, shapes::bumpy_sphere(3, 1))] {
        let mesh = shapes::disjoint_union(&vec![piece; pieces]);
        for mass in [Mass::Lumped, Mass::Full] {
            let of = |count| {
                let options = SpectrumOptions {
                    mass,
                    ..options(count)
                };
                Spectrum::compute(&mesh, &options, &Job::default()).unwrap()
            };
            let all = of(pieces + 4);
            for count in [1, pieces - 1, pieces] {
                let some = of(count);
                assert_eq!(some.eigenvalues(), vec![0.0; count]);
                assert!((0..count).all(|k| some.eigenfunction(k) == all.eigenfunction(k)));
            }
        }
    }
}

#[test]
fn an_operator_with_negative_eigenvalues_is_refused_where_only_the_constant_is_asked_for() {
    let entries = vec![-3.0, 3.0, 3.0, -3.0];
    let negative = TriMat::from_triplets((2, 2), vec![0, 0, 1, 1], vec![0, 1, 0, 1], entries).to_csr();
    let negative = Laplacian::new(negative, vec![1.0; 2]).unwrap();
    let refused = Spectrum::of_laplacian(&negative, &options(1), &Job::default());
    assert!(matches!(
        refused,
        Err(SpectrumError::Incomplete {
            proven: 1,
            found: 0,
            ..
        })
    ));
}

#[test]
fn eigenfunctions_that_no_memory_holds_are_refused() {
    // A mesh of five million unconnected vertices, and all of its pairs: 200 TB.
    let n = 5_000_000;
    let apart = Laplacian::new(CsMat::zero((n, n)), vec![1.0; n]).unwrap();
    let refused = Spectrum::of_laplacian(&apart, &options(n), &Job::default());
    assert_eq!(
        refused.unwrap_err(),
        SpectrumError::Eigenfunctions {
            count: n,
            vertices: n
        }
    );
}

#[test]
fn eigenvalues_that_nearly_coincide_are_all_found() {
    let one = shapes::bumpy_sphere(3, 2);
    let single = spectrum(&one, 30);
    for difference in [1e-3, 1e-5, 1e-7, 1e-9] {
        let copies: Vec<TriMesh> = (0..3)
            .map(|k| {
                let scaled = shapes::scaled(&one, 1.0 + difference * f64::from(k));
                shapes::translated(&scaled, [5.0 * f64::from(k), 0.0, 0.0])
            })
            .collect();
        let found = spectrum(&shapes::disjoint_union(&copies), 90);
        assert!(orthonormality_defect(&found) < 1e-10);
        for k in 3..90 {
            assert!(
                (found.eigenvalues()[k] / single.eigenvalues()[k / 3] - 1.0).abs() < 5.0 * difference + 1e-9
            );
        }
    }
}

#[test]
fn residuals_meet_the_tolerance() {
    let mesh = shapes::bumpy_sphere(5, 4);
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
        let found = Spectrum::compute(
            &mesh,
            &SpectrumOptions {
                tolerance,
                ..options(200)
            },
            &Job::default(),
        )
        .unwrap();
        let worst = found.residuals().iter().copied().fold(0.0, f64::max);
        assert!(worst < tolerance, "{worst:e} at {tolerance:e}");
    }
}

#[test]
fn a_mesh_beside_its_mirror_image_has_every_eigenvalue_twice() {
    let one = shapes::bumpy_torus(30, 16, 4);
    let mirror = shapes::translated(&shapes::mirrored(&one), [10.0, 0.0, 0.0]);
    let found = spectrum(&shapes::disjoint_union(&[one, mirror]), 100);
    for pair in found.eigenvalues().chunks(2) {
        assert!(pair[1] - pair[0] <= 1e-9 * pair[1]);
    }
}

#[test]
fn the_basis_does_not_depend_on_how_many_pairs_are_asked_for_even_inside_a_cluster() {
    // The eigenvalues of the sphere come in clusters of 2l + 1; 40 cuts one of 13.
    for (mesh, few, many) in [
        (shapes::icosphere(4), 40, 90),
        (shapes::bumpy_sphere(4, 3), 61, 150),
    ] {
        let difference = basis_difference(&spectrum(&mesh, few), &spectrum(&mesh, many));
        assert!(difference < 1e-6, "{difference:e}");
    }
}

#[test]
fn threads_change_no_bit() {
    let mesh = shapes::bumpy_sphere(4, 6);
    let [one, two] =
        [1, 2].map(|threads| Spectrum::compute(&mesh, &options(160), &Job::new(threads)).unwrap());
    assert_eq!(one.eigenvalues(), two.eigenvalues());
    assert!((0..one.eigenvalues().len()).all(|k| one.eigenfunction(k) == two.eigenfunction(k)));
}

#[test]
fn in_another_order_of_the_vertices_functions_are_the_same_or_the_opposite_as_foretold() {
    let mesh = shapes::bumpy_sphere(3, 1);
    let held = on_border(&mesh, [0.3, 0.3]);
    for fixed in [vec![false; mesh.vertex_count()], held] {
        let of = |mesh: &TriMesh, fixed: &[bool]| {
            Spectrum::with_fixed(mesh, fixed, &options(40), &Job::default()).unwrap()
        };
        // Vertex v goes to place 7 v mod n.
        let n = mesh.vertex_count() as u32;
        let place = |v: u32| (v * 7) % n;
        let mut order = vec![0; n as usize];
        (0..n).for_each(|v| order[place(v) as usize] = v);
        let positions = order.iter().map(|&v| mesh.positions()[v as usize]).collect();
        let triangles = mesh.triangles().iter().map(|t| t.map(place)).collect();
        let moved = TriMesh::new(positions, triangles).unwrap();
        let fixed_there: Vec<bool> = order.iter().map(|&v| fixed[v as usize]).collect();

        let here = of(&mesh, &fixed);
        let free: Vec<u32> = order.iter().copied().filter(|&v| !fixed[v as usize]).collect();
        let opposite = here.opposite_in(&free);
        assert!(opposite.contains(&true) && opposite.contains(&false));
        let there = of(&moved, &fixed_there).with_opposites(&opposite);
        for k in 0..40 {
            for (place, &v) in order.iter().enumerate() {
                let apart = here.eigenfunction(k)[v as usize] - there.eigenfunction(k)[place];
                assert!(apart.abs() < 1e-6, "{k} {v}: {apart}");
            }
        }
    }
}

#[test]
fn solver_settings_change_the_basis_by_less_than_1e_6() {
    let mesh = shapes::bumpy_sphere(4, 8);
    let a = spectrum(&mesh, 150);
    for (block, band) in [(16, 31), (1, 200), (0, 60)] {
        let other = SpectrumOptions {
            block,
            band,
            ..options(150)
        };
        let difference = basis_difference(&a, &Spectrum::compute(&mesh, &other, &Job::default()).unwrap());
        assert!(difference < 1e-6, "{difference:e}");
    }
}

#[test]
fn eigenvalues_grow_as_weyl_says() {
    let mesh = shapes::bumpy_torus(80, 40, 1);
    let found = spectrum(&mesh, 120);
    let weyl = 4.0 * PI * 119.0 / mesh.area();
    assert!((found.eigenvalues()[119] / weyl - 1.0).abs() < 0.15);
}

#[test]
fn what_has_no_spectrum_is_refused_with_the_place() {
    let compute =
        |mesh: &TriMesh, options: &SpectrumOptions| Spectrum::compute(mesh, options, &Job::default());
    let mesh = shapes::tetrahedron();
    assert!(matches!(
        compute(&mesh, &options(5)),
        Err(SpectrumError::Count {
            count: 5,
            vertices: 4
        })
    ));
    assert!(matches!(
        compute(&mesh, &options(0)),
        Err(SpectrumError::Count { .. })
    ));
    let wrong = SpectrumOptions {
        tolerance: f64::NAN,
        ..options(3)
    };
    assert!(matches!(
        compute(&mesh, &wrong),
        Err(SpectrumError::Tolerance { .. })
    ));

    let mut positions = mesh.positions().to_vec();
    positions.push([9.0; 3]);
    let unused = TriMesh::new(positions, mesh.triangles().to_vec()).unwrap();
    assert!(matches!(
        compute(&unused, &options(3)),
        Err(SpectrumError::Mass { vertex: 4, .. })
    ));

    let point = TriMesh::new(vec![[1.0; 3]; 3], vec![[0, 1, 2]]).unwrap();
    assert!(matches!(
        compute(&point, &options(1)),
        Err(SpectrumError::Area { .. })
    ));

    let lopsided = TriMat::from_triplets((2, 2), vec![0, 0, 1], vec![0, 1, 1], vec![1.0, -1.0, 1.0]).to_csr();
    assert!(matches!(
        Laplacian::new(lopsided, vec![1.0; 2]),
        Err(SpectrumError::Entry { .. })
    ));
    let heavy = TriMat::from_triplets((2, 2), vec![0, 1], vec![0, 1], vec![1.0, 0.0]).to_csr();
    assert!(matches!(
        Laplacian::new(heavy, vec![1.0; 2]),
        Err(SpectrumError::RowSum { row: 0, .. })
    ));
}

/// Writes down the stages, and stops when one begins.
#[derive(Default)]
struct Diary {
    stages: Mutex<Vec<&'static str>>,
    stop_at: Option<&'static str>,
}

impl Observer for Diary {
    fn stage(&self, stage: &dyn Stage) {
        self.stages
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(stage.name());
    }

    fn fraction(&self, done: f64) {
        assert!((0.0..=1.0).contains(&done));
    }

    fn cancelled(&self) -> bool {
        self.stop_at.is_some()
            && self
                .stages
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .last()
                .copied()
                == self.stop_at
    }
}

#[test]
fn an_observer_sees_the_stages_in_order_and_can_stop_in_each() {
    let mesh = shapes::bumpy_sphere(4, 1);
    let watched_by = |diary: &Arc<Diary>| {
        let job = Job::new(2).shared_with(Arc::<Diary>::clone(diary));
        Spectrum::compute(&mesh, &options(40), &job)
    };
    let diary = Arc::new(Diary::default());
    watched_by(&diary).unwrap();
    let order = ["assembly", "ordering", "slicing", "solving", "finishing"];
    assert_eq!(*diary.stages.lock().unwrap(), order);
    for stage in order {
        let stopped = watched_by(&Arc::new(Diary {
            stop_at: Some(stage),
            ..Diary::default()
        }));
        assert_eq!(stopped.unwrap_err(), SpectrumError::Job(JobError::Cancelled));
    }
}

/// Vertices of a rectangle that lie on its border.
fn on_border(mesh: &TriMesh, [a, b]: [f64; 2]) -> Vec<bool> {
    let near = |x: f64, y: f64| (x - y).abs() < 1e-9;
    let is_there = |&[x, y, _]: &[f64; 3]| near(x, 0.0) || near(x, a) || near(y, 0.0) || near(y, b);
    mesh.positions().iter().map(is_there).collect()
}

#[test]
fn a_rectangle_that_is_held_along_its_border_has_the_dirichlet_spectrum_with_errors_of_second_order() {
    let [a, b] = [1.3, 1.0];
    let mut exact: Vec<f64> = (1..12)
        .flat_map(|j| (1..12).map(move |k| (PI * f64::from(j) / a).powi(2) + (PI * f64::from(k) / b).powi(2)))
        .collect();
    exact.sort_by(f64::total_cmp);
    let error = |n: u32| {
        let mesh = shapes::rectangle(n, n, a, b);
        let fixed = on_border(&mesh, [a, b]);
        let spectrum = Spectrum::with_fixed(&mesh, &fixed, &options(10), &Job::default()).unwrap();
        assert!(orthonormality_defect(&spectrum) < 1e-9);
        for k in 0..10 {
            let at_border = spectrum
                .eigenfunction(k)
                .iter()
                .zip(&fixed)
                .filter(|(_, fixed)| **fixed);
            assert!(at_border.into_iter().all(|(h, _)| *h == 0.0));
        }
        worst_error(spectrum.eigenvalues(), &exact[..10])
    };
    let (coarse, fine) = (error(30), error(60));
    assert!(fine < 4e-3 && coarse / fine > 3.5, "{coarse} {fine}");
}

/// Cauchy's interlacing theorem: to hold k vertices lifts an eigenvalue at most to the one k places above.
#[test]
fn to_hold_vertices_lifts_eigenvalues_no_farther_than_interlacing_allows() {
    let mesh = shapes::bumpy_sphere(4, 3);
    let free = spectrum(&mesh, 30);
    let mut fixed = vec![false; mesh.vertex_count()];
    [7, 300, 1999].into_iter().for_each(|v| fixed[v] = true);
    let held = Spectrum::with_fixed(&mesh, &fixed, &options(27), &Job::default()).unwrap();
    for k in 0..27 {
        let [least, found, most] = [
            free.eigenvalues()[k],
            held.eigenvalues()[k],
            free.eigenvalues()[k + 3],
        ];
        assert!(
            least - 1e-9 <= found && found <= most + 1e-9,
            "{least} {found} {most}"
        );
    }
    let none = vec![false; mesh.vertex_count()];
    let same = Spectrum::with_fixed(&mesh, &none, &options(30), &Job::default()).unwrap();
    assert_eq!(same.eigenvalues(), free.eigenvalues());
}

#[test]
fn a_component_that_nothing_holds_keeps_its_constant() {
    for level in [2, 4] {
        let piece = shapes::icosphere(level);
        let n = piece.vertex_count();
        let mesh = shapes::disjoint_union(&[piece.clone(), shapes::translated(&piece, [4.0, 0.0, 0.0])]);
        let mut fixed = vec![false; 2 * n];
        fixed[0] = true;
        let spectrum = Spectrum::with_fixed(&mesh, &fixed, &options(8), &Job::default()).unwrap();
        assert!(spectrum.eigenvalues()[0] == 0.0 && spectrum.eigenvalues()[1] > 1e-3);
        let constant = spectrum.eigenfunction(0);
        assert!(
            constant[..n].iter().all(|h| *h == 0.0)
                && constant[n..]
                    .iter()
                    .all(|h| (h / constant[n] - 1.0).abs() < 1e-12)
        );
    }
    let all = vec![true; 12];
    let refused = Spectrum::with_fixed(&shapes::icosphere(0), &all, &options(1), &Job::default());
    assert!(matches!(refused, Err(SpectrumError::Count { vertices: 0, .. })));
}
