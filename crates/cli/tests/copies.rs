//! One model, many recipients.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use std::{collections::BTreeMap, fs, path::PathBuf, time::SystemTime};

use crate::common::{Folder, Run, finish, model};
use mesh::shapes;
use mesh_io::Precision;

const LIST: &str = "order,recipient\n1,\"Museum, Berlin\"\n2,order-4711\n3,注文 4712\n";
const COPIES: &str = "embed model.ply --recipients list.csv -o copies -k owner.pem --chip-rate 1 -m sold";

/// The model with the keys, and a list of three.
fn folder() -> Folder {
    let folder = Folder::with_signed_model();
    folder.write("list.csv", LIST);
    folder
}

/// Every file below a folder by its path in it.
fn files(folder: &Folder, below: &str) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut files, mut folders) = (BTreeMap::new(), vec![folder.path(below)]);
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => folders.push(path),
                false => {
                    let name = path.strip_prefix(folder.path(below)).unwrap().to_path_buf();
                    files.insert(name, fs::read(path).unwrap());
                }
            }
        }
    }
    files
}

fn named<'a>(files: &'a BTreeMap<PathBuf, Vec<u8>>, name: &str) -> Vec<&'a PathBuf> {
    files.keys().filter(|path| path.ends_with(name)).collect()
}

fn modified(path: PathBuf) -> SystemTime {
    fs::metadata(path).unwrap().modified().unwrap()
}

/// Makes copies and tells how many are new, and how many were there.
fn made(folder: &Folder, line: &str) -> (u64, u64) {
    let report = folder.done(&format!("{line} --json")).json();
    (
        report["made"].as_u64().unwrap(),
        report["skipped"].as_u64().unwrap(),
    )
}

#[test]
fn every_recipient_gets_what_a_run_alone_would_have_made_under_a_name_that_says_nothing() {
    let folder = folder();
    let run = folder.done(COPIES);
    assert!(run.out.contains("\nMade 3 copies of model.ply\n"), "{}", run.out);
    assert!(
        run.out.contains("  who has which  copies/index.csv\n"),
        "{}",
        run.out
    );
    let copies = files(&folder, "copies");
    assert_eq!(copies.len(), 7);
    let meshes = named(&copies, "model.ply");
    assert_eq!(
        (meshes.len(), named(&copies, "model.ply.cert.json").len()),
        (3, 3)
    );
    for mesh in &meshes {
        assert_eq!(copies[*mesh].len(), folder.read("model.ply").len());
        assert_eq!(
            modified(folder.path("copies").join(mesh)),
            modified(folder.path("model.ply"))
        );
    }
    let alone = "embed model.ply -o alone.ply -k owner.pem --chip-rate 1 -m sold --recipient order-4711";
    folder.done(alone);
    assert!(folder.read("copies/order-4711/model.ply") == folder.read("alone.ply"));
    let certificate = folder.text("copies/order-4711/model.ply.cert.json");
    assert_eq!(certificate, folder.text("alone.ply.cert.json"));

    let index = folder.text("copies/index.csv");
    let rows: Vec<&str> = index.lines().collect();
    assert_eq!(rows[0], "recipient,copy,certificate");
    assert!(
        rows[1].starts_with("\"Museum, Berlin\",museum-berlin-"),
        "{index}"
    );
    assert_eq!(
        rows[2],
        "order-4711,order-4711/model.ply,order-4711/model.ply.cert.json"
    );
    let verdict = folder.done(
        "verify copies/order-4711/model.ply --original model.ply --certificate copies/order-4711/model.ply.cert.json --json",
    );
    assert_eq!(verdict.json()["recipient"], "order-4711");
}

#[test]
fn a_run_goes_on_where_another_stopped_and_a_list_may_grow() {
    let folder = folder();
    assert_eq!(made(&folder, COPIES), (3, 0));
    let whole = files(&folder, "copies");
    let museum = named(&whole, "model.ply")[0].clone();
    // As a run leaves it that was killed between the two files, before the first, or after somebody took the mesh away.
    fs::remove_file(folder.path("copies/order-4711/model.ply.cert.json")).unwrap();
    let old = fs::File::options()
        .write(true)
        .open(folder.path("copies/order-4711/model.ply"))
        .unwrap();
    old.set_modified(SystemTime::UNIX_EPOCH).unwrap();
    fs::remove_dir_all(folder.path("copies").join(museum.parent().unwrap())).unwrap();
    let last = folder.path("copies").join(named(&whole, "model.ply")[2]);
    fs::remove_file(&last).unwrap();
    fs::remove_file(folder.path("copies/index.csv")).unwrap();
    assert_eq!(made(&folder, COPIES), (3, 0));
    assert!(files(&folder, "copies") == whole);
    for told in ["copies/order-4711/model.ply", "copies/order-4711"] {
        assert!(
            !cfg!(unix) || modified(folder.path(told)) == modified(folder.path("model.ply")),
            "{told} tells when it was made"
        );
    }

    assert_eq!(made(&folder, COPIES), (0, 3));
    // A stamp, or whatever else a certificate has besides, stays; so do copies whose rows are elsewhere now.
    folder.write("list.csv", "注文 4712\nAnna\norder-4711\n\"Museum, Berlin\"\n");
    let run = folder.done(COPIES);
    assert!(
        run.out
            .contains("\nMade 1 copy of model.ply; 3 of 4 were there\n"),
        "{}",
        run.out
    );
    let grown = files(&folder, "copies");
    assert_eq!(grown.len(), 9);
    let is_same = |(name, bytes): (&PathBuf, &Vec<u8>)| name.ends_with("index.csv") || grown[name] == *bytes;
    assert!(whole.iter().all(is_same));
    // Who is on another list stays in the index.
    folder.write("list.csv", "Bert\n");
    folder.done(COPIES);
    let index = folder.text("copies/index.csv");
    let names: Vec<&str> = index.lines().map(|row| row.split(',').next().unwrap()).collect();
    assert_eq!(
        names,
        ["recipient", "注文 4712", "Anna", "order-4711", "\"Museum", "Bert"]
    );
}

#[test]
fn what_is_another_in_the_place_of_a_copy_is_refused_before_one_is_written() {
    let folder = folder();
    fs::create_dir_all(folder.path("copies/order-4711")).unwrap();
    let place = |name: &str| format!("copies/order-4711/model.ply{name}");
    let table: [(&str, &str, &[&str]); 4] = [
        (
            "signed.ply.cert.json",
            ".cert.json",
            &["another recipient", "order-4711", "--force"],
        ),
        ("model.ply", ".cert.json", &["model.ply.cert.json", "--force"]),
        ("signed.ply", "", &["order-4711/model.ply", "--force"]),
        (
            "certificate of another message",
            ".cert.json",
            &["another message", "--force"],
        ),
    ];
    for (source, suffix, words) in table {
        match source.contains(' ') {
            false => folder.write(place(suffix), folder.read(source)),
            true => {
                folder.done(
                    "embed model.ply -o o.ply -k owner.pem --chip-rate 1 -m given --recipient order-4711",
                );
                folder.write(place(""), folder.read("o.ply"));
                folder.write(place(suffix), folder.read("o.ply.cert.json"));
            }
        }
        let before = files(&folder, "copies");
        folder.refused(COPIES, words);
        assert!(files(&folder, "copies") == before, "{source}");
        for name in before.keys().filter(|_| !source.contains(' ')) {
            fs::remove_file(folder.path("copies").join(name)).unwrap();
        }
    }
    folder.write("copies/index.csv", "my,own,list\n");
    folder.refused(COPIES, &["copies/index.csv: is no list of copies", "--force"]);
    assert_eq!(made(&folder, &format!("{COPIES} --force")), (3, 0));
    assert_eq!(made(&folder, &format!("{COPIES} --force")), (0, 3));
    // What is not its copy has its name, and nobody looks at it before it is asked for.
    folder.write(place(""), folder.read("model.ply"));
    assert_eq!(made(&folder, COPIES), (0, 3));
    assert_eq!(made(&folder, &format!("{COPIES} --force")), (1, 2));
    folder.done(&format!(
        "verify {} --original model.ply --certificate {}",
        place(""),
        place(".cert.json")
    ));
}

#[test]
fn lists_and_options_that_do_not_fit_are_refused_before_anything_is_done() {
    let folder = folder();
    folder.write("twice.csv", "a\nb\n a\n");
    folder.write("empty.csv", "recipient\n");
    folder.write("latin.csv", b"M\xfcller\n");
    fs::create_dir(folder.path("models")).unwrap();
    let line = |list: &str, model: &str, rest: &str| {
        format!("embed {model} --recipients {list} -o copies -k owner.pem {rest}")
    };
    let table: [(String, &[&str]); 9] = [
        (
            line("twice.csv", "model.ply", ""),
            &["twice.csv, line 3: a stands in line 1 already"],
        ),
        (
            line("empty.csv", "model.ply", ""),
            &["empty.csv: names no recipient"],
        ),
        (
            line("latin.csv", "model.ply", ""),
            &["latin.csv: is not text (byte 1)", "UTF-8"],
        ),
        (
            line("missing.csv", "model.ply", ""),
            &["missing.csv: can't be read"],
        ),
        (
            line("owner.pem", "model.ply", ""),
            &["owner.pem: is a key, not a list of recipients"],
        ),
        (
            line("list.csv", "model.ply signed.ply", ""),
            &["--recipients makes copies of one model"],
        ),
        (
            line("list.csv", "models", ""),
            &["--recipients makes copies of one model"],
        ),
        (
            line("list.csv", "model.ply", "--recipient me"),
            &["--recipients", "--recipient <TEXT>"],
        ),
        (
            line("list.csv", "model.ply", "--certificate c.json"),
            &["--certificate <FILE>"],
        ),
    ];
    for (line, words) in table {
        folder.refused(&line, words);
        assert!(!folder.path("copies").exists(), "{line}");
    }
    folder.refused(
        "embed model.ply --recipients list.csv -o owner.pub.pem -k owner.pem",
        &["owner.pub.pem: is a file", "name of one"],
    );
}

#[test]
fn what_a_model_refers_to_lies_beside_every_copy() {
    let folder = folder();
    folder.write_gltf("scene/a.gltf", &model(), "a.bin", b"\x89PNG a picture");
    folder.done("embed scene/a.gltf --recipients list.csv -o copies -k owner.pem --chip-rate 1");
    let copies = files(&folder, "copies");
    let buffers = named(&copies, "a.bin");
    assert_eq!((buffers.len(), copies.len()), (3, 13));
    assert!(copies[buffers[0]] != copies[buffers[1]]);
    for name in named(&copies, "skin.png").into_iter().chain(buffers) {
        assert_eq!(
            modified(folder.path("copies").join(name)),
            modified(folder.path("scene/a.gltf"))
        );
    }
    folder.done(
        "verify copies/order-4711/a.gltf --original scene/a.gltf --certificate copies/order-4711/a.gltf.cert.json",
    );
    // Into the folder where the model lies: its buffer is in none of the copies' folders.
    folder.done("embed scene/a.gltf --recipients list.csv -o scene -k owner.pem --chip-rate 1");
    // But the copy of one is not written over it.
    fs::rename(folder.path("scene"), folder.path("order-4711")).unwrap();
    folder.refused(
        "embed order-4711/a.gltf --recipients list.csv -o . -k owner.pem --chip-rate 1 --force",
        &["order-4711/a.gltf: is the model"],
    );
}

#[test]
fn files_too_coarse_for_the_standard_mark_get_a_strong_one_all_alike() {
    let folder = folder();
    // Far from the origin, single precision has few digits left.
    let coarse = shapes::translated(&shapes::bumpy_sphere(4, 3), [6e4; 3]);
    folder.write_mesh("model.ply", &coarse, Precision::Single);
    folder.write("list.csv", "a\nb\nc\n");
    let run = folder.done(COPIES);
    assert!(
        run.out.contains("strong, since the file's precision is coarse"),
        "{}",
        run.out
    );
    let alphas: Vec<String> = ["a", "b", "c"].map(|name| alphas(&folder, name)).to_vec();
    assert!(alphas[0] == alphas[1] && alphas[1] == alphas[2]);
    assert_eq!(made(&folder, COPIES), (0, 3));
}

fn alphas(folder: &Folder, name: &str) -> String {
    let text = folder.text(&format!("copies/{name}/model.ply.cert.json"));
    let certificate: serde_json::Value = serde_json::from_str(&text).unwrap();
    let patches = certificate["mark"]["patches"].as_array().unwrap();
    patches
        .iter()
        .map(|patch| patch["alpha"].to_string() + " ")
        .collect()
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_whole_copies_and_the_next_run_makes_the_others() {
    use std::{
        process::{Command, Stdio},
        thread,
        time::Duration,
    };
    let folder = folder();
    let list: String = (0..400).map(|i| format!("buyer-{i}\n")).collect();
    folder.write("list.csv", list);
    let mut command = folder.command(COPIES.split_whitespace());
    let mut child = command
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while !folder.path("copies/buyer-0/model.ply.cert.json").exists() {
        assert!(child.try_wait().unwrap().is_none());
        thread::sleep(Duration::from_millis(2));
    }
    let sent = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(sent.unwrap().success());
    let status = child.wait().unwrap();
    let stopped = files(&folder, "copies");
    let certificates = named(&stopped, "model.ply.cert.json").len() as u64;
    if status.code() == Some(130) {
        assert!(!folder.path("copies/index.csv").exists());
    }
    assert!(named(&stopped, "model.ply").len() as u64 >= certificates && certificates > 0);
    assert_eq!(made(&folder, COPIES), (400 - certificates, certificates));
    let after = files(&folder, "copies");
    assert!(stopped.iter().all(|(name, bytes)| after[name] == *bytes));
    assert_eq!(after.len(), 801);
    assert!(
        after
            .keys()
            .all(|name| !name.to_string_lossy().contains(".sigmark-"))
    );
}

#[test]
fn help_says_what_to_send_and_what_to_keep() {
    let Run { out, .. } = finish(Folder::empty().command(["embed", "--help"]));
    assert!(
        out.contains("--recipients <CSV>") && out.contains("keep certificates and index.csv"),
        "{out}"
    );
}
