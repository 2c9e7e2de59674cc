use std::path::PathBuf;

use job::JobError;

/// Why a library can't be read, written or asked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LibraryError {
    /// There is no such file.
    #[error("{}: there is no library; make one with `sigmark library add DIR --library {}`", path.display(), path.display())]
    Missing {
        /// Where it was looked for.
        path: PathBuf,
    },
    /// The file is a database of another program, or none.
    #[error("{}: is no library of Sigmark ({problem}): give the file that `sigmark library add` wrote", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What is there instead.
        problem: String,
    },
    /// A later version of the program wrote it.
    #[error("{}: is a library of version {found}, and this program reads {expected}: use a newer sigmark", path.display())]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: i64,
        /// [`SCHEMA_VERSION`](crate::SCHEMA_VERSION).
        expected: i64,
    },
    /// An earlier version of the program wrote it, with other descriptors.
    #[error("{}: is a library of version {found}, and this program reads {expected}: make it anew with `sigmark library add`", path.display())]
    Older {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: i64,
        /// [`SCHEMA_VERSION`](crate::SCHEMA_VERSION).
        expected: i64,
    },
    /// What stands there can't have been written so.
    #[error("{}: is damaged ({problem}): take a copy of it that is whole, or make it anew with `sigmark library add`", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        problem: String,
    },
    /// Another program writes to it, and goes on doing so.
    #[error("{}: another program is writing to this library; wait for it, and try again", path.display())]
    Busy {
        /// The file.
        path: PathBuf,
    },
    /// The database can't be read or written.
    #[error("{}: can't be read or written: {source}; check the disk and the permissions of the file and its folder", path.display())]
    Database {
        /// The file.
        path: PathBuf,
        /// SQLite's reason.
        source: rusqlite::Error,
    },
    /// A surface without area has no shape.
    #[error("the surface has no area, or one that is not finite: there is nothing to describe")]
    NoArea,
    /// There is no original of this number.
    #[error("there is no original {number} in the library")]
    NoOriginal {
        /// Its number.
        number: i64,
    },
    /// Geometry that was packed does not unpack.
    #[error("the packed geometry is damaged: {problem}")]
    Geometry {
        /// What is wrong.
        problem: String,
    },
    /// Stopped, or no threads.
    #[error(transparent)]
    Job(#[from] JobError),
}
