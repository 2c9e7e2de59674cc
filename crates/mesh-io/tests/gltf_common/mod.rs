//! A pyramid in every kind of glTF.
#![allow(
    dead_code,
    missing_docs,
    unreachable_pub,
    clippy::unwrap_used,
    clippy::single_range_in_vec_init
)]

use std::ops::Range;

use serde_json::{Value, json};

/// A square base from −1 to 1 in y = 0, and an apex at y = 3.
const CORNERS: [[f32; 3]; 5] = [
    [-1.0, 0.0, -1.0],
    [1.0, 0.0, -1.0],
    [1.0, 0.0, 1.0],
    [-1.0, 0.0, 1.0],
    [0.0, 3.0, 0.0],
];
const FACES: [[u16; 3]; 6] = [[0, 1, 2], [0, 2, 3], [1, 0, 4], [2, 1, 4], [3, 2, 4], [0, 3, 4]];
const VOLUME: f64 = 4.0;

#[derive(Clone)]
pub struct Scene {
    pub name: &'static str,
    pub json: Value,
    pub bin: Vec<u8>,
    pub volume: f64,
    /// How exactly it holds positions.
    pub tolerance: f64,
    pub writable: bool,
    /// Bytes of the buffer that are positions.
    pub positions: Vec<Range<usize>>,
}

fn floats(points: &[[f32; 3]]) -> Vec<u8> {
    points
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect()
}

fn indices(faces: &[u16]) -> Vec<u8> {
    faces.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn positions_accessor(view: usize, count: usize) -> Value {
    json!({"bufferView": view, "componentType": 5126, "count": count, "type": "VEC3",
        "min": [-1.0, 0.0, -1.0], "max": [1.0, 3.0, 1.0]})
}

fn indices_accessor(view: usize, count: usize) -> Value {
    json!({"bufferView": view, "componentType": 5123, "count": count, "type": "SCALAR"})
}

impl Scene {
    /// The plain one: positions in bytes 0 to 60, indices from there on.
    pub fn pyramid() -> Self {
        let mut scene = Self {
            name: "plain",
            json: json!({
                "asset": {"version": "2.0", "extras": {"by": "hand – ümlaut"}},
                "scene": 0,
                "scenes": [{"nodes": [0]}],
                "nodes": [{"mesh": 0, "name": "pyramid"}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
                "accessors": [positions_accessor(0, 5), indices_accessor(1, 18)],
                "bufferViews": [],
                "buffers": [{"byteLength": 0}],
                "extensions": {"XYZ_unknown": {"kept": [1, 2.50, "three"]}},
            }),
            bin: Vec::new(),
            volume: VOLUME,
            tolerance: 1e-6,
            writable: true,
            positions: vec![0..60],
        };
        scene.add_view(floats(&CORNERS));
        scene.add_view(indices(FACES.as_flattened()));
        scene
    }

    fn named(name: &'static str) -> Self {
        Self {
            name,
            ..Self::pyramid()
        }
    }

    /// Adds a buffer view with these bytes; returns its number.
    pub fn add_view(&mut self, bytes: Vec<u8>) -> usize {
        let view = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()});
        self.bin.extend(bytes);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.json["buffers"][0]["byteLength"] = self.bin.len().into();
        push(&mut self.json["bufferViews"], view)
    }

    fn clear(&mut self) {
        self.bin.clear();
        self.json["bufferViews"] = json!([]);
        self.json["accessors"] = json!([]);
    }

    pub fn glb(&self) -> Vec<u8> {
        let mut json = serde_json::to_vec(&self.json).unwrap();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut out = b"glTF\x02\0\0\0".to_vec();
        out.extend((28 + json.len() as u32 + self.bin.len() as u32).to_le_bytes());
        for (kind, content) in [(b"JSON", &json), (b"BIN\0", &self.bin)] {
            out.extend((content.len() as u32).to_le_bytes());
            out.extend(kind);
            out.extend(content);
        }
        out
    }

    /// As text that holds its buffer.
    pub fn gltf(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        let encoded = base64(&self.bin);
        json["buffers"][0]["uri"] = format!("data:application/octet-stream;base64,{encoded}").into();
        serde_json::to_vec_pretty(&json).unwrap()
    }

    /// The accessors of positions whose numbers all lie in one view, and those numbers.
    pub fn numbers<'a>(&self, json: &'a Value, bin: &[u8]) -> Vec<(&'a Value, Vec<[f64; 3]>)> {
        let primitives = json["meshes"]
            .as_array()
            .unwrap()
            .iter()
            .flat_map(|mesh| mesh["primitives"].as_array().unwrap());
        let accessors = primitives.map(|primitive| {
            &json["accessors"][primitive["attributes"]["POSITION"].as_u64().unwrap() as usize]
        });
        let whole = accessors.filter(|accessor| accessor.get("sparse").is_none());
        whole
            .map(|accessor| (accessor, numbers_of(json, accessor, bin)))
            .collect()
    }
}

fn numbers_of(json: &Value, accessor: &Value, bin: &[u8]) -> Vec<[f64; 3]> {
    let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let number = |value: &Value| value.as_u64().unwrap_or(0) as usize;
    let (kind, start) = (
        accessor["componentType"].as_u64().unwrap(),
        number(&view["byteOffset"]) + number(&accessor["byteOffset"]),
    );
    let size = match kind {
        5126 => 4,
        5122 | 5123 => 2,
        _ => 1,
    };
    let stride = view["byteStride"]
        .as_u64()
        .map_or(3 * size, |stride| stride as usize);
    let at = |byte: usize| match kind {
        5126 => f64::from(f32::from_le_bytes(bin[byte..byte + 4].try_into().unwrap())),
        5122 => f64::from(i16::from_le_bytes(bin[byte..byte + 2].try_into().unwrap())),
        5123 => f64::from(u16::from_le_bytes(bin[byte..byte + 2].try_into().unwrap())),
        _ => f64::from(bin[byte]),
    };
    let count = number(&accessor["count"]);
    (0..count)
        .map(|i| std::array::from_fn(|axis| at(start + i * stride + axis * size)))
        .collect()
}

pub fn push(array: &mut Value, value: Value) -> usize {
    let array = array.as_array_mut().unwrap();
    array.push(value);
    array.len() - 1
}

fn base64(bytes: &[u8]) -> String {
    use base64::Engine;
    base64::engine::general_purpose::STANDARD.encode(bytes)
}

/// The JSON and the buffer of a GLB.
pub fn parts(glb: &[u8]) -> (&[u8], &[u8]) {
    let size = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    let json = 20..20 + size(12);
    let bin = json.end + 8..json.end + 8 + size(json.end);
    assert_eq!(size(8), glb.len());
    assert!(json.end % 4 == 0 && bin.end % 4 == 0);
    (&glb[json], &glb[bin])
}

/// The pyramid in every way that a file may hold it.
pub fn scenes() -> Vec<Scene> {
    vec![
        Scene::pyramid(),
        interleaved(),
        two_primitives_of_one_accessor(),
        two_accessors_of_the_same_bytes(),
        placed_by_nodes(),
        mirrored_by_a_matrix(),
        not_indexed(),
        fan_and_strip(),
        sparse(),
        sparse_with_zeros(),
        quantised_and_normalised(),
        quantised_to_bytes(),
        skinned(),
        with_morph_targets(),
        without_a_scene(),
        split_along_a_seam(),
    ]
}

fn interleaved() -> Scene {
    let mut scene = Scene::named("interleaved with normals");
    scene.clear();
    let up = [0.0, 1.0, 0.0];
    let records: Vec<[f32; 3]> = CORNERS.iter().flat_map(|&corner| [up, corner]).collect();
    scene.add_view(floats(&records));
    scene.add_view(indices(FACES.as_flattened()));
    scene.json["bufferViews"][0]["byteStride"] = 24.into();
    let mut positions = positions_accessor(0, 5);
    positions["byteOffset"] = 12.into();
    let mut normals = positions_accessor(0, 5);
    (normals["min"], normals["max"]) = (json!(up), json!(up));
    scene.json["accessors"] = json!([positions, indices_accessor(1, 18), normals]);
    scene.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 2.into();
    scene.positions = (0..5).map(|i| 24 * i + 12..24 * i + 24).collect();
    scene
}

fn two_primitives_of_one_accessor() -> Scene {
    let mut scene = Scene::named("two primitives of one accessor");
    let [mut base, mut sides] = [indices_accessor(1, 6), indices_accessor(1, 12)];
    base["byteOffset"] = 0.into();
    sides["byteOffset"] = 12.into();
    scene.json["accessors"] = json!([positions_accessor(0, 5), base, sides]);
    scene.json["meshes"][0]["primitives"] = json!([
        {"attributes": {"POSITION": 0}, "indices": 1}, {"attributes": {"POSITION": 0}, "indices": 2},
    ]);
    scene
}

fn two_accessors_of_the_same_bytes() -> Scene {
    let mut scene = two_primitives_of_one_accessor();
    scene.name = "two accessors of the same bytes";
    push(&mut scene.json["accessors"], positions_accessor(0, 5));
    scene.json["meshes"][0]["primitives"][1]["attributes"]["POSITION"] = 3.into();
    scene
}

fn placed_by_nodes() -> Scene {
    let mut scene = Scene::named("placed by two nodes");
    scene.json["nodes"] = json!([
        {"children": [1], "translation": [10, -2, 3], "scale": [2, 2, 2]},
        {"mesh": 0, "rotation": [0.5, 0.5, 0.5, 0.5], "scale": [1, 3, 0.5]},
    ]);
    scene.volume = VOLUME * 8.0 * 1.5;
    scene.tolerance = 1e-5;
    scene
}

fn mirrored_by_a_matrix() -> Scene {
    let mut scene = Scene::named("mirrored by a matrix");
    scene.json["nodes"][0]["matrix"] = json!([-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 4, 5, 6, 1]);
    scene
}

fn not_indexed() -> Scene {
    let mut scene = Scene::named("not indexed");
    scene.clear();
    let corners: Vec<[f32; 3]> = FACES
        .as_flattened()
        .iter()
        .map(|&v| CORNERS[v as usize])
        .collect();
    scene.add_view(floats(&corners));
    scene.json["accessors"] = json!([positions_accessor(0, 18)]);
    scene.json["meshes"][0]["primitives"] = json!([{"attributes": {"POSITION": 0}}]);
    scene.positions = vec![0..216];
    scene
}

fn fan_and_strip() -> Scene {
    let mut scene = Scene::named("a fan and a strip");
    let fan = scene.add_view(indices(&[4, 1, 0, 3, 2, 1]));
    let strip = scene.add_view(indices(&[0, 1, 3, 2]));
    let fan = push(&mut scene.json["accessors"], indices_accessor(fan, 6));
    let strip = push(&mut scene.json["accessors"], indices_accessor(strip, 4));
    scene.json["meshes"][0]["primitives"] = json!([
        {"attributes": {"POSITION": 0}, "indices": fan, "mode": 6},
        {"attributes": {"POSITION": 0}, "indices": strip, "mode": 5},
    ]);
    scene
}

fn sparse() -> Scene {
    let mut scene = Scene::named("sparse: the apex stands elsewhere");
    scene.bin[48..60].fill(0);
    let numbers = scene.add_view(indices(&[4]));
    let start = scene.bin.len();
    let values = scene.add_view(floats(&CORNERS[4..]));
    scene.json["accessors"][0]["sparse"] = json!({
        "count": 1, "indices": {"bufferView": numbers, "componentType": 5123}, "values": {"bufferView": values},
    });
    scene.positions.push(start..start + 12);
    scene
}

fn sparse_with_zeros() -> Scene {
    let mut scene = sparse();
    scene.name = "sparse: one corner is left out";
    scene.clear();
    let numbers = scene.add_view(indices(&[0, 1, 3, 4]));
    let at_origin = |corner: &[f32; 3]| [corner[0] - 1.0, corner[1], corner[2] - 1.0];
    let corners: Vec<[f32; 3]> = [0, 1, 3, 4].iter().map(|&v| at_origin(&CORNERS[v])).collect();
    let values = scene.add_view(floats(&corners));
    let faces = scene.add_view(indices(FACES.as_flattened()));
    scene.json["accessors"] = json!([
        {"componentType": 5126, "count": 5, "type": "VEC3", "sparse": {
            "count": 4, "indices": {"bufferView": numbers, "componentType": 5123}, "values": {"bufferView": values}}},
        indices_accessor(faces, 18),
    ]);
    scene.writable = false;
    scene
}

fn quantised_and_normalised() -> Scene {
    let mut scene = Scene::named("quantised to 16 bits, normalised");
    scene.clear();
    // Half of the range is in use, so that there is room to move.
    let number = |x: f32| (x / 6.0 * 32_767.0).round() as i16;
    let record = |corner: &[f32; 3]| [number(corner[0]), number(corner[1]), number(corner[2]), 99];
    let records = CORNERS.iter().flat_map(record).flat_map(i16::to_le_bytes);
    scene.add_view(records.collect());
    scene.add_view(indices(FACES.as_flattened()));
    scene.json["bufferViews"][0]["byteStride"] = 8.into();
    let mut positions = positions_accessor(0, 5);
    (positions["componentType"], positions["normalized"]) = (5122.into(), true.into());
    (positions["min"], positions["max"]) = (json!([-5461, 0, -5461]), json!([5461, 16384, 5461]));
    scene.json["accessors"] = json!([positions, indices_accessor(1, 18)]);
    scene.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    scene.json["nodes"][0]["scale"] = json!([6, 6, 6]);
    scene.tolerance = 1e-4;
    scene.positions = (0..5).map(|i| 8 * i..8 * i + 6).collect();
    scene
}

fn quantised_to_bytes() -> Scene {
    let mut scene = Scene::named("quantised to 8 bits");
    scene.clear();
    let number = |x: f32| (x * 20.0 + 100.0).round() as u8;
    let record = |corner: &[f32; 3]| [number(corner[0]), number(corner[1]), number(corner[2]), 7];
    scene.add_view(CORNERS.iter().flat_map(record).collect());
    scene.add_view(indices(FACES.as_flattened()));
    scene.json["bufferViews"][0]["byteStride"] = 4.into();
    let mut positions = positions_accessor(0, 5);
    positions["componentType"] = 5121.into();
    (positions["min"], positions["max"]) = (json!([80, 100, 80]), json!([120, 160, 120]));
    scene.json["accessors"] = json!([positions, indices_accessor(1, 18)]);
    scene.json["nodes"][0]["matrix"] = json!([0.05, 0, 0, 0, 0, 0.05, 0, 0, 0, 0, 0.05, 0, -5, -5, -5, 1]);
    scene.tolerance = 0.026;
    scene.positions = (0..5).map(|i| 4 * i..4 * i + 3).collect();
    scene
}

fn skinned() -> Scene {
    let mut scene = Scene::named("skinned");
    // At rest: the joint stands where its inverse bind matrix expects it, and the mesh's own node does not count.
    let inverse_bind: [[f32; 4]; 4] = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [-5.0, 0.0, 0.0, 1.0],
    ];
    let view = scene.add_view(
        inverse_bind
            .as_flattened()
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect(),
    );
    let matrices = json!({"bufferView": view, "componentType": 5126, "count": 1, "type": "MAT4"});
    let matrices = push(&mut scene.json["accessors"], matrices);
    scene.json["skins"] = json!([{"joints": [1], "inverseBindMatrices": matrices}]);
    scene.json["nodes"] = json!([
        {"mesh": 0, "skin": 0, "scale": [100, 100, 100]}, {"translation": [5, 0, 0]},
    ]);
    scene.json["scenes"] = json!([{"nodes": [0, 1]}]);
    scene
}

fn with_morph_targets() -> Scene {
    let mut scene = Scene::named("with morph targets");
    let offsets = scene.add_view(floats(&[[0.0, 0.5, 0.0]; 5]));
    let offsets = push(&mut scene.json["accessors"], positions_accessor(offsets, 5));
    scene.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": offsets}]);
    scene.json["meshes"][0]["weights"] = json!([0.7]);
    scene
}

fn without_a_scene() -> Scene {
    let mut scene = Scene::named("without scenes and nodes");
    for name in ["scene", "scenes", "nodes"] {
        scene.json.as_object_mut().unwrap().remove(name);
    }
    scene
}

fn split_along_a_seam() -> Scene {
    let mut scene = Scene::named("vertices repeated along a seam, in two primitives");
    scene.clear();
    scene.add_view(floats(&CORNERS));
    scene.add_view(floats(&CORNERS[..4]));
    scene.add_view(indices(FACES[2..].as_flattened()));
    scene.add_view(indices(FACES[..2].as_flattened()));
    let mut base = positions_accessor(1, 4);
    base["max"] = json!([1.0, 0.0, 1.0]);
    scene.json["accessors"] = json!([
        positions_accessor(0, 5),
        base,
        indices_accessor(2, 12),
        indices_accessor(3, 6)
    ]);
    scene.json["meshes"][0]["primitives"] = json!([
        {"attributes": {"POSITION": 0}, "indices": 2}, {"attributes": {"POSITION": 1}, "indices": 3},
    ]);
    scene.positions = vec![0..108];
    scene
}

/// Two triangles with an edge in common, each in a mesh of its own whose node puts it where it belongs.
pub fn two_nodes_with_a_common_edge() -> Vec<u8> {
    let mut scene = Scene::pyramid();
    scene.clear();
    let (sine, cosine) = (0.75_f64.sqrt(), -0.5);
    // The second mesh is stored turned back by 120° about z, and moved.
    let back = |[x, y, z]: [f64; 3]| {
        let (x, y) = (x - 0.1, y - 0.7);
        [
            (cosine * x + sine * y) as f32,
            (-sine * x + cosine * y) as f32,
            z as f32,
        ]
    };
    let first = [[0.3, 0.4, 0.0], [1.7, 0.1, 0.2], [0.9, 1.3, 0.1]];
    let second = [[1.7, 0.1, 0.2], [2.3, 1.9, 0.0], [0.9, 1.3, 0.1]];
    scene.add_view(floats(&first.map(|p: [f64; 3]| p.map(|x| x as f32))));
    scene.add_view(floats(&second.map(back)));
    let accessor =
        |view: usize| json!({"bufferView": view, "componentType": 5126, "count": 3, "type": "VEC3"});
    scene.json["accessors"] = json!([accessor(0), accessor(1)]);
    scene.json["meshes"] = json!([
        {"primitives": [{"attributes": {"POSITION": 0}}]}, {"primitives": [{"attributes": {"POSITION": 1}}]},
    ]);
    scene.json["nodes"] = json!([
        {"mesh": 0}, {"mesh": 1, "translation": [0.1, 0.7, 0.0], "rotation": [0.0, 0.0, sine, 0.5]},
    ]);
    scene.json["scenes"] = json!([{"nodes": [0, 1]}]);
    scene.glb()
}
