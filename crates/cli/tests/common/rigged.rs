//! A model with joints and a morph target.

use mesh::TriMesh;
use mesh_io::{Format, Precision, write_mesh};
use serde_json::{Value, json};

/// A ring whose two halves follow a joint each, and share what lies between; and one target, by which a side swells.
pub(crate) fn rigged(mesh: &TriMesh) -> Vec<u8> {
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
pub(crate) fn with_views(glb: &[u8], views: &[Vec<u8>], change: impl FnOnce(&mut Value, usize)) -> Vec<u8> {
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
