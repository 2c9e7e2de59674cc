//! Archives whose bytes depend on what is in them alone: no times, no owners.

use std::io::{Cursor, Write};

use anyhow::{Context, Result};
use flate2::{Compression, GzBuilder};
use zip::{CompressionMethod, DateTime, ZipWriter, write::SimpleFileOptions};

/// A file of an archive.
pub(super) struct Entry {
    /// In the archive's folder, with `/`.
    pub(super) path: String,
    bytes: Vec<u8>,
    mode: u32,
}

impl Entry {
    pub(super) fn file(path: impl Into<String>, bytes: Vec<u8>) -> Self {
        let (path, mode) = (path.into(), 0o644);
        Self { path, bytes, mode }
    }

    pub(super) fn program(path: impl Into<String>, bytes: Vec<u8>) -> Self {
        let mode = 0o755;
        Self {
            mode,
            ..Self::file(path, bytes)
        }
    }
}

/// All entries in one folder.
pub(super) fn tar_gz(folder: &str, entries: &[Entry]) -> Result<Vec<u8>> {
    // Without a time and a name, and as if by one system, whichever it is.
    let packed = GzBuilder::new()
        .operating_system(255)
        .write(Vec::new(), Compression::best());
    let mut archive = tar::Builder::new(packed);
    for entry in entries {
        let mut header = tar::Header::new_ustar();
        header.set_size(entry.bytes.len() as u64);
        header.set_mode(entry.mode);
        header.set_mtime(0);
        let path = format!("{folder}/{}", entry.path);
        archive
            .append_data(&mut header, &path, entry.bytes.as_slice())
            .context(path)?;
    }
    Ok(archive.into_inner()?.finish()?)
}

/// All entries in one folder.
pub(super) fn zip(folder: &str, entries: &[Entry]) -> Result<Vec<u8>> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for entry in entries {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .last_modified_time(DateTime::default())
            .unix_permissions(entry.mode);
        archive.start_file(format!("{folder}/{}", entry.path), options)?;
        archive.write_all(&entry.bytes)?;
    }
    Ok(archive.finish()?.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    fn entries() -> [Entry; 2] {
        [
            Entry::file("docs/a.md", b"text".to_vec()),
            Entry::program("sigmark", vec![7; 100]),
        ]
    }

    #[test]
    fn a_tar_holds_every_file_with_its_mode_and_is_the_same_each_time() {
        let packed = tar_gz("sigmark-1", &entries()).unwrap();
        assert_eq!(packed, tar_gz("sigmark-1", &entries()).unwrap());
        let mut archive = tar::Archive::new(flate2::read::GzDecoder::new(packed.as_slice()));
        let mut found = Vec::new();
        for entry in archive.entries().unwrap() {
            let mut entry = entry.unwrap();
            let mut bytes = Vec::new();
            entry.read_to_end(&mut bytes).unwrap();
            let path = entry.path().unwrap().display().to_string();
            found.push((path, entry.header().mode().unwrap(), bytes));
        }
        assert_eq!(found[0], ("sigmark-1/docs/a.md".into(), 0o644, b"text".to_vec()));
        assert_eq!(found[1], ("sigmark-1/sigmark".into(), 0o755, vec![7; 100]));
    }

    #[test]
    fn a_zip_holds_every_file_and_is_the_same_each_time() {
        let packed = zip("sigmark-1", &entries()).unwrap();
        assert_eq!(packed, zip("sigmark-1", &entries()).unwrap());
        let mut archive = ::zip::ZipArchive::new(Cursor::new(packed)).unwrap();
        let mut text = String::new();
        let mut file = archive.by_name("sigmark-1/docs/a.md").unwrap();
        file.read_to_string(&mut text).unwrap();
        assert_eq!(text, "text");
    }
}
