//! Meshes in zip archives: one entry is the mesh, the others stay as they are. 3MF is such an archive.

use std::io::{Cursor, Read, Write};
use std::path::Path;
use std::sync::Arc;

use zip::{ZipArchive, ZipWriter, result::ZipError};

use crate::{AssetProblem, Format, source};

const MAGIC: &[u8] = b"PK\x03\x04";

/// The entry of 3MF that holds the meshes.
const MODEL: &str = "3D/3dmodel.model";

/// As for gzip: more is an attack on our memory.
const LARGEST_RATIO: u64 = 64;
const SLACK: u64 = 1 << 20;

/// An archive with a mesh in it.
#[derive(Clone, Debug)]
pub(crate) struct Archive {
    stored: Arc<Vec<u8>>,
    /// Number of the mesh's entry.
    entry: usize,
    pub(crate) format: Format,
    changed: bool,
}

pub(crate) fn is_zip(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

impl Archive {
    /// The archive, and the mesh's bytes.
    pub(crate) fn open(stored: Vec<u8>) -> Result<(Self, Vec<u8>), AssetProblem> {
        let mut archive = ZipArchive::new(Cursor::new(stored.as_slice())).map_err(damaged)?;
        let (entry, format) = mesh_entry(&archive)?;
        let file = archive.by_index(entry).map_err(damaged)?;
        source::check_size(stored.len() as u64, source::LARGEST)?;
        let limit = (LARGEST_RATIO * stored.len() as u64 + SLACK).min(source::LARGEST);
        let mut content = Vec::new();
        file.take(limit + 1)
            .read_to_end(&mut content)
            .map_err(|error| damaged(error.into()))?;
        if content.len() as u64 > limit {
            let compressed = stored.len();
            return Err(AssetProblem::ArchiveTooLarge { compressed, limit });
        }
        let archive = Self {
            stored: Arc::new(stored),
            entry,
            format,
            changed: false,
        };
        // The list at an archive's end may name entries that are not there: said now, not when the mesh has changed.
        archive.packed(&[]).map_err(damaged)?;
        Ok((archive, content))
    }

    /// The same archive with another mesh.
    pub(crate) fn changed(&self) -> Self {
        Self {
            changed: true,
            ..self.clone()
        }
    }

    /// The archive with this mesh: all other entries byte for byte, in their order.
    pub(crate) fn pack(&self, content: &[u8]) -> Vec<u8> {
        match self.changed {
            false => self.stored.as_ref().clone(),
            true => self
                .packed(content)
                .expect("an archive that was read can be copied into memory"),
        }
    }

    fn packed(&self, content: &[u8]) -> Result<Vec<u8>, ZipError> {
        let mut old = ZipArchive::new(Cursor::new(self.stored.as_slice()))?;
        let mut new = ZipWriter::new(Cursor::new(Vec::with_capacity(self.stored.len())));
        new.set_raw_comment(old.comment().into())?;
        for entry in 0..old.len() {
            let file = old.by_index_raw(entry)?;
            if entry == self.entry {
                let name = file.name()?.into_owned();
                new.start_file(name, file.options().large_file(content.len() > u32::MAX as usize))?;
                new.write_all(content)?;
            } else {
                new.raw_copy_file(file)?;
            }
        }
        Ok(new.finish()?.into_inner())
    }
}

/// The entry that is the mesh: the model of a 3MF, or the one file whose name is that of a mesh.
fn mesh_entry(archive: &ZipArchive<Cursor<&[u8]>>) -> Result<(usize, Format), AssetProblem> {
    if let Some(entry) = archive.index_for_name(MODEL) {
        return Ok((entry, Format::ThreeMf));
    }
    let is_own = |name: &str| {
        !name.starts_with("__MACOSX/") && !name.rsplit('/').next().unwrap_or(name).starts_with('.')
    };
    let meshes: Vec<(String, Format)> = archive
        .file_names()
        .filter_map(|name| Some(name.ok()?.into_owned()))
        .filter(|name| is_own(name))
        .filter_map(|name| Format::of_path(Path::new(&name)).map(|format| (name, format)))
        .collect();
    match meshes.as_slice() {
        [] => Err(AssetProblem::NoMeshInArchive),
        [(name, format)] => {
            let entry = archive
                .index_for_name(name)
                .ok_or(AssetProblem::NoMeshInArchive)?;
            Ok((entry, *format))
        }
        several => Err(AssetProblem::SeveralMeshesInArchive(
            several
                .iter()
                .take(4)
                .map(|(name, _)| (*name).to_string())
                .collect(),
        )),
    }
}

fn damaged(error: ZipError) -> AssetProblem {
    AssetProblem::Archive(error.to_string())
}
