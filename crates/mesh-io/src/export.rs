use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::{Format, formats, number};
use mesh::TriMesh;

/// The floating point numbers of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Precision {
    /// 32 bits: about 7 digits. Meshes with neighbouring vertices closer than that may lose triangles.
    Single,
    /// 64 bits: every coordinate exactly.
    Double,
}

/// A new file with nothing but the mesh: OBJ, ASCII OFF, binary little-endian PLY, binary STL, glTF, GLB or 3MF.
///
/// STL and glTF have no double precision: their coordinates are single whatever is asked; normals of STL are those of the triangles.
/// Beyond ±3.4e38, where single precision ends, numbers become infinite.
///
/// ```
/// let mesh = mesh::TriMesh::new(vec![[0., 0., 0.], [1., 0., 0.], [0., 0.5, 0.]], vec![[0, 1, 2]])?;
/// let obj = mesh_io::write_mesh(&mesh, mesh_io::Format::Obj, mesh_io::Precision::Double);
/// assert_eq!(obj, b"v 0 0 0\nv 1 0 0\nv 0 0.5 0\nf 1 2 3\n");
/// # Ok::<(), mesh::MeshError>(())
/// ```
pub fn write_mesh(mesh: &TriMesh, format: Format, precision: Precision) -> Vec<u8> {
    formats::write(format, mesh, precision)
}

/// A binary little-endian PLY of the mesh with a colour (red, green, blue) for each vertex; positions in single precision.
///
/// # Panics
/// If there is not one colour a vertex.
pub fn write_coloured_ply(mesh: &TriMesh, colours: &[[u8; 3]]) -> Vec<u8> {
    assert_eq!(colours.len(), mesh.vertex_count(), "one colour a vertex");
    ply(mesh, Precision::Single, Some(colours))
}

pub(crate) fn obj(mesh: &TriMesh, precision: Precision) -> Vec<u8> {
    let mut out = Vec::new();
    for position in mesh.positions() {
        out.push(b'v');
        write_coordinates(position, precision, &mut out);
    }
    for triangle in mesh.triangles() {
        let [a, b, c] = triangle.map(|v| u64::from(v) + 1);
        out.extend(format!("f {a} {b} {c}\n").bytes());
    }
    out
}

pub(crate) fn off(mesh: &TriMesh, precision: Precision) -> Vec<u8> {
    let mut out = format!("OFF\n{} {} 0\n", mesh.vertex_count(), mesh.triangle_count()).into_bytes();
    for position in mesh.positions() {
        let start = out.len();
        write_coordinates(position, precision, &mut out);
        out.remove(start);
    }
    for [a, b, c] in mesh.triangles() {
        out.extend(format!("3 {a} {b} {c}\n").bytes());
    }
    out
}

/// Three numbers, each after a blank, and the end of the line.
fn write_coordinates(position: &[f64; 3], precision: Precision, out: &mut Vec<u8>) {
    for &x in position {
        out.push(b' ');
        match precision {
            Precision::Single => number::write_single(x as f32, out),
            Precision::Double => number::write_double(x, out),
        }
    }
    out.push(b'\n');
}

pub(crate) fn ply(mesh: &TriMesh, precision: Precision, colours: Option<&[[u8; 3]]>) -> Vec<u8> {
    let real = match precision {
        Precision::Single => "float",
        Precision::Double => "double",
    };
    let colour = match colours {
        Some(_) => "property uchar red\nproperty uchar green\nproperty uchar blue\n",
        None => "",
    };
    let (vertices, faces) = (mesh.vertex_count(), mesh.triangle_count());
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n\
         property {real} x\nproperty {real} y\nproperty {real} z\n\
         {colour}element face {faces}\nproperty list uchar uint vertex_indices\nend_header\n"
    )
    .into_bytes();
    for (vertex, position) in mesh.positions().iter().enumerate() {
        for &x in position {
            match precision {
                Precision::Single => out.extend((x as f32).to_le_bytes()),
                Precision::Double => out.extend(x.to_le_bytes()),
            }
        }
        out.extend(colours.iter().flat_map(|colours| colours[vertex]));
    }
    for triangle in mesh.triangles() {
        out.push(3);
        out.extend(triangle.iter().flat_map(|v| v.to_le_bytes()));
    }
    out
}

pub(crate) fn stl(mesh: &TriMesh) -> Vec<u8> {
    let mut out = vec![b' '; 80];
    out.extend((mesh.triangle_count() as u32).to_le_bytes());
    for triangle in 0..mesh.triangle_count() {
        let [a, b, c] = mesh.corners(triangle);
        let normal = (b - a).cross(c - a).unit();
        for point in [normal, a, b, c] {
            out.extend(point.0.iter().flat_map(|&x| (x as f32).to_le_bytes()));
        }
        out.extend([0, 0]);
    }
    out
}

/// A GLB of one mesh with one primitive.
pub(crate) fn glb(mesh: &TriMesh) -> Vec<u8> {
    let buffer = gltf_buffer(mesh);
    let mut json = gltf_json(mesh, buffer.len(), None).into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut out = b"glTF".to_vec();
    let chunks = [(b"JSON", &json), (b"BIN\0", &buffer)];
    let length: usize = 12 + chunks.iter().map(|(_, content)| 8 + content.len()).sum::<usize>();
    out.extend(2_u32.to_le_bytes());
    out.extend((length as u32).to_le_bytes());
    for (kind, content) in chunks {
        out.extend((content.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(content);
    }
    out
}

/// A glTF of one mesh with one primitive, its buffer in the text.
pub(crate) fn gltf(mesh: &TriMesh) -> Vec<u8> {
    let buffer = gltf_buffer(mesh);
    let encoded = STANDARD.encode(&buffer);
    let uri = format!("data:application/octet-stream;base64,{encoded}");
    gltf_json(mesh, buffer.len(), Some(&uri)).into_bytes()
}

/// Positions in single precision, then indices.
fn gltf_buffer(mesh: &TriMesh) -> Vec<u8> {
    let coordinates = mesh.positions().as_flattened().iter();
    let indices = mesh.triangles().as_flattened().iter();
    let numbers = coordinates.flat_map(|&x| (x as f32).to_le_bytes());
    numbers.chain(indices.flat_map(|v| v.to_le_bytes())).collect()
}

fn gltf_json(mesh: &TriMesh, length: usize, uri: Option<&str>) -> String {
    let positions = mesh.positions();
    let bound = |pick: fn(f32, f32) -> f32| -> [f32; 3] {
        let single = |p: &[f64; 3]| p.map(|x| x as f32);
        let first = single(&positions[0]);
        positions
            .iter()
            .map(single)
            .fold(first, |a, b| std::array::from_fn(|i| pick(a[i], b[i])))
    };
    let indices_at = 12 * positions.len();
    let mut buffer = serde_json::json!({"byteLength": length});
    if let Some(uri) = uri {
        buffer["uri"] = uri.into();
    }
    serde_json::json!({
        "asset": {"version": "2.0", "generator": "sigmark"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": positions.len(), "type": "VEC3",
                "min": bound(f32::min), "max": bound(f32::max)},
            {"bufferView": 1, "componentType": 5125, "count": 3 * mesh.triangle_count(), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": indices_at, "target": 34962},
            {"buffer": 0, "byteOffset": indices_at, "byteLength": length - indices_at, "target": 34963},
        ],
        "buffers": [buffer],
    })
    .to_string()
}

/// A 3MF of one object, in millimetres.
pub(crate) fn threemf(mesh: &TriMesh, precision: Precision) -> Vec<u8> {
    const TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>"#;
    const RELATIONS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>"#;
    let parts = [
        ("[Content_Types].xml", TYPES.as_bytes()),
        ("_rels/.rels", RELATIONS.as_bytes()),
        ("3D/3dmodel.model", &threemf_model(mesh, precision)),
    ];
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, content) in parts {
        let options = zip::write::SimpleFileOptions::default();
        archive
            .start_file(name, options)
            .and_then(|()| Ok(std::io::Write::write_all(&mut archive, content)?))
            .expect("a vector takes every byte");
    }
    archive.finish().expect("a vector takes every byte").into_inner()
}

fn threemf_model(mesh: &TriMesh, precision: Precision) -> Vec<u8> {
    let mut out = br#"<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<resources><object id="1" type="model"><mesh>
<vertices>
"#
    .to_vec();
    for position in mesh.positions() {
        out.extend(b"<vertex");
        for (name, &x) in ["x", "y", "z"].iter().zip(position) {
            out.extend(format!(" {name}=\"").bytes());
            match precision {
                Precision::Single => number::write_single(x as f32, &mut out),
                Precision::Double => number::write_double(x, &mut out),
            }
            out.push(b'"');
        }
        out.extend(b"/>\n");
    }
    out.extend(b"</vertices>\n<triangles>\n");
    for [a, b, c] in mesh.triangles() {
        out.extend(format!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>\n").bytes());
    }
    out.extend(
        b"</triangles>\n</mesh></object></resources>\n<build><item objectid=\"1\"/></build>\n</model>\n",
    );
    out
}
