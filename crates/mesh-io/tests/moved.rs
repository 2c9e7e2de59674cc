//! Normals turn with a mesh that is moved as a whole, and nothing else changes that would not without them.
#![allow(clippy::unwrap_used)] // in the helpers of tests, too

mod moved_common;

use mesh::{Similarity, TriMesh, shapes};
use mesh_io::{Asset, Format};
use moved_common::{assert_near, similarities, turned};
use proptest::prelude::*;

/// A kind of file that has normals.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Obj,
    Noff,
    StlAscii,
    StlBinary,
    PlyAscii,
    PlyBinary { double: bool, big: bool },
}

const KINDS: [Kind; 8] = [
    Kind::Obj,
    Kind::Noff,
    Kind::StlAscii,
    Kind::StlBinary,
    Kind::PlyAscii,
    Kind::PlyBinary {
        double: false,
        big: false,
    },
    Kind::PlyBinary {
        double: true,
        big: false,
    },
    Kind::PlyBinary {
        double: false,
        big: true,
    },
];

impl Kind {
    fn format(self) -> Format {
        match self {
            Self::Obj => Format::Obj,
            Self::Noff => Format::Off,
            Self::StlAscii | Self::StlBinary => Format::Stl,
            Self::PlyAscii | Self::PlyBinary { .. } => Format::Ply,
        }
    }

    fn tolerance(self) -> f64 {
        match self {
            Self::PlyBinary { double: true, .. } => 1e-14,
            _ => 2e-7,
        }
    }

    fn write(self, mesh: &TriMesh) -> Vec<u8> {
        match self {
            Self::Obj => obj(mesh),
            Self::Noff => {
                let counts = format!(
                    "NOFF # normals\n{} {} 0\n",
                    mesh.vertex_count(),
                    mesh.triangle_count()
                );
                lines(counts, mesh)
            }
            Self::StlAscii => stl_ascii(mesh),
            Self::StlBinary => stl_binary(mesh),
            Self::PlyAscii => lines(ply_header(mesh, "ascii", "float"), mesh),
            Self::PlyBinary { double, big } => ply_binary(mesh, double, big),
        }
    }

    /// The normals of a file, and the file without them.
    fn split(self, bytes: &[u8]) -> (Vec<[f64; 3]>, Vec<u8>) {
        match self {
            Self::StlBinary => cut(bytes, 84, 50, 0, (4, false)),
            Self::PlyBinary { double, big } => {
                let data = bytes
                    .windows(11)
                    .position(|word| word == b"end_header\n")
                    .unwrap()
                    + 11;
                let size = if double { 8 } else { 4 };
                let (header, _) = std::str::from_utf8(&bytes[..data])
                    .unwrap()
                    .split_once("\nelement face")
                    .unwrap();
                let vertices: usize = header
                    .split(' ')
                    .filter_map(|word| word.lines().next()?.parse().ok())
                    .next_back()
                    .unwrap();
                let end = data + vertices * 6 * size;
                let (normals, mut rest) = cut(&bytes[..end], data, 6 * size, 3 * size, (size, big));
                rest.extend(&bytes[end..]);
                (normals, rest)
            }
            _ => self.split_text(std::str::from_utf8(bytes).unwrap()),
        }
    }

    fn split_text(self, text: &str) -> (Vec<[f64; 3]>, Vec<u8>) {
        let (mut normals, mut rest) = (Vec::new(), String::new());
        for line in text.split_inclusive('\n') {
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let first = match (self, words.as_slice()) {
                (Self::Obj, ["vn", _, _, _]) => 1,
                (Self::StlAscii, ["facet", "normal", _, _, _]) => 2,
                (Self::Noff | Self::PlyAscii, [_, _, _, _, _, _]) if words[0].parse::<f64>().is_ok() => 3,
                _ => {
                    rest += line;
                    continue;
                }
            };
            normals.push(std::array::from_fn(|i| words[first + i].parse().unwrap()));
            rest += &(words[..first].join(" ") + "\n");
        }
        (normals, rest.into_bytes())
    }
}

/// Records from `start` on, of `stride` bytes: the three numbers at `offset` in each, and all bytes but those.
fn cut(
    bytes: &[u8],
    start: usize,
    stride: usize,
    offset: usize,
    number: (usize, bool),
) -> (Vec<[f64; 3]>, Vec<u8>) {
    let (size, big) = number;
    let (mut normals, mut rest) = (Vec::new(), bytes[..start].to_vec());
    for record in bytes[start..].chunks(stride) {
        normals.push(std::array::from_fn(|i| {
            let mut raw = record[offset + i * size..][..size].to_vec();
            if big {
                raw.reverse();
            }
            match size {
                4 => f64::from(f32::from_le_bytes(raw.try_into().unwrap())),
                _ => f64::from_le_bytes(raw.try_into().unwrap()),
            }
        }));
        rest.extend(&record[..offset]);
        rest.extend(&record[offset + 3 * size..]);
    }
    (normals, rest)
}

/// The direction of a vertex from the centre; of the fourth there is none.
fn normal(mesh: &TriMesh, v: usize) -> [f64; 3] {
    let p = mesh::Vec3(mesh.positions()[v]);
    if v == 3 { [0.0; 3] } else { p.unit().0 }
}

fn facet_normal(mesh: &TriMesh, t: usize) -> [f64; 3] {
    let [a, b, c] = mesh.corners(t);
    if t == 3 {
        [0.0; 3]
    } else {
        (b - a).cross(c - a).unit().0
    }
}

fn shown(v: [f64; 3]) -> String {
    v.map(|x| (x as f32).to_string()).join(" ")
}

fn obj(mesh: &TriMesh) -> Vec<u8> {
    let mut text = String::from("# vn 1 2 3\nvn 0.0 0.0 1.00 # up\nvt 0.5 0.5\n");
    for (v, position) in mesh.positions().iter().enumerate() {
        text += &format!("v {}\nvn\t{}\n", shown(*position), shown(normal(mesh, v)));
    }
    for corners in mesh.triangles() {
        let [a, b, c] = corners.map(|v| v + 1);
        text += &format!("f {a}//{a} {b}//{b} {c}//{c}\n");
    }
    text.replace("# up", "").into_bytes()
}

/// Positions and normals in a line, then triangles.
fn lines(mut text: String, mesh: &TriMesh) -> Vec<u8> {
    for (v, position) in mesh.positions().iter().enumerate() {
        text += &format!("{} {}\n", shown(*position), shown(normal(mesh, v)));
    }
    for [a, b, c] in mesh.triangles() {
        text += &format!("3 {a} {b} {c}\n");
    }
    text.into_bytes()
}

fn ply_header(mesh: &TriMesh, encoding: &str, real: &str) -> String {
    let properties: String = ["x", "y", "z", "nx", "ny", "nz"]
        .iter()
        .map(|name| format!("property {real} {name}\n"))
        .collect();
    format!(
        "ply\nformat {encoding} 1.0\nelement vertex {}\n{properties}element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.vertex_count(),
        mesh.triangle_count()
    )
}

fn ply_binary(mesh: &TriMesh, double: bool, big: bool) -> Vec<u8> {
    let encoding = if big {
        "binary_big_endian"
    } else {
        "binary_little_endian"
    };
    let mut out = ply_header(mesh, encoding, if double { "double" } else { "float" }).into_bytes();
    let mut push = |mut raw: Vec<u8>| {
        if big {
            raw.reverse();
        }
        out.extend(raw);
    };
    for (v, position) in mesh.positions().iter().enumerate() {
        for x in position.iter().chain(&normal(mesh, v)) {
            push(if double {
                x.to_le_bytes().to_vec()
            } else {
                (*x as f32).to_le_bytes().to_vec()
            });
        }
    }
    for triangle in mesh.triangles() {
        push(vec![3]);
        triangle.iter().for_each(|v| push(v.to_le_bytes().to_vec()));
    }
    out
}

fn stl_ascii(mesh: &TriMesh) -> Vec<u8> {
    let mut text = String::from("solid one\n");
    for t in 0..mesh.triangle_count() {
        text += &format!("facet normal {}\nouter loop\n", shown(facet_normal(mesh, t)));
        for p in mesh.corners(t) {
            text += &format!("vertex {}\n", shown(p.0));
        }
        text += "endloop\nendfacet\n";
    }
    (text + "endsolid one\n").into_bytes()
}

fn stl_binary(mesh: &TriMesh) -> Vec<u8> {
    let mut out = vec![b' '; 80];
    out.extend((mesh.triangle_count() as u32).to_le_bytes());
    for t in 0..mesh.triangle_count() {
        let corners = mesh.corners(t).map(|p| p.0);
        let numbers = [&[facet_normal(mesh, t)], corners.as_slice()].concat();
        out.extend(
            numbers
                .as_flattened()
                .iter()
                .flat_map(|x| (*x as f32).to_le_bytes()),
        );
        out.extend((t as u16).to_le_bytes());
    }
    out
}

fn moved(asset: &Asset, by: &Similarity) -> Asset {
    let moved = asset.moved_by(by).unwrap();
    assert_eq!(moved.left, [], "nothing is left");
    moved.asset
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn normals_turn_with_the_mesh_in_every_format_and_positions_are_as_without_them(by in similarities()) {
        let mesh = shapes::bumpy_sphere(1, 3);
        for kind in KINDS {
            let file = kind.write(&mesh);
            let asset = Asset::from_bytes(file.clone(), kind.format()).unwrap();
            let there = moved(&asset, &by);
            let (old, _) = kind.split(&file);
            let (new, rest) = kind.split(&there.to_bytes());
            prop_assert!(old.len() >= mesh.vertex_count().min(mesh.triangle_count()));
            for (old, new) in old.iter().zip(&new) {
                assert_near(*new, turned(&by, *old), kind.tolerance());
            }

            let alone = asset.with_positions(&by.apply_all(asset.mesh().positions())).unwrap();
            let (kept, without) = kind.split(&alone.to_bytes());
            prop_assert_eq!(&kept, &old, "{:?}", kind);
            prop_assert!(rest == without, "{:?}: something else changed", kind);
            prop_assert_eq!(there.mesh(), alone.mesh());
            let again = Asset::from_bytes(there.to_bytes(), kind.format()).unwrap();
            prop_assert_eq!(again.mesh(), there.mesh());

            let (back, _) = kind.split(&moved(&there, &by.inverse()).to_bytes());
            for (old, back) in old.iter().zip(back) {
                assert_near(back, *old, 3.0 * kind.tolerance());
            }
        }
    }
}

proptest! {
    #[test]
    fn damaged_files_are_moved_or_refused_and_nothing_panics(
        kind in 0..KINDS.len(), at in any::<prop::sample::Index>(), byte in any::<u8>(), by in similarities()
    ) {
        let kind = KINDS[kind];
        let mut file = kind.write(&shapes::bumpy_sphere(0, 3));
        let at = at.index(file.len());
        file[at] = byte;
        if let Ok(asset) = Asset::from_bytes(file, kind.format()) {
            let _ = asset.moved_by(&by);
        }
    }
}

#[test]
fn a_file_that_does_not_move_keeps_every_byte() {
    for kind in KINDS {
        let file = kind.write(&shapes::bumpy_sphere(1, 3));
        let asset = Asset::from_bytes(file.clone(), kind.format()).unwrap();
        assert!(
            *moved(&asset, &Similarity::IDENTITY).to_bytes() == *file,
            "{kind:?}"
        );
    }
}

#[test]
fn positions_can_be_replaced_after_the_normals_were_turned() {
    let by = Similarity::from_quaternion([0.3, 0.2, -0.7, 0.1]);
    for kind in KINDS {
        let file = kind.write(&shapes::bumpy_sphere(1, 3));
        let asset = Asset::from_bytes(file, kind.format()).unwrap();
        let there = moved(&asset, &by);
        let stretched: Vec<_> = there
            .mesh()
            .positions()
            .iter()
            .map(|[x, y, z]| [2.0 * x, *y, *z])
            .collect();
        let stretched = there.with_positions(&stretched).unwrap();
        let again = Asset::from_bytes(stretched.to_bytes(), kind.format()).unwrap();
        assert_eq!(again.mesh(), stretched.mesh(), "{kind:?}");
        assert_eq!(
            kind.split(&stretched.to_bytes()).0,
            kind.split(&there.to_bytes()).0
        );
    }
}

#[test]
fn what_is_no_normal_is_left_and_named() {
    let quarter = Similarity::from_quaternion([1.0, 0.0, 0.0, 1.0]);
    let tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    let file = format!("{tetrahedron}vn 1 0 0\nvn up\nvn nan 0 0\nvn 0 0 0");
    let moved = Asset::from_bytes(file, Format::Obj)
        .unwrap()
        .moved_by(&quarter)
        .unwrap();
    assert!(
        moved
            .asset
            .to_bytes()
            .ends_with(b"vn 0 1 0\nvn up\nvn nan 0 0\nvn 0 0 0")
    );
    let left: Vec<String> = moved.left.iter().map(ToString::to_string).collect();
    assert_eq!(left, ["1 of the lines vn (they hold no three numbers)"]);

    let vertices = "0 0 0 0 1\n1 0 0 1 0\n0 1 0 0 1\n0 0 1 1 0\n";
    let header = |properties: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n{properties}element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let file = header("property float nx\nproperty float ny\n") + vertices + "3 0 1 2\n";
    let moved = Asset::from_bytes(file, Format::Ply)
        .unwrap()
        .moved_by(&quarter)
        .unwrap();
    assert_eq!(
        moved.left[0].to_string(),
        "the normals of element vertex (it has no property nz)"
    );
    let vertices = vertices.replace('\n', " 0\n");
    let file = header("property char nx\nproperty char ny\nproperty char nz\n") + &vertices + "3 0 1 2\n";
    let moved = Asset::from_bytes(file, Format::Ply)
        .unwrap()
        .moved_by(&quarter)
        .unwrap();
    assert!(
        moved.left[0].to_string().contains("as integers"),
        "{:?}",
        moved.left
    );
}

#[test]
fn normals_of_faces_turn_and_those_of_vertices_that_stay_do_not() {
    let quarter = Similarity::from_quaternion([1.0, 0.0, 0.0, 1.0]);
    let file = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n\
        property float ny\nproperty float nz\nelement face 1\nproperty float nx\nproperty float ny\nproperty float nz\n\
        property list uchar int vertex_indices\nend_header\n0 0 0 1 0 0\n1 0 0 0 1 0\n0 1 0 0 0 1\n7 7 7 1 0 0\n1 0 0 3 0 1 2\n";
    let moved = moved(&Asset::from_bytes(file, Format::Ply).unwrap(), &quarter);
    let text = String::from_utf8(moved.to_bytes().into_owned()).unwrap();
    let (_, data) = text.split_once("end_header\n").unwrap();
    let lines: Vec<&str> = data.lines().collect();
    assert!(
        lines[0].ends_with(" 0 1 0") && lines[1].ends_with(" -1 0 0") && lines[2].ends_with(" 0 0 1"),
        "{data}"
    );
    assert_eq!(lines[3..], ["7 7 7 1 0 0", "0 1 0 3 0 1 2"]);
}
