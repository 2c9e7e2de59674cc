//! A library of originals: what is put in, what is there, and whose a suspect is.

mod add;
mod list;
mod look_up;
mod search;
mod verify;
mod words;

use anyhow::Result;
use library::{FileRecord, LibraryError};

use crate::{
    Answer,
    args::{Library as Arguments, LibraryStep},
};

pub(crate) fn run(arguments: &Arguments) -> Result<Answer> {
    match &arguments.step {
        LibraryStep::Add(arguments) => add::run(arguments),
        LibraryStep::List(arguments) => list::run(arguments),
        LibraryStep::Search(arguments) => search::run(arguments),
        LibraryStep::Verify(arguments) => verify::run(arguments),
    }
}

/// What is noted of a file, by which a later run knows that it has not changed.
fn record_of(path: &std::path::Path) -> Result<FileRecord> {
    use anyhow::Context;
    let shown = || {
        format!(
            "{}: can't be looked at; check the spelling and the folder",
            path.display()
        )
    };
    let metadata = std::fs::metadata(path).with_context(shown)?;
    let full = std::fs::canonicalize(path).with_context(shown)?;
    let since = metadata
        .modified()
        .ok()
        .and_then(|time| time.duration_since(std::time::UNIX_EPOCH).ok());
    Ok(FileRecord {
        path: full.to_string_lossy().into_owned(),
        size: metadata.len(),
        modified: since.map_or(0, |since| i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)),
    })
}

/// Whether a failure is one of the library, after which nothing else can be added either.
fn is_of_library(error: &anyhow::Error) -> bool {
    let of_mesh = |error: &LibraryError| matches!(error, LibraryError::NoArea);
    error
        .downcast_ref::<LibraryError>()
        .is_some_and(|error| !of_mesh(error))
}
