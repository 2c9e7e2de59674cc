use std::path::Path;

use crate::error::AssetError;
use crate::packing::Packing;
use crate::{Format, formats, source};

/// A file to which another one refers by name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Companion {
    /// Its name, from the folder of the other.
    pub name: String,
    /// Whether positions may lie in it, so that it changes with them: a buffer. Textures do not.
    pub is_buffer: bool,
}

/// The files that a mesh file refers to by name, whether or not they are there, without reading the mesh: those of glTF, GLB among it.
/// Others have none, and of what is packed in a zip archive all lies there.
///
/// # Errors
/// When the file can't be read, or its JSON is not that of glTF.
pub fn companions_of(path: impl AsRef<Path>) -> Result<Vec<Companion>, AssetError> {
    let path = path.as_ref();
    if !matches!(Format::of_path(path), None | Some(Format::Gltf | Format::Glb)) {
        return Ok(Vec::new());
    }
    let refused = |problem: crate::AssetProblem| problem.of(path);
    let stored = source::read(path, source::LARGEST).map_err(refused)?;
    let (packing, bytes) = Packing::open(stored).map_err(refused)?;
    let format = match packing {
        Packing::Zip(_) => return Ok(Vec::new()),
        _ => formats::decide(path, None, &bytes).map_err(refused)?,
    };
    match format {
        Format::Gltf | Format::Glb => formats::gltf::companions(path, &bytes),
        _ => Ok(Vec::new()),
    }
}
