//! One mesh as a file of every format and encoding, with everything around the coordinates that such files may have.
//! A fixture knows which of its bytes are coordinates, without asking the reader that is under test.
#![allow(dead_code, missing_docs, unreachable_pub)] // each test binary uses its own part

use mesh::TriMesh;
use mesh_io::Format;

/// Bytes that must never change, or a coordinate of a vertex of the file.
pub enum Piece {
    Fixed(Vec<u8>),
    Coordinate(Vec<u8>),
}

pub struct Fixture {
    pub name: String,
    pub format: Format,
    pub binary: bool,
    /// Whether coordinates have more than single precision.
    pub double: bool,
    pub pieces: Vec<Piece>,
}

impl Fixture {
    pub fn bytes(&self) -> Vec<u8> {
        let bytes = |piece: &Piece| match piece {
            Piece::Fixed(bytes) | Piece::Coordinate(bytes) => bytes.clone(),
        };
        self.pieces.iter().flat_map(bytes).collect()
    }

    /// Panics unless `bytes` is this file but for other coordinates.
    pub fn assert_only_coordinates_differ(&self, bytes: &[u8]) {
        let mut rest = bytes;
        for piece in &self.pieces {
            let length = match piece {
                Piece::Fixed(fixed) => {
                    assert!(
                        rest.starts_with(fixed),
                        "{}: {} is missing",
                        self.name,
                        fixed.escape_ascii()
                    );
                    fixed.len()
                }
                Piece::Coordinate(old) if self.binary => old.len(),
                Piece::Coordinate(_) => rest
                    .iter()
                    .position(|b| b" \t\r\n\\#".contains(b))
                    .unwrap_or(rest.len()),
            };
            if !self.binary && matches!(piece, Piece::Coordinate(_)) {
                let token = String::from_utf8_lossy(&rest[..length]);
                assert!(
                    token.parse::<f64>().is_ok_and(f64::is_finite),
                    "{}: {token}",
                    self.name
                );
            }
            rest = &rest[length..];
        }
        assert!(rest.is_empty(), "{}: {} bytes too many", self.name, rest.len());
    }

    fn new(name: impl Into<String>, format: Format, binary: bool, double: bool) -> Self {
        Self {
            name: name.into(),
            format,
            binary,
            double,
            pieces: Vec::new(),
        }
    }

    fn fixed(&mut self, bytes: impl AsRef<[u8]>) {
        self.pieces.push(Piece::Fixed(bytes.as_ref().to_vec()));
    }

    fn coordinate(&mut self, bytes: impl AsRef<[u8]>) {
        self.pieces.push(Piece::Coordinate(bytes.as_ref().to_vec()));
    }

    /// Three numbers with `between` between them.
    fn text_vertex(&mut self, position: [f64; 3], digits: usize, between: [&str; 2]) {
        for (axis, x) in position.iter().enumerate() {
            self.coordinate(format!("{x:.digits$}"));
            if axis < 2 {
                self.fixed(between[axis]);
            }
        }
    }
}

/// The mesh in all formats and encodings, not gzipped.
pub fn fixtures(mesh: &TriMesh) -> Vec<Fixture> {
    let mut all = vec![
        obj(mesh, "\n", 6),
        obj(mesh, "\r\n", 12),
        stl_ascii(mesh, 1),
        stl_ascii(mesh, 3),
        stl_binary(mesh, b"solid, or so it seems"),
        stl_binary(mesh, b"exported by a modeller, COLOR=\x01\x02\x03\xFF"),
    ];
    for keyword in ["OFF", "COFF", "NOFF", "CNOFF", "STOFF"] {
        all.push(off(mesh, keyword));
    }
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for real in ["float", "double"] {
            all.push(ply_plain(mesh, encoding, real));
            all.push(ply_rich(mesh, encoding, real));
        }
    }
    all
}

/// Comments, groups, materials, textures, normals, colours, negative indices, joined lines, no last line end.
pub fn obj(mesh: &TriMesh, end: &str, digits: usize) -> Fixture {
    let mut file = Fixture::new(
        format!("OBJ with {} and {digits} digits", end.escape_debug()),
        Format::Obj,
        false,
        digits > 9,
    );
    file.fixed(format!(
        "# v 1 2 3 is a comment \\{end}mtllib a b.mtl{end}o Thing # 1{end}{end}vt 0.5 0.25{end}vn 0 0 1{end}"
    ));
    let n = mesh.vertex_count();
    for (v, &position) in mesh.positions().iter().enumerate() {
        file.fixed(if v % 3 == 0 { "v  " } else { "\tv\t" });
        let joined = format!(" \\{end}\t");
        file.text_vertex(
            position,
            digits,
            if v % 5 == 0 { ["\t", &joined] } else { [" ", "  "] },
        );
        let rest = ["", " 1.0", " 0.1 0.2 0.3", " # top", "  ", "\\"][v % 6];
        file.fixed(rest);
        file.fixed(if rest == "\\" {
            format!("{end}0.5 0.5 0.5{end}")
        } else {
            end.to_string()
        });
    }
    file.fixed(format!(
        "g left right{end}usemtl Red{end}s off{end}l 1 2 3{end}p 4{end}"
    ));
    for (t, corners) in mesh.triangles().iter().enumerate() {
        let [a, b, c] = corners.map(|v| v as usize + 1);
        file.fixed(match t % 4 {
            0 => format!("f {a} {b} {c}{end}"),
            1 => format!("f {a}/1/1\t{b}/1/1 {c}/1/1 # f 1 2{end}"),
            2 => format!("f {a}//1 \\{end} {b}//1 {c}//1{end}"),
            _ => format!("f -{}/-1 -{}/-1 -{}/-1{end}", n + 1 - a, n + 1 - b, n + 1 - c),
        });
    }
    file.fixed("# the end");
    file
}

pub fn off(mesh: &TriMesh, keyword: &str) -> Fixture {
    let mut file = Fixture::new(keyword, Format::Off, false, false);
    let counts = format!("{} {} 0", mesh.vertex_count(), mesh.triangle_count());
    let between = if keyword == "COFF" {
        " "
    } else {
        " # comment 1 2 3\n\n# another\n"
    };
    file.fixed(format!("{keyword}{between}{counts}\n"));
    let after = match keyword {
        "COFF" => " 0.1 0.2 0.3 1",
        "NOFF" => " 0 0 1",
        "CNOFF" => " 0 0 1 255 128 0 255",
        "STOFF" => " 0.5 0.5",
        _ => "",
    };
    for (v, &position) in mesh.positions().iter().enumerate() {
        file.text_vertex(position, 7, [" ", "\t"]);
        file.fixed(if v % 7 == 3 {
            format!("{after} # seam\n\n")
        } else {
            format!("{after}\n")
        });
    }
    for (t, [a, b, c]) in mesh.triangles().iter().enumerate() {
        let colour = ["", " 255 0 0", " 1.0 0.5 0.0 1.0", " # red"][t % 4];
        file.fixed(format!("3 {a} {b} {c}{colour}\n"));
    }
    file
}

pub fn stl_ascii(mesh: &TriMesh, solids: usize) -> Fixture {
    let mut file = Fixture::new(format!("ASCII STL of {solids} solids"), Format::Stl, false, false);
    let each = mesh.triangle_count().div_ceil(solids);
    for t in 0..mesh.triangle_count() {
        if t % each == 0 {
            file.fixed(format!("solid part {t}\r\n"));
        }
        file.fixed("  facet normal 0 -0.0e+00 1\r\n    outer loop\r\n");
        for position in mesh.corners(t) {
            file.fixed("      vertex ");
            file.text_vertex(position.into(), 6, [" ", " "]);
            file.fixed("\r\n");
        }
        file.fixed("    endloop\r\n  endfacet\r\n");
        if (t + 1) % each == 0 || t + 1 == mesh.triangle_count() {
            file.fixed("endsolid\r\n");
        }
    }
    file
}

pub fn stl_binary(mesh: &TriMesh, header: &[u8]) -> Fixture {
    let mut file = Fixture::new(
        format!("binary STL beginning {}", header.escape_ascii()),
        Format::Stl,
        true,
        false,
    );
    let mut start = header.to_vec();
    start.resize(80, 0);
    start.extend((mesh.triangle_count() as u32).to_le_bytes());
    file.fixed(start);
    for t in 0..mesh.triangle_count() {
        file.fixed([7_u8; 12]); // a normal, true or not
        for x in mesh.corners(t).map(|p| p.0).as_flattened() {
            file.coordinate((*x as f32).to_le_bytes());
        }
        file.fixed((t as u16).to_le_bytes());
    }
    file
}

/// A value of a PLY file, as text or binary.
struct Values<'a> {
    encoding: &'a str,
}

impl Values<'_> {
    fn write(&self, text: String, little: &[u8]) -> Vec<u8> {
        match self.encoding {
            "ascii" => text.into_bytes(),
            "binary_little_endian" => little.to_vec(),
            _ => little.iter().rev().copied().collect(),
        }
    }

    fn real(&self, kind: &str, x: f64) -> Vec<u8> {
        match kind {
            "float" => self.write(format!("{}", x as f32), &(x as f32).to_le_bytes()),
            _ => self.write(format!("{x:.15}"), &x.to_le_bytes()),
        }
    }

    fn byte(&self, x: u8) -> Vec<u8> {
        self.write(x.to_string(), &[x])
    }

    fn int(&self, x: i32) -> Vec<u8> {
        self.write(x.to_string(), &x.to_le_bytes())
    }

    fn short(&self, x: u16) -> Vec<u8> {
        self.write(x.to_string(), &x.to_le_bytes())
    }

    /// What stands between values, and at the end of a record.
    fn blank(&self) -> &'static [u8] {
        if self.encoding == "ascii" { b" " } else { b"" }
    }

    fn end(&self) -> &'static [u8] {
        if self.encoding == "ascii" { b"\n" } else { b"" }
    }
}

/// Positions and triangles alone.
pub fn ply_plain(mesh: &TriMesh, encoding: &str, real: &str) -> Fixture {
    let mut file = Fixture::new(
        format!("plain PLY, {encoding}, {real}"),
        Format::Ply,
        encoding != "ascii",
        real == "double",
    );
    let values = Values { encoding };
    file.fixed(format!(
        "ply\nformat {encoding} 1.0\nelement vertex {}\nproperty {real} x\nproperty {real} y\nproperty {real} z\n\
         element face {}\nproperty list uchar int vertex_index\nend_header\n",
        mesh.vertex_count(),
        mesh.triangle_count()
    ));
    for position in mesh.positions() {
        for &x in position {
            file.coordinate(values.real(real, x));
            file.fixed(values.blank());
        }
        file.fixed(values.end());
    }
    for triangle in mesh.triangles() {
        file.fixed(values.byte(3));
        for &v in triangle {
            file.fixed(values.blank());
            file.fixed(values.int(v as i32));
        }
        file.fixed(values.end());
    }
    file
}

/// Faces first, as quads where possible and strips otherwise; lists, colours and normals between the coordinates,
/// which stand in the order z, x, y; elements that nobody knows; bytes after the end.
pub fn ply_rich(mesh: &TriMesh, encoding: &str, real: &str) -> Fixture {
    let mut file = Fixture::new(
        format!("rich PLY, {encoding}, {real}"),
        Format::Ply,
        encoding != "ascii",
        real == "double",
    );
    let values = Values { encoding };
    let (faces, strips) = mesh.triangles().split_at(mesh.triangle_count() / 2);
    file.fixed(format!(
        "ply\r\nformat {encoding} 1.0\r\ncomment element vertex 7\r\nobj_info num_cols 512\r\n\
         element face {}\r\nproperty uchar quality\r\nproperty list uchar ushort vertex_indices\r\nproperty list int float texcoord\r\n\
         element nothing 3\r\n\
         element vertex {}\r\nproperty list uchar short tags\r\nproperty {real} z\r\nproperty list uchar double more\r\n\
         property {real} x\r\nproperty uchar red\r\nproperty {real} y\r\nproperty float nx\r\n\
         element tristrips 1\r\nproperty list int int vertex_indices\r\n\
         element camera 1\r\nproperty double view\r\nend_header\r\n",
        faces.len(),
        mesh.vertex_count(),
    ));
    let line = |file: &mut Fixture, record: Vec<Vec<u8>>| {
        for value in record {
            file.fixed(value);
            file.fixed(values.blank());
        }
        file.fixed(values.end());
    };
    for triangle in faces {
        let mut record = vec![values.byte(9), values.byte(3)];
        record.extend(triangle.iter().map(|&v| values.short(v as u16)));
        record.extend([
            values.int(2),
            values.real("float", 0.5),
            values.real("float", 0.25),
        ]);
        line(&mut file, record);
    }
    for (v, &[x, y, z]) in mesh.positions().iter().enumerate() {
        let separated = |file: &mut Fixture, value: Vec<u8>| {
            file.fixed(value);
            file.fixed(values.blank());
        };
        separated(&mut file, values.byte((v % 3) as u8));
        for tag in 0..v % 3 {
            separated(&mut file, values.short(tag as u16));
        }
        file.coordinate(values.real(real, z));
        file.fixed(values.blank());
        separated(&mut file, values.byte(1));
        separated(&mut file, values.real("double", 0.125));
        file.coordinate(values.real(real, x));
        file.fixed(values.blank());
        separated(&mut file, values.byte(255));
        file.coordinate(values.real(real, y));
        file.fixed(values.blank());
        separated(&mut file, values.real("float", 1.0));
        file.fixed(values.end());
    }
    let mut strip = vec![values.int(4 * strips.len() as i32)];
    for triangle in strips {
        strip.extend(triangle.iter().map(|&v| values.int(v as i32)));
        strip.push(values.int(-1));
    }
    line(&mut file, strip);
    line(&mut file, vec![values.real("double", 1.5)]);
    file.fixed("bytes after the end");
    file
}

/// As gzip would write it, with a name and a time.
pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let builder = flate2::GzBuilder::new()
        .filename("original name")
        .mtime(1_234_567_890)
        .comment("kept");
    let mut encoder = builder.write(Vec::new(), flate2::Compression::fast());
    encoder
        .write_all(bytes)
        .and_then(|()| encoder.finish())
        .expect("a vector takes every byte")
}
