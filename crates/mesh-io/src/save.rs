use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::{AssetError, AssetProblem};

/// Writes `bytes` beside `path`, then renames: whoever looks sees the old file or the new one, whole.
///
/// A symbolic link is followed; a file that is replaced passes its permissions on.
///
/// # Errors
/// When the path is a directory, a file stands there and `overwrite` is false, or writing fails.
pub fn write_file(path: impl AsRef<Path>, bytes: &[u8], overwrite: bool) -> Result<(), AssetError> {
    replace(path.as_ref(), bytes, overwrite, 0o666)
}

/// As [`write_file`], but what is written can be read by its owner alone, whatever stood there before.
///
/// # Errors
/// As [`write_file`].
pub fn write_private_file(path: impl AsRef<Path>, bytes: &[u8], overwrite: bool) -> Result<(), AssetError> {
    replace(path.as_ref(), bytes, overwrite, 0o600)
}

fn replace(path: &Path, bytes: &[u8], overwrite: bool, mode: u32) -> Result<(), AssetError> {
    let failed = |source| AssetProblem::Write(source).of(path);
    let exists = || AssetProblem::Exists.of(path);
    let old = fs::metadata(path).ok();
    if old.as_ref().is_some_and(fs::Metadata::is_dir) {
        return Err(AssetProblem::NotAFile("a directory").of(path));
    }
    if !overwrite && fs::symlink_metadata(path).is_ok() {
        return Err(exists());
    }
    let target = if old.is_some() {
        fs::canonicalize(path).map_err(failed)?
    } else {
        path.to_path_buf()
    };
    // Until it has the permissions of a file that it replaces, which may be private, only its owner reads it.
    let at_first = if old.is_some() { 0o600 } else { mode };
    let mut file = temporary_in(&folder_of(&target), at_first).map_err(failed)?;
    file.write_all(bytes)
        .and_then(|()| file.as_file().sync_all())
        .map_err(failed)?;
    if let Some(old) = old.filter(|_| mode == 0o666) {
        file.as_file()
            .set_permissions(old.permissions())
            .map_err(failed)?;
    }
    let renamed = if overwrite {
        file.persist(&target)
    } else {
        file.persist_noclobber(&target)
    };
    renamed.map(drop).map_err(|e| match e.error.kind() {
        io::ErrorKind::AlreadyExists => exists(),
        _ => failed(e.error),
    })
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.into(),
        _ => PathBuf::from("."),
    }
}

/// A temporary file with the permissions `mode`, less what the umask takes away; it goes away unless it is renamed.
#[cfg_attr(not(unix), expect(unused_variables))]
fn temporary_in(folder: &Path, mode: u32) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".sigmark-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(mode));
    }
    builder.tempfile_in(folder)
}
