//! STL, binary and ASCII. Facets share no vertices: each has three of its own, which welding joins.

use super::{geometry::Geometry, text::TextGeometry};
use crate::error::{CUT_SHORT, Fault};
use crate::format::{STL_FACET, STL_HEADER, first_word, is_binary_stl};
use crate::scalar::{Endian, Scalar};
use crate::slots::directions::{Directions, Found, Role, Unturned};
use crate::slots::{Slots, binary::BinaryRun};
use crate::words::{Word, Words};

pub(crate) fn read(bytes: &[u8]) -> Result<Geometry, Fault> {
    match is_binary(bytes) {
        true => read_binary(bytes),
        false => read_ascii(bytes),
    }
}

fn is_binary(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(STL_HEADER)];
    is_binary_stl(bytes) || !first_word(bytes).eq_ignore_ascii_case(b"solid") || head.contains(&0)
}

/// 80 bytes of header, the number of facets, then 50 bytes a facet: a normal, three vertices, two bytes of attributes.
fn read_binary(bytes: &[u8]) -> Result<Geometry, Fault> {
    if !is_binary_stl(bytes) {
        return Err(wrong_size(bytes));
    }
    let facets = (bytes.len() - STL_HEADER) / STL_FACET;
    let vertex_count = 3 * facets;
    let slots = vectors(vec![[12, 16, 20], [24, 28, 32], [36, 40, 44]], facets);
    let positions = slots.positions(&[bytes]);
    let triangles = (0..vertex_count as u32 / 3)
        .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
        .collect();
    Ok(Geometry {
        positions,
        triangles,
        slots,
        names: Vec::new(),
        instances: Vec::new(),
        manifests: 0,
    })
}

/// Vectors in single precision, from those bytes of every facet on.
fn vectors(places: Vec<[usize; 3]>, facets: usize) -> Slots {
    Slots::Binary(vec![BinaryRun {
        buffer: 0,
        start: STL_HEADER,
        stride: STL_FACET,
        count: places.len() * facets,
        vertices: places,
        types: [Scalar::F32; 3],
        endian: Endian::Little,
        quantisation: None,
        placement: None,
        locked: None,
    }])
}

/// The normals of facets; those that are zero, as programs write them that leave them out, stay so.
pub(crate) fn normals(bytes: &[u8]) -> Found {
    let mut found = Found::default();
    if is_binary(bytes) {
        found.lists.push(Directions {
            slots: vectors(vec![[0, 4, 8]], (bytes.len() - STL_HEADER) / STL_FACET),
            role: Role::Normal,
            placement: None,
            of_vertices: false,
            what: "the normals".into(),
        });
        return found;
    }
    let mut words = Words::new(bytes, 0);
    let (mut normals, mut unread) = (TextGeometry::default(), 0);
    while let Some(keyword) = words.next_anywhere() {
        if keyword.text.eq_ignore_ascii_case(b"facet")
            && words.next_in_line().is_some()
            && normals.read_vertex(&mut words).is_err()
        {
            unread += 1;
        }
        words.skip_line();
    }
    found.lists.extend(normals.into_normals(false));
    if unread > 0 {
        let what = format!("the normals of {unread} facets");
        found.left.push(Unturned::new(what, "they are no three numbers"));
    }
    found
}

fn wrong_size(bytes: &[u8]) -> Fault {
    let Some(count) = Scalar::U32.read(bytes, STL_HEADER - 4, Endian::Little) else {
        let problem = format!(
            "neither ASCII STL (which begins with solid) nor binary STL ({} bytes are too few){CUT_SHORT}",
            bytes.len()
        );
        return Fault::in_file(problem);
    };
    let needed = STL_HEADER as f64 + count * STL_FACET as f64;
    let problem = format!(
        "{count} facets take {needed} bytes, but the file has {}{CUT_SHORT}",
        bytes.len()
    );
    Fault::at_byte(STL_HEADER - 4, "number of facets of a binary STL", problem)
}

/// `solid`, then for each facet `facet normal`, `outer loop`, three `vertex` lines, `endloop`, `endfacet`; `endsolid`.
fn read_ascii(bytes: &[u8]) -> Result<Geometry, Fault> {
    // With other numbers before it a zero could come to stand where binary STL counts its facets.
    if let Some(at) = bytes.iter().position(|&byte| byte == 0) {
        let problem = "a zero byte, which ASCII STL never has: the file is damaged, or another format";
        return Err(Fault::at_line(bytes, at, problem));
    }
    let mut words = Words::new(bytes, 0);
    let mut geometry = TextGeometry::default();
    let mut open = Open::Nothing;
    let mut corners: Vec<u32> = Vec::with_capacity(4);
    while let Some(keyword) = words.next_anywhere() {
        let is = |name: &str| keyword.text.eq_ignore_ascii_case(name.as_bytes());
        if is("vertex") {
            open.expect(Open::Loop, Open::Loop, &words, keyword)?;
            corners.push(geometry.vertex_count() as u32);
            geometry.read_vertex(&mut words)?;
        } else if is("facet") {
            open.expect(Open::Solid, Open::Facet, &words, keyword)?;
        } else if is("outer") {
            open.expect(Open::Facet, Open::Loop, &words, keyword)?;
        } else if is("endloop") {
            open.expect(Open::Loop, Open::Facet, &words, keyword)?;
            if corners.len() < 3 {
                let problem = format!(
                    "this facet has {} vertices, and needs 3{CUT_SHORT}",
                    corners.len()
                );
                return Err(words.fault_at(keyword, problem));
            }
            geometry.push_polygon(&corners);
            corners.clear();
        } else if is("endfacet") {
            open.expect(Open::Facet, Open::Solid, &words, keyword)?;
        } else if is("solid") {
            open.expect(Open::Nothing, Open::Solid, &words, keyword)?;
        } else if is("endsolid") {
            open.expect(Open::Solid, Open::Nothing, &words, keyword)?;
        } else {
            let problem = format!(
                "{} is not a word of STL: expected facet, vertex, endsolid or the like",
                keyword.shown()
            );
            return Err(words.fault_at(keyword, problem));
        }
        words.skip_line();
    }
    match open {
        Open::Nothing => Ok(geometry.finish()),
        open => Err(words.fault(format!("the file ends inside a {}{CUT_SHORT}", open.name()))),
    }
}

/// The innermost thing that is open.
#[derive(Clone, Copy, PartialEq)]
enum Open {
    Nothing,
    Solid,
    Facet,
    Loop,
}

impl Open {
    fn name(self) -> &'static str {
        match self {
            Self::Nothing => "file",
            Self::Solid => "solid",
            Self::Facet => "facet",
            Self::Loop => "loop",
        }
    }

    /// Goes on to `next`, from `before` alone.
    fn expect(
        &mut self,
        before: Self,
        next: Self,
        words: &Words<'_>,
        keyword: Word<'_>,
    ) -> Result<(), Fault> {
        if *self != before {
            let place = format!("{} does not belong inside a {}", keyword.shown(), self.name());
            return Err(words.fault_at(keyword, place + CUT_SHORT));
        }
        *self = next;
        Ok(())
    }
}
