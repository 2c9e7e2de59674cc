//! Libraries: what goes in, what is found, and what a kill, a second writer or a damaged file does to them.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use std::{fs, path::Path, process::Stdio, thread, time::Duration};

use crate::common::Folder;
use mesh::{TriMesh, shapes};
use mesh_io::{Asset, Precision};
use serde_json::{Value, json};

/// Twelve originals that no symmetry or likeness confuses.
fn originals() -> Vec<(String, TriMesh)> {
    let ball = |seed: u64| (format!("ball{seed}.ply"), shapes::bumpy_sphere(3, seed));
    let ring = |seed: u64| {
        (
            format!("ring{seed}.ply"),
            shapes::bumpy_torus(24 + seed as u32, 16, seed),
        )
    };
    (2..8).map(ball).chain((1..7).map(ring)).collect()
}

/// A folder `models` with these, and with a signed model, its copies and certificates.
fn shop() -> Folder {
    let folder = Folder::with_signed_model();
    fs::create_dir_all(folder.path("models")).unwrap();
    for (name, mesh) in originals() {
        folder.write_mesh(&format!("models/{name}"), &mesh, Precision::Double);
    }
    folder.write("list.csv", "Anna\nBert\n");
    folder.done("embed model.ply --recipients list.csv -o sold -k owner.pem --chip-rate 1");
    folder
}

fn number(object: &Value, key: &str) -> u64 {
    object[key].as_u64().unwrap_or_else(|| panic!("{key}: {object}"))
}

fn copy_for(folder: &Folder, who: &str) -> String {
    let mut sold = fs::read_dir(folder.path("sold"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap());
    format!(
        "sold/{}/model.ply",
        sold.find(|name| name.starts_with(who)).unwrap()
    )
}

#[test]
fn a_suspect_is_found_without_saying_which_model_or_whose_copy_it_is() {
    let folder = shop();
    let added = folder
        .done("library add models model.ply sold --library lib.sigmark --json")
        .json();
    assert_eq!(
        (
            number(&added, "originals"),
            number(&added, "certificates"),
            number(&added, "copies")
        ),
        (13, 2, 2),
        "{added}"
    );
    let again = folder
        .done("library add models model.ply sold --library lib.sigmark --json")
        .json();
    assert_eq!(
        (
            number(&again, "originals"),
            number(&again, "unchanged"),
            number(&again, "total")
        ),
        (0, 15, 13),
        "{again}"
    );

    // Bert's copy, moved and noisy, under another name; the originals have been moved away.
    let copy = Asset::open(folder.path(copy_for(&folder, "bert"))).unwrap();
    let worn = shapes::scaled(&shapes::shuffled(&shapes::jittered(copy.mesh(), 0.02, 3), 5), 7.0);
    folder.write_mesh("found.obj", &worn, Precision::Double);
    fs::remove_dir_all(folder.path("models")).unwrap();
    fs::remove_file(folder.path("model.ply")).unwrap();
    let found = folder
        .done("library search found.obj --library lib.sigmark --json")
        .json();
    assert_eq!(
        (
            &found["recipient"],
            &found["original"]["name"],
            &found["evidence"]
        ),
        (&"Bert".into(), &"model.ply".into(), &true.into()),
        "{found}"
    );
    assert_eq!(found["outcome"], "verified", "{found}");
    assert_eq!(number(&found, "searched"), 13);
    let text = folder.done("library search found.obj --library lib.sigmark").out;
    assert!(
        text.starts_with("VERIFIED: found.obj carries the signature that was written into model.ply")
            && text.contains("Bert"),
        "{text}"
    );

    // The verdict in full, by the code of verify.
    let judged = folder
        .done("library verify found.obj --library lib.sigmark --public-key owner.pub.pem --dispute --json")
        .json();
    assert_eq!(
        (&judged["outcome"], &judged["recipient"], &judged["evidence"]),
        (&"verified".into(), &"Bert".into(), &true.into())
    );
    // Another's key claims nothing.
    let other = folder
        .run("library search found.obj --library lib.sigmark --public-key other.pub.pem --json")
        .json();
    assert_eq!(
        (&other["outcome"], &other["recipient"], &other["p_value"]),
        (&"shape".into(), &Value::Null, &Value::Null)
    );
}

#[test]
fn originals_without_a_mark_are_named_and_strangers_are_not() {
    let folder = shop();
    folder.done("library add models --library lib.sigmark");
    for (name, mesh) in originals().into_iter().step_by(3) {
        folder.write_mesh(
            "suspect.ply",
            &shapes::jittered(&shapes::flipped(&mesh, 4), 0.02, 1),
            Precision::Single,
        );
        let run = folder.run("library search suspect.ply --library lib.sigmark --json");
        let found = run.json();
        assert_eq!(
            (run.code, &found["outcome"]),
            (Some(0), &"shape".into()),
            "{name}: {found}"
        );
        assert_eq!(found["original"]["name"], name.as_str(), "{found}");
        assert_eq!(found["p_value"], Value::Null);
    }
    folder.write_mesh("stranger.ply", &shapes::block(1, 10), Precision::Double);
    let run = folder.run("library search stranger.ply --library lib.sigmark --json");
    assert_eq!((run.code, &run.json()["outcome"]), (Some(1), &"not_found".into()));
    let run = folder.run("library verify stranger.ply --library lib.sigmark");
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.out.starts_with("NOT FOUND"), "{}", run.out);
}

#[test]
fn a_signed_copy_is_an_original_only_where_a_certificate_says_so() {
    let folder = Folder::with_signed_model();
    // theirs.ply is a copy of model.ply; here it is signed once more, and so an original, too.
    folder.done("embed theirs.ply -o twice.ply -k other.pem --chip-rate 1");
    let added = folder
        .done("library add signed.ply theirs.ply twice.ply twice.ply.cert.json --library lib.sigmark --json")
        .json();
    assert_eq!(
        (
            number(&added, "originals"),
            number(&added, "copies"),
            number(&added, "waiting")
        ),
        (1, 2, 0),
        "{added}"
    );
    let later = folder
        .done("library add signed.ply.cert.json --library lib.sigmark --json")
        .json();
    assert_eq!(number(&later, "waiting"), 1, "{later}");
    let then = folder
        .done("library add model.ply --library lib.sigmark --json")
        .json();
    assert_eq!(
        (number(&then, "waiting"), number(&then, "total")),
        (0, 2),
        "{then}"
    );
    let found = folder
        .done("library search signed.ply --library lib.sigmark --json")
        .json();
    assert_eq!(
        (&found["outcome"], &found["message"]),
        (&"verified".into(), &"order-4711".into())
    );
}

#[test]
fn without_geometry_marks_are_read_while_the_file_stays() {
    let folder = Folder::with_signed_model();
    folder.done("library add model.ply signed.ply.cert.json --library lib.sigmark --no-geometry");
    assert!(
        folder
            .done("library list --library lib.sigmark")
            .out
            .contains("geometry not kept")
    );
    let found = folder
        .done("library search signed.ply --library lib.sigmark --json")
        .json();
    assert_eq!(found["outcome"], "verified");
    fs::rename(folder.path("model.ply"), folder.path("elsewhere.ply")).unwrap();
    // That it is none of the originals is what nobody can say now.
    for ask in ["search", "verify"] {
        folder.refused(
            &format!("library {ask} signed.ply --library lib.sigmark --json"),
            &[
                "signed.ply: can't be judged",
                "model.ply",
                "was not kept, and its file is gone",
                "sigmark library add",
            ],
        );
    }
    // Added again from where it is, with its geometry, it is the same original.
    let added = folder
        .done("library add elsewhere.ply --library lib.sigmark --json")
        .json();
    assert_eq!((number(&added, "known"), number(&added, "total")), (1, 1));
    fs::remove_file(folder.path("elsewhere.ply")).unwrap();
    assert_eq!(
        folder
            .done("library search signed.ply --library lib.sigmark --json")
            .json()["outcome"],
        "verified"
    );
}

#[test]
fn the_geometry_of_files_that_were_added_without_it_is_kept_once_it_is_asked_for() {
    let folder = Folder::with_signed_model();
    let add = "library add model.ply signed.ply.cert.json --library lib.sigmark --json";
    folder.done(&format!("{add} --no-geometry"));
    let counts = |line: &str| {
        let added = folder.done(line).json();
        (number(&added, "known"), number(&added, "unchanged"))
    };
    assert_eq!(counts(&format!("{add} --no-geometry")), (0, 2));
    assert_eq!(counts(add), (1, 1));
    assert_eq!(counts(add), (0, 2));
    // Nor is what is kept given up.
    assert_eq!(counts(&format!("{add} --no-geometry")), (0, 2));
    fs::remove_file(folder.path("model.ply")).unwrap();
    let found = folder
        .done("library search signed.ply --library lib.sigmark --json")
        .json();
    assert_eq!(found["outcome"], "verified");
}

#[test]
fn a_verdict_by_one_of_several_certificates_counts_them_all() {
    let folder = shop();
    folder.done("library add model.ply sold --library lib.sigmark");
    let copy = Asset::open(folder.path(copy_for(&folder, "anna"))).unwrap();
    let verify = format!(
        "verify worn.ply --certificate {}.cert.json --original model.ply --json",
        copy_for(&folder, "anna")
    );
    // So much noise that the mark is seen, but not its signature.
    let p = (1..20).find_map(|step| {
        let worn = shapes::jittered(copy.mesh(), 0.03 * f64::from(step), 3);
        folder.write_mesh("worn.ply", &worn, Precision::Double);
        let judged = folder.run(&verify).json();
        (judged["outcome"] == "detected").then(|| judged["p_value"].as_f64().unwrap())
    });
    let p = p.expect("a mark that is seen and not read");
    for (bound, code, outcome) in [(1.5 * p, 1, "not_found"), (2.5 * p, 0, "detected")] {
        let alone = folder.done(&format!("{verify} --p-bound {bound:e}")).json();
        assert_eq!(alone["outcome"], "detected");
        let run = folder.run(&format!(
            "library verify worn.ply --library lib.sigmark --json --p-bound {bound:e}"
        ));
        let judged = run.json();
        assert_eq!(
            (run.code, &judged["outcome"], &judged["recipient"]),
            (Some(code), &outcome.into(), &"Anna".into()),
            "{judged}"
        );
        assert!(
            (judged["p_value"].as_f64().unwrap() / p - 2.0).abs() < 1e-9,
            "{judged}"
        );
        // What was searched for and judged has one clock.
        assert!(judged["seconds"]["search"].is_number(), "{judged}");
    }
}

/// Of the model's shape, whatever marks are in it that a search does not read.
#[test]
fn certificates_of_the_papers_profile_are_passed_over_and_hide_no_shape() {
    let folder = Folder::with_signed_model();
    folder.done("keygen -o paper.pem --profile paper");
    for message in ["one", "two"] {
        folder.done(&format!(
            "embed model.ply -o {message}.ply -k paper.pem --profile paper --chip-rate 2 -m {message}"
        ));
    }
    for (certificates, counted) in [
        ("one.ply.cert.json", "1 certificate of model.ply passed over"),
        ("two.ply.cert.json", "2 certificates of model.ply passed over"),
    ] {
        folder.done(&format!(
            "library add model.ply {certificates} --library lib.sigmark"
        ));
        let run = folder.run("library search model.ply one.ply --library lib.sigmark");
        assert_eq!(run.code, Some(0), "{run:?}");
        assert_eq!(run.out.matches("SHAPE FOUND").count(), 2, "{}", run.out);
        assert!(
            run.out.contains("none that could be read with") && !run.out.contains("asked for"),
            "{}",
            run.out
        );
        assert!(
            run.err.contains(counted)
                && run.err.contains("`sigmark verify --profile paper`")
                && run.err.lines().count() == 1,
            "{}",
            run.err
        );
    }
    // Nor do they hide a mark that is read, and none of them counts.
    folder.done("library add signed.ply.cert.json --library lib.sigmark");
    let run = folder.run("library search signed.ply --library lib.sigmark --json");
    let found: Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!(
        (&found["outcome"], number(&found, "readings")),
        (&"verified".into(), 1),
        "{found}"
    );
}

/// In somebody else's folder, where nothing can be written. For root there is none: then nobody asks.
#[cfg(unix)]
#[test]
fn a_library_that_cannot_be_written_to_is_read() {
    use std::os::unix::{fs::PermissionsExt, process::CommandExt};
    let folder = Folder::with_signed_model();
    fs::create_dir(folder.path("50% of a #?")).unwrap();
    let library = folder.path("50% of a #?/lib.sigmark");
    let mut add = folder.command(["library", "add", "model.ply", "signed.ply.cert.json", "--library"]);
    assert!(add.arg(&library).output().unwrap().status.success());
    let set = |path: &Path, mode| fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    set(&folder.path("."), 0o755);
    set(&folder.path("signed.ply"), 0o644);
    set(&library, 0o444);
    set(&folder.path("50% of a #?"), 0o555);
    let mut search = folder.command(["library", "search", "signed.ply", "--json", "--library"]);
    search.arg(&library);
    if fs::File::options().write(true).open(&library).is_ok() {
        search.uid(65534).gid(65534);
    }
    match search.output() {
        Ok(output) => {
            let found: Value =
                serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{output:?}"));
            assert_eq!(found["outcome"], "verified", "{found}");
        }
        // Nobody can't run what root built here.
        Err(error) => assert_eq!(error.kind(), std::io::ErrorKind::PermissionDenied),
    }
    set(&folder.path("50% of a #?"), 0o755);
}

#[test]
fn a_bad_file_costs_its_own_line_only() {
    let folder = shop();
    folder.write("models/bad.stl", "solid nothing\nfacet\n");
    folder.write("models/flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    folder.write("models/no.cert.json", "{}");
    let run = folder.run("library add models --library lib.sigmark");
    assert_eq!((run.code, run.err.lines().count()), (Some(2), 3), "{run:?}");
    assert!(
        run.out.starts_with("Added 12 originals and 0 certificates"),
        "{}",
        run.out
    );
    assert!(
        run.err.contains("flat.obj: the surface has no area"),
        "{}",
        run.err
    );
}

/// What a library holds, after it was checked by a run that reads everything.
fn total(folder: &Folder) -> usize {
    let listed = folder.done("library list --library lib.sigmark --json").json();
    listed["originals"].as_array().unwrap().len()
}

#[test]
fn a_kill_at_any_moment_leaves_a_whole_library_and_the_next_run_goes_on() {
    let folder = shop();
    for seed in 20..60 {
        folder.write_mesh(
            &format!("models/more{seed}.ply"),
            &shapes::bumpy_sphere(2, seed),
            Precision::Double,
        );
    }
    let mut before = 0;
    for wait in [5, 15, 30, 45, 60, 80, 100, 130] {
        let mut command =
            folder.command("library add models sold model.ply --library lib.sigmark --threads 1".split(' '));
        let mut run = command
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        thread::sleep(Duration::from_millis(wait));
        run.kill().unwrap();
        run.wait().unwrap();
        let run = folder.run("library list --library lib.sigmark --json");
        if run.code == Some(2) {
            // Killed before there was a table in it.
            assert!(
                run.err.contains("there is no library") || run.err.contains("it is empty"),
                "{}",
                run.err
            );
            continue;
        }
        let now = run.json()["originals"].as_array().unwrap().len();
        assert!(now >= before, "{now} after {before}");
        before = now;
    }
    folder.done("library add models sold model.ply --library lib.sigmark");
    assert_eq!(total(&folder), 53);
    let suspect = copy_for(&folder, "anna");
    let found = folder
        .done(&format!("library search {suspect} --library lib.sigmark --json"))
        .json();
    assert_eq!(
        (&found["outcome"], &found["recipient"]),
        (&"verified".into(), &"Anna".into())
    );
}

#[test]
fn two_who_add_at_once_both_get_everything_in() {
    let folder = shop();
    let start = || {
        let mut command =
            folder.command("library add models model.ply sold --library lib.sigmark --json".split(' '));
        command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let runs: Vec<_> = (0..3).map(|_| start()).collect();
    let mut new = 0;
    for run in runs {
        let output = run.wait_with_output().unwrap();
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let object: Value = serde_json::from_slice(&output.stdout).unwrap();
        new += number(&object, "originals");
    }
    assert_eq!((new, total(&folder)), (13, 13));
}

#[test]
fn what_is_no_library_is_refused_with_the_reason_and_left_as_it_is() {
    let folder = shop();
    folder.done("library add models --library lib.sigmark");
    folder.refused(
        "library list --library none.sigmark",
        &["none.sigmark", "there is no library"],
    );
    folder.refused(
        "library search model.ply --library model.ply",
        &["model.ply", "no library of Sigmark"],
    );
    folder.refused(
        "library add model.ply --library model.ply",
        &["model.ply", "is a mesh that is to be added"],
    );
    folder.refused(
        "library add signed.ply --library model.ply",
        &["model.ply", "no SQLite database"],
    );
    folder.write("empty.sigmark", "");
    folder.refused("library list --library empty.sigmark", &["it is empty"]);

    let whole = folder.read("lib.sigmark");
    // Half of it, and a later version: SQLite keeps it in bytes 60 to 63.
    folder.write("half.sigmark", &whole[..whole.len() / 2]);
    folder.refused(
        "library list --library half.sigmark",
        &["half.sigmark", "damaged"],
    );
    let mut newer = whole.clone();
    let version = library::SCHEMA_VERSION + 1;
    newer[60..64].copy_from_slice(&(version as u32).to_be_bytes());
    folder.write("newer.sigmark", &newer);
    folder.refused(
        "library list --library newer.sigmark",
        &[&format!("version {version}"), "newer sigmark"],
    );
    let mut older = whole.clone();
    older[60..64].copy_from_slice(&1_u32.to_be_bytes());
    folder.write("older.sigmark", &older);
    folder.refused(
        "library list --library older.sigmark",
        &["version 1", "make it anew"],
    );
    let mut foreign = whole.clone();
    foreign[68..72].copy_from_slice(&7_u32.to_be_bytes());
    folder.write("foreign.sigmark", &foreign);
    folder.refused(
        "library add model.ply --library foreign.sigmark",
        &["another program"],
    );

    // Anything may be wrong inside: an answer or a refusal, and never a panic.
    for step in 0..16 {
        let mut damaged = whole.clone();
        let place = 100 + step * (whole.len() - 100) / 16;
        damaged[place..place + 16].fill(0xa5);
        folder.write("damaged.sigmark", &damaged);
        for line in ["list", "search models/ball2.ply --candidates 2"] {
            let run = folder.run(&format!("library {line} --library damaged.sigmark --json"));
            assert!(
                matches!(run.code, Some(0..=2)) && !run.err.contains("panicked"),
                "{place}: {run:?}"
            );
        }
    }
}

#[test]
fn a_crop_of_half_is_found() {
    let folder = shop();
    folder.done("library add models --library lib.sigmark");
    let (name, mesh) = originals().remove(9);
    let is_kept = |corners: &&[u32; 3]| corners.iter().all(|&v| mesh.point(v as usize).0[0] > 0.0);
    let kept: Vec<[u32; 3]> = mesh.triangles().iter().filter(is_kept).copied().collect();
    let half = mesh::Welded::new(mesh.positions(), &kept).unwrap().into_mesh();
    folder.write_mesh("half.stl", &shapes::scaled(&half, 3.0), Precision::Single);
    let found = folder
        .done("library search half.stl --library lib.sigmark --json")
        .json();
    assert_eq!(
        (&found["outcome"], &found["original"]["name"]),
        (&"shape".into(), &name.as_str().into()),
        "{found}"
    );
}

#[test]
fn originals_are_found_that_stand_on_a_floor_or_several_times_in_a_scene() {
    let folder = shop();
    let (name, mesh) = originals().remove(3);
    folder.write_gltf(
        "models/room.gltf",
        &shapes::bumpy_torus(31, 17, 9),
        "room.bin",
        b"",
    );
    let mut room: Value = serde_json::from_slice(&folder.read("models/room.gltf")).unwrap();
    let nodes = (0..12).map(|i| json!({"mesh": 0, "translation": [7 * i, 0, 0]}));
    room["nodes"] = nodes.collect();
    room["scenes"] = json!([{"nodes": (0..12).collect::<Vec<_>>()}]);
    folder.write("models/room.gltf", room.to_string());
    folder.done("library add models --library lib.sigmark");
    let floor = [
        [-9.0, -9.0, -1.5],
        [9.0, -9.0, -1.5],
        [9.0, 9.0, -1.5],
        [-9.0, 9.0, -1.5],
    ];
    let floor = TriMesh::new(floor.into(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    folder.write_mesh(
        "on_a_floor.ply",
        &shapes::disjoint_union(&[mesh, floor]),
        Precision::Single,
    );
    for (suspect, name) in [("models/room.gltf", "room.gltf"), ("on_a_floor.ply", &name)] {
        let run = folder.run(&format!("library search {suspect} --library lib.sigmark --json"));
        let found = run.json();
        assert_eq!(
            (&found["outcome"], &found["original"]["name"]),
            (&"shape".into(), &name.into()),
            "{found}"
        );
    }
}
