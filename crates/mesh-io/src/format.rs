use std::fmt;
use std::path::Path;

use crate::formats::gltf::is_glb;

/// A file format whose positions can be rewritten in place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// Wavefront OBJ.
    Obj,
    /// Stanford PLY: ASCII, binary little-endian or big-endian.
    Ply,
    /// Stereolithography: ASCII or binary.
    Stl,
    /// Geomview OFF, with or without normals, colours and texture coordinates.
    Off,
    /// glTF 2.0 as JSON, its buffers in the text or in files beside it.
    Gltf,
    /// glTF 2.0 in one binary file.
    Glb,
    /// 3D Manufacturing Format: XML in a zip archive.
    ThreeMf,
}

/// How binary STL begins: a free header, then the number of facets in 32 bits; and the size of a facet.
pub(crate) const STL_HEADER: usize = 84;
pub(crate) const STL_FACET: usize = 50;

impl Format {
    /// The formats, as a message lists them.
    pub(crate) const LIST: &str = "GLB, glTF, OBJ, PLY, STL, OFF and 3MF";
    const ALL: [Self; 7] = [
        Self::Obj,
        Self::Ply,
        Self::Stl,
        Self::Off,
        Self::Gltf,
        Self::Glb,
        Self::ThreeMf,
    ];

    /// The usual end of a file name, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::Stl => "stl",
            Self::Off => "off",
            Self::Gltf => "gltf",
            Self::Glb => "glb",
            Self::ThreeMf => "3mf",
        }
    }

    /// The format that a file name promises; a final `.gz` is passed over, case does not matter.
    pub fn of_path(path: &Path) -> Option<Self> {
        let extension = extension_before_gz(path)?;
        Self::ALL
            .into_iter()
            .find(|format| format.extension() == extension)
    }

    /// The format that the content shows by its first bytes or, for STL, its size. OBJ has no mark of its own:
    /// it is recognised by a `v`, `vn`, `vt`, `f`, `o`, `g`, `mtllib` or `usemtl` line near the beginning.
    pub fn of_content(bytes: &[u8]) -> Option<Self> {
        Self::marked(bytes).or_else(|| looks_like_obj(bytes).then_some(Self::Obj))
    }

    /// The format that a mark in the content proves; such a mark may contradict a file's name.
    pub(crate) fn marked(bytes: &[u8]) -> Option<Self> {
        if is_glb(bytes) {
            return Some(Self::Glb);
        }
        let bytes = without_bom(bytes);
        let first = first_word(bytes);
        if first == b"ply" && bytes.starts_with(b"ply") {
            Some(Self::Ply)
        } else if shows_binary_stl(bytes)
            || (first.eq_ignore_ascii_case(b"solid") && has_word(bytes, b"facet"))
        {
            Some(Self::Stl)
        } else if first.ends_with(b"OFF") && first.iter().all(u8::is_ascii_alphanumeric) {
            Some(Self::Off)
        } else if first.starts_with(b"{") && has_word(bytes, b"\"asset\"") {
            Some(Self::Gltf)
        } else {
            None
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gltf => f.write_str("glTF"),
            other => f.write_str(&other.extension().to_ascii_uppercase()),
        }
    }
}

/// The extension in lower case, after a final `.gz` is taken off.
pub(crate) fn extension_before_gz(path: &Path) -> Option<String> {
    let lower = |path: &Path| path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match lower(path) {
        Some(gz) if gz == "gz" => lower(Path::new(path.file_stem()?)),
        other => other,
    }
}

/// Whether a name says that the file is gzipped.
pub(crate) fn ends_in_gz(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"))
}

/// Empty where there is none.
pub(crate) fn first_word(bytes: &[u8]) -> &[u8] {
    let mut words = bytes.split(u8::is_ascii_whitespace);
    words.find(|word| !word.is_empty()).unwrap_or_default()
}

/// Text files from Windows may begin with a byte-order mark.
pub(crate) fn without_bom(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}

/// Whether the size is the one that the count of facets demands: also true of headers that begin with `solid`.
pub(crate) fn is_binary_stl(bytes: &[u8]) -> bool {
    let count = bytes
        .get(STL_HEADER - 4..STL_HEADER)
        .and_then(|c| c.try_into().ok())
        .map(u32::from_le_bytes);
    count.is_some_and(|count| {
        (STL_HEADER as u64) + (STL_FACET as u64) * u64::from(count) == bytes.len() as u64
    })
}

/// Whether the size proves binary STL: where there is a facet, and no line of an OBJ in place of the header, whose size may be anything.
fn shows_binary_stl(bytes: &[u8]) -> bool {
    is_binary_stl(bytes) && bytes.len() > STL_HEADER && !looks_like_obj(&bytes[..STL_HEADER - 4])
}

fn has_word(bytes: &[u8], word: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(SNIFFED)];
    head.windows(word.len()).any(|w| w.eq_ignore_ascii_case(word))
}

/// How far into a file its first lines are sought.
const SNIFFED: usize = 1 << 16;

fn looks_like_obj(bytes: &[u8]) -> bool {
    const WORDS: [&[u8]; 8] = [b"v", b"vn", b"vt", b"f", b"o", b"g", b"mtllib", b"usemtl"];
    let head = without_bom(&bytes[..bytes.len().min(SNIFFED)]);
    let lines = head.split(|&b| b == b'\n' || b == b'\r');
    !head.contains(&0) && lines.map(first_word).any(|word| WORDS.contains(&word))
}
