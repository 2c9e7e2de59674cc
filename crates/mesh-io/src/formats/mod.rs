//! One module a format: each finds the geometry of a file, and the bytes of every coordinate.

mod geometry;
mod obj;
mod off;
mod ply;
mod stl;
mod text;

use std::path::Path;

use mesh::TriMesh;

use crate::error::{AssetProblem, Fault};
use crate::{Format, Precision, export, format};
pub(crate) use geometry::Geometry;

/// Reads the bytes of a file.
pub(crate) fn read(format: Format, bytes: &[u8]) -> Result<Geometry, Fault> {
    match format {
        Format::Obj => obj::read(bytes),
        Format::Ply => ply::read(bytes),
        Format::Stl => stl::read(bytes),
        Format::Off => off::read(bytes),
    }
}

/// The bytes of a new file with nothing but a mesh.
pub(crate) fn write(format: Format, mesh: &TriMesh, precision: Precision) -> Vec<u8> {
    match format {
        Format::Obj => export::obj(mesh, precision),
        Format::Ply => export::ply(mesh, precision, None),
        Format::Stl => export::stl(mesh),
        Format::Off => export::off(mesh, precision),
    }
}

/// The format of a file, by what the caller says, its name and its content.
pub(crate) fn decide(path: &Path, given: Option<Format>, bytes: &[u8]) -> Result<Format, AssetProblem> {
    let unknown = AssetProblem::UnknownFormat;
    let extension = format::extension_before_gz(path);
    if bytes.starts_with(b"glTF") || matches!(extension.as_deref(), Some("glb" | "gltf")) {
        return Err(unknown(
            "glTF is not read yet: export the model to another format".into(),
        ));
    }
    let Some(named) = given.or_else(|| Format::of_path(path)) else {
        let found = Format::of_content(bytes);
        return match (extension, found) {
            (None, Some(found)) => Ok(found),
            (None, None) => Err(unknown("the content is of no known format".into())),
            (Some(extension), Some(found)) => Err(unknown(format!(
                "the name ends in .{extension}, but the content looks like {found}: rename it to end in .{}",
                found.extension()
            ))),
            (Some(extension), None) => Err(unknown(format!(
                "files that end in .{extension} are of no known format"
            ))),
        };
    };
    match Format::marked(bytes) {
        Some(found) if found != named => Err(AssetProblem::WrongExtension { named, found }),
        _ => Ok(named),
    }
}
