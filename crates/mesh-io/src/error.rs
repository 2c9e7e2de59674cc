use std::fmt;
use std::io;
use std::path::PathBuf;

use crate::Format;
use mesh::MeshError;

/// Why a mesh file was not read, or not written.
///
/// The message names the file, the place in it, the cause and the remedy.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", Spot(path, place.as_ref()))]
pub struct AssetError {
    /// The file; empty for bytes in memory.
    pub path: PathBuf,
    /// Where its content breaks the rules of its format.
    pub place: Option<Place>,
    /// What is wrong.
    #[source]
    pub problem: AssetProblem,
}

/// What can be wrong with a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AssetProblem {
    /// The file is missing, or may not be read.
    #[error("{}", reason_and_remedy(.0, "read"))]
    Read(#[source] io::Error),
    /// "a directory" or "not a regular file", such as a device or a pipe.
    #[error("this is {0}: name a file that holds a mesh")]
    NotAFile(&'static str),
    /// No bytes at all, usually from a program that failed while it wrote.
    #[error("the file is empty: write it again from its source")]
    Empty,
    /// Neither the name nor the content tells a format that is read here: what is unusual about them.
    #[error("{0}; {list} are read, each also gzipped (.gz)", list = Format::LIST)]
    UnknownFormat(String),
    /// The name says one format and the content another.
    #[error("the name says {named}, but the content is {found}: rename it to end in .{}", found.extension())]
    WrongExtension {
        /// The format that the name promises.
        named: Format,
        /// The format that the content shows.
        found: Format,
    },
    /// The content breaks the rules of its format: what was found, what was expected, and what to do.
    #[error("{0}")]
    Malformed(String),
    /// More bytes than are read.
    #[error(
        "has more than {largest} bytes (unpacked, if it is gzipped), and no larger file is read: simplify the model, cut it into several, \
         or save it in a format of fewer bytes, such as binary PLY"
    )]
    TooLarge {
        /// The largest size that is read, in bytes.
        largest: u64,
    },
    /// The gzip stream is damaged.
    #[error("the gzip stream is damaged or cut short ({0}): fetch the file again")]
    Gzip(#[source] io::Error),
    /// The gzip stream grows beyond what meshes do.
    #[error(
        "unpacks to more than {limit} bytes, far more than a mesh would from {compressed}: if you trust it, unpack it with gunzip first"
    )]
    GzipTooLarge {
        /// Compressed size in bytes.
        compressed: usize,
        /// The largest size that is accepted for it.
        limit: u64,
    },
    /// The zip archive is damaged, or packed in a way that is not read.
    #[error("the zip archive can't be read ({0}): fetch the file again, or unpack it first")]
    Archive(String),
    /// An entry of the archive grows beyond what meshes do.
    #[error(
        "unpacks to more than {limit} bytes, far more than a mesh would from {compressed}: if you trust it, unpack it first"
    )]
    ArchiveTooLarge {
        /// Compressed size in bytes.
        compressed: usize,
        /// The largest size that is accepted for it.
        limit: u64,
    },
    /// The mesh in the archive refers to a file by name, and no entry has it.
    #[error("there is no {0} in this zip archive, to which the model in it refers: pack it beside the model")]
    NotInArchive(String),
    /// No entry of the archive is a mesh by its name.
    #[error("there is no mesh in this zip archive; {list} are read in one", list = Format::LIST)]
    NoMeshInArchive,
    /// Which one is meant can't be told.
    #[error("there are several meshes in this zip archive ({}): unpack it, and name one", .0.join(", "))]
    SeveralMeshesInArchive(Vec<String>),
    /// Positions and faces were read but do not make a mesh.
    #[error("{0}")]
    Geometry(#[source] MeshError),
    /// A new coordinate that the file's number type cannot hold.
    #[error("vertex {vertex} cannot be moved to {value}: {problem}")]
    Unwritable {
        /// Vertex of the welded mesh, from 0.
        vertex: usize,
        /// The new coordinate.
        value: f64,
        /// Why the file cannot hold it, and what to do.
        problem: &'static str,
    },
    /// The output file is there already.
    #[error("exists already: choose another name, or allow overwriting")]
    Exists,
    /// An asset keeps its format and compression, and the output's name says otherwise.
    #[error("the output stays {format}{packed}: give it a name that ends in .{ending}")]
    SaveName {
        /// The asset's format.
        format: Format,
        /// How it is packed, as a message says it after the format; empty if it is not.
        packed: &'static str,
        /// How its name has to end.
        ending: String,
    },
    /// The output cannot be written.
    #[error("{}", reason_and_remedy(.0, "written"))]
    Write(#[source] io::Error),
}

impl AssetProblem {
    /// The error of a file as a whole.
    pub(crate) fn of(self, path: impl Into<PathBuf>) -> AssetError {
        AssetError {
            path: path.into(),
            place: None,
            problem: self,
        }
    }
}

/// A place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// Line of a text file, from 1.
    Line(usize),
    /// A byte of a binary file, and what lies there, such as `vertex 12, property y`.
    Byte {
        /// Offset from 0.
        offset: usize,
        /// The element and property.
        what: String,
    },
    /// The file as a whole.
    File,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte { offset, what } => write!(f, "byte {offset} ({what})"),
            Self::File => write!(f, "whole file"),
        }
    }
}

/// A file in a message, or what stands for it when the bytes came from memory; and a place in it.
struct Spot<'a>(&'a PathBuf, Option<&'a Place>);

impl fmt::Display for Spot<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let &Self(path, place) = self;
        match path.as_os_str().is_empty() {
            true => write!(f, "bytes in memory")?,
            false => write!(f, "{}", path.display())?,
        }
        place.map_or(Ok(()), |place| write!(f, ", {place}"))
    }
}

fn reason_and_remedy(error: &io::Error, done: &str) -> String {
    let remedy = match error.kind() {
        io::ErrorKind::NotFound if done == "read" => "check the spelling and the folder",
        io::ErrorKind::NotFound => "the folder does not exist: make it first",
        io::ErrorKind::PermissionDenied => "allow it with chmod, or choose another place",
        io::ErrorKind::StorageFull => "make room on the disk",
        _ => "check the disk and the path",
    };
    format!("cannot be {done} ({error}): {remedy}")
}

/// What to think of a file that lacks something.
pub(crate) const CUT_SHORT: &str = ": the file is damaged or cut short, fetch or export it again";

/// What a reader of one format reports; [`Asset`](crate::Asset) adds the path.
#[derive(Debug)]
pub(crate) struct Fault {
    pub(crate) place: Place,
    pub(crate) problem: String,
}

impl Fault {
    /// The error of a file in which this was found.
    pub(crate) fn of(self, path: impl Into<PathBuf>) -> AssetError {
        AssetError {
            place: Some(self.place),
            ..AssetProblem::Malformed(self.problem).of(path)
        }
    }

    pub(crate) fn in_file(problem: impl Into<String>) -> Self {
        Self {
            place: Place::File,
            problem: problem.into(),
        }
    }

    /// A fault in a text of which the parser counts lines itself.
    pub(crate) fn at_json_line(line: usize, problem: impl Into<String>) -> Self {
        Self {
            place: Place::Line(line),
            problem: problem.into(),
        }
    }

    /// A fault in a text file: the line of byte `at`, counted only now.
    pub(crate) fn at_line(bytes: &[u8], at: usize, problem: impl Into<String>) -> Self {
        Self {
            place: Place::Line(line_number(bytes, at)),
            problem: problem.into(),
        }
    }

    pub(crate) fn at_byte(offset: usize, what: impl Into<String>, problem: impl Into<String>) -> Self {
        Self {
            place: Place::Byte {
                offset,
                what: what.into(),
            },
            problem: problem.into(),
        }
    }
}

/// Line of byte `at`, from 1; lines end with LF, CR LF or CR.
fn line_number(bytes: &[u8], at: usize) -> usize {
    let before = &bytes[..at.min(bytes.len())];
    let ends = |(i, &b): (usize, &u8)| b == b'\n' || (b == b'\r' && bytes.get(i + 1) != Some(&b'\n'));
    1 + before.iter().enumerate().filter(|&x| ends(x)).count()
}
