//! Several models, and folders of them.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use crate::common::{Folder, finish, model};
use mesh::shapes;
use mesh_io::Precision;
use serde_json::Value;

const CLAIM: &str = "--original model.ply --certificate signed.ply.cert.json --public-key owner.pub.pem";

/// A folder of models in several formats, with one that is damaged.
fn models() -> Folder {
    let folder = Folder::with_signed_model();
    std::fs::create_dir_all(folder.path("models/deep")).unwrap();
    folder.write_mesh("models/a.obj", &model(), Precision::Double);
    folder.write_mesh("models/deep/b.ply.gz", &model(), Precision::Double);
    folder.write("models/deep/bad.stl", "solid nothing\nfacet\n");
    folder.write("models/notes.txt", "not a mesh");
    folder.write("models/.hidden.obj", "v 0 0 0");
    folder
}

fn objects(out: &str) -> Vec<Value> {
    out.lines()
        .map(|line| serde_json::from_str(line).expect("an object a line"))
        .collect()
}

#[test]
fn folders_are_signed_with_their_structure_and_one_bad_file_stops_nothing() {
    let folder = models();
    let run = folder.run("embed models/ model.ply -o out/signed -k owner.pem --chip-rate 1 -m order-7");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(
        run.err.starts_with("sigmark: models/deep/bad.stl, ") && run.err.lines().count() == 1,
        "{}",
        run.err
    );
    assert!(
        run.out
            .contains("Signed models/a.obj: out/signed/a.obj and out/signed/a.obj.cert.json"),
        "{}",
        run.out
    );
    assert!(run.out.contains("\n3 signed, 1 failed\n"), "{}", run.out);
    for (name, original) in [
        ("a.obj", "models/a.obj"),
        ("deep/b.ply.gz", "models/deep/b.ply.gz"),
        ("model.ply", "model.ply"),
    ] {
        let line = format!(
            "verify out/signed/{name} --original {original} --certificate out/signed/{name}.cert.json --json"
        );
        let report = folder.done(&line).json();
        assert_eq!(
            (&report["outcome"], &report["message"]),
            (&"verified".into(), &"order-7".into()),
            "{name}"
        );
    }
    assert!(
        !folder.path("out/signed/deep/bad.stl").exists() && !folder.path("out/signed/notes.txt").exists()
    );

    // What is there is not replaced; the rest, which is nothing here, would be.
    let again = folder.run("embed models/ -o out/signed -k owner.pem --chip-rate 1");
    assert_eq!(again.code, Some(2));
    assert!(
        again.err.contains("out/signed/a.obj: exists already") && again.out.contains("0 signed, 3 failed"),
        "{again:?}"
    );
}

#[test]
fn batches_print_an_object_a_model_with_failures_among_them() {
    let folder = models();
    let run = folder.run("embed models -o signed -k owner.pem --chip-rate 1 --json");
    assert_eq!(run.code, Some(2));
    let objects = objects(&run.out);
    let models: Vec<&str> = objects
        .iter()
        .map(|object| object["model"].as_str().unwrap())
        .collect();
    assert_eq!(
        models,
        ["models/a.obj", "models/deep/b.ply.gz", "models/deep/bad.stl"]
    );
    assert_eq!(objects[1]["output"], "signed/deep/b.ply.gz");
    assert!(objects[0]["error"].is_null());
    let keys: Vec<&String> = objects[2].as_object().unwrap().keys().collect();
    assert_eq!(keys, ["error", "model"]);
    // What one model prints alone is as it was.
    let alone = folder
        .done("embed model.ply -o s.ply -k owner.pem --chip-rate 1 --json")
        .json();
    assert!(alone.get("model").is_none());
}

#[test]
fn a_batch_asks_for_the_passphrase_once_and_gives_what_single_runs_give() {
    let folder = models();
    std::fs::remove_file(folder.path("models/deep/bad.stl")).unwrap();
    let with_passphrase = |line: &str| {
        let mut command = folder.command(line.split_whitespace());
        command.env("SIGMARK_PASSPHRASE", "open sesame");
        let run = finish(command);
        assert_eq!((run.code, run.err.as_str()), (Some(0), ""), "{line}");
    };
    with_passphrase("keygen -o locked.pem --encrypt");
    with_passphrase("embed models -o signed -k locked.pem --chip-rate 1 -m once");
    with_passphrase("embed models/a.obj -o alone.obj -k locked.pem --chip-rate 1 -m once");
    assert!(folder.read("signed/a.obj") == folder.read("alone.obj"));
    assert_eq!(
        folder.text("signed/a.obj.cert.json"),
        folder.text("alone.obj.cert.json")
    );
}

#[test]
fn batches_that_would_harm_are_refused_before_anything_is_done() {
    let folder = models();
    std::fs::create_dir(folder.path("empty")).unwrap();
    std::fs::create_dir(folder.path("other")).unwrap();
    folder.write_mesh("other/a.obj", &model(), Precision::Double);
    let table: [(&str, &[&str]); 7] = [
        (
            "embed models other -o signed -k owner.pem",
            &["models/a.obj and other/a.obj", "would both become a.obj"],
        ),
        (
            "embed model.ply models/../model.ply -o signed -k owner.pem",
            &["would both become model.ply"],
        ),
        (
            "embed models -o models -k owner.pem --force",
            &["models/a.obj", "is one of the models"],
        ),
        (
            "embed empty -o signed -k owner.pem",
            &["empty: is a directory, and no file in it"],
        ),
        (
            "embed models -o owner.pem -k owner.pem --force",
            &["owner.pem: is a file", "name of one"],
        ),
        (
            "embed models -o signed -k owner.pem --certificate c.json",
            &["--certificate is for one model"],
        ),
        (
            "embed models -o signed -k missing.pem",
            &["missing.pem", "can't be read"],
        ),
    ];
    for (line, words) in table {
        folder.refused(line, words);
        assert!(!folder.path("signed").exists(), "{line}");
    }
    assert_eq!(std::fs::read_dir(folder.path("models")).unwrap().count(), 4);
}

#[test]
fn companions_that_would_replace_each_other_or_what_is_read_are_refused_before_anything_is_done() {
    let folder = models();
    let other = shapes::bumpy_torus(40, 20, 2);
    // Two models from two folders, with buffers of one name; two in one folder that share a buffer.
    folder.write_gltf("one/a.gltf", &model(), "scene.bin", b"\x89PNG a picture");
    folder.write_gltf("two/b.gltf", &other, "scene.bin", b"\x89PNG a picture");
    folder.write_gltf("shared/c.gltf", &model(), "scene.bin", b"\x89PNG a picture");
    std::fs::copy(folder.path("shared/c.gltf"), folder.path("shared/d.gltf")).unwrap();
    // And two whose pictures alone have one name, the same and not the same.
    folder.write_gltf("three/e.gltf", &other, "e.bin", b"\x89PNG a picture");
    folder.write_gltf("four/f.gltf", &other, "f.bin", b"\x89PNG another picture");
    std::fs::create_dir_all(folder.path("five/data")).unwrap();
    folder.write_gltf("five/g.gltf", &other, "data/scene.bin", b"\x89PNG a picture");
    let table: [(&str, &[&str]); 4] = [
        (
            "embed one/a.gltf two/b.gltf -o signed -k owner.pem",
            &[
                "one/a.gltf and two/b.gltf would both write signed/scene.bin",
                "two folders",
            ],
        ),
        (
            "embed shared -o signed -k owner.pem",
            &["shared/c.gltf and shared/d.gltf would both write signed/scene.bin"],
        ),
        (
            "embed three/e.gltf four/f.gltf -o signed -k owner.pem",
            &["three/e.gltf and four/f.gltf would both write signed/skin.png"],
        ),
        (
            "embed one/a.gltf five/g.gltf -o five/data -k owner.pem --force",
            &["five/data/a.gltf: the copy of one/scene.bin would replace five/data/scene.bin, which is read"],
        ),
    ];
    for (line, words) in table {
        folder.refused(line, words);
        assert!(!folder.path("signed").exists(), "{line}");
    }
    folder.refused(
        "embed two/b.gltf -o one/h.gltf -k one/scene.bin --force",
        &["one/h.gltf: the copy of two/scene.bin would replace one/scene.bin, which is read"],
    );
    // Files in folders are not among those that `refused` looks at.
    assert!(folder.read("five/data/scene.bin") == folder.read("three/e.bin"));

    let run = folder.done("embed one/a.gltf three/e.gltf -o signed -k owner.pem --chip-rate 1");
    assert!(
        run.out.contains("2 signed, 0 failed"),
        "one picture for both: {}",
        run.out
    );
    assert_eq!(folder.read("signed/skin.png"), b"\x89PNG a picture");
    assert!(folder.read("signed/scene.bin") != folder.read("one/scene.bin"));
}

#[test]
fn materials_and_their_pictures_go_with_every_signed_copy_of_an_obj() {
    let folder = models();
    for name in ["in", "signed"] {
        std::fs::create_dir(folder.path(name)).unwrap();
    }
    folder.write_mesh("in/bare.obj", &model(), Precision::Single);
    let bare = folder.text("in/bare.obj");
    folder.write("in/model.obj", format!("mtllib model.mtl\n{bare}"));
    folder.write("in/model.mtl", "newmtl skin\nmap_Kd skin.png\n");
    std::fs::write(folder.path("in/skin.png"), b"\x89PNG a picture").unwrap();
    folder.write("orders.csv", "recipient\nAnna\n");
    folder.done("embed in/model.obj -o signed/model.obj -k owner.pem --chip-rate 1");
    folder.done("embed in/model.obj --recipients orders.csv -o copies -k owner.pem --chip-rate 1");
    let copy = std::fs::read_dir(folder.path("copies")).unwrap().flatten();
    let copy = copy.map(|entry| entry.path()).find(|path| path.is_dir()).unwrap();
    for signed in [folder.path("signed"), copy] {
        let same =
            |name: &str| std::fs::read(signed.join(name)).unwrap() == folder.read(&format!("in/{name}"));
        assert!(same("model.mtl") && same("skin.png"), "{}", signed.display());
        assert!(!same("model.obj"));
    }
    folder.write("in/model.obj", format!("mtllib owner.pem\n{bare}"));
    std::fs::copy(folder.path("owner.pem"), folder.path("in/owner.pem")).unwrap();
    folder.refused(
        "embed in/model.obj -o again.obj -k in/owner.pem",
        &["in/model.obj: refers to in/owner.pem, which is the private key"],
    );
}

#[test]
fn outputs_inside_the_folder_are_not_signed_again() {
    let folder = models();
    std::fs::remove_file(folder.path("models/deep/bad.stl")).unwrap();
    for force in ["", "--force"] {
        let run = folder.done(&format!(
            "embed models -o models/signed -k owner.pem --chip-rate 1 {force}"
        ));
        assert!(run.out.contains("2 signed, 0 failed"), "{}", run.out);
    }
    assert!(!folder.path("models/signed/signed").exists());
}

#[test]
fn folders_of_suspects_are_judged_and_counted() {
    let folder = Folder::with_signed_model();
    std::fs::create_dir_all(folder.path("found/deep")).unwrap();
    for name in ["found/one.ply", "found/deep/two.ply"] {
        std::fs::copy(folder.path("signed.ply"), folder.path(name)).unwrap();
    }
    folder.write_mesh(
        "found/torus.obj",
        &shapes::bumpy_torus(20, 20, 1),
        Precision::Single,
    );
    let run = folder.done(&format!("verify found {CLAIM}"));
    assert!(run.out.ends_with("\nFound in 2 of 3\n"), "{}", run.out);

    folder.write("found/bad.off", "OFF\n");
    let run = folder.run(&format!("verify found model.ply {CLAIM} --json"));
    assert_eq!(run.code, Some(2));
    assert!(
        run.err.starts_with("sigmark: found/bad.off, ") && run.err.lines().count() == 1,
        "{}",
        run.err
    );
    let objects = objects(&run.out);
    let outcomes: Vec<(&str, Option<&str>)> = objects
        .iter()
        .map(|object| (object["suspect"].as_str().unwrap(), object["outcome"].as_str()))
        .collect();
    assert_eq!(
        outcomes,
        [
            ("found/bad.off", None),
            ("found/deep/two.ply", Some("verified")),
            ("found/one.ply", Some("verified")),
            ("found/torus.obj", Some("not_found")),
            ("model.ply", Some("not_found")),
        ]
    );
    assert!(
        objects[0]["error"]
            .as_str()
            .unwrap()
            .starts_with("found/bad.off, ")
    );
    // Nothing found is a no.
    assert_eq!(
        folder.run(&format!("verify model.ply theirs.ply {CLAIM}")).code,
        Some(1)
    );
}

/// A copy of it would go to whoever gets the signed model.
#[test]
fn a_model_that_names_the_private_key_is_not_signed() {
    let folder = Folder::with_signed_model();
    folder.write_gltf("a.gltf", &model(), "a.bin", b"\x89PNG a picture");
    let named = String::from_utf8(folder.read("a.gltf")).unwrap();
    folder.write("a.gltf", named.replace("skin.png", "owner.pem"));
    folder.write("list.csv", "Anna\n");
    for line in ["-o ../a.gltf", "-o signed --recipients list.csv"] {
        let line = format!("embed a.gltf -k owner.pem {line}");
        folder.refused(
            &line,
            &["a.gltf: refers to", "owner.pem, which is the private key"],
        );
    }
    assert!(!folder.path("signed").exists());
}
