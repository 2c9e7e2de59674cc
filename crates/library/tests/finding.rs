//! Descriptors: what changes them and what doesn't, and who is first.

use job::{Job, JobError, Observer};
use library::{AddedAs, By, Descriptor, Entry, Index, Library, LibraryError, OriginalId, Query};
use mesh::{Similarity, TriMesh, Vec3, Welded, shapes};
use proptest::prelude::*;

fn models() -> Vec<TriMesh> {
    let balls = (1..9).map(|seed| shapes::bumpy_sphere(4, seed));
    let rings = (1..9).map(|seed| shapes::bumpy_torus(40 + 4 * seed as u32, 20, seed));
    let blocks = (1..4).map(|holes| shapes::bumpy_block(holes, 6, u64::from(holes)));
    balls.chain(rings).chain(blocks).collect()
}

/// A library of these, and the number of each.
fn library(models: &[TriMesh]) -> (tempfile::TempDir, Library, Vec<OriginalId>) {
    let folder = tempfile::tempdir().expect("a folder");
    let mut library = Library::create(&folder.path().join("lib.sigmark")).expect("a library");
    let ids = models.iter().enumerate().map(|(i, mesh)| {
        let entry = Entry::of(&i.to_string(), mesh, false).expect("a shape");
        match library.add(&entry).expect("added") {
            AddedAs::New(id) | AddedAs::Known(id) => id,
        }
    });
    let ids = ids.collect();
    (folder, library, ids)
}

fn half(mesh: &TriMesh, direction: Vec3) -> TriMesh {
    let centre = Vec3(mesh.bounding_box().centre());
    let is_kept = |corners: &&[u32; 3]| {
        corners
            .iter()
            .all(|&v| (mesh.point(v as usize) - centre).dot(direction) > 0.0)
    };
    let kept: Vec<[u32; 3]> = mesh.triangles().iter().filter(is_kept).copied().collect();
    Welded::new(mesh.positions(), &kept).expect("a half").into_mesh()
}

#[test]
fn every_original_is_the_first_for_itself_and_for_what_is_left_of_it() {
    let models = models();
    let (_folder, library, ids) = library(&models);
    let index = Index::load(&library, &Job::default()).expect("an index");
    assert_eq!(index.len(), models.len());
    let first = |mesh: &TriMesh| {
        let query = Query::of(mesh, &Job::default()).expect("a shape");
        index
            .search(&library, &query, 3, &Job::new(2))
            .expect("an answer")[0]
    };
    for (mesh, &id) in models.iter().zip(&ids) {
        let same = first(mesh);
        assert_eq!((same.original, same.score), (id, 1.0));
        for changed in [
            shapes::jittered(mesh, 0.2, 3),
            shapes::divided(mesh),
            shapes::flipped(mesh, 5),
        ] {
            assert_eq!(first(&changed).original, id);
        }
    }
}

#[test]
fn halves_bring_their_originals_up() {
    let models = models();
    let (_folder, library, ids) = library(&models);
    let index = Index::load(&library, &Job::default()).expect("an index");
    let mut found = 0;
    for (i, (mesh, &id)) in models.iter().zip(&ids).enumerate() {
        let query = Query::of(
            &half(mesh, Vec3([1.0, 0.3 * i as f64 - 2.0, 0.7]).unit()),
            &Job::default(),
        )
        .expect("a shape");
        let candidates = index
            .search(&library, &query, 4, &Job::default())
            .expect("an answer");
        found += usize::from(candidates.iter().any(|candidate| candidate.original == id));
    }
    assert!(found + 2 >= models.len(), "{found} of {}", models.len());
}

#[test]
fn a_floor_or_a_triangle_far_away_hides_no_original() {
    let models = models();
    let (_folder, library, ids) = library(&models);
    let index = Index::load(&library, &Job::default()).expect("an index");
    let floor = shapes::moved(
        &shapes::rectangle(1, 1, 60.0, 60.0),
        &Similarity {
            translation: [-30.0, -30.0, -2.0],
            ..Similarity::from_quaternion([0.9, 0.1, 0.0, 0.2])
        },
    );
    let far_away = shapes::translated(&shapes::tetrahedron(), [1e7, 0.0, 3e5]);
    for added in [floor, far_away] {
        for (mesh, &id) in models.iter().zip(&ids) {
            let suspect = shapes::disjoint_union(&[shapes::divided(mesh), added.clone()]);
            let query = Query::of(&suspect, &Job::default()).expect("a shape");
            let found = index
                .search(&library, &query, 3, &Job::default())
                .expect("an answer");
            assert_eq!(found[0].original, id);
        }
    }
}

#[test]
fn a_model_is_found_in_a_scene_of_others() {
    let models = models();
    let (_folder, library, ids) = library(&models);
    let index = Index::load(&library, &Job::default()).expect("an index");
    let stranger = shapes::scaled(&shapes::bumpy_sphere(4, 77), 5.0);
    for (mesh, &id) in models.iter().zip(&ids) {
        let scene = shapes::disjoint_union(&[stranger.clone(), shapes::divided(mesh)]);
        let query = Query::of(&scene, &Job::default()).expect("a shape");
        let found = index
            .search(&library, &query, 3, &Job::default())
            .expect("an answer");
        assert_eq!(found[0].original, id);
    }
}

#[test]
fn a_model_pulled_out_of_shape_is_found_by_how_its_triangles_hang_together() {
    let models: Vec<TriMesh> = (1..9)
        .map(|seed| shapes::flipped(&shapes::bumpy_sphere(4, seed), seed))
        .collect();
    let (_folder, library, ids) = library(&models);
    let index = Index::load(&library, &Job::default()).expect("an index");
    for (mesh, &id) in models.iter().zip(&ids) {
        let pulled = mesh.positions().iter().map(|&[x, y, z]| {
            let (sine, cosine) = (2.0 * z).sin_cos();
            [
                3.0 * (x * cosine - y * sine),
                x * sine + y * cosine,
                0.5 * z + x * y,
            ]
        });
        let suspect = mesh.with_positions(pulled.collect()).expect("a mesh");
        let query = Query::of(&suspect, &Job::default()).expect("a shape");
        let found = index
            .search(&library, &query, 1, &Job::default())
            .expect("an answer");
        assert_eq!((found[0].original, found[0].by), (id, By::Tessellation));
    }
}

#[test]
fn answers_do_not_depend_on_the_number_of_threads() {
    let models = models();
    let (_folder, library, _) = library(&models);
    let index = Index::load(&library, &Job::default()).expect("an index");
    let query = Query::of(&half(&models[3], Vec3([0.0, 1.0, 0.2]).unit()), &Job::default()).expect("a shape");
    let answer = |threads| {
        index
            .search(&library, &query, 10, &Job::new(threads))
            .expect("an answer")
    };
    assert_eq!(answer(1), answer(3));
}

#[test]
fn whoever_cancels_waits_for_no_index() {
    struct Stop;
    impl Observer for Stop {
        fn cancelled(&self) -> bool {
            true
        }
    }
    let (_folder, library, _) = library(&models()[..2]);
    let loaded = Index::load(&library, &Job::new(2).observed_by(Stop));
    assert!(matches!(loaded, Err(LibraryError::Job(JobError::Cancelled))));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn place_size_and_position_do_not_matter(seed in 0..50_u64, angles in prop::array::uniform4(-1.0..1.0_f64), scale in 1e-3..1e3_f64, mirrored in any::<bool>()) {
        prop_assume!(angles.iter().map(|x| x * x).sum::<f64>() > 0.01);
        let mesh = shapes::bumpy_sphere(3, seed);
        let transform = Similarity { scale, translation: [1e3, -2.0, 5.0], ..Similarity::from_quaternion(angles) };
        let moved = shapes::moved(&mesh, &transform);
        let original = Descriptor::of(&mesh).expect("a shape");
        let distance = |mesh: &TriMesh| Query::of(mesh, &Job::default()).expect("a shape").distance(&original);
        // A mirror turns triangles around, so that samples lie elsewhere in them.
        if mirrored {
            prop_assert!(distance(&shapes::mirrored(&moved)) < 2.0);
        } else {
            prop_assert!(distance(&moved) < 0.1);
        }
    }

    #[test]
    fn other_triangles_matter_less_than_another_shape(seed in 0..50_u64) {
        let (mesh, other) = (shapes::bumpy_sphere(4, seed), shapes::bumpy_sphere(4, seed + 100));
        let original = Descriptor::of(&mesh).expect("a shape");
        let distance = |mesh: &TriMesh| Query::of(mesh, &Job::default()).expect("a shape").distance(&original);
        let same = [shapes::flipped(&mesh, seed), shapes::divided(&mesh), shapes::shuffled(&mesh, seed)];
        for same in &same {
            prop_assert!(distance(same) < 0.5 * distance(&other));
        }
    }

    #[test]
    fn any_surface_is_described_or_refused(seed in any::<u64>(), count in 1..40_u32, flat in any::<bool>()) {
        let soup = shapes::soup(count, seed);
        let positions = soup.positions().iter().map(|p| if flat { [p[0], 0.0, 0.0] } else { *p });
        let mesh = soup.with_positions(positions.collect()).expect("a mesh");
        prop_assert_eq!(Descriptor::of(&mesh).is_err(), flat);
    }
}
