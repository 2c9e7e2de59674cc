//! Stanford PLY: a header that declares elements and their properties, then their values as text or binary numbers.

use crate::asset::Geometry;
use crate::error::Fault;
use crate::scalar::{Endian, Scalar};
use crate::slots::Slots;
use crate::text::{CUT_SHORT, TextGeometry, Word, Words, fan, not_a_number};

pub(crate) fn read(bytes: &[u8]) -> Result<Geometry, Fault> {
    let header = Header::read(bytes)?;
    let vertex = header.elements.iter().position(|e| e.name == b"vertex");
    let vertex = vertex
        .ok_or_else(|| Fault::in_file("the header declares no element vertex: export the file again"))?;
    let axes = header.elements[vertex].axes()?;
    match header.encoding {
        Encoding::Ascii => Ascii::read(bytes, &header, vertex, axes),
        Encoding::Binary(endian) => Binary::read(bytes, endian, &header, vertex, axes),
    }
}

#[derive(Clone, Copy)]
enum Encoding {
    Ascii,
    Binary(Endian),
}

struct Header<'a> {
    encoding: Encoding,
    elements: Vec<Element<'a>>,
    /// Where the data begin.
    end: usize,
}

struct Element<'a> {
    name: &'a [u8],
    count: usize,
    properties: Vec<Property<'a>>,
}

struct Property<'a> {
    name: &'a [u8],
    /// The type of a list's count; `None` for a single value.
    count: Option<Scalar>,
    value: Scalar,
}

/// How an element's list of vertex indices is to be understood.
#[derive(Clone, Copy, PartialEq)]
enum Faces {
    Polygons,
    Strips,
}

impl<'a> Header<'a> {
    fn read(bytes: &'a [u8]) -> Result<Self, Fault> {
        let mut lines = Lines::of(bytes);
        if !bytes.starts_with(b"ply") {
            return Err(Fault::at_line(
                bytes,
                0,
                format!("expected ply, with which every PLY file begins{CUT_SHORT}"),
            ));
        }
        let mut encoding = None;
        let mut elements: Vec<Element<'a>> = Vec::new();
        loop {
            let (start, line) = lines.next().ok_or_else(|| {
                Fault::at_line(
                    bytes,
                    bytes.len(),
                    format!("the header does not end with end_header{CUT_SHORT}"),
                )
            })?;
            let mut words = line
                .split(u8::is_ascii_whitespace)
                .filter(|word| !word.is_empty());
            let fault = |problem: &str| Fault::at_line(bytes, start, problem.to_owned() + CUT_SHORT);
            match words.next() {
                Some(b"end_header") => break,
                Some(b"format") => {
                    encoding = Some(match words.next() {
                        Some(b"ascii") => Encoding::Ascii,
                        Some(b"binary_little_endian") => Encoding::Binary(Endian::Little),
                        Some(b"binary_big_endian") => Encoding::Binary(Endian::Big),
                        _ => {
                            return Err(fault(
                                "expected format ascii, binary_little_endian or binary_big_endian",
                            ));
                        }
                    });
                }
                Some(b"element") => {
                    let element = Element::of(words).ok_or_else(|| fault("expected element NAME COUNT"))?;
                    if elements.iter().any(|e| e.name == element.name) {
                        return Err(fault("this element is declared twice"));
                    }
                    elements.push(element);
                }
                Some(b"property") => {
                    let property = Property::of(words).ok_or_else(|| {
                        fault("expected property TYPE NAME or property list TYPE TYPE NAME, with types such as int and float")
                    })?;
                    let element = elements
                        .last_mut()
                        .ok_or_else(|| fault("this property belongs to no element"))?;
                    if element.properties.iter().any(|p| p.name == property.name) {
                        return Err(fault("this property is declared twice"));
                    }
                    element.properties.push(property);
                }
                None | Some(b"ply" | b"comment" | b"obj_info") => {}
                Some(_) => return Err(fault("not a line of a PLY header")),
            }
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
    fn axes(&self) -> Result<[usize; 3], Fault> {
        let mut axes = [0; 3];
        for (axis, name) in axes.iter_mut().zip(["x", "y", "z"]) {
            let found = self
                .properties
                .iter()
                .position(|p| p.name == name.as_bytes() && p.count.is_none());
            *axis = found.ok_or_else(|| {
                Fault::in_file(format!(
                    "the vertices have no property {name}: export the file with x, y and z"
                ))
            })?;
        }
        Ok(axes)
    }

    /// Which property lists vertex indices, if this element has to do with faces.
    fn faces(&self) -> Option<(usize, Faces)> {
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
    fn fixed_size(&self) -> Option<usize> {
        let sizes = self.properties.iter().map(|p| {
            if p.count.is_none() {
                Some(p.value.size())
            } else {
                None
            }
        });
        sizes.sum()
    }

    /// A fault unless as many records as the header says can fit into `available` bytes.
    fn check_count(
        &self,
        available: usize,
        smallest_value: impl Fn(&Property<'_>) -> usize,
    ) -> Result<(), Fault> {
        let smallest: usize = self.properties.iter().map(smallest_value).sum();
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

/// Gathers triangles and knows how many vertices they may refer to.
struct Triangles {
    vertex_count: usize,
    corners: Vec<u32>,
    triangles: Vec<[u32; 3]>,
}

impl Triangles {
    fn new(vertex_count: usize) -> Self {
        Self {
            vertex_count,
            corners: Vec::new(),
            triangles: Vec::new(),
        }
    }

    /// Takes an index; −1 ends a strip.
    fn push_index(&mut self, index: i64, faces: Faces) -> Result<(), String> {
        if faces == Faces::Strips && index == -1 {
            self.end_list(faces)?;
            return Ok(());
        }
        let valid = u32::try_from(index)
            .ok()
            .filter(|&i| (i as usize) < self.vertex_count);
        self.corners.push(valid.ok_or_else(|| {
            format!(
                "{index} is not one of the {} vertices (counted from 0){CUT_SHORT}",
                self.vertex_count
            )
        })?);
        Ok(())
    }

    /// Ends a polygon or a strip.
    fn end_list(&mut self, faces: Faces) -> Result<(), String> {
        match faces {
            Faces::Polygons if self.corners.len() < 3 => {
                return Err(format!(
                    "this face has {} corners, and needs at least 3: remove it",
                    self.corners.len()
                ));
            }
            Faces::Polygons => fan(&self.corners, &mut self.triangles),
            // Every other triangle of a strip is turned round, so that all face one way.
            Faces::Strips => self
                .triangles
                .extend(self.corners.windows(3).enumerate().map(|(i, c)| {
                    if i % 2 == 0 {
                        [c[0], c[1], c[2]]
                    } else {
                        [c[1], c[0], c[2]]
                    }
                })),
        }
        self.corners.clear();
        Ok(())
    }
}

/// Reads the data as text: one record a line.
struct Ascii<'a> {
    words: Words<'a>,
    triangles: Triangles,
}

impl<'a> Ascii<'a> {
    fn read(
        bytes: &'a [u8],
        header: &Header<'_>,
        vertex: usize,
        axes: [usize; 3],
    ) -> Result<Geometry, Fault> {
        let words = Words::new(bytes, header.end);
        let mut ascii = Self {
            words,
            triangles: Triangles::new(header.elements[vertex].count),
        };
        let mut geometry = TextGeometry::new();
        for (number, element) in header.elements.iter().enumerate() {
            // A digit and a blank a value; the last blank may lack.
            element.check_count((bytes.len() + 1).saturating_sub(ascii.words.position()), |_| 2)?;
            if element.properties.is_empty() {
                continue;
            }
            let indices = element.faces();
            for record in 0..element.count {
                let Some(first) = ascii.words.next_anywhere() else {
                    let (count, name) = (element.count, element.name.escape_ascii());
                    let problem = format!(
                        "the file ends after {record} of {count} records of element {name}{CUT_SHORT}"
                    );
                    return Err(ascii.words.fault(problem));
                };
                ascii.words.go_back_to(first);
                let xyz = ascii.record(element, axes, number == vertex, indices)?;
                if number == vertex {
                    geometry.push_vertex(&ascii.words, xyz.map(|word| word.unwrap_or(first)))?;
                }
                if let Some(extra) = ascii.words.next_in_line() {
                    let problem = format!(
                        "{} is more than the header declares for this line: mend one of them",
                        extra.shown()
                    );
                    return Err(ascii.words.fault_at(extra, problem));
                }
                ascii.words.skip_line();
            }
        }
        let declared = axes.map(|axis| header.elements[vertex].properties[axis].value);
        let geometry = geometry.finish_as(declared);
        Ok(Geometry {
            triangles: ascii.triangles.triangles,
            ..geometry
        })
    }

    /// Reads one record; returns the words of x, y and z of a vertex.
    fn record(
        &mut self,
        element: &Element<'_>,
        axes: [usize; 3],
        is_vertex: bool,
        indices: Option<(usize, Faces)>,
    ) -> Result<[Option<Word<'a>>; 3], Fault> {
        let mut xyz = [None; 3];
        for (number, property) in element.properties.iter().enumerate() {
            let value = self.value(property)?;
            if property.count.is_none() {
                if is_vertex && let Some(axis) = axes.iter().position(|&a| a == number) {
                    xyz[axis] = Some(value);
                }
                continue;
            }
            let faces = indices
                .filter(|&(list, _)| list == number)
                .map(|(_, faces)| faces);
            self.list(property, value, faces)?;
        }
        Ok(xyz)
    }

    fn list(&mut self, property: &Property<'_>, count: Word<'_>, faces: Option<Faces>) -> Result<(), Fault> {
        let length = count.integer().filter(|&n| n >= 0).ok_or_else(|| {
            self.words.fault_at(
                count,
                format!("{} is not the length of a list{CUT_SHORT}", count.shown()),
            )
        })?;
        for _ in 0..length {
            let word = self.value(property)?;
            if let Some(faces) = faces {
                let index = word.integer().ok_or_else(|| not_a_number(&self.words, word))?;
                self.triangles
                    .push_index(index, faces)
                    .map_err(|problem| self.words.fault_at(word, problem))?;
            }
        }
        faces.map_or(Ok(()), |faces| {
            self.triangles
                .end_list(faces)
                .map_err(|p| self.words.fault_at(count, p))
        })
    }

    fn value(&mut self, property: &Property<'_>) -> Result<Word<'a>, Fault> {
        self.words.next_in_line().ok_or_else(|| {
            let name = property.name.escape_ascii();
            self.words.fault(format!(
                "the line ends before the value of property {name}{CUT_SHORT}"
            ))
        })
    }
}

/// Reads the data as binary numbers.
struct Binary<'a> {
    bytes: &'a [u8],
    at: usize,
    endian: Endian,
    triangles: Triangles,
}

/// A record being read, for messages.
#[derive(Clone, Copy)]
struct Spot<'a> {
    element: &'a Element<'a>,
    record: usize,
    property: &'a Property<'a>,
}

impl Spot<'_> {
    fn fault(self, at: usize, problem: impl Into<String>) -> Fault {
        let (element, property) = (
            self.element.name.escape_ascii(),
            self.property.name.escape_ascii(),
        );
        Fault::at_byte(
            at,
            format!("{element} {}, property {property}", self.record),
            problem,
        )
    }
}

impl<'a> Binary<'a> {
    fn read(
        bytes: &'a [u8],
        endian: Endian,
        header: &Header<'_>,
        vertex: usize,
        axes: [usize; 3],
    ) -> Result<Geometry, Fault> {
        let vertices = &header.elements[vertex];
        let triangles = Triangles::new(vertices.count);
        let mut binary = Self {
            bytes,
            at: header.end,
            endian,
            triangles,
        };
        let mut starts = Vec::new();
        for (number, element) in header.elements.iter().enumerate() {
            element.check_count(bytes.len() - binary.at, |p| p.count.unwrap_or(p.value).size())?;
            if element.properties.is_empty() {
                continue;
            }
            let is_vertex = number == vertex;
            if let Some(size) = element.fixed_size() {
                if is_vertex {
                    let offsets = axes.map(|axis| {
                        element.properties[..axis]
                            .iter()
                            .map(|p| p.value.size())
                            .sum::<usize>()
                    });
                    let records = (0..element.count).map(|record| binary.at + record * size);
                    starts = records
                        .map(|start| offsets.map(|offset| start + offset))
                        .collect();
                }
                binary.at += element.count * size;
            } else {
                let indices = element.faces();
                for record in 0..element.count {
                    let xyz = binary.record(element, record, axes, indices)?;
                    if is_vertex {
                        starts.push(xyz);
                    }
                }
            }
        }
        let slots = Slots::binary(starts, axes.map(|axis| vertices.properties[axis].value), endian);
        let positions = (0..slots.len()).map(|v| slots.position(bytes, v)).collect();
        Ok(Geometry {
            positions,
            triangles: binary.triangles.triangles,
            slots,
        })
    }

    /// Reads one record; returns where the values of the properties `axes` begin.
    fn record(
        &mut self,
        element: &Element<'_>,
        record: usize,
        axes: [usize; 3],
        indices: Option<(usize, Faces)>,
    ) -> Result<[usize; 3], Fault> {
        let mut xyz = [0; 3];
        for (number, property) in element.properties.iter().enumerate() {
            let spot = Spot {
                element,
                record,
                property,
            };
            if property.count.is_some() {
                let faces = indices
                    .filter(|&(list, _)| list == number)
                    .map(|(_, faces)| faces);
                self.list(spot, faces)?;
            } else {
                for axis in 0..3 {
                    if axes[axis] == number {
                        xyz[axis] = self.at;
                    }
                }
                self.skip(spot, property.value.size() as u64)?;
            }
        }
        Ok(xyz)
    }

    fn list(&mut self, spot: Spot<'_>, faces: Option<Faces>) -> Result<(), Fault> {
        let (start, kind) = (self.at, spot.property.value);
        let count_type = spot.property.count.unwrap_or(kind);
        let count = count_type.read(self.bytes, start, self.endian);
        let count = count.ok_or_else(|| spot.fault(start, format!("the file ends here{CUT_SHORT}")))?;
        if count < 0.0 {
            return Err(spot.fault(start, format!("{count} is not the length of a list{CUT_SHORT}")));
        }
        self.at += count_type.size();
        let first = self.at;
        self.skip(spot, count as u64 * kind.size() as u64)?;
        let Some(faces) = faces else { return Ok(()) };
        if !kind.is_integer() {
            return Err(spot.fault(
                start,
                "vertex indices are of a floating point type: export the file with integers",
            ));
        }
        for at in (first..self.at).step_by(kind.size()) {
            let index = kind.read(self.bytes, at, self.endian).unwrap_or_default() as i64;
            self.triangles
                .push_index(index, faces)
                .map_err(|problem| spot.fault(at, problem))?;
        }
        self.triangles
            .end_list(faces)
            .map_err(|problem| spot.fault(start, problem))
    }

    fn skip(&mut self, spot: Spot<'_>, length: u64) -> Result<(), Fault> {
        let left = (self.bytes.len() - self.at) as u64;
        if length > left {
            return Err(spot.fault(
                self.at,
                format!("{length} bytes should follow, but only {left} do{CUT_SHORT}"),
            ));
        }
        self.at += length as usize;
        Ok(())
    }
}
