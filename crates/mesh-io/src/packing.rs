//! What a mesh's bytes are packed in.

use std::borrow::Cow;
use std::path::Path;

use crate::archive::{Archive, is_zip};
use crate::gzip::{self, Gzip};
use crate::{AssetProblem, Format, format, source};

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

    /// The same for another content.
    pub(crate) fn changed(&self) -> Self {
        match self {
            Self::Plain => Self::Plain,
            Self::Gzip(gzip) => Self::Gzip(gzip.changed()),
            Self::Zip(archive) => Self::Zip(archive.changed()),
        }
    }

    pub(crate) fn pack<'a>(&'a self, content: &'a [u8]) -> Cow<'a, [u8]> {
        match self {
            Self::Plain => Cow::Borrowed(content),
            Self::Gzip(gzip) => gzip.pack(content),
            Self::Zip(archive) => Cow::Owned(archive.pack(content)),
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
