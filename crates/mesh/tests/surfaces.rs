//! What is known about the fixtures holds, and the report says so.

use mesh::{Facing, Similarity, TopologyReport, TriMesh, Vec3, Welded, shapes};
use proptest::prelude::*;
use std::f64::consts::PI;

/// A fixture and what its documentation says of it.
struct Known {
    name: &'static str,
    mesh: TriMesh,
    vertices: usize,
    triangles: usize,
    euler: i64,
    loops: usize,
    genus: Option<u64>,
}

#[rustfmt::skip] // a table
fn catalogue() -> Vec<Known> {
    let known = |name, mesh, [vertices, triangles]: [usize; 2], euler, loops, genus| {
        Known { name, mesh, vertices, triangles, euler, loops, genus }
    };
    vec![
        known("tetrahedron", shapes::tetrahedron(), [4, 4], 2, 0, Some(0)),
        known("cube", shapes::cube(2.0), [8, 12], 2, 0, Some(0)),
        known("icosahedron", shapes::icosphere(0), [12, 20], 2, 0, Some(0)),
        known("icosphere", shapes::icosphere(3), [642, 1280], 2, 0, Some(0)),
        known("torus", shapes::torus(20, 10, 2.0, 0.5), [200, 400], 0, 0, Some(1)),
        known("block", shapes::block(0, 2), [58, 112], 2, 0, Some(0)),
        known("block with holes", shapes::block(3, 2), [268, 544], -4, 0, Some(3)),
        known("rectangle", shapes::rectangle(5, 3, 2.0, 1.0), [24, 30], 1, 1, Some(0)),
        known("cylinder", shapes::cylinder(12, 4, 1.0, 3.0), [60, 96], 0, 2, Some(0)),
        known("Möbius strip", shapes::moebius_strip(9), [18, 18], 0, 1, None),
        known("open book", shapes::book(2), [6, 4], 1, 1, Some(0)),
        known("book", shapes::book(3), [8, 6], 1, 3, None),
        known("book of slivers", shapes::book_of_slivers(10, 1e-6), [22, 20], 1, 1, Some(0)),
        known("soup", shapes::soup(6, 1), [18, 6], 6, 6, None),
        known("bumpy sphere", shapes::bumpy_sphere(4, 7), [2562, 5120], 2, 0, Some(0)),
        known("bumpy torus", shapes::bumpy_torus(50, 24, 7), [1200, 2400], 0, 0, Some(1)),
        known("bumpy block", shapes::bumpy_block(2, 6, 7), [1798, 3600], -2, 0, Some(2)),
    ]
}

#[test]
fn every_shape_has_the_counts_and_the_topology_that_its_table_states() {
    for Known {
        name,
        mesh,
        vertices,
        triangles,
        euler,
        loops,
        genus,
    } in catalogue()
    {
        let report = TopologyReport::of(&mesh);
        assert_eq!(
            [report.vertices, report.triangles],
            [vertices, triangles],
            "{name}"
        );
        assert_eq!(
            (report.euler_characteristic, report.boundary_loops),
            (euler, loops),
            "{name}"
        );
        assert_eq!(report.genus, genus, "{name}");
        assert_eq!(report.components, if name == "soup" { 6 } else { 1 }, "{name}");
        assert_eq!(report.closed, loops == 0, "{name}");
        assert_eq!(report.facing, (loops == 0).then_some(Facing::Outward), "{name}");
        assert_eq!(
            (report.manifold, report.non_manifold_edges),
            if name == "book" { (false, 1) } else { (true, 0) },
            "{name}"
        );
        assert_eq!(report.orientable, name != "Möbius strip", "{name}");
        assert_eq!(
            (
                report.degenerate_triangles,
                report.duplicated_triangles,
                report.unused_vertices
            ),
            (0, 0, 0),
            "{name}"
        );
    }
}

#[test]
fn angle_defects_of_a_closed_surface_sum_to_two_pi_times_its_euler_characteristic() {
    for Known {
        name,
        mesh,
        euler,
        loops,
        ..
    } in catalogue()
    {
        if loops > 0 {
            continue;
        }
        let mut defect = vec![2.0 * PI; mesh.vertex_count()];
        for (t, triangle) in mesh.triangles().iter().enumerate() {
            let p = mesh.corners(t);
            for i in 0..3 {
                defect[triangle[i] as usize] -= angle(p[i], p[(i + 1) % 3], p[(i + 2) % 3]);
            }
        }
        let total: f64 = defect.iter().sum();
        assert!((total - 2.0 * PI * euler as f64).abs() < 1e-9, "{name}: {total}");
    }
}

/// By the law of cosines.
fn angle(apex: Vec3, p: Vec3, q: Vec3) -> f64 {
    let (u, v, w) = ((apex - p).squared(), (apex - q).squared(), (p - q).squared());
    ((u + v - w) / (2.0 * (u * v).sqrt())).acos()
}

#[test]
fn areas_and_volumes_of_finer_spheres_approach_those_of_the_sphere_four_times_closer_at_each_level() {
    let error = |level| {
        let sphere = shapes::icosphere(level);
        [4.0 * PI - sphere.area(), 4.0 / 3.0 * PI - sphere.signed_volume()]
    };
    let (coarse, fine) = (error(4), error(5));
    for i in 0..2 {
        let ratio = coarse[i] / fine[i];
        assert!(fine[i] > 0.0 && (3.9..4.1).contains(&ratio), "{ratio}");
    }
}

#[test]
fn a_divided_surface_has_four_times_the_triangles_and_the_same_area_and_topology() {
    for Known { name, mesh, .. } in catalogue() {
        let divided = shapes::divided(&mesh);
        assert_eq!(divided.triangle_count(), 4 * mesh.triangle_count(), "{name}");
        assert_eq!(
            divided.positions()[..mesh.vertex_count()],
            *mesh.positions(),
            "{name}"
        );
        assert!((divided.area() / mesh.area() - 1.0).abs() < 1e-9, "{name}");
        let [fine, coarse] = [&divided, &mesh].map(TopologyReport::of);
        assert_eq!(fine.euler_characteristic, coarse.euler_characteristic, "{name}");
        assert_eq!(fine.boundary_loops, coarse.boundary_loops, "{name}");
        assert_eq!(fine.facing, coarse.facing, "{name}");
    }
}

#[test]
fn areas_and_volumes_are_those_of_the_formulas() {
    let cases = [
        (shapes::tetrahedron(), 8.0 * 3.0_f64.sqrt(), Some(8.0 / 3.0)),
        (shapes::cube(2.0), 24.0, Some(8.0)),
        (shapes::block(0, 1), 14.0, Some(3.0)),
        (shapes::block(3, 2), 68.0, Some(18.0)),
        (shapes::rectangle(5, 3, 2.0, 0.7), 1.4, None),
        (shapes::book(5), 5.0, None),
        (shapes::book_of_slivers(10, 1e-6), 1e-5, None),
    ];
    for (mesh, area, volume) in cases {
        let report = TopologyReport::of(&mesh);
        assert!(
            (report.area - area).abs() < 1e-11 * area,
            "{} for {area}",
            report.area
        );
        assert_eq!(report.volume.is_some(), volume.is_some());
        assert!((report.volume.unwrap_or(0.0) - volume.unwrap_or(0.0)).abs() < 1e-12);
    }
    let torus = shapes::torus(400, 200, 2.0, 0.5).area();
    assert!((torus / (4.0 * PI * PI) - 1.0).abs() < 1e-3, "{torus}");
}

#[test]
fn slivers_have_the_angle_that_was_asked_for() {
    let slivers = shapes::book_of_slivers(4, 1e-6);
    for t in 0..slivers.triangle_count() {
        let [a, b, c] = slivers.corners(t);
        let longest = [a, b, c].map(|p| p[0]).into_iter().fold(0.0, f64::max);
        let height = 2.0 * slivers.triangle_area(t) / longest;
        assert!((height - 1e-6).abs() < 1e-15);
    }
}

#[test]
fn bumpy_surfaces_have_irregular_nets_of_well_shaped_triangles_and_depend_on_the_seed() {
    let make: [fn(u64) -> TriMesh; 3] = [
        |s| shapes::bumpy_sphere(4, s),
        |s| shapes::bumpy_torus(50, 24, s),
        |s| shapes::bumpy_block(2, 6, s),
    ];
    for make in make {
        let mesh = make(1);
        assert_eq!(mesh, make(1));
        assert_ne!(mesh.positions(), make(2).positions());
        assert_ne!(mesh.triangles(), make(2).triangles());
        let adjacency = mesh.neighbours();
        let irregular = (0..mesh.vertex_count())
            .filter(|&v| adjacency.of(v).len() != 6)
            .count();
        assert!(irregular > mesh.vertex_count() / 4, "{irregular}");
        let report = TopologyReport::of(&mesh);
        assert!(report.shortest_edge > 0.02 * report.longest_edge, "{report}");
    }
}

#[test]
fn a_report_does_not_depend_on_the_order_of_vertices_and_triangles() {
    for Known { name, mesh, .. } in catalogue() {
        let [report, of_shuffled] = [&mesh, &shapes::shuffled(&mesh, 3)].map(TopologyReport::of);
        assert!(
            (report.area - of_shuffled.area).abs() <= 1e-12 * report.area,
            "{name}"
        );
        assert!(
            (report.mean_edge - of_shuffled.mean_edge).abs() <= 1e-12 * report.mean_edge,
            "{name}"
        );
        let [volume, other] = [&report, &of_shuffled].map(|r| r.volume.unwrap_or(0.0));
        assert!((volume - other).abs() <= 1e-12 * volume, "{name}");
        // All else is exact.
        let TopologyReport {
            area,
            mean_edge,
            volume,
            ..
        } = report;
        assert_eq!(
            report,
            TopologyReport {
                area,
                mean_edge,
                volume,
                ..of_shuffled
            },
            "{name}"
        );
    }
}

#[test]
fn a_mirrored_surface_faces_outward_and_one_turned_over_faces_inward() {
    let sphere = shapes::bumpy_sphere(2, 5);
    let facing = |mesh: &TriMesh| TopologyReport::of(mesh).facing;
    assert_eq!(facing(&shapes::mirrored(&sphere)), Some(Facing::Outward));
    assert_eq!(facing(&shapes::inside_out(&sphere)), Some(Facing::Inward));
    let turned = Similarity {
        scale: 3.0,
        translation: [1e3, 0.0, 0.0],
        ..Similarity::from_quaternion([1.0, 2.0, 3.0, 4.0])
    };
    assert_eq!(facing(&shapes::moved(&sphere, &turned)), Some(Facing::Outward));
}

#[test]
fn a_triangle_that_faces_the_other_way_is_noticed_and_can_be_mended() {
    let sphere = shapes::icosphere(1);
    let mut triangles = sphere.triangles().to_vec();
    triangles[5].swap(0, 1);
    let report = TopologyReport::of(&TriMesh::new(sphere.positions().to_vec(), triangles).unwrap());
    assert_eq!(
        (
            report.inconsistent_edges,
            report.orientable,
            report.facing,
            report.genus
        ),
        (3, true, None, Some(0))
    );
    assert!(report.remarks()[0].starts_with("3 edges between triangles that face opposite ways"));
}

#[test]
fn two_cones_that_touch_at_their_tips_meet_at_a_non_manifold_vertex() {
    let cone = shapes::tetrahedron();
    let through_its_tip = Similarity {
        rotation: [[-1., 0., 0.], [0., -1., 0.], [0., 0., -1.]],
        translation: [2.0; 3],
        scale: 1.0,
    };
    let both = shapes::disjoint_union(&[cone.clone(), shapes::moved(&cone, &through_its_tip)]);
    let report = TopologyReport::of_welded(&Welded::new(both.positions(), both.triangles()).unwrap());
    assert!(report.closed && !report.manifold);
    assert_eq!(
        (
            report.vertices,
            report.non_manifold_vertices,
            report.non_manifold_edges
        ),
        (7, 1, 0)
    );
    assert_eq!(
        (report.components, report.genus, report.facing),
        (1, None, Some(Facing::Outward))
    );
}

#[test]
fn triangles_of_no_area_and_repeated_ones_are_counted_and_kept() {
    let positions = vec![
        [0., 0., 0.],
        [1., 0., 0.],
        [2., 0., 0.],
        [0., 1., 0.],
        [7., 7., 7.],
    ];
    let mesh = TriMesh::new(positions, vec![[0, 1, 3], [0, 1, 2], [3, 0, 1], [1, 0, 3]]).unwrap();
    let report = TopologyReport::of(&mesh);
    assert_eq!(
        (
            report.triangles,
            report.degenerate_triangles,
            report.duplicated_triangles
        ),
        (4, 1, 2)
    );
    assert_eq!(
        (report.unused_vertices, report.vertices, report.components),
        (1, 4, 1)
    );
    assert_eq!(report.bounding_box.max, [2.0, 1.0, 0.0]);
    assert_eq!(report.area, 1.5);
}

#[test]
fn the_report_reads_well() {
    let cube = shapes::exploded(&shapes::inside_out(&shapes::cube(2.0)));
    let report = TopologyReport::of_welded(&Welded::new(cube.positions(), cube.triangles()).unwrap());
    let expected = "\
surface      8 vertices, 18 edges, 12 triangles
welded       28 of 36 file vertices repeat a position
components   1
boundary     none
manifold     yes
closed       yes
orientation  consistent, inward
Euler char.  2, genus 0
area         24
volume       8
size         2 × 2 × 2, diagonal 3.4641
edge lengths 2 to 2.82843, mean 2.27614
note         1 surface turned inside out: normals point into the solid; turn the faces over in a mesh editor if they should not.
";
    assert_eq!(report.to_string(), expected);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn flips_keep_the_topology_of_any_surface(seed: u64, rounds in 1..6_u64) {
        for mesh in [shapes::icosphere(1), shapes::rectangle(6, 5, 1.0, 1.0), shapes::torus(9, 6, 2.0, 0.8)] {
            let flipped = (0..rounds).fold(mesh.clone(), |m, round| shapes::flipped(&m, seed ^ round));
            let [before, after] = [&mesh, &flipped].map(TopologyReport::of);
            prop_assert!(after.manifold && after.inconsistent_edges == 0 && after.degenerate_triangles == 0);
            prop_assert_eq!(before.genus, after.genus);
            prop_assert_eq!(before.boundary_edges, after.boundary_edges);
            prop_assert_eq!(before.euler_characteristic, after.euler_characteristic);
        }
    }
}
