//! Where pages and tables go.

use std::{
    fs,
    path::{Path, PathBuf},
    process,
};

use anyhow::{Context, Result};
use evaluation::process::root;

/// The folder `results`, which is made if it is not there.
pub(crate) fn folder() -> Result<PathBuf> {
    let results = root().join("results");
    fs::create_dir_all(&results).with_context(|| results.display().to_string())?;
    Ok(results)
}

/// Writes a file, under a name of this process alone until it is whole; an error names it.
pub(crate) fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<()> {
    let mut partial = path.as_os_str().to_owned();
    partial.push(format!(".{}.partial", process::id()));
    let written = fs::write(&partial, bytes).and_then(|()| fs::rename(&partial, path));
    if written.is_err() {
        let _ = fs::remove_file(&partial);
    }
    written.with_context(|| path.display().to_string())
}

/// Writes a page, and tells where it is.
pub(crate) fn write_page(path: &Path, text: &str) -> Result<()> {
    write(path, text)?;
    println!("\nwritten: {}", path.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_nothing_is_left_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("figures.json");
        for text in ["a long text", "short"] {
            write(&path, text).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
        let refused = write(folder.path(), "a folder").unwrap_err();
        assert!(refused.to_string().contains(&folder.path().display().to_string()));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
