//! Meshes in zip archives, 3MF among them: written back with everything else as it was.
#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use std::io::{Cursor, Read, Write};

use mesh::{TriMesh, shapes};
use mesh_io::{Asset, AssetProblem, Format, Precision, write_mesh};
use proptest::prelude::*;
use zip::{CompressionMethod, ZipArchive, ZipWriter, write::SimpleFileOptions};

fn open(bytes: &[u8]) -> Asset {
    Asset::from_bytes(bytes, None).unwrap_or_else(|error| panic!("{error}"))
}

fn refusal(bytes: &[u8]) -> String {
    Asset::from_bytes(bytes, None)
        .expect_err("a bad file")
        .to_string()
}

fn moved(mesh: &TriMesh) -> Vec<[f64; 3]> {
    mesh.positions()
        .iter()
        .map(|[x, y, z]| [x + 0.5, y - 0.25 * x, z * 1.5])
        .collect()
}

/// An archive of entries; those that are said to be stored are not compressed.
fn archive(entries: &[(&str, &[u8], bool)]) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    writer.set_raw_comment(b"kept".as_slice().into()).unwrap();
    for (name, content, stored) in entries {
        let method = if *stored {
            CompressionMethod::Stored
        } else {
            CompressionMethod::Deflated
        };
        writer
            .start_file(*name, SimpleFileOptions::default().compression_method(method))
            .unwrap();
        writer.write_all(content).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

/// Names and contents of the entries, in their order.
fn entries(bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).unwrap();
    assert_eq!(archive.comment(), b"kept");
    (0..archive.len())
        .map(|i| {
            let mut file = archive.by_index(i).unwrap();
            let mut content = Vec::new();
            file.read_to_end(&mut content).unwrap();
            (file.name().unwrap().into_owned(), content)
        })
        .collect()
}

fn threemf(model: &str) -> Vec<u8> {
    archive(&[
        ("[Content_Types].xml", b"<Types/>", false),
        ("Metadata/thumbnail.png", &[7; 100], true),
        ("3D/3dmodel.model", model.as_bytes(), false),
        ("_rels/.rels", b"<Relationships/>", false),
    ])
}

/// A tetrahedron of volume 1/6.
const MESH: &str = r#"<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x=" 1.0" y='0' z="0" />
  <vertex z="0" y="1" x="0"/><vertex x="0" y="0" z="1"/></vertices>
  <triangles><triangle v1="0" v2="2" v3="1" pid="1"/><triangle v1="0" v2="1" v3="3"/><triangle v1="1" v2="2" v3="3"/><triangle v1="2" v2="0" v3="3"/></triangles></mesh>"#;

fn model(resources: &str, build: &str) -> String {
    format!(
        r#"<?xml version="1.0"?><!-- by hand --><model unit="inch" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><metadata name="Title">a &lt;b&gt;</metadata><resources>{resources}</resources><build>{build}</build></model>"#
    )
}

fn one_object() -> Vec<u8> {
    threemf(&model(
        &format!(r#"<object id="4">{MESH}</object>"#),
        r#"<item objectid="4"/>"#,
    ))
}

#[test]
fn a_threemf_is_read_and_unchanged_it_keeps_every_byte() {
    let file = one_object();
    let asset = open(&file);
    assert_eq!(asset.format(), Format::ThreeMf);
    assert_eq!(
        (asset.mesh().vertex_count(), asset.mesh().triangle_count()),
        (4, 4)
    );
    assert!((asset.mesh().signed_volume() - 1.0 / 6.0).abs() < 1e-12);
    assert_eq!(*asset.to_bytes(), *file);
    let same = asset.with_positions(asset.mesh().positions()).unwrap();
    assert_eq!(*same.to_bytes(), *file);
}

#[test]
fn of_a_threemf_only_numbers_of_vertices_change() {
    let file = one_object();
    let asset = open(&file);
    let changed = asset.with_positions(&moved(asset.mesh())).unwrap();
    let bytes = changed.to_bytes();
    assert_eq!(open(&bytes).mesh(), changed.mesh());
    assert_eq!(open(&bytes).mesh().positions(), moved(asset.mesh()));
    let (old, new) = (entries(&file), entries(&bytes));
    for (i, (old, new)) in old.iter().zip(&new).enumerate() {
        assert_eq!(old.0, new.0);
        assert!(i == 2 || old.1 == new.1, "{}", old.0);
    }
    let without_numbers = |xml: &[u8]| {
        let text = String::from_utf8(xml.to_vec()).unwrap();
        text.chars()
            .filter(|c| !c.is_ascii_digit() && !"-.".contains(*c))
            .collect::<String>()
    };
    assert_eq!(without_numbers(&old[2].1), without_numbers(&new[2].1));
}

#[test]
fn objects_lie_where_items_and_components_put_them_and_once_each() {
    let resources = format!(
        r#"<object id="1">{MESH}</object><object id="2"><components><component objectid="1" transform="2 0 0 0 2 0 0 0 2 10 0 0"/>
           <component objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/></components></object>"#
    );
    let build = r#"<item objectid="2" transform="0 1 0 -1 0 0 0 0 1 0 0 5"/>"#;
    let asset = open(&threemf(&model(&resources, build)));
    // Doubled and moved by 10 along x, which the item turns to y; then up by 5.
    assert_eq!(asset.mesh().positions()[0], [0.0, 10.0, 5.0]);
    assert_eq!(asset.mesh().positions()[1], [0.0, 12.0, 5.0]);
    assert!((asset.mesh().signed_volume() - 8.0 / 6.0).abs() < 1e-12);
    let shown = asset.scene().unwrap();
    assert_eq!(shown.vertex_count(), 8);
    assert!(
        (shown.signed_volume() - 9.0 / 6.0).abs() < 1e-12,
        "the mirrored one faces outwards, too"
    );
    let changed = asset.with_positions(&moved(asset.mesh())).unwrap();
    assert_eq!(open(&changed.to_bytes()).mesh(), changed.mesh());
    for (held, wanted) in changed
        .mesh()
        .positions()
        .as_flattened()
        .iter()
        .zip(moved(asset.mesh()).as_flattened())
    {
        assert!((held - wanted).abs() < 1e-5);
    }
}

#[test]
fn what_a_threemf_lacks_is_said() {
    let object = |mesh: &str| {
        threemf(&model(
            &format!(r#"<object id="4">{mesh}</object>"#),
            r#"<item objectid="4"/>"#,
        ))
    };
    for (file, expected) in [
        (
            object(&MESH.replace("v3=\"1\"", "v3=\"9\"")),
            "a triangle whose vertex there is not",
        ),
        (
            object(&MESH.replace("x=\" 1.0\"", "x=\"one\"")),
            "\"one\" is not a number",
        ),
        (
            object(&MESH.replace("x=\" 1.0\"", "")),
            "vertex 1 needs three coordinates",
        ),
        (
            object(&MESH.replace("</mesh>", "</triangles>")),
            "not the XML of 3MF",
        ),
        (
            threemf(&model("", r#"<item objectid="4" p:path="/3D/Objects/a.model"/>"#)),
            "production extension",
        ),
        (
            threemf(&model(
                r#"<object id="1"><components><component objectid="1"/><component objectid="1"/></components></object>"#,
                r#"<item objectid="1"/>"#,
            )),
            "made of each other without end",
        ),
        (object(""), "triangle"),
    ] {
        let message = refusal(&file);
        assert!(message.contains(expected), "{expected}: {message}");
    }
}

/// Objects are numbered anew in each part of a package (3MF's production extension).
#[test]
fn an_object_of_another_part_is_never_taken_for_one_of_the_same_number() {
    let read = |component: &str, item: &str| {
        let resources = format!(
            r#"<object id="1">{MESH}</object><object id="2"><components>{component}</components></object><object id="3"><components><component objectid="1" p:path="/3D/unused.model"/></components></object>"#
        );
        Asset::from_bytes(threemf(&model(&resources, item)), None)
    };
    let own = r#"<component objectid="1" p:path="/3D/3DModel.model"/>"#;
    let other = r#"<component objectid="1" p:path="/3D/Objects/a.model"/>"#;
    let asset = read(own, r#"<item objectid="2"/>"#).unwrap();
    assert_eq!(asset.mesh().triangle_count(), 4);
    for (component, item) in [
        (other, r#"<item objectid="1"/><item objectid="2"/>"#),
        (own, r#"<item objectid="2" p:path="/3D/Objects/a.model"/>"#),
    ] {
        let message = read(component, item).unwrap_err().to_string();
        let words = "lies in another part of the package, /3D/Objects/a.model";
        assert!(message.contains(words) && message.contains("line "), "{message}");
    }
}

/// Ten of each in the next, fifteen deep, and no mesh in any of them.
#[test]
fn objects_that_are_made_of_nothing_again_and_again_are_refused() {
    let object = |i: usize| {
        let part = format!(r#"<component objectid="{}"/>"#, i + 1);
        format!(
            r#"<object id="{i}"><components>{}</components></object>"#,
            part.repeat(10)
        )
    };
    let nested: String = (100..115).map(object).collect();
    let resources = format!(r#"<object id="4">{MESH}</object>{nested}"#);
    let items = r#"<item objectid="4"/><item objectid="100"/>"#;
    let message = refusal(&threemf(&model(&resources, items)));
    assert!(message.contains("made of each other without end"), "{message}");
}

/// Each of 20 000 objects is placed by itself: who holds a vertex is looked up, or this takes minutes.
#[test]
fn positions_of_many_placed_objects_are_written_in_no_time() {
    let corner = |x: usize| {
        format!(r#"<vertex x="{x}" y="0" z="0"/><vertex x="{x}" y="1" z="0"/><vertex x="{x}" y="0" z="1"/>"#)
    };
    let triangles = r#"<triangles><triangle v1="0" v2="1" v3="2"/></triangles>"#;
    let object = |i: usize| {
        let vertices = corner(i);
        format!(r#"<object id="{i}"><mesh><vertices>{vertices}</vertices>{triangles}</mesh></object>"#)
    };
    // Built in another order than they are written in.
    let item = |i: usize| format!(r#"<item objectid="{i}" transform="1 0 0 0 1 0 0 0 1 0 0 {i}"/>"#);
    let resources: String = (0..20_000).map(object).collect();
    let items: String = (0..20_000).rev().map(item).collect();
    let asset = open(&threemf(&model(&resources, &items)));
    let shifted: Vec<[f64; 3]> = asset
        .mesh()
        .positions()
        .iter()
        .map(|[x, y, z]| [*x, y + 1.0, *z])
        .collect();
    assert_eq!(
        asset.with_positions(&shifted).unwrap().mesh().positions(),
        shifted
    );
}

#[test]
fn a_new_threemf_is_read_as_it_was_written() {
    let mesh = shapes::bumpy_sphere(2, 7);
    let asset = open(&write_mesh(&mesh, Format::ThreeMf, Precision::Double));
    assert_eq!(asset.mesh(), &mesh);
}

#[test]
fn the_one_mesh_of_an_archive_is_read_and_the_rest_stays() {
    let mesh = shapes::bumpy_sphere(2, 7);
    let obj = write_mesh(&mesh, Format::Obj, Precision::Double);
    let file = archive(&[
        ("model/model.obj", &obj, false),
        ("model/model.mtl", b"newmtl a", true),
        ("__MACOSX/model/._model.obj", b"junk", true),
        ("model/.hidden.obj", b"junk", true),
    ]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.zip");
    std::fs::write(&path, &file).unwrap();
    let asset = Asset::open(&path).unwrap();
    assert_eq!((asset.format(), asset.mesh()), (Format::Obj, &mesh));
    let changed = asset.with_positions(&moved(&mesh)).unwrap();
    let signed = folder.path().join("signed.zip");
    changed.save(&signed, false).unwrap();
    let again = Asset::open(&signed).unwrap();
    assert_eq!(again.mesh().positions(), moved(&mesh));
    let (old, new) = (entries(&file), entries(&std::fs::read(&signed).unwrap()));
    assert_eq!(old[1..], new[1..]);
    let error = changed.save(folder.path().join("signed.obj"), false).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("the output stays OBJ in a zip archive: give it a name that ends in .zip"),
        "{error}"
    );
}

/// A glTF with its buffer and a picture beside it, as they lie in archives of models; and its mesh.
fn gltf_beside(uri: &str) -> (TriMesh, String, Vec<u8>) {
    let mesh = shapes::bumpy_sphere(2, 7);
    let glb = write_mesh(&mesh, Format::Glb, Precision::Single);
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let mut json: serde_json::Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    json["buffers"][0]["uri"] = uri.into();
    json["images"] = serde_json::json!([{"uri": "textures/skin.png"}, {"uri": "missing.png"}]);
    let mesh = open(&glb).mesh().clone();
    (mesh, json.to_string(), glb[28 + length..].to_vec())
}

#[test]
fn a_gltf_in_an_archive_is_written_back_with_its_buffer_and_the_rest_stays() {
    let (mesh, json, bin) = gltf_beside("my%20scene.bin");
    let file = archive(&[
        ("readme.txt", b"my scene.bin", false),
        ("model/my scene.bin", &bin, false),
        ("model/scene.gltf", json.as_bytes(), true),
        ("model/textures/skin.png", &[7; 300], true),
        ("my scene.bin", b"another", false),
    ]);
    let asset = open(&file);
    assert_eq!((asset.format(), asset.mesh()), (Format::Gltf, &mesh));
    assert_eq!(asset.companions().count(), 0, "all lies in the archive");
    assert_eq!(*asset.to_bytes(), *file);

    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("my scene.bin"), b"beside the archive").unwrap();
    let changed = asset.with_positions(&moved(&mesh)).unwrap();
    changed.save(folder.path().join("signed.zip"), false).unwrap();
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        2,
        "one file is written"
    );
    let written = std::fs::read(folder.path().join("signed.zip")).unwrap();
    let (old, new) = (entries(&file), entries(&written));
    for (i, (old, new)) in old.iter().zip(&new).enumerate() {
        assert_eq!(old.0, new.0);
        assert_eq!(old.1 == new.1, ![1, 2].contains(&i), "{}", old.0);
    }
    let again = Asset::open(folder.path().join("signed.zip")).unwrap();
    assert_eq!(again.mesh(), changed.mesh());
    let twice = again.with_positions(&moved(again.mesh())).unwrap();
    assert_eq!(open(&twice.to_bytes()).mesh(), twice.mesh());
}

#[test]
fn of_a_gltf_in_an_archive_only_what_changes_is_packed_anew() {
    let (mesh, json, bin) = gltf_beside("scene.bin");
    let file = archive(&[("scene.gltf", json.as_bytes(), false), ("scene.bin", &bin, false)]);
    let asset = open(&file);
    // A vertex within the box: the bounds in the text stay.
    let mut positions = mesh.positions().to_vec();
    let extreme = |axis: usize| {
        let order = |a: &&[f64; 3], b: &&[f64; 3]| a[axis].total_cmp(&b[axis]);
        [
            mesh.positions().iter().min_by(order),
            mesh.positions().iter().max_by(order),
        ]
    };
    let extremes: Vec<_> = (0..3).flat_map(extreme).flatten().collect();
    let inside = positions.iter().position(|p| !extremes.contains(&p)).unwrap();
    positions[inside] = positions[inside].map(|x| 0.5 * x);
    let changed = asset.with_positions(&positions).unwrap();
    let (old, new) = (entries(&file), entries(&changed.to_bytes()));
    assert!(old[0] == new[0] && old[1].1 != new[1].1);
    assert_eq!(open(&changed.to_bytes()).mesh(), changed.mesh());
}

#[test]
fn a_gltf_in_an_archive_finds_its_buffer_there_or_nowhere() {
    let refused = |uri: &str, name: &str, words: &str| {
        let (_, json, bin) = gltf_beside(uri);
        let message = refusal(&archive(&[
            ("a/scene.gltf", json.as_bytes(), false),
            (name, &bin, false),
        ]));
        assert!(message.contains(words), "{uri}: {message}");
    };
    refused(
        "scene.bin",
        "scene.bin",
        "there is no a/scene.bin in this zip archive",
    );
    refused(
        "../scene.bin",
        "scene.bin",
        "lies elsewhere than beside the model",
    );
    refused(
        "%2e%2e/scene.bin",
        "scene.bin",
        "lies elsewhere than beside the model",
    );
    refused(
        "/etc/passwd",
        "etc/passwd",
        "lies elsewhere than beside the model",
    );
    // Beside the archive there is one.
    let folder = tempfile::tempdir().unwrap();
    let (_, json, bin) = gltf_beside("scene.bin");
    std::fs::write(folder.path().join("scene.bin"), &bin).unwrap();
    let file = archive(&[("scene.gltf", json.as_bytes(), false)]);
    std::fs::write(folder.path().join("model.zip"), file).unwrap();
    assert!(matches!(
        Asset::open(folder.path().join("model.zip")).unwrap_err().problem,
        AssetProblem::NotInArchive(_)
    ));
}

#[test]
fn archives_made_to_harm_are_refused() {
    let (_, json, bin) = gltf_beside("scene.bin");
    let bomb = vec![0; 40 << 20];
    let files = [
        ("scene.gltf", json.as_bytes(), false),
        ("scene.bin", &bomb, false),
    ];
    assert!(matches!(
        Asset::from_bytes(archive(&files), None).unwrap_err().problem,
        AssetProblem::ArchiveTooLarge { .. }
    ));
    // Two entries of one name, of which a reader might see the other.
    let twice = archive(&[
        ("scene.gltf", json.as_bytes(), false),
        ("scene.bin", &bin, false),
        ("other.bin", &bin, false),
    ]);
    let twice = replaced(twice, b"other.bin", b"scene.bin");
    assert!(refusal(&twice).contains("two of its entries have the same name"));
    // A comment in which some readers find a directory, behind the one that all archives here have.
    let mut nested = archive(&[("scene.gltf", json.as_bytes(), false), ("scene.bin", &bin, false)]);
    let comment = nested.len() - b"kept".len();
    nested.extend([b"PK\x05\x06", &[0xFF; 18][..]].concat());
    let length = u16::try_from(nested.len() - comment).unwrap();
    nested[comment - 2..comment].copy_from_slice(&length.to_le_bytes());
    assert!(refusal(&nested).contains("its comment holds another archive"));
    // Two records of the directory for the bytes of one entry, of which a copy would have two: the offset is the last number before the name.
    let mut shared = archive(&[
        ("scene.gltf", json.as_bytes(), false),
        ("scene.bin", &bin, false),
        ("other.bin", &bin, false),
    ]);
    let record = |name: &[u8]| {
        let mut all = (0..shared.len() - name.len()).rev();
        all.find(|&at| shared[at..].starts_with(name)).unwrap() - 4
    };
    let [from, to] = [record(b"scene.bin"), record(b"other.bin")];
    shared.copy_within(from..from + 4, to);
    assert!(
        refusal(&shared).contains("its entries overlap"),
        "{}",
        refusal(&shared)
    );
    // The bits that say that an entry is encrypted, in its own header and in the directory.
    let mut locked = archive(&[("scene.gltf", json.as_bytes(), false), ("scene.bin", &bin, false)]);
    let names: Vec<usize> = (0..locked.len() - 9)
        .filter(|&at| &locked[at..at + 9] == b"scene.bin")
        .collect();
    let [local, central] = names[..] else {
        panic!("{names:?}")
    };
    locked[local - 30 + 6] |= 1;
    locked[central - 46 + 8] |= 1;
    assert!(refusal(&locked).contains("the zip archive can't be read"));
}

/// Folders have entries of their own where a program packed them.
#[test]
fn the_entry_of_the_meshs_folder_stays_empty() {
    let mesh = shapes::bumpy_sphere(1, 3);
    let obj = write_mesh(&mesh, Format::Obj, Precision::Single);
    let file = archive(&[("models/", b"", true), ("models/ball.obj", &obj, false)]);
    let asset = open(&file);
    let changed = asset.with_positions(&moved(asset.mesh())).unwrap();
    let [(folder, content), (name, _)] = &entries(&changed.to_bytes())[..] else {
        panic!("two entries")
    };
    assert_eq!(
        (&**folder, content.len(), &**name),
        ("models/", 0, "models/ball.obj")
    );
    assert_eq!(open(&changed.to_bytes()).mesh(), changed.mesh());
}

/// The same bytes with another word in place of one.
fn replaced(mut bytes: Vec<u8>, old: &[u8], new: &[u8]) -> Vec<u8> {
    assert_eq!(old.len(), new.len());
    for at in 0..=bytes.len() - old.len() {
        if bytes[at..at + old.len()] == *old {
            bytes[at..at + old.len()].copy_from_slice(new);
        }
    }
    bytes
}

#[test]
fn archives_without_one_mesh_are_refused() {
    let several = archive(&[("a.obj", b"v", false), ("b.stl", b"", false)]);
    assert!(refusal(&several).contains("several meshes in this zip archive (a.obj, b.stl)"));
    assert!(refusal(&archive(&[("a.txt", b"", false)])).contains("no mesh in this zip archive"));
    assert!(refusal(b"PK\x03\x04 and nothing more").contains("can't be read"));
    let bomb = archive(&[("a.obj", &vec![b'#'; 30 << 20], false)]);
    assert!(matches!(
        Asset::from_bytes(bomb, None).unwrap_err().problem,
        AssetProblem::ArchiveTooLarge { .. }
    ));
}

proptest! {
    #[test]
    fn damaged_models_are_refused_or_read_and_nothing_panics(at in any::<prop::sample::Index>(), byte in any::<u8>(), raw in any::<bool>()) {
        let text = model(&format!(r#"<object id="4">{MESH}</object>"#), r#"<item objectid="4" transform="2 0 0 0 2 0 0 0 2 1 1 1"/>"#);
        let mut bytes = text.into_bytes();
        if !raw {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        let mut file = archive(&[("3D/3dmodel.model", &bytes, false)]);
        if raw {
            let at = at.index(file.len());
            file[at] = byte;
        }
        if let Ok(asset) = Asset::from_bytes(file, None) {
            let changed = asset.with_positions(&moved(asset.mesh()));
            if let Ok(changed) = changed {
                let again = open(&changed.to_bytes());
                prop_assert_eq!(again.mesh(), changed.mesh());
            }
        }
    }
}

#[test]
fn an_archive_whose_other_entries_are_damaged_is_refused_before_anything_is_written() {
    let mut file = one_object();
    // The local header of the last entry, of which the directory at the end still speaks.
    let at = file.windows(4).rposition(|word| word == b"PK\x03\x04").unwrap();
    file[at + 1] = b'?';
    assert!(refusal(&file).contains("the zip archive can't be read"));
}
