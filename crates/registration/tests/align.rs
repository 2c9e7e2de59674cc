//! A suspect in any pose is brought back onto its original, and anything else is told apart from it.

use job::{Job, JobError, Observer, Stage};
use mesh::{Edges, Similarity, TriMesh, shapes};
use registration::{
    AlignOptions, Aligner, Alignment, MatchedBy, Placement, PointPair, RegistrationError, align, align_points,
};
use std::sync::{
    Arc, Mutex, PoisonError,
    atomic::{AtomicUsize, Ordering},
};

/// A pose unlike the original's: turned by about 150°, a hundredth of the size, ten diagonals away.
fn away() -> Similarity {
    let turn = Similarity::from_quaternion([0.25, 0.4, -0.8, 0.3]);
    Similarity {
        scale: 0.01,
        translation: [0.2, -0.1, 0.15],
        ..turn
    }
}

/// How far the alignment misses the true pose: RMS over the vertices, as a fraction of the original's
/// diagonal.
fn miss(found: &Alignment, original: &TriMesh, suspect: &TriMesh, moved: &Similarity) -> f64 {
    let back = moved.inverse();
    let apart = suspect.positions().iter().map(|&p| {
        let (x, y) = (found.transform.apply(p), back.apply(p));
        (0..3).map(|i| (x[i] - y[i]).powi(2)).sum::<f64>()
    });
    (apart.sum::<f64>() / suspect.vertex_count() as f64).sqrt() / original.bounding_box().diagonal()
}

/// Aligns a moved copy of `suspect` with `original`.
fn aligned(original: &TriMesh, suspect: &TriMesh) -> (Alignment, f64) {
    let moved = shapes::moved(suspect, &away());
    let found =
        align(original, &moved, &AlignOptions::default(), &Job::default()).expect("both have a surface");
    let miss = miss(&found, original, &moved, &away());
    (found, miss)
}

/// Every triangle in four, by the middles of its edges: the same surface with other vertices.
fn divided(mesh: &TriMesh) -> TriMesh {
    let edges = Edges::of(mesh);
    let mut positions = mesh.positions().to_vec();
    for &[a, b] in edges.vertices() {
        let (p, q) = (mesh.positions()[a as usize], mesh.positions()[b as usize]);
        positions.push(std::array::from_fn(|i| 0.5 * (p[i] + q[i])));
    }
    let mut triangles = Vec::new();
    for (&[a, b, c], sides) in mesh.triangles().iter().zip(edges.of_triangle()) {
        let [x, y, z] = sides.map(|e| mesh.vertex_count() as u32 + e);
        triangles.extend([[a, x, z], [b, y, x], [c, z, y], [x, y, z]]);
    }
    TriMesh::new(positions, triangles).expect("a valid mesh")
}

/// The triangles whose corners all lie below a slanted plane that leaves `share` of the vertices, renumbered.
fn cut(mesh: &TriMesh, share: f64) -> TriMesh {
    let height = |p: &[f64; 3]| p[0] + 0.4 * p[1] - 0.2 * p[2];
    let mut heights: Vec<f64> = mesh.positions().iter().map(height).collect();
    heights.sort_by(f64::total_cmp);
    let bound = heights[(share * heights.len() as f64) as usize];
    let left = mesh.triangles().iter().enumerate();
    let left = left.filter(|(t, _)| mesh.corners(*t).iter().all(|p| height(&p.0) < bound));
    let open =
        TriMesh::new(mesh.positions().to_vec(), left.map(|(_, t)| *t).collect()).expect("a valid mesh");
    mesh::Welded::new(open.positions(), open.triangles())
        .expect("a valid mesh")
        .mesh()
        .clone()
}

#[test]
fn a_moved_and_shuffled_copy_is_brought_back_to_rounding_by_its_vertices() {
    let original = shapes::bumpy_block(2, 6, 1);
    let (found, miss) = aligned(&original, &shapes::shuffled(&original, 2));
    assert_eq!((found.matched_by, found.aligned), (MatchedBy::Connectivity, true));
    assert!(miss < 1e-13 && found.residual < 1e-13, "{miss}");
    assert_eq!((found.overlap, found.coverage), (1.0, 1.0));
}

#[test]
fn a_cut_copy_is_brought_back_to_rounding_by_the_vertices_that_are_left() {
    let original = shapes::bumpy_torus(60, 40, 3);
    for share in [0.5, 0.25] {
        let suspect = shapes::mirrored(&shapes::shuffled(&cut(&original, share), 2));
        let moved = shapes::moved(&suspect, &away());
        let found = align(&original, &moved, &AlignOptions::default(), &Job::default()).unwrap();
        assert_eq!((found.matched_by, found.aligned), (MatchedBy::Surroundings, true));
        assert!(
            found.transform.mirrors() && found.residual < 1e-12,
            "{}",
            found.residual
        );
        assert!((found.coverage - share).abs() < 0.1, "{}", found.coverage);
    }
}

#[test]
fn a_few_survivors_do_not_place_a_suspect_that_is_new_elsewhere() {
    let original = shapes::bumpy_torus(120, 80, 3);
    let part = |left: bool| {
        let is_left = |t: usize| original.corners(t).iter().all(|p| p[0] > 1.2) == left;
        let triangles = original
            .triangles()
            .iter()
            .enumerate()
            .filter(|(t, _)| is_left(*t));
        let part = TriMesh::new(
            original.positions().to_vec(),
            triangles.map(|(_, t)| *t).collect(),
        );
        part.expect("a valid mesh")
    };
    let suspect = shapes::disjoint_union(&[part(true), divided(&part(false))]);
    let (found, miss) = aligned(&original, &shapes::jittered(&suspect, 0.2, 9));
    assert_eq!((found.matched_by, found.aligned), (MatchedBy::Surface, true));
    assert!(found.correspondence.is_none() && miss < 1e-4, "{miss}");
}

#[test]
fn noise_does_not_shrink_the_suspect() {
    let original = shapes::bumpy_sphere(4, 1);
    let (found, miss) = aligned(&original, &shapes::jittered(&original, 0.3, 9));
    assert_eq!((found.matched_by, found.aligned), (MatchedBy::Connectivity, true));
    assert!(
        (found.transform.scale * 0.01 - 1.0).abs() < 3e-4 && miss < 3e-4,
        "{miss}"
    );
}

#[test]
fn the_same_surface_with_other_vertices_is_brought_back_to_rounding() {
    let shapes = [
        shapes::bumpy_sphere(3, 1),
        shapes::bumpy_torus(24, 16, 2),
        shapes::bumpy_block(1, 4, 3),
    ];
    for (i, original) in shapes.iter().enumerate() {
        let mut suspect = divided(original);
        if i == 1 {
            suspect = mesh::shapes::inside_out(&suspect);
        }
        let (found, miss) = aligned(original, &suspect);
        assert_eq!((found.matched_by, found.aligned), (MatchedBy::Surface, true));
        assert!(miss < 1e-12, "{miss}");
    }
}

#[test]
fn half_of_the_surface_with_other_vertices_is_brought_back_to_rounding() {
    let original = shapes::bumpy_block(2, 4, 3);
    let (found, miss) = aligned(&original, &divided(&cut(&original, 0.5)));
    assert_eq!((found.matched_by, found.aligned), (MatchedBy::Surface, true));
    assert!(miss < 1e-12, "{miss}");
}

#[test]
fn another_net_on_the_same_shape_is_aligned() {
    let original = shapes::bumped(&shapes::icosphere(4), 0.3, 7);
    let finer = shapes::bumped(&shapes::icosphere(5), 0.3, 7);
    let (found, miss) = aligned(&original, &finer);
    assert!(found.aligned && found.overlap > 0.99 && miss < 1e-3, "{miss}");
    let (mirrored, _) = aligned(&original, &shapes::mirrored(&finer));
    assert!(mirrored.aligned && mirrored.overlap > 0.99 && mirrored.transform.mirrors());
}

#[test]
fn another_model_does_not_align() {
    let original = shapes::bumpy_block(2, 4, 3);
    for suspect in [
        shapes::bumpy_sphere(3, 1),
        shapes::bumpy_torus(24, 16, 2),
        shapes::cube(1.0),
    ] {
        let (found, _) = aligned(&original, &suspect);
        assert!(!found.aligned && found.overlap < 0.9, "{}", found.overlap);
    }
}

#[test]
fn a_symmetric_shape_has_alternatives() {
    let original = shapes::cube(1.0);
    let (found, _) = aligned(&original, &divided(&divided(&original)));
    assert!(found.aligned && found.residual < 1e-12, "{}", found.residual);
    assert!(!found.alternatives.is_empty());
    let (found, _) = aligned(&original, &original);
    assert_eq!(found.matched_by, MatchedBy::Connectivity);
    // A cube of triangles has fewer symmetries than a cube: the diagonals must match, too.
    assert!(found.aligned && !found.alternatives.is_empty() && found.residual < 1e-12);
}

#[test]
fn every_pose_of_a_symmetric_shape_is_found_wherever_the_suspect_lay() {
    // A box of three different edges lies in its place in 8 ways, mirrored ones among them, a cube in 48.
    let stretched = |edges: [f64; 3]| {
        let cube = shapes::cube(1.0);
        let positions = cube
            .positions()
            .iter()
            .map(|p| std::array::from_fn(|i| edges[i] * p[i]));
        cube.with_positions(positions.collect()).expect("a valid mesh")
    };
    for (original, poses) in [(stretched([1.0, 1.3, 1.7]), 8), (stretched([1.0; 3]), 48)] {
        let suspect = divided(&divided(&original));
        let (found, _) = aligned(&original, &suspect);
        assert_eq!(
            (found.matched_by, found.alternatives.len() + 1),
            (MatchedBy::Surface, poses)
        );
        let all = std::iter::once(&found.transform).chain(&found.alternatives);
        let true_pose = all.map(|pose| {
            miss(
                &Alignment {
                    transform: *pose,
                    ..found.clone()
                },
                &original,
                &shapes::moved(&suspect, &away()),
                &away(),
            )
        });
        assert!(true_pose.fold(f64::INFINITY, f64::min) < 1e-9);
    }
    // Half of it fits in as many, and an irregular shape in one.
    let original = stretched([1.0, 1.3, 1.7]);
    let (found, _) = aligned(&original, &cut(&divided(&divided(&divided(&original))), 0.5));
    assert!(
        found.aligned && found.alternatives.len() >= 7,
        "{}",
        found.alternatives.len()
    );
    let original = shapes::bumpy_block(1, 4, 3);
    assert!(aligned(&original, &divided(&original)).0.alternatives.is_empty());
}

#[test]
fn degenerate_suspects_get_defined_answers() {
    let original = shapes::bumpy_sphere(2, 1);
    let triangle = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]).unwrap();
    let far = shapes::translated(&shapes::scaled(&shapes::icosphere(2), 1000.0), [1e6, 0.0, 0.0]);
    for suspect in [
        triangle,
        shapes::rectangle(4, 4, 1.0, 2.0),
        far,
        shapes::soup(50, 1),
    ] {
        let found = align(&original, &suspect, &AlignOptions::default(), &Job::default()).unwrap();
        assert!(found.transform.scale > 0.0 && found.transform.scale.is_finite());
        assert!((0.0..=1.0).contains(&found.overlap) && (0.0..=1.0).contains(&found.coverage));
    }
    let line = vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
    let line = TriMesh::new(line, vec![[0, 1, 2]]).unwrap();
    let nothing = align(&original, &line, &AlignOptions::default(), &Job::default());
    assert_eq!(nothing, Err(RegistrationError::NoSurface { mesh: "suspect" }));
    let nothing = align(&line, &original, &AlignOptions::default(), &Job::default());
    assert_eq!(nothing, Err(RegistrationError::NoSurface { mesh: "original" }));
}

#[test]
fn threads_change_nothing() {
    let original = shapes::bumpy_torus(24, 16, 2);
    let suspect = shapes::moved(&divided(&original), &away());
    let with = |threads| align(&original, &suspect, &AlignOptions::default(), &Job::new(threads)).unwrap();
    assert_eq!(with(1), with(3));
}

/// Keeps the names of the stages, and cancels when asked for the n-th time.
#[derive(Default)]
struct Watch {
    stages: Mutex<Vec<&'static str>>,
    asked: AtomicUsize,
    limit: usize,
}

impl Observer for Watch {
    fn stage(&self, stage: &dyn Stage) {
        self.stages
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(stage.name());
    }

    fn cancelled(&self) -> bool {
        self.asked.fetch_add(1, Ordering::Relaxed) >= self.limit
    }
}

/// What becomes of an alignment that is cancelled when it asks for the n-th time.
fn watched(
    original: &TriMesh,
    suspect: &TriMesh,
    limit: usize,
) -> (Result<Alignment, RegistrationError>, Arc<Watch>) {
    let watch = Arc::new(Watch {
        limit,
        ..Watch::default()
    });
    let job = Job::default().shared_with(watch.clone());
    (align(original, suspect, &AlignOptions::default(), &job), watch)
}

#[test]
fn the_stages_of_a_search_are_reported() {
    let original = shapes::bumpy_torus(24, 16, 2);
    let (found, watch) = watched(&original, &divided(&original), usize::MAX);
    let mut stages = watch.stages.lock().unwrap().clone();
    stages.dedup();
    assert!(found.is_ok());
    assert_eq!(stages, ["connectivity", "preparation", "guesses", "refinement"]);
}

#[test]
fn an_alignment_can_be_cancelled_wherever_it_is() {
    let original = shapes::icosphere(3);
    let suspects = [
        shapes::shuffled(&original, 1),
        divided(&cut(&shapes::bumpy_block(1, 4, 3), 0.4)),
    ];
    for suspect in suspects {
        let aligned = |limit| {
            let (found, watch) = watched(&original, &suspect, limit);
            (found, watch.asked.load(Ordering::Relaxed))
        };
        let (found, asked) = aligned(usize::MAX);
        assert!(found.is_ok() && asked > 10, "{asked}");
        for limit in [0, 1, asked / 2, asked - 1] {
            let (stopped, more) = aligned(limit);
            assert_eq!(stopped, Err(RegistrationError::Job(JobError::Cancelled)));
            // Nothing more than loops that were under way.
            assert!(more - limit < 150, "{limit} {more}");
        }
    }
}

#[test]
fn vertices_are_looked_for_first_and_surfaces_only_if_some_are_missing() {
    let original = shapes::icosphere(2);
    let aligner = Aligner::new(&original, &AlignOptions::default()).unwrap();
    let find = |suspect: &TriMesh| aligner.find(suspect, &Job::default()).unwrap();
    let Placement::ByVertices(maps) = find(&shapes::shuffled(&original, 3)) else {
        panic!("the connectivity is there");
    };
    assert_eq!(maps.len(), 120);
    // Even where no surface is left.
    let point = original
        .with_positions(vec![[0.0; 3]; original.vertex_count()])
        .unwrap();
    assert!(matches!(find(&point), Placement::ByVertices(_)));
    let part = shapes::bumpy_sphere(3, 1);
    let aligner = Aligner::new(&part, &AlignOptions::default()).unwrap();
    for suspect in [cut(&part, 0.5), divided(&part)] {
        let Placement::BySurface(found) = aligner.find(&suspect, &Job::default()).unwrap() else {
            panic!("the connectivity is gone");
        };
        assert_eq!(found, aligner.align(&suspect, &Job::default()).unwrap());
    }
}

/// Pairs of points on the faces of two copies of a mesh, each off by up to `error` of the diagonal.
fn pairs(original: &TriMesh, suspect: &TriMesh, count: usize, error: f64) -> Vec<PointPair> {
    let size = error * original.bounding_box().diagonal();
    let middle = |mesh: &TriMesh, t: usize| {
        let [a, b, c] = mesh.corners(t);
        std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0)
    };
    let step = original.triangle_count() / count;
    let pair = |k: usize| {
        let point: [f64; 3] = middle(original, k * step);
        let wrong = [0.3, 0.7, 0.9].map(|x: f64| size * (2.0 * (x * (k + 1) as f64).fract() - 1.0));
        PointPair {
            suspect: middle(suspect, k * step),
            original: std::array::from_fn(|i| point[i] + wrong[i]),
        }
    };
    (0..count).map(pair).collect()
}

#[test]
fn given_points_lead_to_the_same_fine_alignment() {
    let original = shapes::bumpy_sphere(4, 1);
    let options = AlignOptions::default();
    for (count, mirrored) in [(3, false), (3, true), (8, true)] {
        let mut copy = original.clone();
        if mirrored {
            copy = shapes::mirrored(&copy);
        }
        let copy = shapes::moved(&copy, &away());
        let pairs = pairs(&original, &copy, count, 0.03);
        let suspect = divided(&copy);
        let found = align_points(&original, &suspect, &pairs, &options, &Job::default()).unwrap();
        assert_eq!((found.matched_by, found.aligned), (MatchedBy::Points, true));
        assert_eq!(found.mirrored(), mirrored);
        assert!(found.residual < 1e-12 && !found.ambiguous(), "{}", found.residual);
        let found = align_points(&original, &copy, &pairs, &options, &Job::default()).unwrap();
        assert_eq!((found.matched_by, found.aligned), (MatchedBy::Connectivity, true));
    }
}

#[test]
fn given_points_choose_among_the_maps_of_a_symmetric_net() {
    let original = shapes::icosphere(2);
    let suspect = shapes::moved(&original, &away());
    let pairs = pairs(&original, &suspect, 5, 0.02);
    let found = align_points(
        &original,
        &suspect,
        &pairs,
        &AlignOptions::default(),
        &Job::default(),
    )
    .unwrap();
    assert_eq!(
        (found.matched_by, found.alternatives.len()),
        (MatchedBy::Connectivity, 119)
    );
    assert!(miss(&found, &original, &suspect, &away()) < 1e-12);
}

#[test]
fn points_that_determine_nothing_are_refused() {
    let original = shapes::bumpy_sphere(2, 1);
    let options = AlignOptions::default();
    let given = |pairs: &[PointPair]| align_points(&original, &original, pairs, &options, &Job::default());
    let pair = |p: [f64; 3]| PointPair {
        suspect: p,
        original: p,
    };
    let two = [pair([0.0; 3]), pair([1.0, 0.0, 0.0])];
    assert_eq!(given(&two), Err(RegistrationError::TooFewPoints { given: 2 }));
    let line = [0.0, 1.0, 3.0].map(|x| pair([x, x, 0.0]));
    assert!(matches!(given(&line), Err(RegistrationError::Collinear { .. })));
    let nowhere = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, f64::NAN, 0.0]].map(pair);
    assert_eq!(given(&nowhere), Err(RegistrationError::NotFinite { index: 2 }));
}

#[test]
fn a_mirrored_copy_is_recognised_and_mirrored_back() {
    let original = shapes::bumpy_torus(24, 16, 2);
    for suspect in [original.clone(), divided(&original)] {
        for mirrored in [false, true] {
            let suspect = if mirrored {
                shapes::mirrored(&suspect)
            } else {
                suspect.clone()
            };
            let (found, _) = aligned(&original, &suspect);
            assert_eq!((found.aligned, found.mirrored()), (true, mirrored));
            assert!(found.residual < 1e-12, "{}", found.residual);
        }
    }
}

#[test]
fn the_directions_in_which_a_surface_slides_on_itself_are_counted() {
    let ball = shapes::icosphere(4);
    let ring = shapes::torus(120, 60, 1.0, 0.4);
    let bumpy = shapes::bumpy_torus(24, 16, 2);
    for (original, free) in [(ball, 3), (ring, 1), (bumpy, 0)] {
        let (found, _) = aligned(&original, &divided(&original));
        assert_eq!((found.aligned, found.free_directions), (true, free));
        assert_eq!(found.ambiguous(), free > 0);
    }
}

#[test]
fn what_lies_on_any_flat_place_is_not_aligned() {
    let original = shapes::bumpy_block(1, 4, 3);
    let triangle = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]).unwrap();
    for suspect in [triangle, shapes::rectangle(4, 4, 1.0, 2.0)] {
        for original in [&original, &shapes::cube(1.0)] {
            let found = align(original, &suspect, &AlignOptions::default(), &Job::default()).unwrap();
            assert!(!found.aligned, "{found:?}");
        }
    }
}

#[test]
fn size_facing_and_number_of_pieces_do_not_matter() {
    let piece = shapes::bumpy_sphere(2, 1);
    let places = (0..30).map(|i| {
        let [x, y, z] = [0.618, 0.755, 0.570].map(|step| 20.0 * (step * f64::from(i)).fract());
        shapes::translated(&shapes::scaled(&piece, 1.0 + 0.03 * f64::from(i)), [x, y, z])
    });
    let original = shapes::disjoint_union(&places.collect::<Vec<_>>());
    let larger = shapes::scaled(&original, 1000.0);
    for suspect in [larger.clone(), shapes::inside_out(&larger), divided(&larger)] {
        let found = align(&original, &suspect, &AlignOptions::default(), &Job::default()).unwrap();
        assert!(found.aligned && !found.ambiguous());
        assert!(
            found.residual < 1e-12 && (found.transform.scale * 1000.0 - 1.0).abs() < 1e-12,
            "{}",
            found.residual
        );
    }
}

#[test]
fn options_out_of_range_are_named() {
    let ball = shapes::icosphere(0);
    for options in [
        AlignOptions {
            tolerance: 0.0,
            ..Default::default()
        },
        AlignOptions {
            tolerance: f64::NAN,
            ..Default::default()
        },
        AlignOptions {
            least_overlap: 1.5,
            ..Default::default()
        },
    ] {
        assert!(matches!(
            align(&ball, &ball, &options, &Job::default()),
            Err(RegistrationError::Option { .. })
        ));
    }
}
