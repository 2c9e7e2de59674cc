//! Welding finds the surface in a file, whatever copies and leftovers the file holds.

use mesh::{MeshError, TopologyReport, TriMesh, WeldSummary, Welded, shapes};
use proptest::prelude::*;

/// The triangles as positions, each begun at its least corner, sorted: the same for the same surface in any order.
fn canonical(mesh: &TriMesh) -> Vec<[[u64; 3]; 3]> {
    let least_first = |t: usize| {
        let mut corners = mesh.corners(t).map(|p| p.0.map(|x| (x + 0.0).to_bits()));
        let least = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
        corners.rotate_left(least);
        corners
    };
    let mut triangles: Vec<_> = (0..mesh.triangle_count()).map(least_first).collect();
    triangles.sort_unstable();
    triangles
}

/// A file of the mesh with corners on copies of their vertices as `choices` say, stray vertices among them, and
/// triangles with two corners at one point.
fn messy_file(mesh: &TriMesh, choices: &[u8]) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let mut choice = choices.iter().cycle();
    let mut positions = mesh.positions().to_vec();
    let mut triangles = mesh.triangles().to_vec();
    for corner in triangles.as_flattened_mut() {
        match choice.next() {
            Some(0) => {
                positions.push(mesh.positions()[*corner as usize].map(|x| if x == 0.0 { -x } else { x }));
                *corner = positions.len() as u32 - 1;
            }
            Some(1) => positions.push([f64::NAN, 0.0, 0.0]),
            _ => {}
        }
    }
    let [a, b, _] = mesh.triangles()[0];
    positions.push(mesh.positions()[a as usize]);
    triangles.insert(triangles.len() / 2, [a, b, positions.len() as u32 - 1]);
    (positions, triangles)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn copies_strays_and_order_do_not_change_the_surface(
        choices in prop::collection::vec(0..6_u8, 1..40), seed: u64, which in 0..4_usize
    ) {
        let mesh = [shapes::cube(1.0), shapes::bumpy_sphere(1, 3), shapes::rectangle(4, 3, 1.0, 1.0), shapes::book(3)][which].clone();
        let shuffled = shapes::shuffled(&mesh, seed);
        let (positions, triangles) = messy_file(&shuffled, &choices);
        let welded = Welded::new(&positions, &triangles).unwrap();

        prop_assert_eq!(canonical(welded.mesh()), canonical(&mesh));
        prop_assert_eq!(welded.mesh().vertex_count(), mesh.vertex_count());
        prop_assert_eq!(welded.summary().dropped_triangles, 1);

        // The maps lead back: every file vertex to its own position, every triangle to its own corners.
        for (v, number) in welded.vertex_of().iter().enumerate() {
            match number {
                Some(number) => prop_assert_eq!(welded.mesh().positions()[*number as usize], positions[v]),
                None => prop_assert!(!triangles.as_flattened().contains(&(v as u32))),
            }
        }
        let corners = triangles.iter().map(|t| t.map(|v| welded.vertex_of()[v as usize]));
        let kept = corners.filter(|[a, b, c]| a != b && b != c && c != a);
        prop_assert!(kept.eq(welded.mesh().triangles().iter().map(|t| t.map(Some))));
        let WeldSummary { merged_vertices, unused_vertices, .. } = welded.summary();
        prop_assert_eq!(merged_vertices + unused_vertices + mesh.vertex_count(), positions.len());
    }

    #[test]
    fn welding_what_is_welded_changes_nothing(seed: u64) {
        let mesh = shapes::shuffled(&shapes::bumpy_torus(9, 6, seed), seed);
        let welded = Welded::new(mesh.positions(), mesh.triangles()).unwrap();
        prop_assert_eq!(welded.mesh(), &mesh);
    }
}

#[test]
fn an_exploded_surface_is_put_together_again() {
    for mesh in [
        shapes::icosphere(2),
        shapes::torus(12, 8, 2.0, 0.5),
        shapes::moebius_strip(6),
    ] {
        let exploded = shapes::exploded(&mesh);
        assert_eq!(TopologyReport::of(&exploded).components, mesh.triangle_count());
        let welded = Welded::new(exploded.positions(), exploded.triangles()).unwrap();
        let [report, original] = [welded.mesh(), &mesh].map(TopologyReport::of);
        assert_eq!(
            (report.vertices, report.edges, report.genus),
            (original.vertices, original.edges, original.genus)
        );
        assert_eq!(canonical(welded.mesh()), canonical(&mesh));
    }
}

#[test]
fn vertices_keep_the_order_of_their_first_used_copies() {
    let positions = [
        [9., 0., 0.],
        [0., 1., 0.],
        [0., 0., 0.],
        [-0., 1., 0.],
        [1., 0., 0.],
        [0., 1., 0.],
    ];
    let welded = Welded::new(&positions, &[[4, 2, 3]]).unwrap();
    // Vertices 1 and 5 lie where 3 lies, but no triangle uses them.
    assert_eq!(welded.vertex_of(), [None, None, Some(0), Some(1), Some(2), None]);
    assert_eq!(welded.mesh().triangles(), [[2, 0, 1]]);
}

#[test]
fn what_holds_no_surface_is_refused_with_the_files_own_indices() {
    let positions = [
        [0., 0., 0.],
        [f64::NAN, 0., 0.],
        [1., 0., 0.],
        [0., 1., 0.],
        [0., 0., 0.],
    ];
    let weld = |triangles: &[[u32; 3]]| Welded::new(&positions, triangles).map(|welded| welded.summary());
    assert_eq!(weld(&[]), Err(MeshError::NoTriangles));
    assert_eq!(
        weld(&[[0, 2, 3], [0, 2, 5]]),
        Err(MeshError::IndexOutOfRange {
            triangle: 1,
            vertex: 5,
            count: 5
        })
    );
    assert!(matches!(
        weld(&[[0, 1, 2]]),
        Err(MeshError::NotFinite { vertex: 1, .. })
    ));
    assert_eq!(
        weld(&[[0, 4, 2], [3, 3, 2]]),
        Err(MeshError::OnlyRepeatedVertices { count: 2 })
    );
}
