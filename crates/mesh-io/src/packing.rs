//! What a mesh's bytes are packed in.

use std::borrow::Cow;
use std::cell::Cell;
use std::path::{Path, PathBuf};

use crate::archive::{Archive, is_zip};
use crate::buffer::Buffer;
use crate::error::Fault;
use crate::gzip::{self, Gzip};
use crate::{AssetError, AssetProblem, Format, format, source};

/// How a file is packed.
#[derive(Clone, Debug)]
pub(crate) enum Packing {
    Plain,
    Gzip(Gzip),
    Zip(Archive),
}

impl Packing {
    /// How stored bytes are packed, and what is in them.
    pub(crate) fn open(stored: Vec<u8>) -> Result<(Self, Vec<u8>), AssetProblem> {
        if is_zip(&stored) {
            let (archive, content) = Archive::open(stored)?;
            return Ok((Self::Zip(archive), content));
        }
        let (content, gzip) = gzip::unpack(stored, source::LARGEST)?;
        Ok((gzip.map_or(Self::Plain, Self::Gzip), content))
    }

    /// The same for another content: of these buffers.
    pub(crate) fn changed<'a>(&self, buffers: impl Iterator<Item = &'a Buffer>) -> Self {
        match self {
            Self::Zip(archive) => Self::Zip(archive.changed(buffers.map(|buffer| buffer.name.as_str()))),
            Self::Gzip(gzip) if buffers.into_iter().any(Buffer::is_file) => Self::Gzip(gzip.changed()),
            Self::Plain | Self::Gzip(_) => self.clone(),
        }
    }

    pub(crate) fn pack<'a>(&'a self, buffers: &'a [Buffer]) -> Cow<'a, [u8]> {
        let content = &buffers[0].bytes;
        match self {
            Self::Plain => Cow::Borrowed(content),
            Self::Gzip(gzip) => gzip.pack(content),
            Self::Zip(archive) => archive.pack(buffers),
        }
    }

    /// Where the files lie that the content, of so many bytes, refers to by name.
    pub(crate) fn beside(&self, path: &Path, content: usize) -> Beside<'_> {
        match (self, path.parent()) {
            (Self::Zip(archive), _) => {
                let left = archive.limit().saturating_sub(content as u64);
                Beside::Archive(archive, Cell::new(left))
            }
            (_, Some(folder)) => Beside::Folder(folder.into()),
            (_, None) => Beside::Nowhere,
        }
    }

    /// Whether a file may have this name.
    pub(crate) fn fits(&self, format: Format, path: &Path) -> bool {
        let ends = |extension: &str| {
            path.extension()
                .is_some_and(|own| own.eq_ignore_ascii_case(extension))
        };
        match self {
            Self::Zip(_) if format == Format::ThreeMf => ends("3mf"),
            Self::Zip(_) => ends("zip"),
            Self::Plain | Self::Gzip(_) => {
                Format::of_path(path) == Some(format)
                    && format::ends_in_gz(path) == matches!(self, Self::Gzip(_))
            }
        }
    }

    /// How a message says it after the format, and how names end.
    pub(crate) fn name_of(&self, format: Format) -> (&'static str, String) {
        let extension = format.extension();
        match self {
            Self::Plain => ("", extension.into()),
            Self::Gzip(_) => (", gzipped", format!("{extension}.gz")),
            Self::Zip(_) if format == Format::ThreeMf => ("", extension.into()),
            Self::Zip(_) => (" in a zip archive", "zip".into()),
        }
    }
}

/// Where the files lie that a file refers to by name.
pub(crate) enum Beside<'a> {
    /// The file was never one, but bytes in memory.
    Nowhere,
    Folder(PathBuf),
    /// In the same archive; and how many more bytes may be unpacked from it.
    Archive(&'a Archive, Cell<u64>),
}

impl Beside<'_> {
    /// What the file itself is called in its archive; empty outside of one.
    pub(crate) fn own_name(&self) -> &str {
        match self {
            Self::Archive(archive, _) => archive.entry(),
            Self::Nowhere | Self::Folder(_) => "",
        }
    }

    /// The bytes of a file that the one at `path` names.
    pub(crate) fn read(&self, path: &Path, name: &str) -> Result<Vec<u8>, AssetError> {
        match self {
            Self::Nowhere => {
                let problem = format!(
                    "refers to the file {name}, which bytes in memory have none of: open it by its path"
                );
                Err(Fault::in_file(problem).of(path))
            }
            Self::Folder(folder) => {
                let beside = folder.join(name);
                source::read(&beside, source::LARGEST).map_err(|problem| problem.of(&beside))
            }
            Self::Archive(archive, left) => {
                let bytes = archive
                    .member(name, left.get())
                    .map_err(|problem| problem.of(path))?;
                left.set(left.get() - bytes.len() as u64);
                Ok(bytes)
            }
        }
    }
}
