//! Ctrl-C.

#![cfg(unix)]
#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use std::{
    io::{BufRead, BufReader, Read},
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use crate::common::Folder;
use mesh::shapes;
use mesh_io::Precision;

/// A model whose mark takes many seconds to write.
fn folder() -> Folder {
    let folder = Folder::empty();
    folder.write_mesh("large.ply", &shapes::bumpy_sphere(7, 1), Precision::Double);
    folder.done("keygen -o owner.pem");
    folder
}

fn started(folder: &Folder, line: &str) -> Child {
    let mut command = folder.command(line.split_whitespace());
    command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn interrupt(child: &Child) {
    let sent = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(sent.success());
}

/// One line, the right code, no file.
fn ended_in_order(folder: &Folder, mut child: Child, files: &[&str]) {
    let asked = Instant::now();
    let code = child.wait().unwrap().code();
    assert!(asked.elapsed() < Duration::from_secs(5), "{:?}", asked.elapsed());
    let mut err = String::new();
    child.stderr.take().unwrap().read_to_string(&mut err).unwrap();
    assert_eq!(
        (code, err.as_str()),
        (Some(130), "sigmark: interrupted; no file is half-written\n")
    );
    let names: Vec<String> = folder
        .contents()
        .into_keys()
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    assert_eq!(names, files);
}

#[test]
fn a_signature_that_is_interrupted_leaves_nothing() {
    let folder = folder();
    let mut child = started(&folder, "embed large.ply -o signed.ply -k owner.pem --threads 1");
    // It says what it is about to do when the long part begins.
    let mut out = BufReader::new(child.stdout.take().unwrap());
    out.read_line(&mut String::new()).unwrap();
    interrupt(&child);
    ended_in_order(&folder, child, &["large.ply", "owner.pem", "owner.pub.pem"]);
}

#[test]
fn a_batch_that_is_interrupted_ends_as_a_whole() {
    let folder = folder();
    folder.write_mesh("small.ply", &crate::common::model(), Precision::Double);
    let mut child = started(
        &folder,
        "embed small.ply large.ply -o signed -k owner.pem --chip-rate 1 --threads 1 --json",
    );
    let mut out = BufReader::new(child.stdout.take().unwrap());
    out.read_line(&mut String::new()).unwrap();
    thread::sleep(Duration::from_millis(200));
    interrupt(&child);
    ended_in_order(
        &folder,
        child,
        &["large.ply", "owner.pem", "owner.pub.pem", "small.ply"],
    );
    // What was signed before stays, whole.
    folder.done("verify signed/small.ply --original small.ply --certificate signed/small.ply.cert.json");
    assert_eq!(std::fs::read_dir(folder.path("signed")).unwrap().count(), 2);
}

#[test]
fn a_verification_that_is_interrupted_answers_nothing() {
    let folder = folder();
    folder.write_mesh("small.ply", &crate::common::model(), Precision::Double);
    folder.done("embed small.ply -o s.ply -k owner.pem --chip-rate 1");
    let before: Vec<String> = folder
        .contents()
        .into_keys()
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    let child = started(
        &folder,
        "verify large.ply --original small.ply --certificate s.ply.cert.json --threads 1 --report r.html",
    );
    thread::sleep(Duration::from_millis(400));
    interrupt(&child);
    ended_in_order(
        &folder,
        child,
        &before.iter().map(String::as_str).collect::<Vec<_>>(),
    );
}
