//! Claims: what the owner needs, what a third party is asked for, and claims against claims.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use crate::common::Folder;
use mesh::shapes;
use mesh_io::Precision;

#[test]
fn the_owner_needs_no_more_than_the_certificate() {
    let folder = Folder::with_signed_model();
    let verify = "verify signed.ply --certificate signed.ply.cert.json";
    let report = folder.done(&format!("{verify} --json")).json();
    assert_eq!(
        (&report["outcome"], &report["own_key"]),
        (&"verified".into(), &true.into())
    );
    assert!(report["original"].as_str().unwrap().ends_with("model.ply"));
    assert_eq!(
        (&report["evidence"], &report["signed"]),
        (&true.into(), &"statement".into())
    );
    let text = folder.done(verify).out;
    for words in [
        "the certificate's own",
        "ecdsa-p256-sha256",
        "over key, original, mark and message",
        "evidence",
    ] {
        assert!(text.contains(words), "{text}");
    }

    // By its digest, where it has another name and another mesh has its own.
    std::fs::rename(folder.path("model.ply"), folder.path("renamed.ply")).unwrap();
    folder.write_mesh("model.ply", &shapes::icosphere(2), Precision::Double);
    folder.write("damaged.ply", "ply");
    let report = folder.done(&format!("{verify} --json")).json();
    assert!(report["original"].as_str().unwrap().ends_with("renamed.ply"));

    std::fs::remove_file(folder.path("renamed.ply")).unwrap();
    folder.refused(
        verify,
        &[
            "signed.ply.cert.json",
            "its original (model.ply)",
            "not beside it",
            "--original",
        ],
    );
}

#[test]
fn a_third_party_is_asked_for_the_key_and_the_original() {
    let folder = Folder::with_signed_model();
    let verify = "verify signed.ply --certificate signed.ply.cert.json --dispute";
    folder.refused(verify, &["--original <FILE>", "--public-key <PEM>"]);
    let verify = format!("{verify} --original model.ply --public-key owner.pub.pem");
    let report = folder.done(&format!("{verify} --json")).json();
    assert_eq!(report["own_key"], false);
    assert!(report["p_dispute"].as_f64().unwrap() < 1e-12);
    folder.refused(
        &verify.replace("owner.pub", "other.pub"),
        &["other.pub.pem", "issued by the key"],
    );
}

#[cfg(unix)]
#[test]
fn a_certificate_is_its_owners_alone() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::with_signed_model();
    folder.done("embed model.ply -o s.ply --key owner.pem --chip-rate 1 --recipient buyer-12");
    let mode = std::fs::metadata(folder.path("s.ply.cert.json"))
        .unwrap()
        .permissions()
        .mode();
    assert_eq!(mode & 0o777, 0o600);
    let report = folder
        .done("verify s.ply --certificate s.ply.cert.json --json")
        .json();
    assert_eq!(report["recipient"], "buyer-12");
}

/// The owner's claim, and that of somebody who signed the owner's published model again.
fn dispute() -> Folder {
    let folder = Folder::with_signed_model();
    folder.done("embed signed.ply -o stolen.ply -k other.pem --chip-rate 1");
    let claim = |original: &str, signed: &str, key: &str| {
        format!(
            r#"{{"original": "{original}", "certificate": "{signed}.cert.json", "public_key": "{key}.pub.pem"}}"#
        )
    };
    folder.write("mine.claim.json", claim("model.ply", "signed.ply", "owner"));
    folder.write("theirs.claim.json", claim("signed.ply", "stolen.ply", "other"));
    folder.write("copy.claim.json", claim("model.ply", "theirs.ply", "other"));
    folder
}

#[test]
fn who_signed_a_signed_model_came_second() {
    let folder = dispute();
    let report = folder
        .done("dispute mine.claim.json theirs.claim.json --suspect stolen.ply --json")
        .json();
    assert_eq!(report["outcome"], "first");
    assert_eq!(report["first_in_second"]["evidence"], true);
    assert_eq!(report["second_in_first"]["evidence"], false);
    assert_eq!(report["second_in_suspect"]["outcome"], "verified");
    let text = folder.done("dispute theirs.claim.json mine.claim.json").out;
    assert!(
        text.starts_with("SECOND: the claim of mine.claim.json came first"),
        "{text}"
    );
}

#[test]
fn two_claims_on_one_unmarked_original_are_undecided() {
    let folder = dispute();
    let run = folder.run("dispute mine.claim.json copy.claim.json --json");
    assert_eq!(run.code, Some(1));
    assert_eq!(run.json()["outcome"], "undecided");
    let text = folder.run("dispute mine.claim.json copy.claim.json").out;
    assert!(
        text.contains("UNDECIDED") && text.contains("time stamps"),
        "{text}"
    );
}

#[test]
fn claims_on_different_models_do_not_contradict_each_other() {
    let folder = dispute();
    folder.write_mesh("torus.ply", &shapes::bumpy_torus(40, 24, 3), Precision::Double);
    folder.done("embed torus.ply -o t.ply -k other.pem --chip-rate 1");
    folder.write(
        "torus.claim.json",
        r#"{"original": "torus.ply", "certificate": "t.ply.cert.json", "public_key": "other.pub.pem"}"#,
    );
    let run = folder.run("dispute mine.claim.json torus.claim.json");
    assert_eq!(run.code, Some(1), "{}", run.err);
    assert!(run.out.contains("different shapes"), "{}", run.out);
}

#[test]
fn claims_that_are_none_are_refused() {
    let folder = dispute();
    folder.write("short.json", "{\"original\": \"model.ply\"}");
    folder.write(
        "elsewhere.json",
        folder.text("mine.claim.json").replace("model.ply", "missing.ply"),
    );
    folder.write(
        "mixed.json",
        folder.text("mine.claim.json").replace("owner.pub", "other.pub"),
    );
    for (name, words) in [
        ("short.json", ["is no claim", "certificate"]),
        ("elsewhere.json", ["missing.ply", "cannot be read"]),
        ("mixed.json", ["mixed.json", "issued by the key"]),
        ("model.ply", ["model.ply", "claim"]),
    ] {
        folder.refused(&format!("dispute {name} theirs.claim.json"), &words);
    }
}

/// The original's numbers with fewer digits, and its vertices the other way round.
fn written_anew(folder: &Folder, name: &str) -> String {
    let asset = mesh_io::Asset::open(folder.path(name)).unwrap();
    let mesh = asset.mesh();
    let last = mesh.vertex_count();
    let mut text = String::new();
    for [x, y, z] in mesh.positions().iter().rev() {
        text += &format!("v {:.6} {:.6} {:.6}\n", 1e3 * x, 1e3 * z, -1e3 * y);
    }
    for triangle in mesh.triangles() {
        let [a, b, c] = triangle.map(|v| last - v as usize);
        text += &format!("f {b} {c} {a}\n");
    }
    text
}

#[test]
fn an_original_that_was_exported_again_informs_its_owner_and_is_no_evidence() {
    let folder = Folder::with_signed_model();
    folder.write("again.obj", written_anew(&folder, "model.ply"));
    let text = folder
        .done("verify signed.ply --certificate signed.ply.cert.json --original again.obj")
        .out;
    for words in [
        "VERIFIED, for the owner alone",
        "not the very file",
        "a claim needs that file",
    ] {
        assert!(text.contains(words), "{text}");
    }
    // Beside the certificate it is found, once the very file is not there.
    std::fs::remove_file(folder.path("model.ply")).unwrap();
    let report = folder
        .done("verify signed.ply --certificate signed.ply.cert.json --json")
        .json();
    assert!(report["original"].as_str().unwrap().ends_with("again.obj"));
    assert_eq!(report["original_is"], "geometry");
    assert_eq!(
        (&report["evidence"], &report["p_dispute"]),
        (&false.into(), &1.0.into())
    );
    let asked = folder.run(
        "verify signed.ply --certificate signed.ply.cert.json --original again.obj --public-key owner.pub.pem --dispute --report r.html",
    );
    assert_eq!(asked.code, Some(1));
    let page = folder.text("r.html");
    assert!(page.contains("for the owner alone") && page.contains("does NOT have it"));
    // The signed copy is no original.
    folder.refused(
        "verify signed.ply --certificate signed.ply.cert.json --original signed.ply",
        &["not the original"],
    );
}

/// A tag is read where more bits of its codeword are lost than a stranger's claim may have wrong.
#[test]
fn a_tag_that_was_read_without_the_evidence_is_no_answer_to_who_asks_for_it() {
    let folder = Folder::with_signed_model();
    folder.done("embed model.ply -o tagged.ply -k owner.pem --payload tag --chip-rate 2");
    let tagged = mesh_io::Asset::open(folder.path("tagged.ply")).unwrap();
    std::fs::create_dir(folder.path("worn")).unwrap();
    // The key is another each time, and so are the bits: of many that are about as worn, one is as it should be.
    for seed in 0..48 {
        let worn = shapes::jittered(tagged.mesh(), 0.025 + 1e-4 * seed as f64, seed);
        folder.write_mesh(&format!("worn/{seed}.ply"), &worn, Precision::Double);
    }
    let claim = "--certificate tagged.ply.cert.json --original model.ply --public-key owner.pub.pem";
    let reports = folder.done(&format!("verify worn {claim} --json")).out;
    let reports = reports
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    let is_so = |report: &serde_json::Value| report["outcome"] == "verified" && report["evidence"] == false;
    let report = reports.into_iter().find(is_so).unwrap();
    let suspect = report["suspect"].as_str().unwrap();

    let owner = folder.done(&format!("verify {suspect} {claim}")).out;
    assert!(owner.starts_with(&format!("VERIFIED: {suspect}")), "{owner}");
    let run = folder.run(&format!(
        "verify {suspect} {claim} --dispute --report report.html"
    ));
    assert_eq!(run.code, Some(1));
    assert!(
        run.out.starts_with(&format!("NO EVIDENCE: {suspect}")),
        "{}",
        run.out
    );
    let page = folder.text("report.html");
    assert!(
        page.contains("No evidence") && page.contains("and this was asked") && !page.contains(">Verified<"),
        "{page}"
    );
}
