//! Models with joints and morph targets that come back in another pose: what commands make of them.

mod common;

use common::Folder;
use mesh::{TriMesh, Vec3, shapes};
use mesh_io::{Asset, Format, Precision, write_mesh};
use serde_json::{Value, json};

const EMBED: &str = "embed model.glb -o signed.glb -k owner.pem -m order-4711";
const VERIFY: &str = "--original model.glb --certificate signed.glb.cert.json --public-key owner.pub.pem";

/// A ring whose two halves follow a joint each, and share what lies between; and one target, by which a side swells.
fn rigged(mesh: &TriMesh) -> Vec<u8> {
    let share = |p: &[f64; 3]| (0.5 + p[0]).clamp(0.0, 1.0) as f32;
    let points = mesh.positions();
    let joints: Vec<u8> = points.iter().flat_map(|_| [0, 1, 0, 0]).collect();
    let weights = points.iter().flat_map(|p| [1.0 - share(p), share(p), 0.0, 0.0]);
    let swelling = points.iter().flat_map(|p| {
        let by = if p[1] > 0.0 { 0.2 } else { 0.0 };
        p.map(|x| (x * by) as f32)
    });
    let bytes = |numbers: Vec<f32>| -> Vec<u8> { numbers.into_iter().flat_map(f32::to_le_bytes).collect() };
    let views = [joints, bytes(weights.collect()), bytes(swelling.collect())];
    with_views(
        &write_mesh(mesh, Format::Glb, Precision::Single),
        &views,
        |json, first| {
            let count = points.len();
            let accessor = |i: usize, kind: u32, shape: &str| json!({"bufferView": first + i, "componentType": kind, "count": count, "type": shape});
            let accessors = json["accessors"].as_array_mut().expect("accessors");
            let number = accessors.len();
            accessors.extend([
                accessor(0, 5121, "VEC4"),
                accessor(1, 5126, "VEC4"),
                accessor(2, 5126, "VEC3"),
            ]);
            let primitive = &mut json["meshes"][0]["primitives"][0];
            (
                primitive["attributes"]["JOINTS_0"],
                primitive["attributes"]["WEIGHTS_0"],
            ) = (number.into(), (number + 1).into());
            primitive["targets"] = json!([{"POSITION": number + 2}]);
            json["skins"] = json!([{"joints": [1, 2]}]);
            json["nodes"] = json!([{"mesh": 0, "skin": 0}, {}, {}]);
            json["scenes"] = json!([{"nodes": [0, 1, 2]}]);
        },
    )
}

/// A GLB with more buffer views, the first of which has the number that is passed on.
fn with_views(glb: &[u8], views: &[Vec<u8>], change: impl FnOnce(&mut Value, usize)) -> Vec<u8> {
    let length = u32::from_le_bytes(glb[12..16].try_into().expect("a number")) as usize;
    let mut json: Value = serde_json::from_slice(&glb[20..20 + length]).expect("JSON");
    let mut bin = glb[28 + length..].to_vec();
    let all = json["bufferViews"].as_array_mut().expect("views");
    let first = all.len();
    for view in views {
        bin.resize(bin.len().next_multiple_of(4), 0);
        all.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": view.len()}));
        bin.extend(view);
    }
    json["buffers"][0]["byteLength"] = bin.len().into();
    change(&mut json, first);
    let mut text = serde_json::to_vec(&json).expect("JSON");
    text.resize(text.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend((28 + text.len() as u32 + bin.len() as u32).to_le_bytes());
    for (kind, content) in [(b"JSON", &text), (b"BIN\0", &bin)] {
        out.extend((content.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(content);
    }
    out
}

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
    let run = folder.run(&format!("verify bare.obj {VERIFY} --json"));
    assert_eq!(
        (run.code, run.json()["outcome"].clone()),
        (Some(1), json!("not_found"))
    );
}

#[test]
fn a_rig_that_was_not_signed_is_named_and_passed_over() {
    let folder = folder();
    // The same geometry, signed without its skin.
    folder.write("plain.glb", without_skin(&folder.read("model.glb")));
    folder.done("embed plain.glb -o bound.glb -k owner.pem");
    let plain = folder.run("verify posed.obj --original plain.glb --certificate signed.glb.cert.json");
    assert_eq!(plain.code, Some(1));
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
    assert_eq!(report["outcome"], "verified", "{report}");
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

    // Without a rig, without the vertices.
    folder.write("plain.glb", without_skin(&folder.read("model.glb")));
    folder.refused(
        "align posed.obj plain.glb -o never.obj --pose",
        &["plain.glb: has no joints or morph targets"],
    );
    folder.write_mesh("ball.obj", &shapes::icosphere(3), Precision::Single);
    let run = folder.run("align ball.obj model.glb -o never.obj --pose --json");
    assert_eq!((run.code, run.json()["aligned"].clone()), (Some(1), json!(false)));
    assert!(!folder.path("never.obj").exists());
}
