//! NPZ, NumPy's archive of arrays: a ZIP, not compressed, of NPY files (NEP 1).

use std::io::{BufWriter, Cursor, Write};

use anyhow::{Context, Result};
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

const FAILED: &str = "the array archive can't be made";

/// Array by array into memory.
pub(crate) struct Npz {
    zip: ZipWriter<Cursor<Vec<u8>>>,
}

impl Npz {
    pub(crate) fn new() -> Self {
        Self {
            zip: ZipWriter::new(Cursor::new(Vec::new())),
        }
    }

    /// Adds an array of doubles of a shape; `values` has the last index running fastest.
    pub(crate) fn doubles(
        &mut self,
        name: &str,
        shape: &[usize],
        values: impl Iterator<Item = f64>,
    ) -> Result<()> {
        self.array(name, "<f8", shape, values.map(f64::to_le_bytes))
    }

    /// Adds a vector of whole numbers.
    pub(crate) fn integers(&mut self, name: &str, values: &[i64]) -> Result<()> {
        self.array(
            name,
            "<i8",
            &[values.len()],
            values.iter().map(|v| v.to_le_bytes()),
        )
    }

    fn array(
        &mut self,
        name: &str,
        kind: &str,
        shape: &[usize],
        values: impl Iterator<Item = [u8; 8]>,
    ) -> Result<()> {
        let header = header(kind, shape);
        let size = header.len() + 8 * shape.iter().product::<usize>();
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(size >= u32::MAX as usize);
        self.zip
            .start_file(format!("{name}.npy"), options)
            .context(FAILED)?;
        let mut out = BufWriter::new(&mut self.zip);
        out.write_all(&header).context(FAILED)?;
        for value in values {
            out.write_all(&value).context(FAILED)?;
        }
        out.flush().context(FAILED)
    }

    /// The bytes of the archive.
    pub(crate) fn finish(self) -> Result<Vec<u8>> {
        Ok(self.zip.finish().context(FAILED)?.into_inner())
    }
}

/// Magic, version 1.0, length, and a Python dictionary padded with spaces to a multiple of 64 bytes.
fn header(kind: &str, shape: &[usize]) -> Vec<u8> {
    let shape: String = shape.iter().map(|extent| format!("{extent}, ")).collect();
    let mut dictionary = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
    while (10 + dictionary.len() + 1) % 64 != 0 {
        dictionary.push(' ');
    }
    dictionary.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((dictionary.len() as u16).to_le_bytes());
    bytes.extend(dictionary.as_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_is_what_numpy_writes() {
        let header = header("<f8", &[3, 2]);
        assert_eq!(header.len() % 64, 0);
        assert_eq!(&header[..8], b"\x93NUMPY\x01\x00");
        let text = std::str::from_utf8(&header[10..]).unwrap();
        assert!(text.starts_with("{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2, ), }"));
        assert!(text.ends_with('\n'));
    }
}
