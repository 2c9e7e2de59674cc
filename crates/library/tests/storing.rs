//! The database: what was put in comes out.

use std::{fs, path::Path, thread};

use library::{AddedAs, CertificateRecord, Entry, FileRecord, Library, LibraryError};
use mesh::shapes;
use sigmark::GeometryDigest;

fn entry(seed: u64) -> Entry {
    Entry::of(&format!("{seed}"), &shapes::bumpy_sphere(2, seed), true).expect("a shape")
}

fn record(path: &str) -> FileRecord {
    FileRecord {
        path: path.into(),
        size: 7,
        modified: 9,
    }
}

#[test]
fn geometry_comes_back_and_an_original_is_there_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("lib.sigmark");
    let mesh = shapes::bumpy_torus(24, 16, 1);
    {
        let mut library = Library::create(&path).expect("a library");
        let without = Entry::of("ring", &mesh, false).expect("a shape");
        let AddedAs::New(id) = library.add(&without.lying_in(record("a"))).expect("added") else {
            panic!("it is new");
        };
        assert!(!library.keeps(&record("a")).expect("an answer"));
        let with = Entry::of("again", &mesh, true)
            .expect("a shape")
            .lying_in(record("b"));
        assert_eq!(library.add(&with).expect("added"), AddedAs::Known(id));
        assert!(library.knows(&record("a")).expect("an answer"));
        assert!(library.keeps(&record("a")).expect("an answer"));
        let other = FileRecord {
            modified: 10,
            ..record("a")
        };
        assert!(!library.knows(&other).expect("an answer"));
    }
    let library = Library::open(&path).expect("a library");
    let originals = library.originals().expect("a list");
    assert_eq!((originals.len(), originals[0].name.as_str()), (1, "ring"));
    assert_eq!(library.geometry(&originals[0]).expect("geometry"), Some(mesh));
    let paths: Vec<String> = library
        .files(originals[0].id)
        .expect("a list")
        .into_iter()
        .map(|file| file.path)
        .collect();
    assert_eq!(paths, ["a", "b"]);
    // Closed, it is one file.
    drop(library);
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
}

#[cfg(unix)]
#[test]
fn a_library_is_its_owners_alone_with_all_that_lies_beside_it() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("lib.sigmark");
    let mut library = Library::create(&path).expect("a library");
    library.add(&entry(1)).expect("added");
    let entries = fs::read_dir(folder.path()).expect("a folder");
    let modes: Vec<u32> = entries
        .map(|entry| {
            entry
                .expect("a file")
                .metadata()
                .expect("metadata")
                .permissions()
                .mode()
                & 0o777
        })
        .collect();
    // The file, the log ahead of it, and the log's index.
    assert_eq!(modes, [0o600; 3]);
}

#[test]
fn certificates_find_their_originals_in_any_order() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut library = Library::create(&folder.path().join("lib.sigmark")).expect("a library");
    let certificate = CertificateRecord {
        original: GeometryDigest::of(&shapes::bumpy_sphere(2, 1)),
        recipient: "Anna".into(),
        message: "order".into(),
        key: "00".into(),
        text: "{}".into(),
    };
    assert!(
        library
            .add_certificate(&certificate, Some(&record("c")))
            .expect("added")
    );
    assert!(!library.add_certificate(&certificate, None).expect("added"));
    assert_eq!(library.waiting().expect("a count"), 1);
    assert!(library.names(&certificate.original).expect("an answer"));
    library.add(&entry(1)).expect("added");
    assert_eq!(
        (
            library.waiting().expect("a count"),
            library.originals().expect("a list")[0].certificates
        ),
        (0, 1)
    );
    assert_eq!(
        library.certificates(&certificate.original).expect("a list"),
        [certificate]
    );
}

#[test]
fn many_writers_at_once_lose_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("lib.sigmark");
    let add = |path: &Path, first: u64| {
        let mut library = Library::create(path).expect("a library");
        (first..first + 6).for_each(|seed| {
            library.add(&entry(seed)).expect("added");
        });
    };
    thread::scope(|scope| {
        for first in [0, 3, 6, 9] {
            scope.spawn({
                let path = &path;
                move || add(path, first)
            });
        }
    });
    assert_eq!(
        Library::open(&path).expect("a library").count().expect("a count"),
        15
    );
}

#[test]
fn many_who_make_one_library_at_once_all_get_it() {
    let folder = tempfile::tempdir().expect("a folder");
    for round in 0..50 {
        let path = folder.path().join(format!("{round}.sigmark"));
        thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| Library::create(&path).expect("a library"));
            }
        });
    }
}

#[test]
fn geometry_that_is_not_what_its_digest_says_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut library = Library::create(&folder.path().join("lib.sigmark")).expect("a library");
    let mut forged = entry(1);
    forged.geometry = entry(2).geometry;
    library.add(&forged).expect("added");
    let original = library.originals().expect("a list").remove(0);
    let refused = library.geometry(&original);
    assert!(
        matches!(&refused, Err(LibraryError::Damaged { problem, .. }) if problem.contains("another digest")),
        "{refused:?}"
    );
}

#[test]
fn another_programs_database_is_left_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("other.db");
    rusqlite::Connection::open(&path)
        .and_then(|other| other.execute_batch("CREATE TABLE t (x)"))
        .expect("a database");
    let before = fs::read(&path).expect("a file");
    assert!(matches!(
        Library::create(&path),
        Err(LibraryError::Foreign { .. })
    ));
    assert_eq!(fs::read(&path).expect("a file"), before);

    // One that calls itself a library, with a trigger of its own.
    let path = folder.path().join("lib.sigmark");
    drop(Library::create(&path).expect("a library"));
    let trigger = "CREATE TRIGGER evil AFTER INSERT ON original BEGIN DELETE FROM original; END";
    rusqlite::Connection::open(&path)
        .and_then(|other| other.execute_batch(trigger))
        .expect("a database");
    let refused = Library::open(&path);
    assert!(
        matches!(&refused, Err(LibraryError::Foreign { problem, .. }) if problem.contains("tables")),
        "{refused:?}"
    );
}
