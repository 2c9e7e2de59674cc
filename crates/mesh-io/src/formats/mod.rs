//! One module a format: each finds the geometry of a file, and the bytes of every coordinate.

mod geometry;
pub(crate) mod gltf;
mod obj;
mod off;
mod ply;
mod stl;
mod text;
mod threemf;

use std::path::Path;

use mesh::TriMesh;

use crate::buffer::Buffer;
use crate::error::{AssetError, AssetProblem, Fault};
use crate::packing::Beside;
use crate::slots::Slots;
use crate::slots::directions::Found;
use crate::{Format, Precision, export, format, materials};
pub(crate) use geometry::{Geometry, Instance};

/// Reads a file from its bytes; returns the buffers of which the geometry speaks.
pub(crate) fn read(
    format: Format,
    path: &Path,
    bytes: Vec<u8>,
    beside: &Beside<'_>,
) -> Result<(Vec<Buffer>, Geometry), AssetError> {
    let file = Buffer::file(bytes);
    let geometry = match format {
        Format::Obj => obj::read(&file.bytes),
        Format::Ply => ply::read(&file.bytes),
        Format::Stl => stl::read(&file.bytes),
        Format::Off => off::read(&file.bytes),
        Format::ThreeMf => threemf::read(&file.bytes, beside.own_name()),
        Format::Gltf | Format::Glb => return gltf::read(path, file, beside),
    };
    let geometry = geometry.map_err(|fault| fault.of(path))?;
    let mut buffers = vec![file];
    if let Beside::Folder(folder) = beside {
        buffers.extend(materials::beside(format, &buffers[0].bytes, folder));
    }
    Ok((buffers, geometry))
}

/// What turns with the mesh besides its positions, which lie in these slots.
pub(crate) fn directions(format: Format, buffers: &[Buffer], slots: &Slots) -> Result<Found, Fault> {
    let bytes = &buffers[0].bytes;
    match (format, slots) {
        (Format::Obj, _) => Ok(obj::normals(bytes)),
        (Format::Ply, _) => ply::normals(bytes),
        (Format::Stl, _) => Ok(stl::normals(bytes)),
        (Format::Off, _) => off::normals(bytes),
        (Format::Gltf | Format::Glb, Slots::Scene(scene)) => gltf::directions(buffers, scene),
        (Format::Gltf | Format::Glb | Format::ThreeMf, _) => Ok(Found::default()),
    }
}

/// What poses the file's vertices, where the format has it.
pub(crate) fn rig(
    format: Format,
    buffers: &[Buffer],
    slots: &Slots,
) -> Result<Option<gltf::RigOfFile>, Fault> {
    match (format, slots) {
        (Format::Gltf | Format::Glb, Slots::Scene(scene)) => gltf::rig(buffers, scene),
        _ => Ok(None),
    }
}

/// The bytes of a new file with nothing but a mesh.
pub(crate) fn write(format: Format, mesh: &TriMesh, precision: Precision) -> Vec<u8> {
    match format {
        Format::Obj => export::obj(mesh, precision),
        Format::Ply => export::ply(mesh, precision, None),
        Format::Stl => export::stl(mesh),
        Format::Off => export::off(mesh, precision),
        Format::Gltf => export::gltf(mesh),
        Format::Glb => export::glb(mesh),
        Format::ThreeMf => export::threemf(mesh, precision),
    }
}

/// The format of a file, by what the caller says, its name and its content.
pub(crate) fn decide(path: &Path, given: Option<Format>, bytes: &[u8]) -> Result<Format, AssetProblem> {
    let unknown = AssetProblem::UnknownFormat;
    let extension = format::extension_before_gz(path);
    let Some(named) = given.or_else(|| Format::of_path(path)) else {
        let found = Format::of_content(bytes);
        return match (extension, found) {
            (None, Some(found)) => Ok(found),
            (None, None) => Err(unknown(
                foreign(bytes, "")
                    .unwrap_or("the content is of no known format")
                    .into(),
            )),
            (Some(extension), Some(found)) => Err(unknown(format!(
                "the name ends in .{extension}, but the content looks like {found}: rename it to end in .{}",
                found.extension()
            ))),
            (Some(extension), None) => Err(unknown(match foreign(bytes, &extension) {
                Some(remedy) => remedy.into(),
                None => format!("files that end in .{extension} are of no known format"),
            })),
        };
    };
    match Format::marked(bytes) {
        Some(found) if found != named => Err(AssetProblem::WrongExtension { named, found }),
        _ => Ok(named),
    }
}

/// What to do with a file of a well-known format that is not read.
fn foreign(bytes: &[u8], extension: &str) -> Option<&'static str> {
    let begins = |mark: &str| bytes.starts_with(mark.as_bytes());
    Some(match extension {
        _ if begins("Kaydara FBX") => FBX,
        "fbx" => FBX,
        _ if begins("ISO-10303-21") => STEP,
        "step" | "stp" | "iges" | "igs" | "brep" | "x_t" | "sldprt" => STEP,
        _ if begins("BLENDER") => BLEND,
        "blend" => BLEND,
        "usd" | "usda" | "usdc" | "usdz" => USD,
        "dae" | "3ds" | "max" | "ma" | "mb" | "c4d" | "lwo" | "x3d" | "wrl" | "vrml" => SCENE,
        _ => return None,
    })
}

const FBX: &str = "FBX is a closed format, and is not read: open it in Blender (File, Import, FBX) and export it as glTF (.glb), which keeps \
                   materials and skeletons";
const STEP: &str = "STEP and its like hold curved faces without triangles, and the mark lives in a mesh: have your CAD program export STL, OBJ \
                    or 3MF as finely as you will give it away, and sign that";
const BLEND: &str = "a Blender project is not read: export the model from Blender as glTF (.glb)";
const USD: &str = "USD is not read: open it in Blender (File, Import, Universal Scene Description) and export it as glTF (.glb)";
const SCENE: &str = "this format is not read: open it in the program that it comes from, or in Blender, and export it as glTF (.glb) or OBJ";
