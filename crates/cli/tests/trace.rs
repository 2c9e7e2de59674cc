//! Whose copy was it: copies for a list, a leak, and who is named.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use std::fs;

use crate::common::Folder;
use mesh::{TriMesh, shapes};
use mesh_io::{Asset, Precision};
use serde_json::Value;

const TRACE: &str = "--original model.ply --certificates copies --public-key owner.pub.pem";

/// The model, the keys, and copies for twelve.
fn folder() -> Folder {
    let folder = Folder::with_signed_model();
    let list: String = (0..12).map(|i| format!("order-{i}\n")).collect();
    folder.write("list.csv", list);
    folder.done("embed model.ply --recipients list.csv -o copies -k owner.pem --chip-rate 1 -m sold");
    folder
}

fn copy(folder: &Folder, recipient: &str) -> TriMesh {
    let path = folder.path("copies").join(recipient).join("model.ply");
    Asset::open(path).unwrap().mesh().clone()
}

fn named(report: &Value) -> Vec<&str> {
    let accused = report["accused"].as_array().unwrap().iter();
    accused
        .map(|accused| accused["recipient"].as_str().unwrap())
        .collect()
}

#[test]
fn a_leaked_copy_is_named_and_said_with_its_certificate() {
    let folder = folder();
    let leak = shapes::scaled(&shapes::shuffled(&copy(&folder, "order-7"), 3), 12.0);
    folder.write_mesh("found.obj", &leak, Precision::Double);
    let run = folder.done(&format!("trace found.obj {TRACE} --report report.html"));
    assert!(
        run.out
            .starts_with("NAMED: found.obj was made of the copy for \u{201c}order-7\u{201d}\n"),
        "{}",
        run.out
    );
    assert!(
        run.out.contains("copies/order-7/model.ply.cert.json"),
        "{}",
        run.out
    );
    assert!(!run.out.contains("order-6"), "{}", run.out);
    let page = folder.text("report.html");
    assert!(page.contains("order-7") && page.contains("One copy named") && !page.contains("order-6"));
    for line in [
        "  copies/order-7/model.ply.cert.json\n",
        "  found.obj\n",
        "sigmark trace found.obj \\\n    --original model.ply \\\n    --certificates copies",
    ] {
        assert!(page.contains(line), "{line} is not in the page");
    }
    let report = folder.done(&format!("trace found.obj {TRACE} --json")).json();
    assert_eq!(named(&report), ["order-7"]);
    assert_eq!(
        (&report["candidates"], &report["own_key"]),
        (&12.into(), &false.into())
    );
    assert!(report["accused"][0]["p_value"].as_f64().unwrap() < 1e-20);
}

#[test]
fn two_who_mix_their_copies_are_both_named() {
    let folder = folder();
    let (a, b) = (copy(&folder, "order-2"), copy(&folder, "order-9"));
    let pairs = a.positions().iter().zip(b.positions());
    let mean = pairs.map(|(a, b)| std::array::from_fn(|axis| 0.5 * (a[axis] + b[axis])));
    let mixed = a.with_positions(mean.collect()).unwrap();
    folder.write_mesh("found.ply", &mixed, Precision::Double);
    let report = folder.done(&format!("trace found.ply {TRACE} --json")).json();
    let mut named = named(&report);
    named.sort_unstable();
    assert_eq!(named, ["order-2", "order-9"]);
    let run = folder.done(&format!("trace found.ply {TRACE}"));
    assert!(
        run.out
            .starts_with("NAMED: found.ply was made of 2 copies at least\n"),
        "{}",
        run.out
    );
}

#[test]
fn nobody_is_named_for_the_original_another_copy_or_another_shape() {
    let folder = folder();
    folder.write_mesh("torus.ply", &shapes::bumpy_torus(20, 20, 1), Precision::Double);
    for suspect in ["model.ply", "signed.ply", "torus.ply"] {
        let run = folder.run(&format!("trace {suspect} {TRACE}"));
        assert_eq!(run.code, Some(1), "{run:?}");
        assert!(run.out.starts_with("NOBODY NAMED: "), "{run:?}");
        assert!(!run.out.contains("order-"), "{run:?}");
    }
    let run = folder.run(&format!("trace model.ply torus.ply {TRACE}"));
    assert_eq!(run.code, Some(1));
    assert!(run.out.ends_with("Somebody named in 0 of 2\n"), "{run:?}");
}

/// Copies lie where other certificates do, too, some of them first.
#[test]
fn the_key_is_that_of_the_first_certificate_that_is_of_this_original_and_signed() {
    let folder = folder();
    folder.write_mesh("found.ply", &copy(&folder, "order-4"), Precision::Double);
    folder.write_mesh("torus.ply", &shapes::bumpy_torus(40, 24, 3), Precision::Double);
    folder.done("embed torus.ply -o copies/0.ply -k other.pem --chip-rate 1");
    let damaged = folder
        .text("theirs.ply.cert.json")
        .replace("order-4712", "order-4713");
    folder.write("copies/1.cert.json", damaged);
    folder.write("copies/2.cert.json", "{");
    let run = folder.run("trace found.ply --original model.ply --certificates copies --json");
    let report: Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!(
        (run.code, named(&report)),
        (Some(0), vec!["order-4"]),
        "{}",
        run.err
    );
    assert_eq!(
        (&report["candidates"], &report["passed_over"]),
        (&12.into(), &1.into())
    );
    assert_eq!(report["unreadable"].as_array().unwrap().len(), 2);
    assert!(run.err.contains("1.cert.json") && run.err.contains("2.cert.json"));
    assert_eq!(report["own_key"], true);
}

#[test]
fn where_two_keys_signed_copies_it_is_asked_which() {
    let folder = folder();
    folder.write_mesh("found.ply", &copy(&folder, "order-4"), Precision::Double);
    for name in ["copies/0.cert.json", "copies/z.cert.json"] {
        folder.write(name, folder.text("theirs.ply.cert.json"));
        let run = folder.run("trace found.ply --original model.ply --certificates copies");
        assert_eq!((run.code, run.out.as_str()), (Some(2), ""));
        for words in [name, "order-0", "two keys", "--public-key"] {
            assert!(run.err.contains(words), "{}", run.err);
        }
        let report = folder.done(&format!("trace found.ply {TRACE} --json")).json();
        assert_eq!(
            (named(&report), &report["passed_over"]),
            (vec!["order-4"], &1.into())
        );
        fs::remove_file(folder.path(name)).unwrap();
    }
}

#[test]
fn an_original_that_is_none_is_blamed_and_not_the_certificate() {
    let folder = folder();
    folder.refused(
        "trace model.ply --original signed.ply --certificates copies/order-3/model.ply.cert.json",
        &[
            "sigmark: signed.ply",
            "copies/order-3/model.ply.cert.json",
            "not the original",
        ],
    );
}

#[test]
fn marks_of_the_papers_profile_are_no_copies_that_can_be_told_apart() {
    let folder = folder();
    folder.done("keygen -o paper.pem --profile paper");
    folder.done("embed model.ply -o p.ply --key paper.pem --profile paper --chip-rate 2");
    let run = folder.run("trace p.ply --original model.ply --certificates p.ply.cert.json");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(
        run.err.contains("p.ply.cert.json") && run.err.contains("paper's profile"),
        "{}",
        run.err
    );
    // That is an option of another command.
    assert!(!run.err.contains("--profile"), "{}", run.err);
}

#[test]
fn what_can_t_be_asked_is_said_with_its_remedy() {
    let folder = folder();
    let copies = folder.path("copies");
    let refused = |line: &str, said: &[&str]| {
        let run = folder.run(line);
        assert_eq!(run.code, Some(2), "{line}: {run:?}");
        for word in said {
            assert!(run.err.contains(word), "{line}: {word} is not in {}", run.err);
        }
    };
    refused(
        "trace model.ply --original signed.ply --certificates copies",
        &["not the original"],
    );
    refused(
        "trace model.ply --original model.ply --certificates copies --public-key other.pub.pem",
        &["issued by the key"],
    );
    refused(
        "trace model.ply --original model.ply --certificates list.csv",
        &["certificate"],
    );
    fs::create_dir(folder.path("empty")).unwrap();
    refused(
        "trace model.ply --original model.ply --certificates empty",
        &["empty", "sigmark embed"],
    );
    refused(
        &format!("trace model.ply {TRACE} --report model.ply"),
        &["model.ply"],
    );
    let certificate = "copies/order-3/model.ply.cert.json";
    refused(
        &format!("trace model.ply {TRACE} --report {certificate} --force"),
        &["is a certificate"],
    );
    refused(
        &format!("trace model.ply {TRACE} --time-limit 0.000001"),
        &["--time-limit"],
    );
    // One that can't be read is said, and the others are asked for.
    fs::write(copies.join("order-3/model.ply.cert.json"), "{").unwrap();
    folder.write_mesh("found.ply", &copy(&folder, "order-4"), Precision::Double);
    let run = folder.run(&format!("trace found.ply {TRACE} --json"));
    let report: Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!((run.code, named(&report)), (Some(0), vec!["order-4"]));
    assert_eq!(report["candidates"], 11);
    assert_eq!(report["unreadable"].as_array().unwrap().len(), 1);
    assert!(run.err.contains("order-3"), "{}", run.err);
}
