//! Meshes in zip archives: one entry is the mesh, and those that it names go with it; the others stay as they are. 3MF is such an archive.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::io::{Cursor, Read, Write};
use std::path::Path;
use std::sync::Arc;

use zip::{ZipArchive, ZipWriter, result::ZipError};

use crate::buffer::Buffer;
use crate::{AssetProblem, Format, source};

const MAGIC: &[u8] = b"PK\x03\x04";

/// The first bytes of the record that ends an archive.
const END: &[u8] = b"PK\x05\x06";

/// The entry of 3MF that holds the meshes.
const MODEL: &str = "3D/3dmodel.model";

/// As for gzip: more is an attack on our memory.
const LARGEST_RATIO: u64 = 64;
const SLACK: u64 = 1 << 20;

/// An archive with a mesh in it.
#[derive(Clone, Debug)]
pub(crate) struct Archive {
    stored: Arc<Vec<u8>>,
    /// The mesh's entry, with its folder.
    entry: String,
    pub(crate) format: Format,
    /// The names of buffers that changed.
    changed: BTreeSet<String>,
}

pub(crate) fn is_zip(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

impl Archive {
    /// The archive, and the mesh's bytes.
    pub(crate) fn open(stored: Vec<u8>) -> Result<(Self, Vec<u8>), AssetProblem> {
        source::check_size(stored.len() as u64, source::LARGEST)?;
        let mut archive = ZipArchive::new(Cursor::new(stored.as_slice())).map_err(damaged)?;
        // A copy would hold the bytes that they share once for each.
        if archive.has_overlapping_entries().map_err(damaged)? {
            return Err(AssetProblem::Archive("its entries overlap".into()));
        }
        if archive.has_duplicate_names() {
            return Err(AssetProblem::Archive(
                "two of its entries have the same name".into(),
            ));
        }
        // Whoever reads the archive once it has another length might take what stands there for its directory.
        if archive.comment().windows(END.len()).any(|bytes| bytes == END) {
            return Err(AssetProblem::Archive("its comment holds another archive".into()));
        }
        let (entry, format) = mesh_entry(&archive)?;
        let archive = Self {
            stored: Arc::new(stored),
            entry,
            format,
            changed: BTreeSet::new(),
        };
        let content = archive.unpacked(&archive.entry, archive.limit())?;
        // What can't be copied now could not be when the mesh is written back.
        archive.packed(&|_| None).map_err(damaged)?;
        Ok((archive, content))
    }

    /// How many bytes may be unpacked from it.
    pub(crate) fn limit(&self) -> u64 {
        (LARGEST_RATIO * self.stored.len() as u64 + SLACK).min(source::LARGEST)
    }

    /// The bytes of a file that the mesh names, at most `limit`.
    pub(crate) fn member(&self, name: &str, limit: u64) -> Result<Vec<u8>, AssetProblem> {
        self.unpacked(&(self.folder().to_owned() + name), limit)
    }

    /// The mesh's entry, with its folder.
    pub(crate) fn entry(&self) -> &str {
        &self.entry
    }

    /// Where in the archive the mesh lies: empty, or with a slash at its end.
    fn folder(&self) -> &str {
        let end = self.entry.rfind('/').map_or(0, |slash| slash + 1);
        &self.entry[..end]
    }

    fn unpacked(&self, name: &str, limit: u64) -> Result<Vec<u8>, AssetProblem> {
        let mut archive = ZipArchive::new(Cursor::new(self.stored.as_slice())).map_err(damaged)?;
        let entry = archive.index_for_name(name);
        let entry = entry.ok_or_else(|| AssetProblem::NotInArchive(name.into()))?;
        let file = archive.by_index(entry).map_err(damaged)?;
        let mut content = Vec::new();
        file.take(limit + 1)
            .read_to_end(&mut content)
            .map_err(|error| damaged(error.into()))?;
        if content.len() as u64 > limit {
            let (compressed, limit) = (self.stored.len(), self.limit());
            return Err(AssetProblem::ArchiveTooLarge { compressed, limit });
        }
        Ok(content)
    }

    /// The same archive of which these buffers changed, too.
    pub(crate) fn changed<'a>(&self, buffers: impl Iterator<Item = &'a str>) -> Self {
        let mut archive = self.clone();
        archive.changed.extend(buffers.map(str::to_owned));
        archive
    }

    /// The archive with these buffers where they changed: all other entries byte for byte, in their order.
    pub(crate) fn pack(&self, buffers: &[Buffer]) -> Cow<'_, [u8]> {
        if self.changed.is_empty() {
            return Cow::Borrowed(&self.stored);
        }
        // The first without a name is the file itself.
        let of_name = |name: &str| buffers.iter().find(|buffer| buffer.name == name);
        let changed = |name: &str| {
            let buffer = of_name(self.changed.get(name)?)?;
            Some(buffer.bytes.as_slice())
        };
        let packed = self.packed(&changed);
        Cow::Owned(packed.expect("an archive that was read can be copied into memory"))
    }

    /// A copy with other contents where `changed` has some for a buffer's name.
    fn packed<'a>(&self, changed: &dyn Fn(&str) -> Option<&'a [u8]>) -> Result<Vec<u8>, ZipError> {
        let mut old = ZipArchive::new(Cursor::new(self.stored.as_slice()))?;
        let mut new = ZipWriter::new(Cursor::new(Vec::with_capacity(self.stored.len())));
        new.set_raw_comment(old.comment().into())?;
        for entry in 0..old.len() {
            let file = old.by_index_raw(entry)?;
            let name = file.name()?.into_owned();
            let buffer = match name == self.entry {
                true => Some(""),
                // What is left of the folder's own entry is no name of a buffer.
                false => name.strip_prefix(self.folder()).filter(|name| !name.is_empty()),
            };
            match buffer.and_then(changed) {
                Some(content) => {
                    new.start_file(name, file.options().large_file(content.len() > u32::MAX as usize))?;
                    new.write_all(content)?;
                }
                None => new.raw_copy_file(file)?,
            }
        }
        Ok(new.finish()?.into_inner())
    }
}

/// The entry that is the mesh: the model of a 3MF, or the one file whose name is that of a mesh.
fn mesh_entry(archive: &ZipArchive<Cursor<&[u8]>>) -> Result<(String, Format), AssetProblem> {
    if archive.index_for_name(MODEL).is_some() {
        return Ok((MODEL.into(), Format::ThreeMf));
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
        [(name, format)] => Ok((name.clone(), *format)),
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
