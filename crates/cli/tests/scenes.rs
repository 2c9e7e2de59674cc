//! Scenes on the command line: glTF and 3MF, files beside the model, manifests, coarse files, parts.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use crate::common::{Folder, model};
use mesh::shapes;
use mesh_io::{Asset, Format, Precision, write_mesh};
use serde_json::Value;

fn keyed() -> Folder {
    let folder = Folder::empty();
    folder.done("keygen -o owner.pem");
    folder
}

fn verified(folder: &Folder, suspect: &str, original: &str, signed: &str) -> Value {
    let line = format!("verify {suspect} --original {original} --certificate {signed}.cert.json --json");
    let report = folder.done(&line).json();
    assert_eq!(report["outcome"], "verified", "{report}");
    report
}

/// A glTF whose buffer lies in a file beside it.
fn write_gltf(folder: &Folder) {
    let file = write_mesh(&model(), Format::Glb, Precision::Single);
    let length = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
    let mut json: Value = serde_json::from_slice(&file[20..20 + length]).unwrap();
    json["buffers"][0]["uri"] = "model.bin".into();
    folder.write("model.gltf", json.to_string());
    folder.write("model.bin", &file[28 + length..]);
}

#[test]
fn a_model_is_signed_as_glb_and_as_3mf_and_found_in_other_formats() {
    let folder = keyed();
    for ending in ["glb", "gltf", "3mf"] {
        let [name, signed] = ["model", "signed"].map(|name| format!("{name}.{ending}"));
        folder.write_mesh(&name, &model(), Precision::Single);
        folder.done(&format!("embed {name} -o {signed} -k owner.pem --chip-rate 1"));
        let marked = Asset::open(folder.path(&signed)).unwrap();
        folder.write_mesh(
            "found.stl",
            &shapes::scaled(marked.mesh(), 25.4),
            Precision::Single,
        );
        verified(&folder, &signed, &name, &signed);
        verified(&folder, "found.stl", &name, &signed);
    }
}

#[test]
fn a_buffer_beside_the_model_goes_with_the_copy_and_never_over_its_own() {
    let folder = keyed();
    write_gltf(&folder);
    folder.refused(
        "embed model.gltf -o signed.gltf -k owner.pem --chip-rate 1 --force",
        &[
            "the model refers to model.bin, which would change",
            "another folder",
        ],
    );
    std::fs::create_dir(folder.path("out")).unwrap();
    let bin = folder.read("model.bin");
    folder.done("embed model.gltf -o out/signed.gltf -k owner.pem --chip-rate 1");
    assert_eq!(folder.read("model.bin"), bin);
    assert_ne!(folder.read("out/model.bin"), bin);
    verified(&folder, "out/signed.gltf", "model.gltf", "out/signed.gltf");
}

#[test]
fn a_manifest_is_left_out_and_said_or_the_model_refused() {
    let folder = keyed();
    let mut file = write_mesh(&model(), Format::Glb, Precision::Single);
    file.extend(12_u32.to_le_bytes());
    file.extend(b"C2PAwho made it.");
    let length = (file.len() as u32).to_le_bytes();
    file[8..12].copy_from_slice(&length);
    folder.write("model.glb", &file);
    folder.refused(
        "embed model.glb -o signed.glb -k owner.pem --chip-rate 1 --c2pa refuse",
        &["holds a C2PA manifest", "--c2pa drop"],
    );
    let run = folder.done("embed model.glb -o signed.glb -k owner.pem --chip-rate 1");
    assert!(run.out.contains("C2PA manifest is left out"), "{}", run.out);
    let report = folder
        .done("embed model.glb -o signed.glb -k owner.pem --chip-rate 1 --force --json")
        .json();
    assert_eq!(report["manifest_dropped"], true);
    assert!(folder.read("signed.glb").windows(4).all(|word| word != b"C2PA"));
}

#[test]
fn a_part_that_was_taken_out_is_named() {
    let folder = keyed();
    let far = |mesh, x| shapes::translated(&mesh, [x, 0.0, 0.0]);
    let parts = [
        shapes::bumpy_sphere(3, 1),
        far(shapes::bumpy_torus(40, 20, 2), 9.0),
        far(shapes::bumpy_block(1, 6, 3), 22.0),
    ];
    folder.write_mesh("model.glb", &shapes::disjoint_union(&parts), Precision::Single);
    folder.done("embed model.glb -o signed.glb -k owner.pem --strength strong");
    let marked = Asset::open(folder.path("signed.glb")).unwrap();
    let torus: Vec<[u32; 3]> = marked
        .mesh()
        .triangles()
        .iter()
        .copied()
        .filter(|corners| {
            marked.mesh().positions()[corners[0] as usize][0] > 5.0
                && marked.mesh().positions()[corners[0] as usize][0] < 15.0
        })
        .collect();
    let torus = mesh::Welded::new(marked.mesh().positions(), &torus)
        .unwrap()
        .into_mesh();
    folder.write_mesh(
        "torus.obj",
        &shapes::shuffled(&shapes::scaled(&torus, 3.0), 1),
        Precision::Single,
    );
    let line = "verify torus.obj --original model.glb --certificate signed.glb.cert.json";
    let report = folder.done(&format!("{line} --json")).json();
    assert_eq!(report["marked_parts"], 3);
    assert_eq!(report["parts"][0]["part"], 1, "{report}");
    let run = folder.done(line);
    assert!(
        run.out.contains("1 of 3 that carry the mark: part 1"),
        "{}",
        run.out
    );
}
