//! glTF as it comes: scenes, seams, buffers of all kinds; written back with new positions and nothing else changed.
#![allow(clippy::unwrap_used)] // in the helpers of tests, too

mod gltf_common;

use std::fs;

use gltf_common::Scene;
use mesh_io::{Asset, AssetProblem, Format};
use proptest::prelude::*;
use serde_json::{Value, json};

fn open(file: &[u8]) -> Asset {
    let asset = Asset::from_bytes(file, None);
    asset.unwrap_or_else(|error| panic!("{error}"))
}

fn refusal(file: &[u8]) -> String {
    Asset::from_bytes(file, None).expect_err("a bad file").to_string()
}

/// Every vertex somewhere else, by amounts that single precision holds.
fn moved(asset: &Asset) -> Vec<[f64; 3]> {
    let bend = |[x, y, z]: [f64; 3]| [x + 0.25, y - 0.125 * z, z + 0.0625 * x];
    asset.mesh().positions().iter().map(|&p| bend(p)).collect()
}

fn assert_near(held: &[[f64; 3]], wanted: &[[f64; 3]], tolerance: f64) {
    assert_eq!(held.len(), wanted.len());
    for (held, wanted) in held.as_flattened().iter().zip(wanted.as_flattened()) {
        assert!((held - wanted).abs() <= tolerance, "{held} for {wanted}");
    }
}

/// Moves all vertices, reads the file again, and checks that they are where they should be. Returns the new file.
fn moved_and_read_again(file: &[u8], tolerance: f64) -> Vec<u8> {
    let asset = open(file);
    let target = moved(&asset);
    let changed = asset.with_positions(&target).unwrap();
    assert_near(changed.mesh().positions(), &target, tolerance);
    let again = open(&changed.to_bytes());
    assert_eq!(again.mesh(), changed.mesh());
    let back = again.with_positions(asset.mesh().positions()).unwrap();
    assert_near(back.mesh().positions(), asset.mesh().positions(), tolerance);
    changed.to_bytes().into_owned()
}

#[test]
fn an_unchanged_file_keeps_every_byte() {
    for scene in gltf_common::scenes() {
        for file in [scene.glb(), scene.gltf()] {
            let asset = open(&file);
            assert_eq!(*asset.to_bytes(), *file, "{}", scene.name);
            let same = asset.with_positions(asset.mesh().positions()).unwrap();
            assert_eq!(*same.to_bytes(), *file, "{}", scene.name);
        }
    }
}

#[test]
fn every_kind_of_file_shows_the_same_pyramid_where_the_scene_puts_it() {
    for scene in gltf_common::scenes() {
        let asset = open(&scene.glb());
        assert_eq!(asset.format(), Format::Glb);
        assert_eq!(asset.mesh().vertex_count(), 5, "{}", scene.name);
        assert_eq!(asset.mesh().triangle_count(), 6, "{}", scene.name);
        assert!(
            (asset.mesh().signed_volume() - scene.volume).abs() < 1e-3 * scene.volume,
            "{}: {}",
            scene.name,
            asset.mesh().signed_volume()
        );
        assert_eq!(open(&scene.gltf()).mesh(), asset.mesh(), "{}", scene.name);
    }
}

#[test]
fn positions_are_written_where_they_lie_and_read_back() {
    for scene in gltf_common::scenes().into_iter().filter(|scene| scene.writable) {
        for file in [scene.glb(), scene.gltf()] {
            moved_and_read_again(&file, scene.tolerance);
        }
    }
}

#[test]
fn only_positions_and_their_bounds_change() {
    for scene in gltf_common::scenes().into_iter().filter(|scene| scene.writable) {
        let file = scene.glb();
        let changed = moved_and_read_again(&file, scene.tolerance);
        let [(old_json, old_bin), (new_json, new_bin)] =
            [&file, &changed].map(|file| gltf_common::parts(file));
        assert_eq!(old_bin.len(), new_bin.len());
        for (at, (old, new)) in old_bin.iter().zip(new_bin).enumerate() {
            assert!(
                old == new || scene.positions.iter().any(|bytes| bytes.contains(&at)),
                "{}: byte {at}",
                scene.name
            );
        }
        let [mut old, mut new]: [Value; 2] =
            [old_json, new_json].map(|json| serde_json::from_slice(json).unwrap());
        for json in [&mut old, &mut new] {
            for accessor in json["accessors"].as_array_mut().unwrap() {
                (accessor["min"], accessor["max"]) = (Value::Null, Value::Null);
            }
        }
        assert_eq!(old, new, "{}", scene.name);
        // The text is the same but for numbers: the words stand in their order.
        let words = |json: &[u8]| {
            let text = String::from_utf8(json.to_vec()).unwrap();
            text.chars()
                .filter(|c| !c.is_ascii_digit() && !"-.e ".contains(*c))
                .collect::<String>()
        };
        assert_eq!(words(old_json), words(new_json), "{}", scene.name);
    }
}

#[test]
fn bounds_are_those_of_the_numbers_in_the_file() {
    for scene in gltf_common::scenes().into_iter().filter(|scene| scene.writable) {
        let changed = moved_and_read_again(&scene.glb(), scene.tolerance);
        let (json, bin) = gltf_common::parts(&changed);
        let json: Value = serde_json::from_slice(json).unwrap();
        for (accessor, numbers) in scene.numbers(&json, bin) {
            for (name, pick) in [("min", f64::min as fn(f64, f64) -> f64), ("max", f64::max)] {
                for axis in 0..3 {
                    let true_bound = numbers.iter().map(|number| number[axis]).reduce(pick).unwrap();
                    let stated = accessor[name][axis].as_f64().unwrap();
                    assert_eq!(stated as f32, true_bound as f32, "{}: {name} {axis}", scene.name);
                }
            }
        }
    }
}

#[test]
fn a_surface_that_two_nodes_share_has_no_crack_before_or_after() {
    // Two triangles with an edge in common, in two meshes that a third of a turn and a move put where they belong: their corners
    // differ in the last digits.
    let scene = gltf_common::two_nodes_with_a_common_edge();
    let asset = open(&scene);
    assert_eq!(asset.welded().summary().file_vertices, 6);
    assert_eq!(asset.mesh().vertex_count(), 4, "the edge is one");
    let changed = asset.with_positions(&moved(&asset)).unwrap();
    let again = open(&changed.to_bytes());
    assert_eq!(
        (again.mesh().vertex_count(), again.mesh().triangle_count()),
        (4, 2)
    );
    assert_near(again.mesh().positions(), &moved(&asset), 2e-6);
}

#[test]
fn an_instance_is_marked_once_and_lies_where_the_default_scene_has_it_first() {
    let mut scene = Scene::pyramid();
    scene.json["nodes"] = json!([
        {"mesh": 0, "translation": [5, 0, 0]},
        {"mesh": 0, "translation": [9, 0, 0]},
        {"mesh": 0, "translation": [7, 0, 0]},
    ]);
    scene.json["scenes"] = json!([{"nodes": [0]}, {"nodes": [2, 1]}]);
    scene.json["scene"] = 1.into();
    let asset = open(&scene.glb());
    assert_eq!(asset.mesh().vertex_count(), 5);
    assert!(
        asset
            .mesh()
            .positions()
            .iter()
            .all(|p| (6.0..=8.0).contains(&p[0]))
    );
    assert_eq!(asset.name_of(4), None, "neither node nor mesh has a name");
    assert_eq!(open(&Scene::pyramid().glb()).name_of(4), Some("pyramid"));
    let shown = asset.scene().unwrap();
    // Neighbours stand side by side: two corners of each are those of the next.
    assert_eq!((shown.vertex_count(), shown.triangle_count()), (11, 18));
    assert!((shown.signed_volume() - 3.0 * 4.0).abs() < 1e-9);
    let changed = asset.with_positions(&moved(&asset)).unwrap();
    let shown = changed.scene().unwrap();
    assert!((shown.signed_volume() - 3.0 * changed.mesh().signed_volume()).abs() < 1e-6);
}

#[test]
fn a_mirrored_instance_faces_outwards_and_a_flood_of_instances_is_bounded() {
    let mut scene = Scene::pyramid();
    scene.json["nodes"] = json!([{"mesh": 0}, {"mesh": 0, "scale": [-1, 2, 1], "translation": [5, 0, 0]}]);
    scene.json["scenes"] = json!([{"nodes": [0, 1]}]);
    assert!((open(&scene.glb()).scene().unwrap().signed_volume() - 4.0 * 3.0).abs() < 1e-9);
    let nodes: Vec<Value> = (0..1000)
        .map(|i| json!({"mesh": 0, "translation": [3 * i, 0, 0]}))
        .collect();
    scene.json["scenes"][0]["nodes"] = (0..nodes.len()).collect();
    scene.json["nodes"] = nodes.into();
    let file = scene.glb();
    assert!(open(&file).scene().unwrap().triangle_count() <= file.len() + 6);
}

#[test]
fn a_manifest_of_all_bytes_is_not_carried_into_another_file() {
    let mut file = Scene::pyramid().glb();
    file.extend(12_u32.to_le_bytes());
    file.extend(b"C2PAwho made it.");
    let length = (file.len() as u32).to_le_bytes();
    file[8..12].copy_from_slice(&length);
    let asset = open(&file);
    assert!(asset.has_manifest());
    assert_eq!(*asset.to_bytes(), *file);
    let changed = asset.with_positions(&moved(&asset)).unwrap();
    assert!(!changed.has_manifest());
    let changed = changed.to_bytes();
    assert!(changed.windows(4).all(|word| word != b"C2PA"));
    assert_eq!(open(&changed).mesh().vertex_count(), 5);
}

#[test]
fn files_beside_the_model_go_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = Scene::pyramid();
    scene.json["buffers"][0]["uri"] = "data/my%20pyramid.bin".into();
    scene.json["images"] = json!([{"uri": "skin.png"}, {"uri": "missing.png"}]);
    fs::create_dir(folder.path().join("data")).unwrap();
    fs::write(folder.path().join("data/my pyramid.bin"), &scene.bin).unwrap();
    fs::write(folder.path().join("skin.png"), b"\x89PNG and so on").unwrap();
    let text = serde_json::to_string_pretty(&scene.json).unwrap();
    fs::write(folder.path().join("model.gltf"), &text).unwrap();
    let asset = Asset::open(folder.path().join("model.gltf")).unwrap();
    let names: Vec<&str> = asset.companions().map(|(name, _)| name).collect();
    assert_eq!(names, ["data/my pyramid.bin", "skin.png"]);

    let other = tempfile::tempdir().unwrap();
    let changed = asset.with_positions(&moved(&asset)).unwrap();
    changed.save(other.path().join("signed.gltf"), false).unwrap();
    let again = Asset::open(other.path().join("signed.gltf")).unwrap();
    assert_eq!(again.mesh(), changed.mesh());
    let skin = fs::read(other.path().join("skin.png")).unwrap();
    assert_eq!(skin, b"\x89PNG and so on");
    // In the original's folder its buffer would be lost.
    let error = changed
        .save(folder.path().join("signed.gltf"), false)
        .unwrap_err();
    assert!(matches!(error.problem, AssetProblem::Exists), "{error}");
    assert_eq!(
        fs::read(folder.path().join("data/my pyramid.bin")).unwrap(),
        scene.bin
    );

    let in_memory = Asset::from_bytes(text, Format::Gltf).unwrap_err().to_string();
    assert!(in_memory.contains("open it by its path"), "{in_memory}");
}

/// Whoever gets a copy gets all that goes with it.
#[test]
fn no_key_and_nothing_that_is_no_picture_goes_with_a_strangers_model() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.gltf");
    fs::write(folder.path().join("owner.pem"), b"-----BEGIN PRIVATE KEY-----\n").unwrap();
    fs::write(folder.path().join(".env"), b"PASSWORD=1").unwrap();
    let mut scene = Scene::pyramid();
    scene.json["images"] = json!([{"uri": "owner.pem"}, {"uri": ".env"}]);
    fs::write(&path, scene.gltf()).unwrap();
    assert_eq!(Asset::open(&path).unwrap().companions().count(), 0);
    let key = json!({"uri": "owner.pem", "byteLength": 5});
    scene.json["buffers"].as_array_mut().unwrap().push(key);
    fs::write(&path, scene.gltf()).unwrap();
    let error = Asset::open(&path).unwrap_err().to_string();
    assert!(error.contains("owner.pem, which holds a key"), "{error}");
}

/// Lists that name the same bytes again and again would be as many triangles.
#[test]
fn no_more_triangles_and_vertices_are_read_than_the_file_has_bytes_for() {
    let floats = |count: usize| 12 * count;
    for (is_positions, size, problem) in [
        (false, 2 * 3000, "more corners of triangles than bytes"),
        (
            true,
            floats(3000),
            "more lists of positions than the file has bytes for",
        ),
    ] {
        let of_primitives = |count: usize| {
            let mut scene = Scene::pyramid();
            let view = scene.add_view(vec![0; size]);
            for accessor in 2..2 + count {
                let (kind, list) = match is_positions {
                    true => (5126, json!({"attributes": {"POSITION": accessor}})),
                    false => (5123, json!({"attributes": {"POSITION": 0}, "indices": accessor})),
                };
                let of = if is_positions { "VEC3" } else { "SCALAR" };
                let own = json!({"bufferView": view, "componentType": kind, "count": 3000, "type": of});
                scene.json["accessors"].as_array_mut().unwrap().push(own);
                let primitives = &mut scene.json["meshes"][0]["primitives"];
                primitives.as_array_mut().unwrap().push(list);
            }
            scene.glb()
        };
        assert_eq!(open(&of_primitives(2)).mesh().triangle_count(), 6);
        let refused = refusal(&of_primitives(40));
        assert!(refused.contains(problem), "{refused}");
    }
}

#[test]
fn lists_that_nobody_needs_may_not_name_the_same_bytes_without_end() {
    let with_lists = |count: usize| {
        let mut scene = Scene::pyramid();
        let view = scene.add_view(vec![0; 8 * 3000]);
        for number in 0..count {
            let list = json!({"bufferView": view, "componentType": 5126, "count": 3000, "type": "VEC2"});
            scene.json["accessors"].as_array_mut().unwrap().push(list);
            let name = format!("TEXCOORD_{number}");
            scene.json["meshes"][0]["primitives"][0]["attributes"][name] = (2 + number).into();
        }
        scene.glb()
    };
    assert_eq!(open(&with_lists(3)).mesh().triangle_count(), 6);
    let refused = refusal(&with_lists(2000));
    assert!(refused.contains("the same bytes again and again"), "{refused}");
}

/// One list of positions for all of many parts, as programs write it that divide a model by its materials.
#[test]
fn many_parts_with_one_list_of_positions_are_read_in_no_time() {
    let (parts, vertices) = (20_000, 100_000);
    let mut scene = Scene::pyramid();
    let corners = (0..vertices).flat_map(|v| [v as f32, (v % 7) as f32, (v % 11) as f32]);
    let positions = scene.add_view(corners.flat_map(f32::to_le_bytes).collect());
    let indices = scene.add_view((0..3 * parts as u32).flat_map(u32::to_le_bytes).collect());
    let mut lists = scene.json["accessors"].as_array().unwrap().clone();
    lists.push(json!({"bufferView": positions, "componentType": 5126, "count": vertices, "type": "VEC3"}));
    let primitives = (0..parts).map(|part| {
        let offset = 12 * part;
        lists.push(json!({"bufferView": indices, "byteOffset": offset, "componentType": 5125, "count": 3, "type": "SCALAR"}));
        json!({"attributes": {"POSITION": 2}, "indices": 3 + part})
    });
    scene.json["meshes"][0]["primitives"] = primitives.collect();
    scene.json["accessors"] = lists.into();
    assert_eq!(open(&scene.glb()).mesh().triangle_count(), parts);
}

#[test]
fn bytes_that_mean_something_else_too_are_not_changed() {
    let mut scene = Scene::pyramid();
    scene.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 0.into();
    let asset = open(&scene.glb());
    assert_eq!(asset.mesh().vertex_count(), 5);
    let error = asset.with_positions(&moved(&asset)).unwrap_err().to_string();
    assert!(error.contains("for something else, too"), "{error}");
    assert!(asset.with_positions(asset.mesh().positions()).is_ok());
}

#[test]
fn compressed_geometry_is_refused_with_the_way_out() {
    for (extension, name) in [
        ("KHR_draco_mesh_compression", "Draco"),
        ("EXT_meshopt_compression", "meshopt"),
    ] {
        let mut scene = Scene::pyramid();
        scene.json["extensionsUsed"] = json!([extension]);
        let message = refusal(&scene.glb());
        assert!(
            message.contains(name) && message.contains("gltf-transform"),
            "{message}"
        );
    }
}

#[test]
fn references_that_lead_nowhere_are_refused() {
    type Damage = fn(&mut Value);
    let cases: [(Damage, &str); 14] = [
        (
            |json| json["meshes"][0]["primitives"][0]["indices"] = 77.into(),
            "accessor 77 is referred to",
        ),
        (
            |json| json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 77.into(),
            "accessor 77",
        ),
        (|json| json["nodes"][0]["mesh"] = 3.into(), "mesh 3"),
        (|json| json["nodes"][0]["children"] = json!([8]), "node 8"),
        (|json| json["nodes"][0]["skin"] = 1.into(), "skin 1"),
        (|json| json["scenes"][0]["nodes"] = json!([4]), "node 4"),
        (
            |json| json["accessors"][0]["bufferView"] = 9.into(),
            "buffer view 9",
        ),
        (|json| json["bufferViews"][0]["buffer"] = 2.into(), "buffer 2"),
        (
            |json| json["accessors"][0]["count"] = 4_000_000_000_u32.into(),
            "accessor 0 goes beyond its buffer view",
        ),
        (
            |json| json["accessors"][0]["byteOffset"] = json!(u64::MAX),
            "accessor 0 goes beyond its buffer view",
        ),
        (
            |json| json["bufferViews"][0]["byteLength"] = json!(u64::MAX),
            "buffer view 0 goes beyond its buffer",
        ),
        (
            |json| json["buffers"][0]["byteLength"] = json!(1_u64 << 40),
            "buffer 0 should have",
        ),
        (
            |json| json["accessors"][0]["type"] = "VEC2".into(),
            "accessor 0 holds no positions",
        ),
        (
            |json| {
                json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
                json["accessors"][0]["count"] = json!(1_u64 << 40);
            },
            "more elements than the file has bytes",
        ),
    ];
    for (damage, expected) in cases {
        let mut scene = Scene::pyramid();
        damage(&mut scene.json);
        let message = refusal(&scene.glb());
        assert!(message.contains(expected), "{expected}: {message}");
    }
    let mut scene = Scene::pyramid();
    scene.bin[60] = 200; // an index
    assert!(refusal(&scene.glb()).contains("names a vertex that there is not"));
    let mut scene = Scene::pyramid();
    scene.json["nodes"] = json!([{"mesh": 0, "children": [1]}, {"children": [0]}]);
    assert_eq!(
        open(&scene.glb()).mesh().vertex_count(),
        5,
        "a ring of nodes ends"
    );
}

#[test]
fn a_scene_without_a_mesh_or_with_lines_alone_has_no_surface() {
    let mut scene = Scene::pyramid();
    scene.json["meshes"][0]["primitives"][0]["mode"] = 1.into();
    assert!(
        refusal(&scene.glb()).contains("triangle"),
        "{}",
        refusal(&scene.glb())
    );
    let mut scene = Scene::pyramid();
    scene.json["nodes"][0]["scale"] = json!([1, 0, 1]);
    assert!(refusal(&scene.glb()).contains("triangle"));
}

proptest! {
    #[test]
    fn damaged_files_are_refused_or_read_and_nothing_panics(
        which in 0_usize..16,
        at in any::<prop::sample::Index>(),
        byte in any::<u8>(),
        length in any::<prop::sample::Index>(),
        cut in any::<bool>(),
    ) {
        let scenes = gltf_common::scenes();
        let scene = &scenes[which % scenes.len()];
        let mut file = if which % 2 == 0 { scene.glb() } else { scene.gltf() };
        let at = at.index(file.len());
        file[at] = byte;
        if cut {
            file.truncate(length.index(file.len()));
        }
        if let Ok(asset) = Asset::from_bytes(file, None) {
            let _ = asset.with_positions(&moved(&asset));
        }
    }
}

#[test]
fn a_new_file_is_read_as_it_was_written() {
    let mesh = mesh::shapes::bumpy_sphere(2, 7);
    for format in [Format::Glb, Format::Gltf] {
        let file = mesh_io::write_mesh(&mesh, format, mesh_io::Precision::Single);
        let asset = Asset::from_bytes(file, format).unwrap();
        assert_eq!(asset.mesh().triangles(), mesh.triangles());
        assert_near(asset.mesh().positions(), mesh.positions(), 1e-6);
    }
}

#[test]
fn positions_over_the_numbers_of_replaced_ones_are_not_changed() {
    let mut scenes = gltf_common::scenes().into_iter();
    let mut scene = scenes
        .find(|scene| scene.name.starts_with("sparse: the apex"))
        .unwrap();
    // The list of what is replaced begins where the first position does.
    scene.json["accessors"][0]["sparse"]["indices"] =
        json!({"bufferView": 0, "byteOffset": 0, "componentType": 5121});
    let asset = open(&scene.glb());
    let changed = asset.with_positions(&moved(&asset));
    assert!(
        changed
            .unwrap_err()
            .to_string()
            .contains("for something else, too")
    );
}

#[test]
fn a_manifest_before_the_json_is_not_carried_on() {
    let file = Scene::pyramid().glb();
    let mut early = file[..12].to_vec();
    early.extend(12_u32.to_le_bytes());
    early.extend(b"C2PAwho made it.");
    early.extend(&file[12..]);
    let length = (early.len() as u32).to_le_bytes();
    early[8..12].copy_from_slice(&length);
    assert!(refusal(&early).contains("no JSON chunk"));
}

#[test]
fn joints_and_weights_are_those_of_the_skin_and_a_file_without_one_has_no_rig() {
    use gltf_common::Scene;
    assert_eq!(open(&Scene::pyramid().glb()).rig().unwrap(), None);

    let mut scene = Scene::pyramid();
    let joints = scene.add_view(
        [
            [0, 1, 0, 0],
            [1, 0, 0, 0],
            [0, 0, 0, 0],
            [1, 1, 0, 0],
            [0, 1, 0, 0],
        ]
        .concat(),
    );
    let shares: [[u8; 4]; 5] = [
        [51, 204, 0, 0],
        [255, 0, 0, 0],
        [255, 0, 0, 0],
        [100, 155, 0, 0],
        [0, 255, 0, 0],
    ];
    let weights = scene.add_view(shares.concat());
    let numbers = |view: usize| serde_json::json!({"bufferView": view, "componentType": 5121, "count": 5, "type": "VEC4"});
    let accessors = scene.json["accessors"].as_array_mut().unwrap();
    accessors.extend([numbers(joints), numbers(weights)]);
    accessors[3]["normalized"] = true.into();
    let attributes = &mut scene.json["meshes"][0]["primitives"][0]["attributes"];
    (attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (2.into(), 3.into());
    scene.json["skins"] = serde_json::json!([{"joints": [1, 2]}]);
    scene.json["nodes"] = serde_json::json!([{"mesh": 0, "skin": 0}, {}, {}]);
    let asset = open(&scene.glb());
    let rig = asset.rig().unwrap().unwrap();
    assert_eq!((rig.joints(), rig.vertices()), (2, 5));
    let apex = (0..5).find(|&v| asset.mesh().positions()[v][1] == 3.0).unwrap();
    let corner = (0..5)
        .find(|&v| asset.mesh().positions()[v] == [-1.0, 0.0, -1.0])
        .unwrap();
    // The joint that is named first has the number 0.
    assert_eq!(rig.weights_of(corner), [(0, 0.2), (1, 0.8)]);
    assert_eq!(rig.weights_of(apex), [(1, 1.0)]);

    // However often a file names the same bytes.
    let attributes = &mut scene.json["meshes"][0]["primitives"][0]["attributes"];
    for set in 1..2000 {
        (
            attributes[format!("JOINTS_{set}")],
            attributes[format!("WEIGHTS_{set}")],
        ) = (2.into(), 3.into());
    }
    assert_eq!(open(&scene.glb()).rig().unwrap(), Some(rig));

    scene.json["accessors"][3]["type"] = "VEC3".into();
    let refused = open(&scene.glb()).rig().unwrap_err().to_string();
    assert!(refused.contains("accessor 3"), "{refused}");
}

#[test]
fn morph_targets_are_read_in_the_frame_of_the_mesh_and_bytes_that_are_named_too_often_are_refused() {
    use gltf_common::Scene;
    let mut scene = Scene::pyramid();
    let floats = |numbers: &[f32]| numbers.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>();
    let mut all = [0.0f32; 180];
    all[12..15].copy_from_slice(&[0.0, 0.5, 0.25]);
    let whole = scene.add_view(floats(&all));
    let (numbers, offsets) = (
        scene.add_view(vec![4, 0]),
        scene.add_view(floats(&[1.0, 2.0, 3.0])),
    );
    let accessors = scene.json["accessors"].as_array_mut().unwrap();
    let plain = serde_json::json!({"componentType": 5126, "count": 5, "type": "VEC3"});
    accessors.extend([plain.clone(), plain.clone(), plain]);
    (accessors[2]["bufferView"], accessors[2]["count"]) = (whole.into(), 60.into());
    accessors[3]["sparse"] = serde_json::json!({"count": 1, "indices": {"bufferView": numbers, "componentType": 5121},
        "values": {"bufferView": offsets}});
    // The third moves nothing.
    let targets = serde_json::json!([{"POSITION": 2}, {"POSITION": 4}, {"POSITION": 3}]);
    scene.json["meshes"][0]["primitives"][0]["targets"] = targets;
    // A quarter turn about y, twice as large.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    scene.json["nodes"] =
        serde_json::json!([{"mesh": 0, "rotation": [0.0, half, 0.0, half], "scale": [2.0, 2.0, 2.0]}]);
    let asset = open(&scene.glb());
    let rig = asset.rig().unwrap().unwrap();
    let apex = (0..5).find(|&v| asset.mesh().positions()[v][1] == 6.0).unwrap() as u32;
    assert_eq!((rig.joints(), rig.vertices()), (1, 5));
    let expected = [[0.5, 1.0, 0.0], [6.0, 4.0, -2.0]];
    assert_eq!(rig.targets().len(), 2);
    for (target, expected) in rig.targets().iter().zip(expected) {
        let [(vertex, offset)] = target[..] else {
            panic!("{target:?}")
        };
        assert_eq!(vertex, apex);
        assert!(
            offset.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6),
            "{offset:?}"
        );
    }

    let often = vec![serde_json::json!({"POSITION": 2}); 1000];
    scene.json["meshes"][0]["primitives"][0]["targets"] = often.into();
    let refused = open(&scene.glb()).rig().unwrap_err().to_string();
    assert!(
        refused.contains("morph targets than the file has bytes"),
        "{refused}"
    );
    scene.json["meshes"][0]["primitives"][0]["targets"] = serde_json::json!([{"POSITION": 1}]);
    assert!(open(&scene.glb()).rig().is_err());
}
