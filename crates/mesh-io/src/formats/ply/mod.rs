//! Stanford PLY: a header that declares elements and their properties, then their values as text or binary numbers.

mod ascii;
mod binary;
mod faces;
mod header;

use super::geometry::Geometry;
use crate::error::Fault;
use crate::slots::directions::{Directions, Found, Unturned};
use ascii::Ascii;
use binary::Binary;
use header::{Encoding, Header};

/// Three properties of an element.
#[derive(Clone, Copy)]
struct Wanted {
    element: usize,
    axes: [usize; 3],
}

pub(crate) fn read(bytes: &[u8]) -> Result<Geometry, Fault> {
    let header = Header::read(bytes)?;
    let element = vertex(&header)?;
    let axes = header.elements[element].axes()?;
    vectors(bytes, &header, Wanted { element, axes })
}

/// The normals of vertices, and of whatever else has some: `nx`, `ny`, `nz`.
pub(crate) fn normals(bytes: &[u8]) -> Result<Found, Fault> {
    const NAMES: [&str; 3] = ["nx", "ny", "nz"];
    let header = Header::read(bytes)?;
    let vertex = vertex(&header)?;
    let mut found = Found::default();
    for (number, element) in header.elements.iter().enumerate() {
        let what = format!("the normals of element {}", element.name.escape_ascii());
        let has_some = NAMES
            .iter()
            .any(|name| element.properties.iter().any(|p| p.name == name.as_bytes()));
        let normals = element.vector(NAMES).map(|axes| {
            let element = number;
            vectors(bytes, &header, Wanted { element, axes })
        });
        match normals {
            Ok(Ok(normals)) => found.lists.push(Directions {
                what,
                ..normals.into_normals(number == vertex)
            }),
            Ok(Err(fault)) => found.left.push(Unturned::new(what, fault.problem)),
            Err(name) if has_some => {
                let why = format!("it has no property {name}");
                found.left.push(Unturned::new(what, why));
            }
            Err(_) => {}
        }
    }
    Ok(found)
}

fn vertex(header: &Header<'_>) -> Result<usize, Fault> {
    let vertex = header.elements.iter().position(|e| e.name == b"vertex");
    vertex.ok_or_else(|| Fault::in_file("the header declares no element vertex: export the file again"))
}

/// The triangles, and three numbers of each record of an element as its vertices.
fn vectors(bytes: &[u8], header: &Header<'_>, wanted: Wanted) -> Result<Geometry, Fault> {
    match header.encoding {
        Encoding::Ascii => Ascii::read(bytes, header, wanted),
        Encoding::Binary(endian) => Binary::read(bytes, endian, header, wanted),
    }
}
