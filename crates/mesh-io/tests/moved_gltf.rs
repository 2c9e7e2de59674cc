//! Normals, tangents and morph targets of glTF turn with the mesh, wherever nodes place it.
#![allow(clippy::unwrap_used)] // in the helpers of tests, too

mod gltf_common;
mod moved_common;

use gltf_common::{Scene, parts, push, scenes};
use mesh::{Similarity, Vec3};
use mesh_io::{Asset, Moved};
use moved_common::{assert_near, similarities, turned};
use proptest::prelude::*;
use serde_json::{Value, json};

const FLOAT: u32 = 5126;
const BYTE: u32 = 5120;
const SHORT: u32 = 5122;

/// The one scene with a node that stretches, and how many times its longest side is its shortest.
const STRETCHED: &str = "placed by two nodes";
const STRETCH: f64 = 6.0;

/// A scene whose first primitive has normals, tangents in the plane of two morph targets, and a third target of normals.
struct Dressed {
    scene: Scene,
    kind: u32,
    count: usize,
    /// First bytes of normals, tangents, the two targets of positions and the one of normals.
    at: [usize; 5],
}

/// A right-handed frame, another one for every vertex.
fn frame(vertex: usize) -> [Vec3; 3] {
    let angle = vertex as f64;
    let normal = Vec3([angle.cos() * 0.8, 0.6, angle.sin() * 0.8]);
    let along = normal.cross(Vec3([0.3, -0.2, 1.0])).unit();
    [normal, along, normal.cross(along)]
}

/// The w of a vertex's tangent.
fn sign(vertex: usize) -> f64 {
    if vertex.is_multiple_of(2) { 1.0 } else { -1.0 }
}

fn encoded(vectors: impl Iterator<Item = Vec<f64>>, kind: u32) -> Vec<u8> {
    let number = |x: f64| match kind {
        FLOAT => (x as f32).to_le_bytes().to_vec(),
        SHORT => ((x * 32_767.0).round() as i16).to_le_bytes().to_vec(),
        _ => ((x * 127.0).round() as i8).to_le_bytes().to_vec(),
    };
    let padded = vectors.map(|vector| {
        let mut bytes: Vec<u8> = vector.into_iter().flat_map(number).collect();
        bytes.resize(bytes.len().next_multiple_of(4), 0x55);
        bytes
    });
    padded.flatten().collect()
}

impl Dressed {
    fn of(mut scene: Scene, kind: u32) -> Self {
        let positions = &scene.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"];
        let count = scene.json["accessors"][positions.as_u64().unwrap() as usize]["count"]
            .as_u64()
            .unwrap() as usize;
        let mut at = [0; 5];
        let mut accessors = [0; 5];
        for list in 0..5 {
            let vector = |v: usize| {
                let [normal, along, across] = frame(v);
                match list {
                    0 => normal.0.to_vec(),
                    1 => [along.0.as_slice(), &[sign(v)]].concat(),
                    2 => (along * 0.25).0.to_vec(),
                    3 => (across * 0.125).0.to_vec(),
                    _ => (along * 0.5).0.to_vec(),
                }
            };
            let own = if list < 2 { kind } else { FLOAT };
            let bytes = encoded((0..count).map(vector), own);
            let stride = bytes.len() / count;
            at[list] = scene.bin.len();
            let view = scene.add_view(bytes);
            scene.json["bufferViews"][view]["byteStride"] = stride.into();
            let accessor = json!({"bufferView": view, "componentType": own, "normalized": own != FLOAT, "count": count,
                "type": if list == 1 { "VEC4" } else { "VEC3" }});
            accessors[list] = push(&mut scene.json["accessors"], accessor);
        }
        let primitive = &mut scene.json["meshes"][0]["primitives"][0];
        let [normals, tangents, along, across, offsets] = accessors;
        primitive["attributes"]["NORMAL"] = normals.into();
        primitive["attributes"]["TANGENT"] = tangents.into();
        primitive["targets"] = json!([{"POSITION": along, "NORMAL": offsets}, {"POSITION": across}]);
        Self {
            scene,
            kind,
            count,
            at,
        }
    }

    /// A vector of a list; the fourth number is 0 where there are three.
    fn read(&self, bin: &[u8], list: usize, vertex: usize) -> [f64; 4] {
        let kind = if list < 2 { self.kind } else { FLOAT };
        let components = if list == 1 { 4 } else { 3 };
        let size: usize = match kind {
            FLOAT => 4,
            SHORT => 2,
            _ => 1,
        };
        let start = self.at[list] + vertex * (components * size).next_multiple_of(4);
        std::array::from_fn(|i| {
            let raw = &bin[start + i.min(components - 1) * size..][..size];
            match kind {
                _ if i >= components => 0.0,
                FLOAT => f64::from(f32::from_le_bytes(raw.try_into().unwrap())),
                SHORT => f64::from(i16::from_le_bytes(raw.try_into().unwrap())) / 32_767.0,
                _ => f64::from(raw[0] as i8) / 127.0,
            }
        })
    }

    fn vector(&self, bin: &[u8], list: usize, vertex: usize) -> Vec3 {
        let [x, y, z, _] = self.read(bin, list, vertex);
        Vec3([x, y, z])
    }

    /// How far numbers of normals and tangents are from true.
    fn tolerance(&self) -> f64 {
        match self.kind {
            FLOAT => 1e-5,
            SHORT => 1e-4,
            _ => 2e-2,
        }
    }

    /// How far from right their angles are: where a node stretches what rounding did before the move, [`STRETCH`] times, and what it does after.
    fn tolerance_of_angles(&self) -> f64 {
        let step = match self.kind {
            SHORT if self.scene.name == STRETCHED => 1.0 / 32_767.0,
            BYTE if self.scene.name == STRETCHED => 1.0 / 127.0,
            _ => return self.tolerance(),
        };
        (STRETCH + 1.0) * 3_f64.sqrt() * step / 2.0
    }

    /// All that must hold of a file after a move, whatever the nodes do, by what held before.
    fn check(&self, bin: &[u8], by: &Similarity) {
        let sign = if by.mirrors() { -1.0 } else { 1.0 };
        for v in 0..self.count {
            let [normal, tangent, along, across] = [0, 1, 2, 3].map(|list| self.vector(bin, list, v));
            let name = self.scene.name;
            let (tolerance, of_angles) = (self.tolerance(), self.tolerance_of_angles());
            assert!(
                (normal.norm() - 1.0).abs() < tolerance,
                "{name}: a normal of length {}",
                normal.norm()
            );
            assert!(
                (tangent.norm() - 1.0).abs() < tolerance,
                "{name}: a tangent of length {}",
                tangent.norm()
            );
            // Right angles of the surface stay right angles to its normal, and the sides stay what they were.
            assert!(
                normal.dot(along.unit()).abs() < of_angles,
                "{name}: {}",
                normal.dot(along.unit())
            );
            assert!(
                normal.dot(across.unit()).abs() < of_angles,
                "{name}: {}",
                normal.dot(across.unit())
            );
            assert!(
                sign * normal.dot(along.cross(across)) > 0.0,
                "{name}: a normal on the other side"
            );
            assert_near(tangent.0, along.unit().0, of_angles);
            let w = self.read(bin, 1, v)[3];
            assert_eq!(w, sign * self::sign(v), "{name}");
        }
    }
}

fn moved(file: &[u8], by: &Similarity) -> Moved {
    Asset::from_bytes(file, None).unwrap().moved_by(by).unwrap()
}

/// Without the list of normals in morph targets, which are left where a node stretches.
fn left(moved: &Moved) -> Vec<String> {
    let left = moved.left.iter().map(ToString::to_string);
    left.filter(|left| !left.contains("of a morph target") && !left.starts_with("the skeleton"))
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn normals_tangents_and_offsets_turn_with_the_mesh_wherever_it_is_placed(by in similarities()) {
        for scene in scenes().into_iter().filter(|scene| scene.writable && !scene.name.starts_with("quantised")) {
            for kind in [FLOAT, SHORT, BYTE] {
                let dressed = Dressed::of(scene.clone(), kind);
                let file = dressed.scene.glb();
                let there = moved(&file, &by);
                prop_assert_eq!(left(&there), Vec::<String>::new(), "{}", scene.name);
                let bytes = there.asset.to_bytes();
                let (json, bin) = parts(&bytes);
                dressed.check(bin, &by);

                // All other bytes are those that positions alone would have changed.
                let asset = Asset::from_bytes(file.clone(), None).unwrap();
                let alone = asset.with_positions(&by.apply_all(asset.mesh().positions())).unwrap();
                prop_assert_eq!(there.asset.mesh(), alone.mesh());
                let alone = alone.to_bytes();
                let (json_alone, bin_alone) = parts(&alone);
                prop_assert!(json == json_alone, "{}", scene.name);
                let first = dressed.at[0];
                prop_assert!(bin[..first] == bin_alone[..first], "{}", scene.name);

                let back = moved(&bytes, &by.inverse());
                let back = back.asset.to_bytes();
                let (_, old) = parts(&file);
                for v in 0..dressed.count {
                    for list in 0..4 {
                        let (old, new) = (dressed.vector(old, list, v), dressed.vector(parts(&back).1, list, v));
                        // What rounding did is multiplied on both ways.
                        assert_near(new.0, old.0, 2.0 * STRETCH * dressed.tolerance());
                    }
                }
            }
        }
    }

    #[test]
    fn a_morphed_mesh_moves_as_the_mesh_does(by in similarities()) {
        let names = ["plain", "placed by two nodes", "mirrored by a matrix", "skinned", "without scenes and nodes"];
        for scene in scenes().into_iter().filter(|scene| names.contains(&scene.name)) {
            let dressed = Dressed::of(scene, FLOAT);
            let morphed = |file: &[u8]| {
                let bin = parts(file).1;
                let mut new = file.to_vec();
                let start = bin.as_ptr() as usize - file.as_ptr() as usize;
                for v in 0..dressed.count {
                    let offset = dressed.vector(bin, 2, v);
                    for axis in 0..3 {
                        let at = start + 12 * v + 4 * axis;
                        let x = f32::from_le_bytes(new[at..at + 4].try_into().unwrap()) + offset.0[axis] as f32;
                        new[at..at + 4].copy_from_slice(&x.to_le_bytes());
                    }
                }
                Asset::from_bytes(new, None).unwrap().mesh().positions().to_vec()
            };
            let file = dressed.scene.glb();
            let there = moved(&file, &by).asset.to_bytes().into_owned();
            for (old, new) in morphed(&file).into_iter().zip(morphed(&there)) {
                assert_near(new, by.apply(old), 1e-4 * (1.0 + by.scale));
            }
        }
    }
}

proptest! {
    #[test]
    fn damaged_files_are_moved_or_refused_and_nothing_panics(
        which in 0_usize..16, at in any::<prop::sample::Index>(), byte in any::<u8>(), by in similarities()
    ) {
        let scenes = scenes();
        let dressed = Dressed::of(scenes[which % scenes.len()].clone(), [FLOAT, SHORT, BYTE][which % 3]);
        let mut file = if which % 2 == 0 { dressed.scene.glb() } else { dressed.scene.gltf() };
        let at = at.index(file.len());
        file[at] = byte;
        if let Ok(moved) = Asset::from_bytes(file, None).and_then(|asset| asset.moved_by(&by)) {
            let again = Asset::from_bytes(moved.asset.to_bytes(), moved.asset.format());
            prop_assert!(again.is_ok(), "{}", again.unwrap_err());
        }
    }
}

#[test]
fn normals_of_a_morph_target_turn_and_are_left_where_a_node_stretches() {
    let by = Similarity {
        scale: 3.0,
        ..Similarity::from_quaternion([0.3, 0.2, -0.7, 0.1])
    };
    let dressed = Dressed::of(Scene::pyramid(), FLOAT);
    let file = dressed.scene.glb();
    let there = moved(&file, &by);
    assert_eq!(there.left, []);
    let bytes = there.asset.to_bytes();
    for v in 0..dressed.count {
        let old = dressed.vector(parts(&file).1, 4, v);
        assert_near(dressed.vector(parts(&bytes).1, 4, v).0, turned(&by, old.0), 1e-6);
    }
    let scene = scenes()
        .into_iter()
        .find(|scene| scene.name == "placed by two nodes")
        .unwrap();
    let there = moved(&Dressed::of(scene, FLOAT).scene.glb(), &by);
    let left: Vec<String> = there.left.iter().map(ToString::to_string).collect();
    assert!(
        left.len() == 1
            && left[0].starts_with("the normals of a morph target")
            && left[0].contains("stretches"),
        "{left:?}"
    );
}

#[test]
fn sparse_normals_turn_and_bounds_follow() {
    let quarter = Similarity::from_quaternion([1.0, 0.0, 0.0, 1.0]);
    let mut scene = Scene::pyramid();
    let [base, values, numbers] = [
        encoded((0..5).map(|_| vec![0.0, 0.0, 1.0]), FLOAT),
        encoded([vec![1.0, 0.0, 0.0]].into_iter(), FLOAT),
        vec![2, 0],
    ]
    .map(|bytes| scene.add_view(bytes));
    let start = scene.bin.len() - 4 - 12;
    let accessor = json!({"bufferView": base, "componentType": FLOAT, "count": 5, "type": "VEC3",
        "min": [0.0, 0.0, 0.0], "max": [1.0, 0.0, 1.0], "sparse": {
            "count": 1, "indices": {"bufferView": numbers, "componentType": 5123}, "values": {"bufferView": values}}});
    let normals = push(&mut scene.json["accessors"], accessor);
    scene.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    for file in [scene.glb(), scene.gltf()] {
        let there = moved(&file, &quarter);
        assert_eq!(there.left, []);
        let again = Asset::from_bytes(there.asset.to_bytes(), there.asset.format()).unwrap();
        assert_eq!(again.mesh(), there.asset.mesh());
    }
    let there = moved(&scene.glb(), &quarter).asset.to_bytes().into_owned();
    let (text, bin) = parts(&there);
    assert_eq!(
        bin[start..start + 12],
        *encoded([vec![0.0, 1.0, 0.0]].into_iter(), FLOAT)
    );
    let json: Value = serde_json::from_slice(text).unwrap();
    let accessor = &json["accessors"][normals];
    assert_eq!(
        (&accessor["min"], &accessor["max"]),
        (&json!([0.0, 0.0, 0.0]), &json!([0, 1, 1.0]))
    );
}

#[test]
fn what_can_not_be_turned_is_left_and_named() {
    let by = Similarity::from_quaternion([0.3, 0.2, -0.7, 0.1]);
    let texture = |scene: &mut Scene| {
        let normals = scene.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"].clone();
        scene.json["meshes"][0]["primitives"][0]["attributes"]["_MINE"] = normals;
    };
    let unsigned = |scene: &mut Scene| {
        let normals = scene.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"]
            .as_u64()
            .unwrap() as usize;
        scene.json["accessors"][normals]["componentType"] = 5121.into();
    };
    let two_meanings = |scene: &mut Scene| {
        let primitive = &mut scene.json["meshes"][0]["primitives"][0];
        primitive["targets"] = json!([{"POSITION": primitive["attributes"]["NORMAL"]}]);
    };
    let animated = |scene: &mut Scene| {
        scene.json["animations"] = json!([{"channels": [], "samplers": []}]);
    };
    type Change<'a> = &'a dyn Fn(&mut Scene);
    let cases: [(Change<'_>, &str, bool); 4] = [
        (&texture, "used for something else, too", false),
        (&unsigned, "of another type than glTF has for them", false),
        (&two_meanings, "or has two meanings", false),
        (&animated, "the animations (what moves nodes stays", true),
    ];
    for (change, words, turns) in cases {
        let mut dressed = Dressed::of(Scene::pyramid(), FLOAT);
        change(&mut dressed.scene);
        let file = dressed.scene.glb();
        let there = moved(&file, &by);
        let left: Vec<String> = there.left.iter().map(ToString::to_string).collect();
        assert!(left.len() == 1 && left[0].contains(words), "{words}: {left:?}");
        let bytes = there.asset.to_bytes();
        let normals = |file: &[u8]| parts(file).1[dressed.at[0]..dressed.at[1]].to_vec();
        assert_eq!(normals(&file) != normals(&bytes), turns, "{words}");
        assert_eq!(Asset::from_bytes(bytes, None).unwrap().mesh(), there.asset.mesh());
    }
}

#[test]
fn normals_that_two_places_share_are_left_unless_the_mesh_is_the_same() {
    let by = Similarity::from_quaternion([0.3, 0.2, -0.7, 0.1]);
    let mut dressed = Dressed::of(Scene::pyramid(), FLOAT);
    let turn = json!([0.5, 0.5, 0.5, 0.5]);
    dressed.scene.json["nodes"] =
        json!([{"mesh": 0}, {"mesh": 0, "rotation": turn, "translation": [9, 0, 0]}]);
    dressed.scene.json["scenes"] = json!([{"nodes": [0, 1]}]);
    let there = moved(&dressed.scene.glb(), &by);
    assert_eq!(there.left, [], "instances turn with the first");
    dressed.check(parts(&there.asset.to_bytes()).1, &by);

    // Another mesh, with positions of its own and the same normals.
    let scene = &mut dressed.scene;
    let positions = scene.bin[..60].to_vec();
    let view = scene.add_view(positions);
    let mut accessor = scene.json["accessors"][0].clone();
    accessor["bufferView"] = view.into();
    let accessor = push(&mut scene.json["accessors"], accessor);
    let mut mesh = scene.json["meshes"][0].clone();
    mesh["primitives"][0]["attributes"]["POSITION"] = accessor.into();
    let mesh = push(&mut scene.json["meshes"], mesh);
    scene.json["nodes"][1]["mesh"] = mesh.into();
    let file = scene.glb();
    let there = moved(&file, &by);
    assert_eq!(there.left.len(), 5, "{:?}", there.left);
    assert!(there.left[0].why.contains("place differently"));
    let end = dressed.at[4] + 60;
    assert!(parts(&file).1[dressed.at[0]..end] == parts(&there.asset.to_bytes()).1[dressed.at[0]..end]);
}
