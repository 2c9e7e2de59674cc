//! Stanford PLY: a header that declares elements and their properties, then their values as text or binary numbers.

mod ascii;
mod binary;
mod faces;
mod header;

use super::geometry::Geometry;
use crate::error::Fault;
use ascii::Ascii;
use binary::Binary;
use header::{Encoding, Header};

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
