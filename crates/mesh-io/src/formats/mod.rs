//! One module a format: each finds the geometry of a file, and the bytes of every coordinate.

use crate::{Format, asset::Geometry, error::Fault};

mod obj;
mod off;
mod ply;
mod stl;

/// Reads the bytes of a file.
pub(crate) fn read(format: Format, bytes: &[u8]) -> Result<Geometry, Fault> {
    match format {
        Format::Obj => obj::read(bytes),
        Format::Ply => ply::read(bytes),
        Format::Stl => stl::read(bytes),
        Format::Off => off::read(bytes),
    }
}
