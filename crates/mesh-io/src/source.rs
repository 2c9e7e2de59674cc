//! Bytes of files, and no more of them than there is room for.

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

use crate::AssetProblem;

/// The largest file that is read, in bytes, and the most that a gzipped one may unpack to: 1 GiB.
///
/// A mesh takes some six times the bytes of its file while it is read, sixteen at worst, and computations on it more. A GiB is ten million
/// vertices and more, some ten times what one waits for.
pub const LARGEST: u64 = 1 << 30;

/// All bytes of a regular file of at most `largest`.
pub(crate) fn read(path: &Path, largest: u64) -> Result<Vec<u8>, AssetProblem> {
    let metadata = fs::metadata(path).map_err(AssetProblem::Read)?;
    if metadata.is_dir() {
        return Err(AssetProblem::NotAFile("a directory"));
    }
    if !metadata.is_file() {
        return Err(AssetProblem::NotAFile("not a regular file"));
    }
    check_size(metadata.len(), largest)?;
    let file = File::open(path).map_err(AssetProblem::Read)?;
    let mut bytes = Vec::with_capacity(metadata.len() as usize);
    // Somebody may write to it meanwhile.
    let read = file.take(largest + 1).read_to_end(&mut bytes);
    read.map_err(AssetProblem::Read)?;
    check_size(bytes.len() as u64, largest)?;
    Ok(bytes)
}

pub(crate) fn check_size(size: u64, largest: u64) -> Result<(), AssetProblem> {
    match size <= largest {
        true => Ok(()),
        false => Err(AssetProblem::TooLarge { largest }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_the_largest_size_is_read_and_one_byte_more_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.obj");
        fs::write(&path, b"v 0 0 0\n").unwrap();
        assert_eq!(read(&path, 8).unwrap(), b"v 0 0 0\n");
        let refused = read(&path, 7).unwrap_err();
        assert!(matches!(refused, AssetProblem::TooLarge { largest: 7 }));
    }
}
