//! Where pages and tables go.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use evaluation::process::root;

/// The folder `results`, which is made if it is not there.
pub(crate) fn folder() -> Result<PathBuf> {
    let results = root().join("results");
    fs::create_dir_all(&results).with_context(|| results.display().to_string())?;
    Ok(results)
}

/// Writes a file; an error names it.
pub(crate) fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<()> {
    fs::write(path, bytes).with_context(|| path.display().to_string())
}

/// Writes a page, and tells where it is.
pub(crate) fn write_page(path: &Path, text: &str) -> Result<()> {
    write(path, text)?;
    println!("\nwritten: {}", path.display());
    Ok(())
}
