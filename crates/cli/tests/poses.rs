//! Models with joints and morph targets that come back in another pose: what commands make of them.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use crate::common::{
    Folder,
    rigged::{rigged, with_views},
};
use mesh::{TriMesh, Vec3, shapes};
use mesh_io::{Asset, Precision};
use serde_json::{Value, json};

const EMBED: &str = "embed model.glb -o signed.glb -k owner.pem -m order-4711";
const VERIFY: &str = "--original model.glb --certificate signed.glb.cert.json --public-key owner.pub.pem";

/// The second joint turned by so much, the target taken by so much; scaled and in another order, as a baked file has it.
fn posed(asset: &Asset, angle: f64, swelling: f64) -> TriMesh {
    let (mesh, rig) = (asset.mesh(), asset.rig().unwrap().unwrap());
    let mut points: Vec<Vec3> = (0..mesh.vertex_count()).map(|v| mesh.point(v)).collect();
    for &(v, offset) in &rig.targets()[0] {
        points[v as usize] += Vec3(offset) * swelling;
    }
    let (sin, cos) = angle.sin_cos();
    let place = |v: usize| {
        let Vec3([x, y, z]) = points[v];
        let turned = Vec3([cos * x - sin * z, y, sin * x + cos * z]);
        let moved = rig.weights_of(v).iter();
        let sum: Vec3 = moved
            .map(|&(joint, weight)| {
                if joint == 1 {
                    turned * weight
                } else {
                    points[v] * weight
                }
            })
            .sum();
        (sum * 30.0).into()
    };
    let posed = mesh.with_positions((0..points.len()).map(place).collect());
    shapes::shuffled(&posed.unwrap(), 5)
}

/// With model.glb, signed.glb and its certificate, and posed.obj; another pose of the model without the mark, bare.obj.
fn folder() -> Folder {
    let folder = Folder::empty();
    folder.write("model.glb", rigged(&shapes::bumpy_torus(60, 40, 3)));
    folder.done("keygen -o owner.pem");
    folder.done(EMBED);
    let [signed, model] = ["signed.glb", "model.glb"].map(|name| Asset::open(folder.path(name)).unwrap());
    folder.write_mesh("posed.obj", &posed(&signed, 1.0, 0.7), Precision::Single);
    folder.write_mesh("bare.obj", &posed(&model, 1.0, 0.7), Precision::Single);
    folder
}

fn without_skin(glb: &[u8]) -> Vec<u8> {
    with_views(glb, &[], |json, _| {
        let primitive = &mut json["meshes"][0]["primitives"][0];
        let attributes = primitive["attributes"].as_object_mut().expect("attributes");
        attributes.retain(|name, _| name == "POSITION");
        primitive["targets"] = json!([]);
    })
}

#[test]
fn a_copy_in_another_pose_is_verified_also_as_evidence() {
    let folder = folder();
    let certificate: Value = serde_json::from_str(&folder.text("signed.glb.cert.json")).unwrap();
    assert!(
        certificate["original"]["rig"]
            .as_str()
            .unwrap()
            .starts_with("sha256:")
    );
    let report = folder
        .done(&format!("verify posed.obj {VERIFY} --dispute --json"))
        .json();
    assert_eq!(
        (&report["outcome"], &report["registration"]),
        (&json!("verified"), &json!("rig"))
    );
    assert_eq!(report["evidence"], true);
    assert_eq!([&report["transform"], &report["mirrored"]], [&Value::Null; 2]);
    let words = folder
        .done(&format!(
            "verify posed.obj {VERIFY} --dispute --report page.html --force"
        ))
        .out;
    assert!(
        words.contains("joints and morph targets") && words.contains("evidence: "),
        "{words}"
    );
    let page = folder.text("page.html");
    assert!(page.contains("with all that poses it"), "{page}");
    assert!(page.contains("its pose was undone by the original\u{2019}s joints before it was read"));
    assert!(page.contains("Left apart") && !page.contains("Transform found"));
    assert!(
        page.contains("ask where the suspect comes from")
            && words.contains("ask where the suspect comes from")
    );
    let run = folder.run(&format!("verify bare.obj {VERIFY} --json"));
    assert_eq!(
        (run.code, run.json()["outcome"].clone()),
        (Some(1), json!("not_found"))
    );
}

/// Who poses a published figure, shakes it by as much as a mark, and signs that as his original.
#[test]
fn a_posed_original_comes_second_and_what_that_does_not_say_is_told() {
    let folder = folder();
    let posed = Asset::open(folder.path("posed.obj")).unwrap().mesh().clone();
    folder.write_mesh("his.ply", &shapes::jittered(&posed, 0.02, 4), Precision::Double);
    folder.done("keygen -o his.pem");
    folder.done("embed his.ply -o his_signed.ply -k his.pem");
    let claim = |original: &str, signed: &str, key: &str| json!({"original": original, "certificate": format!("{signed}.cert.json"), "public_key": format!("{key}.pub.pem")});
    folder.write(
        "mine.claim.json",
        claim("model.glb", "signed.glb", "owner").to_string(),
    );
    folder.write(
        "his.claim.json",
        claim("his.ply", "his_signed.ply", "his").to_string(),
    );
    let report = folder
        .done("dispute mine.claim.json his.claim.json --json")
        .json();
    assert_eq!(
        (&report["outcome"], &report["first_in_second"]["registration"]),
        (&json!("first"), &json!("rig")),
        "{report}"
    );
    assert!(
        report["reasons"]
            .to_string()
            .contains("ask where the suspect comes from"),
        "{report}"
    );
}

#[test]
fn a_rig_that_was_not_signed_is_named_and_passed_over() {
    let folder = folder();
    // The same geometry, signed without its skin.
    folder.write("plain.glb", without_skin(&folder.read("model.glb")));
    folder.done("embed plain.glb -o bound.glb -k owner.pem");
    let plain = folder.run("verify posed.obj --original plain.glb --certificate signed.glb.cert.json");
    assert!(
        plain.out.contains("each seen from its own surroundings"),
        "{}",
        plain.out
    );
    assert!(
        plain.out.contains("ask where the suspect comes from"),
        "{}",
        plain.out
    );
    assert!(
        plain
            .err
            .contains("plain.glb: the joints or morph targets that were signed with it are not in this file"),
        "{}",
        plain.err
    );
    let other = folder.run("verify posed.obj --original model.glb --certificate bound.glb.cert.json");
    assert_eq!(other.code, Some(1));
    assert!(
        other
            .err
            .contains("model.glb: its joints or morph targets are not those that were signed with it"),
        "{}",
        other.err
    );
}

#[test]
fn what_poses_the_original_can_t_be_left_out_of_a_certificate_or_put_into_one() {
    let folder = folder();
    let mut certificate: Value = serde_json::from_str(&folder.text("signed.glb.cert.json")).unwrap();
    let original = certificate["original"].as_object_mut().unwrap();
    let digest = original.remove("rig").unwrap();
    folder.write("without.json", certificate.to_string());
    certificate["original"]["rig"] = certificate["original"]["digest"].clone();
    folder.write("another.json", certificate.to_string());
    certificate["original"]["rig"] = digest.as_str().unwrap().to_uppercase().into();
    folder.write("upper.json", certificate.to_string());
    let verify = |name: &str| format!("verify posed.obj --original model.glb --certificate {name}");
    for name in ["without.json", "another.json"] {
        folder.refused(&verify(name), &[name, "not one by its key over what it states"]);
    }
    folder.refused(&verify("upper.json"), &["upper.json", "sha256:"]);
}

#[test]
fn buyers_of_posed_copies_are_named() {
    let folder = folder();
    folder.write("list.csv", "Anna\nBert\n");
    folder.done("embed model.glb --recipients list.csv -o sold -k owner.pem");
    let sold = std::fs::read_dir(folder.path("sold"))
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let bert = sold
        .into_iter()
        .find(|path| path.file_name().unwrap().to_str().unwrap().starts_with("bert"))
        .unwrap();
    let copy = Asset::open(bert.join("model.glb")).unwrap();
    folder.write_mesh("leak.stl", &posed(&copy, 0.8, 0.2), Precision::Single);
    let report = folder
        .done("trace leak.stl --original model.glb --certificates sold --public-key owner.pub.pem --json")
        .json();
    assert_eq!(
        (&report["registration"], &report["accused"][0]["recipient"]),
        (&json!("rig"), &json!("Bert"))
    );
}

#[test]
fn a_library_finds_posed_copies_by_the_rig_of_the_file_that_was_added() {
    let folder = folder();
    folder.done("library add model.glb signed.glb.cert.json --library lib.sigmark");
    let report = folder
        .done("library search posed.obj --library lib.sigmark --json")
        .json();
    assert_eq!(
        (&report["outcome"], &report["registration"], &report["transform"]),
        (&json!("verified"), &json!("rig"), &Value::Null),
        "{report}"
    );
    let words = folder.done("library search posed.obj --library lib.sigmark").out;
    assert!(
        words.contains("brought back from its pose by the original's joints"),
        "{words}"
    );
    let report = folder
        .done("library verify posed.obj --library lib.sigmark --json")
        .json();
    assert_eq!(
        (&report["outcome"], &report["registration"]),
        (&json!("verified"), &json!("rig"))
    );
}

#[test]
fn align_writes_a_suspect_back_in_the_pose_of_the_original() {
    let folder = folder();
    let words = folder.done("align posed.obj model.glb -o back.obj --pose").out;
    assert!(
        words.contains("in its pose") && words.contains("Normals"),
        "{words}"
    );
    let [back, signed] =
        ["back.obj", "signed.glb"].map(|name| Asset::open(folder.path(name)).unwrap().mesh().clone());
    let apart = |p: &[f64; 3]| {
        let distances = signed.positions().iter().map(|q| (Vec3(*p) - Vec3(*q)).norm());
        distances.fold(f64::INFINITY, f64::min)
    };
    let farthest = back.positions().iter().map(apart).fold(0.0, f64::max);
    assert!(farthest < 2e-3 * signed.bounding_box().diagonal(), "{farthest}");
    let report = folder
        .done("align posed.obj model.glb -o again.obj --pose --json")
        .json();
    assert_eq!(
        (&report["pose"]["undone_by"], &report["transform"]),
        (&json!("rig"), &Value::Null)
    );
    assert_eq!(folder.read("back.obj"), folder.read("again.obj"));

    // With other vertices.
    let divided = shapes::divided(&posed(&Asset::open(folder.path("signed.glb")).unwrap(), 0.4, 0.0));
    folder.write_mesh("divided.ply", &divided, Precision::Single);
    let report = folder
        .done("align divided.ply model.glb -o whole.ply --pose --json")
        .json();
    assert_eq!(report["pose"]["undone_by"], "rig_surface");
    assert!(report["overlap"].as_f64() > Some(0.95), "{report}");
    let back = Asset::open(folder.path("whole.ply")).unwrap();
    let surface = mesh::Surface::new(&signed);
    let off = |p: &[f64; 3]| surface.nearest(*p).distance;
    let mut off: Vec<f64> = back.mesh().positions().iter().map(off).collect();
    off.sort_by(f64::total_cmp);
    let median = off[off.len() / 2] / signed.bounding_box().diagonal();
    assert!(median < 2e-3, "{median}");

    // In no other pose than the original's.
    folder.write_mesh("unposed.ply", &shapes::divided(&signed), Precision::Single);
    let run = folder.run("align unposed.ply model.glb -o never.ply --pose");
    assert_eq!(run.code, Some(1));
    assert!(
        run.out.contains("as it is; align it without --pose"),
        "{}",
        run.out
    );
    assert!(!folder.path("never.ply").exists());

    // Another model.
    folder.write_mesh("ball.obj", &shapes::icosphere(3), Precision::Single);
    let run = folder.run("align ball.obj model.glb -o never.obj --pose --json");
    assert_eq!((run.code, run.json()["aligned"].clone()), (Some(1), json!(false)));
    assert!(!folder.path("never.obj").exists());
}

#[test]
fn align_undoes_what_bent_a_suspect_that_no_joints_had_posed() {
    let folder = Folder::empty();
    let long = |&[x, y, z]: &[f64; 3]| [4.0 * x, y, 0.8 * z + 0.1 * x * y];
    let ball = shapes::bumpy_sphere(4, 7);
    let model = ball.with_positions(ball.positions().iter().map(long).collect());
    let model = model.unwrap();
    folder.write_mesh("model.ply", &model, Precision::Double);
    // A quarter of a circle in all, in triangles of its own.
    let bent = |&[x, y, z]: &[f64; 3]| {
        let (sin, cos) = (x / 5.0).sin_cos();
        [(5.0 - z) * sin, y, 5.0 - (5.0 - z) * cos]
    };
    let divided = shapes::divided(&model);
    let suspect = divided.with_positions(divided.positions().iter().map(bent).collect());
    folder.write_mesh("bent.stl", &suspect.unwrap(), Precision::Single);
    let words = folder.done("align bent.stl model.ply -o back.stl --pose").out;
    assert!(words.contains("what had bent or posed it undone"), "{words}");
    let report = folder
        .done("align bent.stl model.ply -o back.stl --pose --json --force")
        .json();
    assert_eq!(report["pose"]["undone_by"], "bent_surface");
    assert!(
        report["overlap"].as_f64().unwrap() > 0.95,
        "{}",
        report["overlap"]
    );
    // What was not bent is to be aligned as it is.
    let run = folder.run("align back.stl model.ply -o never.stl --pose");
    assert!(
        run.out.contains("as it is; align it without --pose"),
        "{}",
        run.out
    );
}
