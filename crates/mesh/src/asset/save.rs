use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::AssetError;

/// Writes `bytes` beside `path`, then renames: whoever looks sees the old file or the new one, whole.
pub(super) fn replace(path: &Path, bytes: &[u8], overwrite: bool) -> Result<(), AssetError> {
    let failed = |source| AssetError::Write {
        path: path.into(),
        source,
    };
    let exists = || AssetError::Exists { path: path.into() };
    let old = fs::metadata(path).ok();
    if old.as_ref().is_some_and(fs::Metadata::is_dir) {
        return Err(AssetError::NotAFile {
            path: path.into(),
            what: "a directory",
        });
    }
    if !overwrite && fs::symlink_metadata(path).is_ok() {
        return Err(exists());
    }
    let target = if old.is_some() {
        fs::canonicalize(path).map_err(failed)?
    } else {
        path.to_path_buf()
    };
    let mut file = temporary_in(&folder_of(&target)).map_err(failed)?;
    file.write_all(bytes)
        .and_then(|()| file.as_file().sync_all())
        .map_err(failed)?;
    if let Some(old) = old {
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

/// A temporary file with the permissions of an ordinary new file; it goes away unless it is renamed.
fn temporary_in(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".sigmark-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666)); // less what the umask takes away
    }
    builder.tempfile_in(folder)
}
