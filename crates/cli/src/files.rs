//! Files that are no meshes: keys, certificates, arrays.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};

/// A text file larger than this is no key and no certificate; it is not read into memory.
const LARGEST_TEXT: u64 = 64 << 20;

/// Reads a text file such as a key or a certificate; `what` says what it should be.
pub(crate) fn read_text(path: &Path, what: &str) -> Result<String> {
    let describe = || format!("{}: can't be read as {what}", path.display());
    let metadata = fs::metadata(path).with_context(describe)?;
    if metadata.is_dir() {
        bail!("{}: is a directory, but {what} is a file", path.display());
    }
    if metadata.len() > LARGEST_TEXT {
        bail!(
            "{}: has {} MiB, far more than {what} ever has",
            path.display(),
            metadata.len() >> 20
        );
    }
    let bytes = fs::read(path).with_context(describe)?;
    String::from_utf8(bytes).map_err(|error| {
        let place = error.utf8_error().valid_up_to();
        anyhow::anyhow!(
            "{}: is not text (byte {place}), so it is not {what}",
            path.display()
        )
    })
}

/// Refuses early to write where a file stands, before the work is done.
pub(crate) fn check_free(path: &Path, force: bool) -> Result<()> {
    if path.is_dir() {
        bail!("{}: is a directory; name a file in it", path.display());
    }
    if !force && fs::symlink_metadata(path).is_ok() {
        bail!(
            "{}: exists already; use --force to replace it, or another name",
            path.display()
        );
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder
        && !folder.is_dir()
    {
        bail!(
            "{}: there is no folder {}; make it first",
            path.display(),
            folder.display()
        );
    }
    Ok(())
}

/// `path` with `suffix` behind its whole name.
pub(crate) fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_os_string();
    name.push(suffix);
    name.into()
}
