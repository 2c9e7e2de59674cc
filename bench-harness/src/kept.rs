//! Figures that an earlier run finished: kept in files, so that a run that was interrupted goes on.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use evaluation::process::root;
use serde::{Serialize, de::DeserializeOwned};

use crate::results;

/// A folder for a comparison's files: inputs that peers read, what they write, figures that are finished.
pub(crate) fn folder(comparison: &str) -> Result<PathBuf> {
    let folder = root().join(".cache/bench").join(comparison);
    fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    Ok(folder)
}

/// The figures of this name in `folder`: as they were finished before, or measured now.
pub(crate) fn figures<T: Serialize + DeserializeOwned>(
    folder: &Path,
    name: &str,
    measure: impl FnOnce() -> Result<T>,
) -> Result<T> {
    figures_if(folder, name, |_| true, measure)
}

/// As [`figures`], but those that were finished before must be `good`.
pub(crate) fn figures_if<T: Serialize + DeserializeOwned>(
    folder: &Path,
    name: &str,
    good: impl FnOnce(&T) -> bool,
    measure: impl FnOnce() -> Result<T>,
) -> Result<T> {
    let path = folder.join(format!("{name}.json"));
    if let Ok(text) = fs::read_to_string(&path) {
        let finished = serde_json::from_str(&text).with_context(|| path.display().to_string())?;
        if good(&finished) {
            return Ok(finished);
        }
    }
    let measured = measure()?;
    results::write(&path, serde_json::to_string(&measured)?)?;
    Ok(measured)
}

/// Whether figures of this name are finished.
pub(crate) fn is_finished(folder: &Path, name: &str) -> bool {
    folder.join(format!("{name}.json")).is_file()
}

/// For the tests of lists of what has no part in some figures.
#[cfg(test)]
pub(crate) fn assert_is_there(paths: &[&str]) {
    for path in paths {
        assert!(evaluation::process::root().join(path).exists(), "{path}");
    }
}
