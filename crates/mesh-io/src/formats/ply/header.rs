use std::collections::BTreeSet;

use super::faces::Faces;
use crate::error::{CUT_SHORT, Fault};
use crate::scalar::{Endian, Scalar};

#[derive(Clone, Copy)]
pub(super) enum Encoding {
    Ascii,
    Binary(Endian),
}

pub(super) struct Header<'a> {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element<'a>>,
    /// Where the data begin.
    pub(super) end: usize,
}

pub(super) struct Element<'a> {
    pub(super) name: &'a [u8],
    pub(super) count: usize,
    pub(super) properties: Vec<Property<'a>>,
}

pub(super) struct Property<'a> {
    pub(super) name: &'a [u8],
    /// The type of a list's count; `None` for a single value.
    pub(super) count: Option<Scalar>,
    pub(super) value: Scalar,
}

impl<'a> Header<'a> {
    pub(super) fn read(bytes: &'a [u8]) -> Result<Self, Fault> {
        if !bytes.starts_with(b"ply") {
            let problem = format!("expected ply, with which every PLY file begins{CUT_SHORT}");
            return Err(Fault::at_line(bytes, 0, problem));
        }
        let mut lines = Lines::of(bytes);
        let (mut encoding, mut elements) = (None, Vec::new());
        let mut names = Names::default();
        loop {
            let Some((start, line)) = lines.next() else {
                let problem = format!("the header does not end with end_header{CUT_SHORT}");
                return Err(Fault::at_line(bytes, bytes.len(), problem));
            };
            let mut words = line
                .split(u8::is_ascii_whitespace)
                .filter(|word| !word.is_empty());
            let read = match words.next() {
                Some(b"end_header") => break,
                Some(b"format") => Encoding::of(words).map(|read| encoding = Some(read)),
                Some(b"element") => declare_element(words, &mut elements, &mut names),
                Some(b"property") => declare_property(words, &mut elements, &mut names),
                None | Some(b"ply" | b"comment" | b"obj_info") => Ok(()),
                Some(_) => Err("not a line of a PLY header"),
            };
            read.map_err(|problem| Fault::at_line(bytes, start, problem.to_owned() + CUT_SHORT))?;
        }
        let encoding =
            encoding.ok_or_else(|| Fault::in_file(format!("the header has no format line{CUT_SHORT}")))?;
        Ok(Self {
            encoding,
            elements,
            end: lines.at,
        })
    }
}

impl Encoding {
    fn of<'a>(mut words: impl Iterator<Item = &'a [u8]>) -> Result<Self, &'static str> {
        match words.next() {
            Some(b"ascii") => Ok(Self::Ascii),
            Some(b"binary_little_endian") => Ok(Self::Binary(Endian::Little)),
            Some(b"binary_big_endian") => Ok(Self::Binary(Endian::Big)),
            _ => Err("expected format ascii, binary_little_endian or binary_big_endian"),
        }
    }
}

/// The names that were declared. Looked up, because a header made for it has millions.
#[derive(Default)]
struct Names<'a> {
    elements: BTreeSet<&'a [u8]>,
    /// Of the last element.
    properties: BTreeSet<&'a [u8]>,
}

fn declare_element<'a>(
    words: impl Iterator<Item = &'a [u8]>,
    elements: &mut Vec<Element<'a>>,
    names: &mut Names<'a>,
) -> Result<(), &'static str> {
    let element = Element::of(words).ok_or("expected element NAME COUNT")?;
    if !names.elements.insert(element.name) {
        return Err("this element is declared twice");
    }
    names.properties = BTreeSet::new();
    elements.push(element);
    Ok(())
}

fn declare_property<'a>(
    words: impl Iterator<Item = &'a [u8]>,
    elements: &mut [Element<'a>],
    names: &mut Names<'a>,
) -> Result<(), &'static str> {
    let property = Property::of(words).ok_or(
        "expected property TYPE NAME or property list TYPE TYPE NAME, with types such as int and float",
    )?;
    let element = elements.last_mut().ok_or("this property belongs to no element")?;
    if !names.properties.insert(property.name) {
        return Err("this property is declared twice");
    }
    element.properties.push(property);
    Ok(())
}

impl<'a> Element<'a> {
    fn of(mut words: impl Iterator<Item = &'a [u8]>) -> Option<Self> {
        let name = words.next()?;
        let count = std::str::from_utf8(words.next()?).ok()?.parse().ok()?;
        Some(Self {
            name,
            count,
            properties: Vec::new(),
        })
    }

    /// Which properties are x, y and z.
    pub(super) fn axes(&self) -> Result<[usize; 3], Fault> {
        self.vector(["x", "y", "z"]).map_err(|name| {
            Fault::in_file(format!(
                "the vertices have no property {name}: export the file with x, y and z"
            ))
        })
    }

    /// Which properties have these names; or the first name that none has.
    pub(super) fn vector(&self, names: [&'static str; 3]) -> Result<[usize; 3], &'static str> {
        let mut axes = [0; 3];
        for (axis, name) in axes.iter_mut().zip(names) {
            let found = self
                .properties
                .iter()
                .position(|p| p.name == name.as_bytes() && p.count.is_none());
            *axis = found.ok_or(name)?;
        }
        Ok(axes)
    }

    /// Which property lists vertex indices, if this element has to do with faces.
    pub(super) fn faces(&self) -> Option<(usize, Faces)> {
        let faces = match self.name {
            b"face" => Faces::Polygons,
            b"tristrips" => Faces::Strips,
            _ => return None,
        };
        let is_indices =
            |p: &Property<'_>| p.count.is_some() && matches!(p.name, b"vertex_indices" | b"vertex_index");
        self.properties
            .iter()
            .position(is_indices)
            .map(|property| (property, faces))
    }

    /// Bytes of a binary record, if it has no lists; [`Self::check_count`] proves that all records are there.
    pub(super) fn fixed_size(&self) -> Option<usize> {
        let size = |p: &Property<'_>| p.count.is_none().then(|| p.value.size());
        self.properties.iter().map(size).sum()
    }

    /// A fault unless as many records as the header says, of `smallest` bytes or more each, can fit into `available` bytes.
    pub(super) fn check_count(&self, available: usize, smallest: usize) -> Result<(), Fault> {
        if smallest > 0 && self.count > available / smallest {
            let (count, name) = (self.count, self.name.escape_ascii());
            let problem = format!(
                "{count} records of element {name} do not fit into the {available} bytes that follow"
            );
            return Err(Fault::in_file(problem + CUT_SHORT));
        }
        Ok(())
    }
}

impl<'a> Property<'a> {
    fn of(mut words: impl Iterator<Item = &'a [u8]>) -> Option<Self> {
        let kind = words.next()?;
        let (count, value) = if kind == b"list" {
            (
                Some(Scalar::of_name(words.next()?).filter(|t| t.is_integer())?),
                words.next()?,
            )
        } else {
            (None, kind)
        };
        Some(Self {
            count,
            value: Scalar::of_name(value)?,
            name: words.next()?,
        })
    }
}

/// Lines that end as the first one does: what follows the header may begin with any byte.
struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
    end: u8,
}

impl<'a> Lines<'a> {
    fn of(bytes: &'a [u8]) -> Self {
        let first_end = bytes
            .iter()
            .position(|&b| b == b'\r' || b == b'\n')
            .unwrap_or(bytes.len());
        let end = if bytes[first_end..].starts_with(b"\r") && !bytes[first_end..].starts_with(b"\r\n") {
            b'\r'
        } else {
            b'\n'
        };
        Self { bytes, at: 0, end }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let start = self.at;
        let length = self.bytes[start..].iter().position(|&b| b == self.end)?;
        self.at = start + length + 1;
        Some((start, &self.bytes[start..start + length]))
    }
}
