use std::path::{Component, Path};

use crate::error::AssetError;
use crate::packing::Packing;
use crate::{Format, formats, materials, source};

/// A file to which another one refers by name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Companion {
    /// Its name, from the folder of the other.
    pub name: String,
    /// Whether positions may lie in it, so that it changes with them: a buffer. Materials and pictures do not.
    pub is_buffer: bool,
}

/// The files that a mesh file refers to by name, whatever they hold, without reading the mesh: those of glTF, GLB among it, whether or not they are there; and of the
/// materials of an OBJ and the pictures of either and of a PLY, whose names can't be told from options, those that are. Others have none, and of what is packed in a zip archive all lies there.
///
/// # Errors
/// When the file can't be read, or its JSON is not that of glTF.
pub fn companions_of(path: impl AsRef<Path>) -> Result<Vec<Companion>, AssetError> {
    let path = path.as_ref();
    if matches!(
        Format::of_path(path),
        Some(Format::Stl | Format::Off | Format::ThreeMf)
    ) {
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
        _ => {
            let folder = path.parent().unwrap_or(Path::new(""));
            let names = materials::names(format, &bytes, folder).into_iter();
            let companion = |name| Companion {
                name,
                is_buffer: false,
            };
            Ok(names.map(companion).collect())
        }
    }
}

/// A name that leads beside the file that has it, or into a folder there, and nowhere else; of all spellings one.
pub(crate) fn name_beside(name: &str) -> Option<String> {
    let part = |part| match part {
        Component::Normal(part) => part.to_str(),
        _ => None,
    };
    let parts: Vec<&str> = Path::new(name).components().map(part).collect::<Option<_>>()?;
    let is_name = !parts.is_empty() && !name.contains('\0');
    is_name.then(|| parts.join("/"))
}
