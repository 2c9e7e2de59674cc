use super::Wanted;
use super::faces::{Faces, Triangles};
use super::header::{Element, Header, Property};
use crate::error::{CUT_SHORT, Fault};
use crate::formats::geometry::Geometry;
use crate::scalar::Endian;
use crate::slots::{Slots, binary::BinaryRun};

/// Reads the data as binary numbers.
pub(super) struct Binary<'a> {
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
    pub(super) fn read(
        bytes: &'a [u8],
        endian: Endian,
        header: &Header<'_>,
        Wanted {
            element: wanted,
            axes,
        }: Wanted,
    ) -> Result<Geometry, Fault> {
        let vertices = &header.elements[wanted];
        let triangles = Triangles::new(header.elements[super::vertex(header)?].count);
        let mut binary = Self {
            bytes,
            at: header.end,
            endian,
            triangles,
        };
        let (mut start, mut stride, mut places) = (0, 0, Vec::new());
        for (number, element) in header.elements.iter().enumerate() {
            let smallest = element
                .properties
                .iter()
                .map(|p| p.count.unwrap_or(p.value).size());
            element.check_count(bytes.len() - binary.at, smallest.sum())?;
            if element.properties.is_empty() {
                continue;
            }
            let is_wanted = number == wanted;
            if let Some(size) = element.fixed_size() {
                if is_wanted {
                    let offsets = axes.map(|axis| {
                        element.properties[..axis]
                            .iter()
                            .map(|p| p.value.size())
                            .sum::<usize>()
                    });
                    (start, stride, places) = (binary.at, size, vec![offsets]);
                }
                binary.at += element.count * size;
            } else {
                let indices = element.faces();
                for record in 0..element.count {
                    let xyz = binary.record(element, record, axes, indices)?;
                    if is_wanted {
                        places.push(xyz);
                    }
                }
            }
        }
        let slots = Slots::Binary(vec![BinaryRun {
            buffer: 0,
            start,
            stride,
            vertices: places,
            count: vertices.count,
            types: axes.map(|axis| vertices.properties[axis].value),
            endian,
            quantisation: None,
            placement: None,
            locked: None,
        }]);
        let positions = slots.positions(&[bytes]);
        Ok(Geometry {
            positions,
            triangles: binary.triangles.triangles,
            slots,
            names: Vec::new(),
            instances: Vec::new(),
            manifests: 0,
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
