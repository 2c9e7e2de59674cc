//! A suspect that kept the original's connectivity is matched vertex by vertex, whatever else was done to it.

use job::Job;
use mesh::{Similarity, TriMesh, Vec3, shapes};
use proptest::prelude::*;
use registration::{
    Difference, Handedness, fit_similarity, match_candidates, match_connectivity, match_cut,
    match_surroundings,
};

/// Asserts that the map takes the triangles of one mesh one to one onto those of the other.
fn assert_isomorphism(original: &TriMesh, suspect: &TriMesh, suspect_of: &[Option<u32>]) {
    let image = |&v: &u32| suspect_of[v as usize].expect("every vertex in use is matched");
    let sorted = |mut t: [u32; 3]| {
        t.sort_unstable();
        t
    };
    let mut images: Vec<_> = original
        .triangles()
        .iter()
        .map(|t| sorted([image(&t[0]), image(&t[1]), image(&t[2])]))
        .collect();
    let mut triangles: Vec<_> = suspect.triangles().iter().map(|&t| sorted(t)).collect();
    images.sort_unstable();
    triangles.sort_unstable();
    assert_eq!(images, triangles);
}

/// Asserts that every vertex is matched with the vertex that has the same position in `shuffled`.
fn assert_same_positions(original: &TriMesh, shuffled: &TriMesh, suspect_of: &[Option<u32>]) {
    for (v, w) in suspect_of.iter().enumerate() {
        let w = w.expect("every vertex is matched");
        assert_eq!(
            original.positions()[v],
            shuffled.positions()[w as usize],
            "vertex {v}"
        );
    }
}

fn irregular(kind: u8, seed: u64) -> TriMesh {
    match kind {
        0 => shapes::bumpy_sphere(3, seed),
        1 => shapes::bumpy_torus(24, 16, seed),
        2 => shapes::bumpy_block(2, 3, seed),
        3 => shapes::flipped(&shapes::rectangle(20, 15, 2.0, 1.0), seed),
        4 => shapes::disjoint_union(&[
            shapes::bumpy_sphere(2, seed),
            shapes::translated(&shapes::bumpy_torus(16, 12, seed), [4.0, 0.0, 0.0]),
            shapes::translated(&shapes::bumpy_sphere(1, seed ^ 1), [0.0, 5.0, 0.0]),
        ]),
        _ => shapes::disjoint_union(&[shapes::bumpy_sphere(2, seed), shapes::book(5)]),
    }
}

fn similarity() -> impl Strategy<Value = Similarity> {
    let quaternion =
        prop::array::uniform4(-1.0..1.0_f64).prop_filter("not zero", |q| q.iter().any(|x| x.abs() > 0.1));
    (quaternion, -6.0..6.0_f64, prop::array::uniform3(-10.0..10.0_f64)).prop_map(
        |(q, exponent, translation)| {
            let scale = 10_f64.powf(exponent);
            Similarity {
                scale,
                translation: translation.map(|x| x * scale),
                ..Similarity::from_quaternion(q)
            }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn shuffled_distorted_moved_and_mirrored_copies_are_matched_exactly(
        kind in 0..6_u8, seed in any::<u64>(), transform in similarity(), mirror in any::<bool>(), turn in any::<bool>(),
    ) {
        let original = irregular(kind, seed);
        let shuffled = shapes::shuffled(&original, seed ^ 7);
        let mut suspect = shapes::moved(&shapes::bumped(&shapes::jittered(&shuffled, 0.2, seed), 0.1, 5), &transform);
        if mirror {
            suspect = shapes::mirrored(&suspect);
        }
        if turn {
            suspect = shapes::inside_out(&suspect);
        }
        let map = match_connectivity(&original, &suspect, &Job::default()).unwrap();
        assert_isomorphism(&original, &suspect, &map.suspect_of);
        if kind < 3 {
            assert_same_positions(&original, &shuffled, &map.suspect_of);
        }
    }

    #[test]
    fn symmetric_meshes_are_matched_with_residual_zero(kind in 0..6_u8, seed in any::<u64>(), transform in similarity(), mirror in any::<bool>()) {
        let original = match kind {
            0 => shapes::tetrahedron(),
            1 => shapes::cube(2.0),
            2 => shapes::icosphere(3),
            3 => shapes::torus(20, 12, 1.0, 0.4),
            4 => shapes::cylinder(12, 7, 1.0, 3.0),
            _ => shapes::book(4),
        };
        let mut suspect = shapes::moved(&shapes::shuffled(&original, seed), &transform);
        if mirror {
            suspect = shapes::mirrored(&suspect);
        }
        let map = match_connectivity(&original, &suspect, &Job::default()).unwrap();
        assert_isomorphism(&original, &suspect, &map.suspect_of);
        let fit = map.fit(&original, &suspect).unwrap();
        prop_assert!(fit.residual < 1e-12, "residual {}", fit.residual);
    }

    #[test]
    fn equal_pieces_go_where_they_belong(seed in any::<u64>(), transform in similarity(), copies in 2..12_u32) {
        let piece = shapes::bumpy_sphere(1, 3);
        let places = (0..copies).map(|i| {
            let angle = f64::from(i * i);
            shapes::translated(&piece, [6.0 * angle.cos() + angle, 6.0 * angle.sin(), f64::from(i % 3)])
        });
        let original = shapes::disjoint_union(&places.collect::<Vec<_>>());
        let shuffled = shapes::shuffled(&original, seed);
        let suspect = shapes::moved(&shapes::jittered(&shuffled, 0.05, seed), &transform);
        let map = match_connectivity(&original, &suspect, &Job::default()).unwrap();
        assert_same_positions(&original, &shuffled, &map.suspect_of);
    }

    #[test]
    fn one_flipped_edge_is_a_difference(seed in any::<u64>(), kind in 0..3_u8) {
        let original = irregular(kind, seed);
        let suspect = shapes::shuffled(&with_an_edge_flipped(&original, seed), seed);
        prop_assert!(match_connectivity(&original, &suspect, &Job::default()).is_err());
    }
}

/// Flips the first edge, from a random place on, whose new edge does not exist yet.
fn with_an_edge_flipped(mesh: &TriMesh, seed: u64) -> TriMesh {
    with_edges_flipped(mesh, seed as usize, 1, |_| true)
}

/// Flips up to `most` edges of the chosen triangles, at most one a triangle, whose new edges do not exist yet,
/// beginning with the edge `start`.
fn with_edges_flipped(mesh: &TriMesh, start: usize, most: usize, chosen: impl Fn(usize) -> bool) -> TriMesh {
    let edges = mesh::Edges::of(mesh);
    let opposite = |t: u32, [a, b]: [u32; 2]| {
        *mesh.triangles()[t as usize]
            .iter()
            .find(|&&v| v != a && v != b)
            .expect("a third corner")
    };
    let mut triangles = mesh.triangles().to_vec();
    let mut untouched: Vec<bool> = (0..triangles.len()).map(chosen).collect();
    let mut new = std::collections::HashSet::new();
    for i in 0..edges.count() {
        let e = (i + start % edges.count()) % edges.count();
        let [a, b] = edges.vertices()[e];
        if let &[t, u] = edges.triangles(e)
            && untouched[t as usize]
            && untouched[u as usize]
            && new.len() < most
        {
            let (c, d) = (opposite(t, [a, b]), opposite(u, [a, b]));
            if edges.find(c, d).is_none() && new.insert([c.min(d), c.max(d)]) {
                triangles[t as usize] = [a, c, d];
                triangles[u as usize] = [b, d, c];
                untouched[t as usize] = false;
                untouched[u as usize] = false;
            }
        }
    }
    TriMesh::new(mesh.positions().to_vec(), triangles).expect("a valid mesh")
}

#[test]
fn three_hundred_loose_triangles_are_matched() {
    let original = shapes::soup(300, 5);
    let shuffled = shapes::shuffled(&original, 6);
    let turned = Similarity {
        scale: 3.0,
        ..Similarity::from_quaternion([1.0, 2.0, 0.0, -1.0])
    };
    let map = match_connectivity(&original, &shapes::moved(&shuffled, &turned), &Job::default()).unwrap();
    assert_same_positions(&original, &shuffled, &map.suspect_of);
}

#[test]
fn an_icosphere_has_120_maps_onto_itself() {
    let original = shapes::icosphere(2);
    let maps = match_candidates(&original, &shapes::shuffled(&original, 1), 1000, &Job::default()).unwrap();
    assert_eq!(maps.len(), 120);
    for (i, map) in maps.iter().enumerate() {
        assert!(maps[..i].iter().all(|other| other != map));
    }
}

#[test]
fn geometry_leaves_one_map_of_a_bumpy_icosphere() {
    let original = shapes::bumped(&shapes::icosphere(2), 0.2, 1);
    let shuffled = shapes::shuffled(&original, 1);
    let maps = match_candidates(
        &original,
        &shapes::jittered(&shuffled, 0.02, 1),
        1000,
        &Job::default(),
    )
    .unwrap();
    assert_eq!(maps.len(), 1);
    assert_same_positions(&original, &shuffled, &maps[0].suspect_of);
}

/// A body with forty buttons around it, all alike, twisted by half a turn: no similarity takes a button to its place, but those next to it tell where that is.
#[test]
fn equal_parts_of_a_twisted_model_are_told_apart_by_what_lies_around_them() {
    let button = |i: usize| {
        let (angle, height) = (i as f64 * 2.4, 0.2 * i as f64 - 4.0);
        let small = shapes::scaled(&shapes::bumpy_sphere(1, 5), 0.05);
        shapes::translated(&small, [height, angle.cos(), angle.sin()])
    };
    let body = shapes::translated(&shapes::bumpy_torus(16, 12, 2), [-5.5, 0.0, 0.0]);
    let parts: Vec<TriMesh> = std::iter::once(body).chain((0..40).map(button)).collect();
    let original = shapes::disjoint_union(&parts);
    let twisted = |[x, y, z]: [f64; 3]| {
        let (sin, cos) = (x * std::f64::consts::PI / 8.0).sin_cos();
        [x, cos * y - sin * z, sin * y + cos * z]
    };
    let places = original.positions().iter().copied().map(twisted).collect();
    let suspect = shapes::shuffled(&original.with_positions(places).unwrap(), 8);
    let maps = match_candidates(&original, &suspect, 8, &Job::default()).unwrap();
    let is_right = |suspect_of: &[Option<u32>]| {
        let mut pairs = suspect_of.iter().zip(original.positions());
        pairs.all(|(w, &p)| w.is_none_or(|w| suspect.positions()[w as usize] == twisted(p)))
    };
    assert!(
        maps.iter()
            .any(|map| map.matched() == original.vertex_count() && is_right(&map.suspect_of))
    );

    let there: Vec<[f64; 3]> = original.positions().iter().copied().map(twisted).collect();
    let fit = fit_similarity(&there, original.positions(), None, Handedness::Either).unwrap();
    let buttons: Vec<usize> = (0..40).map(|i| original.vertex_count() - 42 * (i + 1)).collect();
    let nearest = |&v: &usize| {
        let place = fit.transform.apply(Vec3(there[v]));
        let apart = |&&w: &&usize| (original.point(w) - place).norm();
        *buttons
            .iter()
            .min_by(|a, b| apart(a).total_cmp(&apart(b)))
            .unwrap()
    };
    let astray = buttons.iter().filter(|&v| nearest(v) != *v).count();
    assert!(astray > 10, "{astray}: a similarity would have told");
}

#[test]
fn a_mirrored_copy_is_recognised() {
    let original = shapes::bumpy_sphere(2, 1);
    let suspect = shapes::mirrored(&shapes::shuffled(&original, 4));
    let map = match_connectivity(&original, &suspect, &Job::default()).unwrap();
    let fit = map.fit(&original, &suspect).unwrap();
    assert!(fit.transform.mirrors() && fit.residual < 1e-12 && fit.mirrored_residual > 1e-2);
}

#[test]
fn what_a_cut_leaves_is_matched() {
    for kind in 0..3 {
        let original = irregular(kind, 5);
        let height = |p: &[f64; 3]| p[0] + 0.3 * p[1];
        let middle = original.positions().iter().map(height).sum::<f64>() / original.vertex_count() as f64;
        let left = original.triangles().iter().enumerate();
        let left = left.filter(|(t, _)| original.corners(*t).iter().all(|p| height(&p.0) < middle));
        let cut = TriMesh::new(original.positions().to_vec(), left.map(|(_, t)| *t).collect()).unwrap();
        let cut = shapes::shuffled(&cut, 3);
        let map = match_surroundings(&original, &cut, &Job::default()).unwrap();
        assert_eq!(
            match_cut(&original, &cut, &Job::default()).unwrap(),
            Some(map.clone())
        );
        for (v, p) in map.carry(&cut).into_iter().enumerate() {
            assert!(p.is_none_or(|p| p == original.positions()[v]));
        }
        assert!(
            2 * map.matched() > original.vertex_count() / 2,
            "{} of {}",
            map.matched(),
            original.vertex_count()
        );
    }
}

#[test]
fn meshes_with_nothing_in_common_give_almost_no_pairs() {
    let map = match_surroundings(
        &shapes::bumpy_sphere(3, 1),
        &shapes::bumpy_torus(30, 20, 9),
        &Job::default(),
    )
    .unwrap();
    assert!(map.matched() < 60, "{}", map.matched());
    let (ball, other) = (shapes::bumpy_sphere(3, 1), shapes::bumpy_torus(30, 20, 9));
    assert_eq!(match_cut(&ball, &other, &Job::default()).unwrap(), None);
}

#[test]
fn of_a_cut_a_copy_along_a_seam_stands_for_all() {
    let original = irregular(1, 5);
    let all = shapes::exploded(&original);
    let map = match_cut(&original, &all, &Job::default()).unwrap().unwrap();
    assert_eq!(map.matched(), original.vertex_count());
    assert!(
        map.carry(&all)
            .iter()
            .zip(original.positions())
            .all(|(p, q)| p.as_ref() == Some(q))
    );
}

#[test]
fn a_patch_that_was_left_does_not_grow_into_what_was_altered() {
    for seed in 1..6 {
        let original = shapes::bumpy_torus(120, 80, seed);
        let left = |p: &[f64; 3]| p[0] > 1.1;
        let altered = |t: usize| !original.corners(t).iter().any(|p| left(&p.0));
        let suspect = shapes::shuffled(&with_edges_flipped(&original, 0, usize::MAX, altered), seed);
        let map = match_surroundings(&original, &suspect, &Job::default()).unwrap();
        let kept = original.positions().iter().filter(|p| left(p)).count();
        let true_ones = |(p, q): &(Option<[f64; 3]>, &[f64; 3])| *p == Some(**q);
        let carried = map.carry(&suspect);
        let truly = carried
            .into_iter()
            .zip(original.positions())
            .filter(true_ones)
            .count();
        let wrong = map.matched() - truly;
        assert!(
            100 * wrong < kept && 3 * truly > 2 * kept,
            "{wrong} wrong, {truly} right, {kept} were left"
        );
    }
}

/// Every vertex of the upper half in as many copies as it has triangles, each rounded to single precision from a copy that is off
/// by its last digit.
fn split(mesh: &TriMesh) -> TriMesh {
    let mut positions = mesh.positions().to_vec();
    let mut triangles = mesh.triangles().to_vec();
    for (i, corner) in triangles.as_flattened_mut().iter_mut().enumerate() {
        let p = mesh.positions()[*corner as usize];
        if p[2] > 0.0 {
            let off = if i % 2 == 0 { 6e-8 } else { -6e-8 };
            positions.push(p.map(|x| f64::from((x * (1.0 + off)) as f32)));
            *corner = positions.len() as u32 - 1;
        }
    }
    TriMesh::new(positions, triangles).expect("a valid mesh")
}

#[test]
fn copies_of_vertices_along_seams_are_one_vertex() {
    let original = shapes::bumpy_torus(24, 16, 1);
    let suspect = split(&shapes::shuffled(&original, 4));
    assert!(suspect.vertex_count() > 2 * original.vertex_count());
    let map = match_connectivity(&original, &suspect, &Job::default()).unwrap();
    for (v, w) in map.suspect_of.iter().enumerate() {
        let (p, q) = (
            original.positions()[v],
            suspect.positions()[w.expect("found") as usize],
        );
        assert!((0..3).all(|i| (p[i] - q[i]).abs() < 1e-6));
    }
    // Every triangle on its own, as STL files have it.
    let loose = shapes::exploded(&original);
    assert_eq!(
        match_connectivity(&original, &loose, &Job::default())
            .unwrap()
            .matched(),
        original.vertex_count()
    );
}

#[test]
fn counts_are_compared_first() {
    let (sphere, larger) = (shapes::icosphere(1), shapes::icosphere(2));
    let vertices = Difference::VertexCount {
        original: 42,
        suspect: 162,
    };
    assert_eq!(
        match_connectivity(&sphere, &larger, &Job::default()),
        Err(vertices)
    );
    let mut open = sphere.triangles().to_vec();
    open.pop();
    let open = TriMesh::new(sphere.positions().to_vec(), open).unwrap();
    let triangles = Difference::TriangleCount {
        original: 80,
        suspect: 79,
    };
    assert_eq!(
        match_connectivity(&sphere, &open, &Job::default()),
        Err(triangles)
    );
}

#[test]
fn vertices_that_no_triangle_uses_have_no_partner() {
    let used = shapes::tetrahedron();
    let mut positions = vec![[9.0; 3]];
    positions.extend(used.positions());
    let triangles = used.triangles().iter().map(|t| t.map(|v| v + 1)).collect();
    let original = TriMesh::new(positions, triangles).unwrap();
    for suspect in [&original, &used] {
        let map = match_connectivity(&original, suspect, &Job::default()).unwrap();
        assert_eq!((map.suspect_of[0], map.matched()), (None, 4));
    }
}

#[test]
fn triangles_that_meet_in_one_vertex_are_matched() {
    // Forty triangles around vertex 0, no two with a common edge: only geometry tells them apart.
    let mut positions = vec![[0.0; 3]];
    let mut triangles = Vec::new();
    for i in 0..40_u32 {
        let angle = f64::from(i * i);
        positions.push([angle.cos(), angle.sin(), f64::from(i) / 20.0]);
        positions.push([angle.cos(), angle.sin(), f64::from(i) / 20.0 + 1.0]);
        triangles.push([0, 2 * i + 1, 2 * i + 2]);
    }
    let original = TriMesh::new(positions, triangles).unwrap();
    let suspect = shapes::shuffled(&original, 3);
    let map = match_connectivity(&original, &suspect, &Job::default()).unwrap();
    assert_same_positions(&original, &suspect, &map.suspect_of);
}

proptest! {
    #[test]
    fn umeyama_finds_random_similarities_to_rounding(
        transform in similarity(), points in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 4..40),
    ) {
        let target = transform.apply_all(&points);
        let fit = fit_similarity(&points, &target, None, Handedness::Proper).unwrap();
        prop_assert!((fit.transform.scale / transform.scale - 1.0).abs() < 1e-12);
        prop_assert!(fit.residual < 1e-13 * transform.scale);
    }
}
