//! The Python peers, and the cells that they have finished.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use serde_json::Value;

use evaluation::{process::root, python::Python};

/// One thread, whatever library a peer computes with.
pub(crate) const ONE_THREAD: [(&str, &str); 4] = [
    ("OMP_NUM_THREADS", "1"),
    ("OPENBLAS_NUM_THREADS", "1"),
    ("MKL_NUM_THREADS", "1"),
    ("PYTHONHASHSEED", "0"),
];

/// The environment of `bench-harness/peers`, for one thread.
pub(crate) fn prepare() -> Result<Python> {
    let harness = root().join("bench-harness");
    Ok(Python::prepare_in(harness.join("peers"), harness.join(".venv"))?.with_variables(&ONE_THREAD))
}

/// A folder for a comparison's files: inputs that peers read, what they write, cells that are finished.
pub(crate) fn folder(comparison: &str) -> Result<PathBuf> {
    let folder = root().join(".cache/bench").join(comparison);
    fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    Ok(folder)
}

/// The cell in `folder` of this name: as it was finished before, or measured now.
pub(crate) fn cell(folder: &Path, name: &str, measure: impl FnOnce() -> Result<Value>) -> Result<Value> {
    cell_that(folder, name, |_| true, measure)
}

/// As [`cell`], but one that was finished before must be `good`.
pub(crate) fn cell_that(
    folder: &Path,
    name: &str,
    good: impl FnOnce(&Value) -> bool,
    measure: impl FnOnce() -> Result<Value>,
) -> Result<Value> {
    let path = folder.join(format!("{name}.json"));
    if let Ok(text) = fs::read_to_string(&path) {
        let finished = serde_json::from_str(&text).with_context(|| path.display().to_string())?;
        if good(&finished) {
            return Ok(finished);
        }
    }
    let value = measure()?;
    fs::write(&path, value.to_string()).with_context(|| path.display().to_string())?;
    Ok(value)
}
