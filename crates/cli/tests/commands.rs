//! What the commands do when all is well, and how they answer yes and no.

use std::{
    io::{Cursor, Read},
    process::Stdio,
};

use crate::common::{Folder, finish, model};
use mesh::{Similarity, TriMesh, shapes};
use mesh_io::{Asset, Precision};
use serde_json::Value;

const VERIFY: &str = "--original model.ply --certificate signed.ply.cert.json --public-key owner.pub.pem";

fn keys(object: &Value) -> Vec<&str> {
    object
        .as_object()
        .expect("an object")
        .keys()
        .map(String::as_str)
        .collect()
}

fn number(object: &Value, key: &str) -> f64 {
    object[key]
        .as_f64()
        .unwrap_or_else(|| panic!("{key} in {object}"))
}

#[test]
fn a_new_key_is_pem_with_its_public_half_beside_it_and_private_to_its_owner() {
    let folder = Folder::empty();
    for (profile, curve) in [("standard", "P-256"), ("paper", "B-163")] {
        let run = folder.done(&format!("keygen -o {profile}.pem --profile {profile} --json"));
        let report = run.json();
        assert_eq!(
            keys(&report),
            ["curve", "fingerprint", "private_key", "public_key"]
        );
        assert_eq!(report["curve"], curve);
        assert_eq!(report["public_key"], format!("{profile}.pub.pem"));
        assert!(
            folder
                .text(&format!("{profile}.pem"))
                .starts_with("-----BEGIN PRIVATE KEY-----\n")
        );
        assert!(
            folder
                .text(&format!("{profile}.pub.pem"))
                .starts_with("-----BEGIN PUBLIC KEY-----\n")
        );
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let metadata = std::fs::metadata(folder.path(format!("{profile}.pem"))).unwrap();
            assert_eq!(metadata.permissions().mode() & 0o777, 0o600);
        }
    }
    assert_eq!(folder.contents().len(), 4);
}

#[test]
fn two_keys_are_never_the_same_and_force_replaces_both_halves() {
    let folder = Folder::empty();
    folder.done("keygen -o owner.pem");
    let first = folder.contents();
    folder.done("keygen -o owner.pem --force");
    for (name, bytes) in folder.contents() {
        assert_ne!(first[&name], bytes, "{}", name.display());
    }
}

#[test]
fn a_locked_key_signs_with_its_passphrase() {
    let folder = Folder::with_signed_model();
    for line in [
        "keygen -o locked.pem --encrypt",
        "embed model.ply -o mine.ply --key locked.pem --chip-rate 1",
    ] {
        let mut command = folder.command(line.split_whitespace());
        command.env("SIGMARK_PASSPHRASE", "Grüße, 世界");
        let run = finish(command);
        assert_eq!((run.code, run.err.as_str()), (Some(0), ""));
        assert!(!run.out.contains("Grüße"));
    }
    assert!(
        folder
            .text("locked.pem")
            .starts_with("-----BEGIN ENCRYPTED PRIVATE KEY-----\n")
    );
    folder.done(
        "verify mine.ply --original model.ply --certificate mine.ply.cert.json --public-key locked.pub.pem",
    );
}

#[test]
fn what_embed_writes_verify_finds_in_every_format() {
    let folder = Folder::with_signed_model();
    for (name, precision) in [
        ("a.obj", Precision::Single),
        ("a.ply", Precision::Single),
        ("a.stl", Precision::Single),
        ("a.off", Precision::Double),
        ("a.obj.gz", Precision::Double),
        ("a.ply.gz", Precision::Double),
        ("a.stl.gz", Precision::Single),
        ("a.off.gz", Precision::Single),
    ] {
        folder.write_mesh(name, &model(), precision);
        let signed = format!("signed_{name}");
        let run = folder.done(&format!(
            "embed {name} -o {signed} --key owner.pem --message order-4711 --chip-rate 1 --json"
        ));
        let report = run.json();
        assert_eq!(
            keys(&report),
            [
                "alpha",
                "bits",
                "certificate",
                "chips",
                "code_bits",
                "distortion_rms",
                "facet_turn",
                "flipped",
                "functions",
                "laplacian",
                "manifest_dropped",
                "margin_predicted",
                "margin_read",
                "noise_detected",
                "noise_evidence",
                "noise_read",
                "output",
                "patches",
                "payload",
                "scheme",
                "seconds",
                "unmarked_vertices"
            ]
        );
        assert_eq!(report["certificate"], format!("{signed}.cert.json"));
        // Small as it is, it has the tag, in a code of all chips.
        assert_eq!(
            (&report["payload"], &report["bits"]),
            (&"tag".into(), &128.into())
        );
        assert_eq!(
            (&report["code_bits"], report["chips"].as_u64() >= Some(512)),
            (&512.into(), true)
        );
        assert_eq!(
            (&report["patches"], &report["functions"]),
            (&1.into(), &serde_json::json!([172]))
        );
        assert!((number(&report, "distortion_rms") - 4e-4).abs() < 1e-12);
        assert!(number(&report, "alpha") > 0.0 && number(&report["seconds"], "harmonics") > 0.0);

        let run = folder.done(&format!(
            "verify {signed} --original {name} --certificate {signed}.cert.json --public-key owner.pub.pem --json"
        ));
        let report = run.json();
        assert_eq!(
            keys(&report),
            [
                "attack_model",
                "bit_errors",
                "bits",
                "correlation",
                "coverage",
                "evidence",
                "extraction_rate",
                "margin",
                "marked_parts",
                "message",
                "mirrored",
                "missing",
                "original",
                "original_is",
                "outcome",
                "overlap",
                "own_key",
                "p_dispute",
                "p_value",
                "parts",
                "patches_read",
                "payload",
                "poses",
                "public_key",
                "recipient",
                "registration",
                "remark",
                "residual",
                "scheme",
                "seconds",
                "signed",
                "stamps",
                "stamps_refused",
                "suspect",
                "transform",
                "tries"
            ]
        );
        assert_eq!(
            (&report["outcome"], &report["message"]),
            (&"verified".into(), &"order-4711".into())
        );
        assert_eq!(
            (number(&report, "extraction_rate"), number(&report, "bit_errors")),
            (1.0, 0.0)
        );
        assert_eq!(
            (number(&report, "bits") >= 192.0, number(&report, "overlap")),
            (true, 1.0)
        );
        assert!(number(&report, "p_value") < 1e-30);
        assert!((1e-4..1e-3).contains(&number(&report, "residual")));
        assert_eq!(report["transform"].as_array().map(Vec::len), Some(4));
        assert_eq!(report["transform"][3], serde_json::json!([0.0, 0.0, 0.0, 1.0]));
    }
}

#[test]
fn a_signed_mesh_is_found_moved_scaled_mirrored_shuffled_and_in_another_format() {
    let folder = Folder::with_signed_model();
    let signed = Asset::open(folder.path("signed.ply")).unwrap();
    let turn = Similarity {
        scale: 25.4,
        rotation: [[0.0, 0.0, 1.0], [0.6, 0.8, 0.0], [-0.8, 0.6, 0.0]],
        translation: [3.0, -70.0, 1e3],
    };
    let moved = shapes::shuffled(&shapes::mirrored(&shapes::moved(signed.mesh(), &turn)), 5);
    folder.write_mesh("found.obj.gz", &moved, Precision::Double);
    let report = folder
        .done(&format!("verify found.obj.gz {VERIFY} --json"))
        .json();
    assert_eq!(
        (&report["outcome"], &report["mirrored"]),
        (&"verified".into(), &true.into())
    );

    let text = folder.done(&format!("verify found.obj.gz {VERIFY}")).out;
    assert!(
        text.starts_with("VERIFIED: found.obj.gz carries the signature"),
        "{text}"
    );
    assert!(
        text.contains("512 of 512") && text.contains("order-4711") && text.contains("mirrored"),
        "{text}"
    );
}

#[test]
fn a_damaged_mark_is_detected_where_its_bits_can_no_longer_be_read() {
    let folder = Folder::with_signed_model();
    let signed = Asset::open(folder.path("signed.ply")).unwrap();
    folder.write_mesh(
        "worn.ply",
        &shapes::jittered(signed.mesh(), 0.03, 9),
        Precision::Double,
    );
    let run = folder.done(&format!("verify worn.ply {VERIFY} --json"));
    let report = run.json();
    assert_eq!(report["outcome"], "detected", "{report}");
    assert!(
        number(&report, "bit_errors") > 0.0 && number(&report, "p_value") <= 1e-6,
        "{report}"
    );
    assert!(
        folder
            .done(&format!("verify worn.ply {VERIFY}"))
            .out
            .starts_with("DETECTED: ")
    );

    // A stranger's claim takes more than what is enough for its owner.
    let enough = format!("verify worn.ply {VERIFY} --enough 1e-6");
    assert!(folder.done(&enough).out.starts_with("DETECTED: "));
    let told = folder.done(&format!("{enough} --json")).json();
    assert!(
        number(&told, "p_value") <= 1e-6 && number(&told, "tries") >= 2.0,
        "{told}"
    );
    folder.refused(
        &format!("verify worn.ply {VERIFY} --dispute --enough 1e-9"),
        &["--enough 1e-9 is too much for --dispute", "7.5e-37"],
    );
    folder.refused(
        &format!("verify worn.ply {VERIFY} --enough 1e-3"),
        &["--enough 1e-3 is too much", "--p-bound 1e-6"],
    );

    let stricter = format!(
        "verify worn.ply {VERIFY} --json --p-bound {:e}",
        0.5 * number(&report, "p_value")
    );
    let run = folder.run(&stricter);
    assert_eq!((run.code, &run.json()["outcome"]), (Some(1), &"not_found".into()));
}

#[test]
fn an_unmarked_mesh_and_a_mesh_marked_by_another_key_are_answered_with_no() {
    let folder = Folder::with_signed_model();
    for suspect in ["model.ply", "theirs.ply"] {
        let run = folder.run(&format!("verify {suspect} {VERIFY} --json"));
        let report = run.json();
        assert_eq!((run.code, &report["outcome"]), (Some(1), &"not_found".into()));
        assert!(
            (0.4..0.6).contains(&number(&report, "extraction_rate")),
            "{report}"
        );
        assert!(
            number(&report, "p_value") > 1e-4 && report["remark"].is_null(),
            "{report}"
        );
        let run = folder.run(&format!("verify {suspect} {VERIFY}"));
        assert_eq!((run.code, run.err.as_str()), (Some(1), ""));
        assert!(run.out.starts_with("NOT FOUND: "), "{}", run.out);
    }
}

#[test]
fn another_model_altogether_is_answered_with_no_and_the_reason() {
    let folder = Folder::with_signed_model();
    let others: [(&str, TriMesh); 3] = [
        ("torus.stl", shapes::bumpy_torus(20, 20, 1)),
        ("plane.obj", shapes::rectangle(1, 1, 1.0, 1.0)),
        ("large.ply", shapes::scaled(&shapes::bumpy_block(1, 2, 3), 1000.0)),
    ];
    for (name, mesh) in others {
        folder.write_mesh(name, &mesh, Precision::Double);
        let run = folder.run(&format!("verify {name} {VERIFY} --json"));
        let report = run.json();
        assert_eq!(
            (run.code, &report["outcome"]),
            (Some(1), &"not_found".into()),
            "{name}"
        );
        assert_eq!(
            (number(&report, "p_value"), number(&report, "missing")),
            (1.0, 1.0)
        );
        assert!((0.0..1.0).contains(&number(&report, "overlap")), "{report}");
        assert!(report["extraction_rate"].is_null() && report["transform"].is_null());
        let remark = report["remark"].as_str().expect("a remark");
        let run = folder.run(&format!("verify {name} {VERIFY}"));
        assert!(
            run.out.contains(remark) && run.out.starts_with("NOT FOUND: "),
            "{}",
            run.out
        );
    }
}

#[test]
fn the_papers_profile_signs_with_324_bits() {
    let folder = Folder::with_signed_model();
    folder.done("keygen -o paper.pem --profile paper");
    let report = folder
        .done("embed model.ply -o p.ply --key paper.pem --profile paper --chip-rate 2 --json")
        .json();
    assert_eq!(
        (&report["bits"], &report["functions"]),
        (&324.into(), &serde_json::json!([217]))
    );
    assert_eq!(report["scheme"], "ecdsa-b163-sha1");
    let certificate: Value = serde_json::from_str(&folder.text("p.ply.cert.json")).unwrap();
    assert_eq!(certificate["mark"]["payload"], "plain-signature");
    let verify = "verify p.ply --certificate p.ply.cert.json --original model.ply --public-key paper.pub.pem";
    folder.refused(
        verify,
        &["p.ply.cert.json", "the message alone", "--profile paper"],
    );
    let verify = format!("{verify} --profile paper");
    let report = folder.done(&format!("{verify} --json")).json();
    assert_eq!(
        (&report["outcome"], &report["signed"]),
        (&"verified".into(), &"message".into())
    );
    assert_eq!(
        (&report["evidence"], &report["p_dispute"]),
        (&false.into(), &1.0.into())
    );
    assert!(
        folder
            .done(&verify)
            .out
            .contains("does not say whose the model is")
    );
    // What anybody can make up is evidence for nobody.
    assert_eq!(folder.run(&format!("{verify} --dispute")).code, Some(1));
}

#[test]
fn sha_1_and_the_three_measures_of_strength_can_be_chosen() {
    let folder = Folder::with_signed_model();
    let embed = |options: &str| {
        let line = format!("embed model.ply -o s.ply --key owner.pem --chip-rate 1 --force --json {options}");
        folder.done(&line).json()
    };
    assert_eq!(embed("--sha1")["scheme"], "ecdsa-p256-sha1");
    let strong = embed("--distortion 0.002");
    assert!((number(&strong, "distortion_rms") - 0.002).abs() < 1e-12);
    let same = embed(&format!("--alpha {:e}", number(&strong, "alpha")));
    assert!((number(&same, "distortion_rms") - 0.002).abs() < 1e-12);
    let area = Asset::open(folder.path("model.ply")).unwrap().mesh().area();
    let same = embed(&format!(
        "--paper-alpha {:e}",
        number(&strong, "alpha") * area.sqrt()
    ));
    assert!((number(&same, "distortion_rms") - 0.002).abs() < 1e-9);
}

#[test]
fn the_certificate_goes_where_it_is_asked_to() {
    let folder = Folder::with_signed_model();
    folder.done("embed model.ply -o s.ply --key owner.pem --chip-rate 1 --certificate proof.json");
    assert!(folder.path("proof.json").exists() && !folder.path("s.ply.cert.json").exists());
}

#[test]
fn the_same_key_and_message_give_the_same_files_with_any_number_of_threads() {
    let folder = Folder::empty();
    let pieces = [
        model(),
        shapes::translated(&shapes::bumpy_torus(30, 20, 2), [9.0, 0.0, 0.0]),
    ];
    folder.write_mesh("model.ply", &shapes::disjoint_union(&pieces), Precision::Double);
    folder.done("keygen -o owner.pem");
    for threads in [1, 2] {
        let line = format!(
            "embed model.ply -o s{threads}.ply --certificate s{threads}.json --key owner.pem --chip-rate 1 --threads {threads}"
        );
        folder.done(&line);
        folder.done(&format!(
            "spectrum model.ply -k 12 -o b{threads}.npz --threads {threads}"
        ));
    }
    assert!(folder.read("s1.ply") == folder.read("s2.ply"));
    assert_eq!(folder.text("s1.json"), folder.text("s2.json"));
    assert!(
        array(&folder.read("b1.npz"), "eigenfunctions") == array(&folder.read("b2.npz"), "eigenfunctions")
    );
}

/// Shape and raw 8-byte values of an array in an NPZ file.
fn array(npz: &[u8], name: &str) -> (Vec<usize>, Vec<[u8; 8]>) {
    let mut archive = zip::ZipArchive::new(Cursor::new(npz)).expect("a ZIP archive");
    let mut bytes = Vec::new();
    archive
        .by_name(&format!("{name}.npy"))
        .expect(name)
        .read_to_end(&mut bytes)
        .expect(name);
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let data = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    assert_eq!(data % 64, 0);
    let header = std::str::from_utf8(&bytes[10..data]).expect("ASCII");
    let kind = if name == "vertex" { "<i8" } else { "<f8" };
    assert!(
        header.contains(&format!("'descr': '{kind}', 'fortran_order': False, 'shape': (")),
        "{header}"
    );
    let (_, shape) = header.split_once("'shape': (").expect("a shape");
    let (shape, _) = shape.split_once(')').expect("a shape");
    let shape: Vec<usize> = shape
        .split(',')
        .filter_map(|extent| extent.trim().parse().ok())
        .collect();
    let values: Vec<[u8; 8]> = bytes[data..]
        .chunks(8)
        .map(|v| v.try_into().expect("8 bytes"))
        .collect();
    assert_eq!(values.len(), shape.iter().product::<usize>());
    (shape, values)
}

fn doubles(npz: &[u8], name: &str) -> (Vec<usize>, Vec<f64>) {
    let (shape, values) = array(npz, name);
    (shape, values.into_iter().map(f64::from_le_bytes).collect())
}

/// The two Laplacians agree where the triangles are Delaunay, and differ on slivers; the certificate remembers which one it was.
#[test]
fn the_laplacian_can_be_chosen() {
    let folder = Folder::with_signed_model();
    folder.write_mesh("torus.ply", &shapes::bumpy_torus(60, 30, 4), Precision::Double);
    let values = |kind: &str| {
        let report = folder
            .done(&format!("spectrum torus.ply -k 20 --laplacian {kind} --json"))
            .json();
        assert_eq!(report["laplacian"], kind);
        assert_eq!(report["residuals"].as_array().unwrap().len(), 20);
        assert!(!report["inertia_counts"].as_array().unwrap().is_empty());
        report["eigenvalues"][19].as_f64().unwrap()
    };
    let [cotangent, intrinsic] = ["cotangent", "intrinsic"].map(values);
    assert_ne!(cotangent, intrinsic);
    assert!((cotangent / intrinsic - 1.0).abs() < 0.1);

    folder.done("embed torus.ply -o signed_torus.ply --key owner.pem --chip-rate 1 --laplacian intrinsic");
    assert!(
        folder
            .text("signed_torus.ply.cert.json")
            .contains("\"laplacian\": \"intrinsic\"")
    );
    folder.done(
        "verify signed_torus.ply --original torus.ply --certificate signed_torus.ply.cert.json --public-key owner.pub.pem",
    );
}

#[test]
fn a_spectrum_reads_back_from_its_file_and_is_mass_orthonormal() {
    let folder = Folder::empty();
    let mesh = shapes::exploded(&model());
    folder.write_mesh("model.stl", &mesh, Precision::Single);
    let report = folder.done("spectrum model.stl -k 12 -o basis.npz --json").json();
    assert_eq!(
        keys(&report),
        [
            "count",
            "eigenvalues",
            "inertia_complete",
            "inertia_counts",
            "laplacian",
            "max_residual",
            "output",
            "residuals",
            "seconds",
            "vertices"
        ]
    );
    assert_eq!((&report["count"], &report["vertices"]), (&12.into(), &642.into()));
    assert_eq!(
        (&report["inertia_complete"], &report["output"]),
        (&true.into(), &"basis.npz".into())
    );
    assert!(number(&report, "max_residual") < 1e-6);

    let npz = folder.read("basis.npz");
    let (n, k) = (642, 12);
    let (shape, eigenvalues) = doubles(&npz, "eigenvalues");
    assert_eq!(shape, [k]);
    assert!(eigenvalues.is_sorted() && eigenvalues[0].abs() < 1e-9 && eigenvalues[1] > 0.1);
    let printed: Vec<f64> = report["eigenvalues"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(Value::as_f64)
        .collect();
    assert_eq!(printed, eigenvalues);
    let (shape, h) = doubles(&npz, "eigenfunctions");
    assert_eq!(shape, [n, k]);
    let (shape, mass) = doubles(&npz, "mass");
    assert_eq!(shape, [n]);
    for a in 0..k {
        for b in 0..k {
            let product: f64 = (0..n).map(|i| h[i * k + a] * mass[i] * h[i * k + b]).sum();
            let expected = f64::from(u8::from(a == b));
            assert!((product - expected).abs() < 1e-10, "({a}, {b}): {product}");
        }
    }
    // Row by row, the file vertex is a corner of the file with the position of the welded vertex.
    let asset = Asset::open(folder.path("model.stl")).unwrap();
    let (shape, vertex) = array(&npz, "vertex");
    assert_eq!(shape, [n]);
    for (row, file_vertex) in vertex.into_iter().map(i64::from_le_bytes).enumerate() {
        assert_eq!(asset.welded().vertex_of()[file_vertex as usize], Some(row as u32));
    }
}

#[test]
fn inspect_says_what_the_file_holds() {
    let folder = Folder::empty();
    folder.write_mesh("torus.off.gz", &shapes::torus(12, 8, 2.0, 0.5), Precision::Double);
    let report = folder.done("inspect torus.off.gz --json").json();
    assert_eq!(
        keys(&report),
        [
            "capacity",
            "file",
            "file_vertices",
            "format",
            "gzipped",
            "remarks",
            "topology"
        ]
    );
    assert_eq!(
        (&report["format"], &report["gzipped"]),
        (&"OFF".into(), &true.into())
    );
    assert_eq!(
        (&report["topology"]["genus"], &report["topology"]["vertices"]),
        (&1.into(), &96.into())
    );
    let text = folder.done("inspect torus.off.gz").out;
    assert!(
        text.starts_with("torus.off.gz: OFF, gzipped\n") && text.contains("genus 1"),
        "{text}"
    );
}

#[test]
fn inspect_says_what_a_mark_of_each_strength_holds_and_outlasts() {
    let folder = Folder::with_signed_model();
    folder.write_mesh("sphere.ply", &shapes::bumpy_sphere(4, 3), Precision::Double);
    // Flat triangles, which would turn too far, hold a mark back, by which bits it has: not from one time to the next.
    let ball = shapes::bumpy_sphere(4, 3);
    let mut positions = ball.positions().to_vec();
    for t in (0..ball.triangle_count()).step_by(40) {
        let [a, b, c] = ball.corners(t);
        let middle = (b + c) * 0.5;
        positions[ball.triangles()[t][0] as usize] = (middle + (a - middle) * 0.01).into();
    }
    let flattened = ball.with_positions(positions).unwrap();
    folder.write_mesh("rough.ply", &flattened, Precision::Double);
    let of_model = |name: &str| folder.done(&format!("inspect {name} --json")).json()["capacity"].take();
    assert_eq!(of_model("rough.ply"), of_model("rough.ply"));
    let capacity = of_model("sphere.ply");
    let strengths = capacity["strengths"].as_array().unwrap();
    let of = |key: &str| -> Vec<f64> { strengths.iter().map(|of| of[key].as_f64().unwrap()).collect() };
    let names: Vec<&str> = strengths
        .iter()
        .map(|of| of["strength"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["subtle", "standard", "strong"]);
    for key in ["distortion_rms", "margin_predicted", "noise_detected"] {
        assert!(of(key).is_sorted() && of(key)[0] > 0.0, "{key}: {:?}", of(key));
    }
    assert_eq!(capacity["payload"], strengths[1]["payload"]);
    // As `embed` foretells it.
    let embedded = folder
        .done("embed sphere.ply -o out.ply -k owner.pem --json")
        .json();
    let margin = embedded["margin_predicted"].as_f64().unwrap();
    assert!(
        (margin / of("margin_predicted")[1] - 1.0).abs() < 0.05,
        "{margin}"
    );
    let text = folder.done("inspect sphere.ply").out;
    for name in names {
        let row = text
            .lines()
            .find(|line| line.trim_start().starts_with(name))
            .unwrap();
        assert!(row.contains("signature") || row.contains("tag"), "{row}");
    }
}

#[test]
fn non_manifold_meshes_are_signed_and_found_like_others() {
    // A wall on an inner edge, a lobe at the tip of a corner, and a vertex that no face uses.
    let (sheet, lobe) = (shapes::rectangle(30, 30, 3.0, 3.0), shapes::tetrahedron());
    let mut positions = sheet.positions().to_vec();
    let mut triangles = sheet.triangles().to_vec();
    let wall = positions.len() as u32;
    positions.extend([[0.1, 0.05, 1.0], [2.0, 2.0, 1.0]]);
    let inner = triangles[triangles.len() / 2];
    triangles.push([inner[0], inner[1], wall]);
    let corner = positions.len() as u32;
    positions.extend(
        lobe.positions()
            .iter()
            .skip(1)
            .map(|p| [p[0] - 9.0, p[1], p[2] + 5.0]),
    );
    triangles.extend(
        lobe.triangles()
            .iter()
            .map(|t| t.map(|v| if v == 0 { 0 } else { corner + v - 1 })),
    );
    let mesh = shapes::jittered(&TriMesh::new(positions, triangles).unwrap(), 0.2, 4);
    let folder = Folder::with_signed_model();
    folder.write_mesh("rough.ply", &mesh, Precision::Double);
    let topology = &folder.done("inspect rough.ply --json").json()["topology"];
    assert_eq!(
        (&topology["manifold"], &topology["non_manifold_edges"]),
        (&false.into(), &1.into())
    );
    assert_eq!(topology["welding"]["unused_vertices"], 1);
    folder.done("embed rough.ply -o s.ply --key owner.pem --chip-rate 1");
    let verify =
        "verify s.ply --original rough.ply --certificate s.ply.cert.json --public-key owner.pub.pem --json";
    assert_eq!(folder.done(verify).json()["outcome"], "verified");
}

#[test]
fn a_mesh_is_divided_into_connected_parts_of_equal_size() {
    let folder = Folder::with_signed_model();
    let report = folder
        .done("partition model.ply -k 6 -o parts.ply --labels parts.txt --json")
        .json();
    assert_eq!(
        keys(&report),
        [
            "components",
            "cut",
            "imbalance",
            "labels",
            "output",
            "parts",
            "seconds"
        ]
    );
    assert_eq!(report["components"], serde_json::json!([1, 1, 1, 1, 1, 1]));
    assert!(number(&report, "imbalance") <= 0.03);
    let labels: Vec<usize> = folder
        .text("parts.txt")
        .lines()
        .map(|line| line.parse().unwrap())
        .collect();
    assert_eq!(labels.len(), 642);
    for part in 0..6 {
        assert!((90..=110).contains(&labels.iter().filter(|&&label| label == part).count()));
    }
    let coloured = mesh_io::Asset::open(folder.path("parts.ply")).unwrap();
    assert_eq!(coloured.mesh().triangle_count(), 1280);
}

#[test]
fn a_graph_in_metis_format_is_divided() {
    let folder = Folder::empty();
    // Two triangles with a bridge.
    folder.write("bridge.graph", "6 7\n2 3\n1 3\n1 2 4\n3 5 6\n4 6\n4 5\n");
    let report = folder
        .done("partition bridge.graph -k 2 --labels parts.txt --json")
        .json();
    assert_eq!(report["cut"], 1);
    let text = folder.text("parts.txt");
    assert!(
        text == "0\n0\n0\n1\n1\n1\n" || text == "1\n1\n1\n0\n0\n0\n",
        "{text}"
    );
    assert!(folder.done("partition bridge.graph -k 2").out.contains("1 edge"));
}

#[test]
fn a_mesh_is_signed_in_as_many_patches_as_are_asked_for() {
    let folder = Folder::with_signed_model();
    folder.write_mesh("torus.ply", &shapes::bumpy_torus(60, 40, 1), Precision::Single);
    let line = "embed torus.ply -o t.ply --key owner.pem --chip-rate 1 --patches 4 --json";
    assert_eq!(folder.done(line).json()["patches"], 4);
    let line =
        "verify t.ply --original torus.ply --certificate t.ply.cert.json --public-key owner.pub.pem --json";
    assert_eq!(folder.done(line).json()["outcome"], "verified");
}

#[test]
fn every_command_has_help_with_an_example() {
    let folder = Folder::empty();
    for command in [
        "keygen",
        "embed",
        "verify",
        "trace",
        "dispute",
        "stamp request",
        "stamp attach",
        "stamp",
        "align",
        "compare",
        "inspect",
        "spectrum",
        "partition",
        "library",
        "library add",
        "library list",
        "library search",
        "library verify",
        "completions",
        "man",
    ] {
        let text = folder.done(&format!("{command} --help")).out;
        assert!(text.contains(&format!("Usage: sigmark {command}")), "{text}");
        assert!(
            text.contains(&format!("Example:\n  sigmark {command} ")),
            "{text}"
        );
        let offers = |line: &str| line.trim_start().starts_with("--json") && !line.contains("prints: ");
        assert_eq!(
            text.lines().any(offers),
            text.contains("--json prints: "),
            "{text}"
        );
        assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
    }
    assert!(folder.done("--help").out.contains("sigmark keygen -o owner.pem"));
    assert!(folder.done("--version").out.starts_with("sigmark "));
    let nothing = folder.run("");
    assert_eq!(nothing.code, Some(2));
    assert!(
        nothing.out.is_empty() && nothing.err.contains("A first session:"),
        "{}",
        nothing.err
    );
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let folder = Folder::with_signed_model();
    for line in [
        "inspect model.ply",
        "inspect model.ply --json",
        "--help",
        "spectrum model.ply -k 2",
    ] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let mut command = folder.command(line.split_whitespace());
        let output = command
            .stdout(writer)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
            .wait_with_output()
            .unwrap();
        assert_eq!(
            (output.status.code(), output.stderr.as_slice()),
            (Some(0), &b""[..]),
            "{line}"
        );
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_report_that_nobody_could_get_is_an_error() {
    let folder = Folder::with_signed_model();
    let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let mut command = folder.command(["inspect", "model.ply"]);
    let run = command
        .stdout(full())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
        .wait_with_output()
        .unwrap();
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).starts_with("sigmark: the report can't be written"));
    // With standard error full as well, the exit code still says it.
    let run = folder
        .command(["inspect", "model.ply"])
        .stdout(full())
        .stderr(full())
        .status()
        .unwrap();
    assert_eq!(run.code(), Some(2));
}

#[test]
fn names_and_messages_from_outside_do_not_steer_the_terminal() {
    let folder = Folder::with_signed_model();
    let embed = [
        "embed",
        "model.ply",
        "-o",
        "s.ply",
        "--key",
        "owner.pem",
        "--chip-rate",
        "1",
        "--message",
        "a\x1b[2Jb\nc",
    ];
    assert_eq!(finish(folder.command(embed)).code, Some(0));
    let line = "verify s.ply --original model.ply --certificate s.ply.cert.json --public-key owner.pub.pem";
    let text = folder.done(line).out;
    assert!(
        text.contains("a\u{fffd}[2Jb\u{fffd}c") && !text.contains('\x1b'),
        "{text}"
    );
    assert_eq!(
        folder.done(&format!("{line} --json")).json()["message"],
        "a\x1b[2Jb\nc"
    );
    folder.refused_as(
        "inspect …",
        folder.command(["inspect", "no\nsuch\x07file.obj"]),
        &["no\u{fffd}such\u{fffd}file.obj"],
    );
}

#[test]
fn compare_measures_everything_and_what_was_asked_for_alone() {
    let folder = Folder::with_signed_model();
    let report = folder.done("compare model.ply signed.ply --json").json();
    let distance = &report["distance"];
    let (rmse, hausdorff) = (number(distance, "d_rmse"), number(distance, "hausdorff"));
    // The mark moves the surface by 0.04 % of the diagonal, sideways too.
    assert!((1e-4..4.1e-4).contains(&rmse) && hausdorff > rmse && hausdorff < 10.0 * rmse);
    assert!(number(distance, "mean") < rmse && number(distance, "mrms") >= rmse);
    assert!(number(&report["shape_dna"], "distance") > 0.0);
    assert!(number(&report["msdm2"], "symmetric") > 0.0 && number(&report["dame"], "error") > 0.0);
    assert_eq!(report["not_computed"], serde_json::json!({}));
    assert!(report["heatmap"].is_null());

    let report = folder
        .done("compare model.ply signed.ply --metrics dame,dame --json")
        .json();
    assert!(report["distance"].is_null() && report["msdm2"].is_null() && !report["dame"].is_null());

    let people = folder.done("compare model.ply signed.ply").out;
    for word in [
        "d_rmse",
        "Hausdorff",
        "MRMS",
        "d_2,50",
        "MSDM2",
        "DAME",
        "of the diagonal",
    ] {
        assert!(people.contains(word), "no {word} in {people}");
    }
}

#[test]
fn compare_finds_no_difference_between_a_mesh_and_itself_in_other_files_and_orders() {
    let folder = Folder::empty();
    let mesh = model();
    folder.write_mesh("model.ply", &mesh, Precision::Double);
    folder.write_mesh("model.off.gz", &mesh, Precision::Double);
    folder.write_mesh("shuffled.obj", &shapes::shuffled(&mesh, 7), Precision::Double);
    for other in ["model.off.gz", "shuffled.obj"] {
        let report = folder
            .done(&format!("compare model.ply {other} --json --interval 0.01"))
            .json();
        assert!(number(&report["distance"], "hausdorff") < 1e-14);
        assert!(number(&report["shape_dna"], "distance") < 1e-8);
        assert!(number(&report["msdm2"], "symmetric") < 1e-6);
        assert!(number(&report["dame"], "error") < 1e-12);
    }
}

#[test]
fn compare_says_which_metric_needs_the_same_triangles_and_gives_the_others() {
    let folder = Folder::empty();
    folder.write_mesh("coarse.ply", &shapes::icosphere(3), Precision::Double);
    folder.write_mesh("fine.ply", &shapes::icosphere(4), Precision::Double);
    let report = folder
        .done("compare coarse.ply fine.ply --interval 0.01 --json")
        .json();
    assert!(report["dame"].is_null());
    let reason = report["not_computed"]["dame"].as_str().expect("a reason");
    assert!(reason.contains("connectivity differs") && reason.contains("fine.ply"));
    assert!(number(&report["distance"], "d_rmse") > 0.0 && number(&report["msdm2"], "symmetric") > 0.0);
    let people = folder.done("compare coarse.ply fine.ply --interval 0.01").out;
    assert!(people.contains("not computed") && people.contains("connectivity differs"));
}

#[test]
fn heat_maps_are_pictures_or_coloured_meshes_on_a_scale_that_can_be_shared() {
    let folder = Folder::with_signed_model();
    let compare = "compare model.ply signed.ply --metrics distance --interval 0.01 --json --heatmap";
    let report = folder.done(&format!("{compare} map.png")).json();
    let greatest = number(&report["heatmap"], "max");
    // A vertex measured alone, and measured among others: the same but for rounding.
    let hausdorff = number(&report["distance"], "hausdorff_forward");
    assert!(greatest > 0.0 && greatest <= hausdorff * (1.0 + 1e-9));
    assert!(folder.read("map.png").starts_with(b"\x89PNG"));
    folder.done(&format!("{compare} map.ply --heatmap-max 0.01"));
    let coloured = Asset::open(folder.path("map.ply")).unwrap();
    assert_eq!(coloured.mesh().triangles(), model().triangles());
    // On a scale of 1 % all vertices are of the first colours; on their own scale some are of the last.
    let header_end = |bytes: &[u8]| bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let reds = |name: &str| -> Vec<u8> {
        let bytes = folder.read(name);
        let vertices = bytes[header_end(&bytes)..]
            .chunks(15)
            .take(model().vertex_count());
        vertices.map(|vertex| vertex[12]).collect()
    };
    assert!(reds("map.ply").iter().all(|&red| red < 0x60));
    folder.done(&format!("{compare} map.ply --force"));
    assert!(reds("map.ply").contains(&0xc9));
    folder.done(&format!("{compare} local.png --heatmap-of msdm2"));
}
