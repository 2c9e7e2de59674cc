//! What holds of every decimated mesh, and of quadrics.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use decimation::{Decimator, Quadric, decimate};
use job::{Job, JobError, Observer};
use mesh::{TopologyReport, TriMesh, Vec3, shapes};
use proptest::prelude::*;

fn decimated(mesh: &TriMesh, target: usize, decimator: Decimator) -> TriMesh {
    decimate(mesh, target, decimator, &Job::default()).unwrap()
}

#[test]
fn a_closed_sphere_is_decimated_to_the_size_that_was_asked_for_and_stays_one() {
    let ball = shapes::icosphere(5);
    for decimator in Decimator::ALL {
        for target in [10_000, 2_048, 512] {
            let coarse = decimated(&ball, target, decimator);
            let report = TopologyReport::of(&coarse);
            assert_eq!(coarse.triangle_count(), target, "{decimator:?}");
            assert!(
                report.closed && report.euler_characteristic == 2,
                "{decimator:?} {target}"
            );
            assert!((coarse.signed_volume() / ball.signed_volume() - 1.0).abs() < 0.02);
        }
    }
}

#[test]
fn a_plane_stays_a_plane() {
    let plane = shapes::rectangle(20, 20, 3.0, 2.0);
    for decimator in Decimator::ALL {
        let coarse = decimated(&plane, 100, decimator);
        assert!(coarse.triangle_count() <= 100, "{decimator:?}");
        assert!(coarse.positions().iter().all(|p| p[2].abs() < 1e-12));
        assert!((coarse.area() - 6.0).abs() < 0.3, "{}", coarse.area());
    }
}

#[test]
fn a_mesh_that_is_small_enough_stays_as_it_is() {
    let cube = shapes::cube(1.0);
    for decimator in Decimator::ALL {
        assert_eq!(decimated(&cube, 12, decimator), cube);
        assert_eq!(decimated(&cube, 100, decimator), cube);
    }
}

#[test]
fn what_is_left_keeps_its_order() {
    let original = shapes::bumpy_torus(40, 30, 1);
    for decimator in Decimator::ALL {
        // The first triangles are cut off the list: those that nothing touched are the same in both.
        let coarse = decimated(&original, 2_300, decimator);
        let corners = |mesh: &TriMesh, t: usize| mesh.corners(t).map(|p| p.map(|x| (x * 1e9).round()));
        let all: Vec<_> = (0..original.triangle_count())
            .map(|t| corners(&original, t))
            .collect();
        let place = |t: usize| all.iter().position(|c| *c == corners(&coarse, t));
        let places: Vec<usize> = (0..coarse.triangle_count()).filter_map(place).collect();
        assert!(places.len() > 100 && places.is_sorted(), "{decimator:?}");
    }
}

#[test]
fn a_job_ends_on_request() {
    struct Stop;
    impl Observer for Stop {
        fn cancelled(&self) -> bool {
            true
        }
    }
    let job = Job::default().observed_by(Stop);
    for decimator in Decimator::ALL {
        let stopped = decimate(&shapes::icosphere(3), 10, decimator, &job);
        assert_eq!(stopped, Err(JobError::Cancelled));
    }
}

/// Meshes of all kinds, some of them no manifolds.
fn hard() -> impl Strategy<Value = TriMesh> {
    let seed = 0..20_u64;
    prop_oneof![
        seed.clone().prop_map(|seed| shapes::soup(30, seed)),
        seed.clone().prop_map(|seed| shapes::bumpy_block(2, 2, seed)),
        seed.clone()
            .prop_map(|seed| shapes::shuffled(&shapes::bumpy_torus(9, 7, seed), seed)),
        (3..9_u32).prop_map(shapes::book),
        (4..30_u32).prop_map(shapes::moebius_strip),
        (1..20_u32).prop_map(|n| shapes::book_of_slivers(n, 1e-4)),
        seed.prop_map(|seed| shapes::jittered(&shapes::rectangle(8, 5, 1.0, 1.0), 0.4, seed)),
        Just(shapes::tetrahedron()),
        Just(shapes::disjoint_union(&[shapes::cube(1.0), shapes::cube(1.0)])),
    ]
}

proptest! {
    #[test]
    fn every_mesh_has_a_decimated_one_and_always_the_same(
        mesh in hard(),
        target in 0..200_usize,
        scale in prop::sample::select(vec![1e-30, 1e-3, 1.0, 1e6, 1e30]),
    ) {
        let mesh = shapes::scaled(&mesh, scale);
        for decimator in Decimator::ALL {
            let coarse = decimated(&mesh, target, decimator);
            prop_assert!((1..=mesh.triangle_count()).contains(&coarse.triangle_count()));
            prop_assert_eq!(&coarse, &decimated(&mesh, target, decimator));
            if coarse.triangle_count() < mesh.triangle_count() {
                prop_assert!(coarse.used_vertices().iter().all(|&used| used));
            }
        }
    }

    #[test]
    fn three_planes_have_their_least_quadric_where_they_meet(
        normals in prop::array::uniform3(prop::array::uniform3(-1.0..1.0_f64)),
        point in prop::array::uniform3(-10.0..10.0_f64),
    ) {
        let (normals, point) = (normals.map(Vec3), Vec3(point));
        let [a, b, c] = normals;
        prop_assume!(a.dot(b.cross(c)).abs() > 0.05);
        let planes = normals.map(|n| Quadric::of_plane(n, n.dot(point)));
        let sum = planes.into_iter().fold(Quadric::ZERO, |sum, plane| sum + plane);
        prop_assert!((sum.minimum().unwrap() - point).norm() < 1e-6);
        prop_assert!(sum.at(point).abs() < 1e-9);

        // Along a line it is least at the foot of the valley, and Q is the sum of squared distances.
        let from = point + Vec3([0.3, -0.2, 0.5]);
        let way = sum.way_along(from, point - from).unwrap();
        prop_assert!((way - 1.0).abs() < 1e-6);
        let squares: f64 = normals.iter().map(|n| n.dot(from - point).powi(2)).sum();
        prop_assert!((sum.at(from) - squares).abs() < 1e-9);
    }
}
