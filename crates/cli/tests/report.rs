//! The page that `verify --report` writes.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use std::process::Command;

use crate::common::{Folder, Run, finish, model};
use mesh::{Similarity, shapes};
use mesh_io::{Asset, Precision};
use sha2::{Digest, Sha256};

const CLAIM: &str = "--original model.ply --certificate signed.ply.cert.json --public-key owner.pub.pem";

/// The page of a run that answers with an exit code.
fn page(folder: &Folder, suspects: &str, code: i32) -> String {
    let run = folder.run(&format!("verify {suspects} {CLAIM} --report report.html --force"));
    assert_eq!(run.code, Some(code), "{run:?}");
    assert!(run.out.ends_with("The report is in report.html\n"), "{}", run.out);
    let html = folder.text("report.html");
    is_harmless(&html);
    html
}

/// Nothing runs, nothing is loaded, and every element that is opened is closed.
fn is_harmless(html: &str) {
    for word in [
        "<script",
        "javascript:",
        "http:",
        "https:",
        "@import",
        "<link",
        "<iframe",
        " onerror",
        " onload",
    ] {
        assert!(!html.to_lowercase().contains(word), "{word}");
    }
    assert!(html.contains("default-src 'none'"));
    for source in html.split("src=").skip(1) {
        assert!(
            source.starts_with("\"data:image/png;base64,") || source.starts_with("'none'"),
            "{}",
            &source[..60]
        );
    }
    let mut open = Vec::new();
    for tag in html.split('<').skip(1) {
        let (tag, _) = tag.split_once('>').expect("a whole tag");
        let name = tag.trim_start_matches('/').split(' ').next().unwrap();
        match (tag.starts_with('/'), name) {
            (_, "!DOCTYPE" | "meta" | "img" | "wbr" | "br") => {}
            (true, name) => assert_eq!(open.pop(), Some(name)),
            (false, name) => open.push(name),
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

/// The text alone, for what is said and not how it is set.
fn text(html: &str) -> String {
    let body = &html[html.find("<body>").unwrap()..];
    let texts = body
        .split('<')
        .map(|piece| piece.split_once('>').map_or("", |(_, text)| text));
    texts.collect()
}

fn moved(folder: &Folder) {
    let signed = Asset::open(folder.path("signed.ply")).unwrap();
    let turn = Similarity {
        scale: 25.4,
        rotation: [[0.0, 0.0, 1.0], [0.6, 0.8, 0.0], [-0.8, 0.6, 0.0]],
        translation: [3.0, -70.0, 1e3],
    };
    let moved = shapes::mirrored(&shapes::moved(signed.mesh(), &turn));
    folder.write_mesh("found.obj.gz", &moved, Precision::Double);
}

#[test]
fn a_report_says_what_was_found_of_what_and_how_to_repeat_it() {
    let folder = Folder::with_signed_model();
    moved(&folder);
    let html = page(&folder, "found.obj.gz", 0);
    let text = text(&html);
    for words in [
        "Verified",
        "found.obj.gz",
        "all 512 bits",
        "512 of 512 agree",
        "order-4711",
        "p is an upper bound",
        "mirrored at the zero point",
        "scaled by 0.0393701",
        "ecdsa-p256-sha256",
        "sigmark verify found.obj.gz",
        "--public-key owner.pub.pem",
        concat!("made by sigmark ", env!("CARGO_PKG_VERSION")),
        "no time stamp says since when",
        " UTC",
    ] {
        assert!(text.contains(words), "no {words:?} in {text}");
    }
    let (owner, stranger) = (
        text.find("\u{2264}\u{a0}10").unwrap(),
        text.rfind("\u{2264}\u{a0}10").unwrap(),
    );
    assert!(owner < stranger, "both probabilities");
    // Three pictures from two sides, and the scale.
    assert_eq!(html.matches("data:image/png").count(), 7);
    let fingerprint = folder.done(&format!("verify signed.ply {CLAIM} --json")).json()["public_key"].clone();
    assert!(text.contains(fingerprint.as_str().unwrap()));
}

/// What the page tells to type, typed.
#[cfg(target_os = "linux")]
#[test]
fn the_commands_of_a_report_repeat_it() {
    let folder = Folder::with_signed_model();
    std::fs::copy(folder.path("signed.ply"), folder.path("it's $HOME & co.ply")).unwrap();
    let mut arguments = vec![
        "verify",
        "it's $HOME & co.ply",
        "--report",
        "report.html",
        "--dispute",
    ];
    arguments.extend(CLAIM.split(' '));
    assert_eq!(finish(folder.command(arguments)).code, Some(0));
    let html = folder.text("report.html");
    let plain = |text: &str| {
        let text = text
            .replace("&lt;", "<")
            .replace("&gt;", ">")
            .replace("&quot;", "\"");
        text.replace("&#39;", "'").replace("&amp;", "&")
    };
    let commands: Vec<String> = html
        .split("<pre>")
        .skip(1)
        .map(|piece| plain(piece.split("</pre>").next().unwrap()))
        .filter(|text| text.starts_with("sigmark verify") || text.starts_with("sha256sum"))
        .collect();
    assert_eq!(commands.len(), 2);
    for command in &commands {
        let line = command.replacen("sigmark", env!("CARGO_BIN_EXE_sigmark"), 1);
        let mut shell = Command::new("sh");
        shell.args(["-c", &line]).current_dir(folder.path(""));
        let run: Run = finish(shell);
        assert_eq!(run.code, Some(0), "{command}: {run:?}");
        assert!(
            run.out.contains(": OK") || run.out.starts_with("VERIFIED"),
            "{command}: {run:?}"
        );
    }
}

#[test]
fn what_is_not_found_makes_an_honest_page() {
    let folder = Folder::with_signed_model();
    let unmarked = text(&page(&folder, "model.ply", 1));
    assert!(
        unmarked.contains("Not found") && unmarked.contains("nothing of its mark was found"),
        "{unmarked}"
    );
    folder.write_mesh("torus.stl", &shapes::bumpy_torus(20, 20, 1), Precision::Single);
    let html = page(&folder, "torus.stl", 1);
    let other = text(&html);
    assert!(
        other.contains("is not the original") && other.contains("% are needed"),
        "{other}"
    );
    assert!(other.contains("no position was found"), "{other}");
    assert_eq!(html.matches("data:image/png").count(), 4);
    // A mark copied onto another shape with the same triangles.
    let squeezed: Vec<[f64; 3]> = Asset::open(folder.path("signed.ply"))
        .unwrap()
        .mesh()
        .positions()
        .iter()
        .map(|&[x, y, z]| [x, 0.1 * y, z * (1.0 + 0.5 * x)])
        .collect();
    folder.write_mesh(
        "squeezed.ply",
        &model().with_positions(squeezed).unwrap(),
        Precision::Double,
    );
    let shape = text(&page(&folder, "squeezed.ply", 1));
    assert!(
        shape.contains("another shape") && shape.contains("counts for nothing"),
        "{shape}"
    );
}

#[test]
fn a_worn_mark_is_detected_and_called_evidence_only_if_it_is() {
    let folder = Folder::with_signed_model();
    let signed = Asset::open(folder.path("signed.ply")).unwrap();
    folder.write_mesh(
        "worn.ply",
        &shapes::jittered(signed.mesh(), 0.03, 9),
        Precision::Double,
    );
    let html = text(&page(&folder, "worn.ply", 0));
    assert!(
        html.contains("Detected") && html.contains("of its 512 bits were read back rightly: too few"),
        "{html}"
    );
}

#[test]
fn no_text_from_outside_becomes_markup() {
    let folder = Folder::with_signed_model();
    let evil = "</td><script>alert(1)</script><img src=x onerror=alert(2)>\u{202e}&amp;\"'";
    let arguments = [
        "embed",
        "model.ply",
        "-o",
        "s.ply",
        "-k",
        "owner.pem",
        "--chip-rate",
        "1",
        "-m",
        evil,
        "--recipient",
        evil,
    ];
    assert_eq!(finish(folder.command(arguments)).code, Some(0));
    let name = "<b onload=alert(3)>&'\" s.ply";
    std::fs::copy(folder.path("s.ply"), folder.path(name)).unwrap();
    let arguments = [
        "verify",
        name,
        "<i>missing.ply",
        "--certificate",
        "s.ply.cert.json",
        "--report",
        "report.html",
    ];
    assert_eq!(finish(folder.command(arguments)).code, Some(2));
    let html = folder.text("report.html");
    assert!(
        !html.contains("<script")
            && !html.contains("<img src=x")
            && !html.contains("<b onload")
            && !html.contains("<i>")
    );
    assert!(!html.contains('\u{202e}'));
    assert!(html.contains("&lt;/td&gt;&lt;script&gt;alert(1)&lt;/script&gt;"));
    assert!(html.contains("&lt;b onload=alert(3)&gt;&amp;&#39;&quot; s.ply"));
    assert!(html.contains("&lt;i&gt;missing.ply"));
    is_harmless(
        &html
            .replace("onload=alert(3)", "")
            .replace("src=x", "")
            .replace("onerror=alert(2)", ""),
    );
}

#[test]
fn files_beside_a_model_stand_in_the_table_of_what_was_read() {
    let folder = Folder::with_signed_model();
    folder.write_gltf("in/model.gltf", &model(), "model.bin", b"\x89PNG a picture");
    std::fs::create_dir(folder.path("out")).unwrap();
    folder.done("embed in/model.gltf -o out/signed.gltf -k owner.pem --chip-rate 1");
    let line = "verify out/signed.gltf --original in/model.gltf --certificate out/signed.gltf.cert.json";
    folder.done(&format!("{line} --report report.html"));
    let html = folder.text("report.html");
    is_harmless(&html);
    let text = text(&html);
    let (table, commands) = text.split_once("How to repeat this").unwrap();
    assert_eq!(table.matches("Read with it").count(), 4, "two files of each");
    for name in ["in/model.bin", "in/skin.png", "out/model.bin", "out/skin.png"] {
        let digest: String = Sha256::digest(folder.read(name))
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        let row = &table[table.find(&format!("Read with it{name}")).expect(name)..];
        let size = format!("{} bytes", folder.read(name).len());
        let row = &row[..row.find(&digest).expect(name)];
        assert!(row.replace('\u{202f}', "").contains(&size), "{name}: {row}");
        assert!(row.matches("Read with it").count() == 1, "{name}: {row}");
        assert!(commands.contains(&format!("{digest}  {name}")), "{name}");
    }
    for name in ["in/skin.png", "out/model.bin"] {
        folder.refused(
            &format!("{line} --report {name} --force"),
            &[name, "is a part of"],
        );
    }
}

#[test]
fn several_suspects_share_a_page_with_a_section_each() {
    let folder = Folder::with_signed_model();
    let run = folder.run(&format!(
        "verify signed.ply missing.ply model.ply {CLAIM} --report report.html"
    ));
    assert_eq!(run.code, Some(2));
    assert_eq!(run.err.lines().count(), 1, "{}", run.err);
    assert!(
        run.out
            .ends_with("Found in 1 of 3; 1 could not be judged\nThe report is in report.html\n"),
        "{}",
        run.out
    );
    let html = folder.text("report.html");
    is_harmless(&html);
    assert_eq!(html.matches("<section class=\"suspect\">").count(), 3);
    let text = text(&html);
    for words in [
        "Verified",
        "Not judged",
        "Not found",
        "Which of these 3D models carry",
    ] {
        assert!(text.contains(words), "{text}");
    }
}

#[test]
fn a_report_replaces_nothing_unless_told_and_leaves_the_json_as_it_is() {
    let folder = Folder::with_signed_model();
    let verify = format!("verify signed.ply {CLAIM}");
    let json = folder
        .done(&format!("{verify} --json --report report.html"))
        .json();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let metadata = std::fs::metadata(folder.path("report.html")).unwrap();
        assert_eq!(metadata.permissions().mode() & 0o777, 0o600);
    }
    let without = folder.done(&format!("{verify} --json")).json();
    let keys = |value: &serde_json::Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    assert_eq!(keys(&json), keys(&without));
    folder.refused(
        &format!("{verify} --report report.html"),
        &["report.html", "exists already", "--force"],
    );
    for (path, words) in [
        ("signed.ply", "is a suspect"),
        ("model.ply", "is the original"),
        ("signed.ply.cert.json", "is the certificate"),
        ("owner.pub.pem", "is the public key"),
        ("nowhere/report.html", "make it first"),
    ] {
        folder.refused(&format!("{verify} --report {path} --force"), &[path, words]);
    }
    // The original that is found beside the certificate is an original, too.
    folder.refused(
        "verify signed.ply --certificate signed.ply.cert.json --report model.ply --force",
        &["model.ply: is the original"],
    );
    folder.refused(&format!("{verify} --force"), &["--report <FILE>"]);
    // Without an answer there is no page.
    folder.refused(
        &format!("verify missing.ply {CLAIM} --report other.html"),
        &["missing.ply"],
    );
}
