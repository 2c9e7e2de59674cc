//! The file around the JSON: the text alone, or GLB's chunks.

use std::ops::Range;

use crate::error::{CUT_SHORT, Fault};
use crate::scalar::{Endian, Scalar};

const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BIN: u32 = u32::from_le_bytes(*b"BIN\0");
/// Where a manifest of the Coalition for Content Provenance and Authenticity lies.
const C2PA: u32 = u32::from_le_bytes(*b"C2PA");

/// Where the parts of a file lie, in bytes.
#[derive(Debug)]
pub(super) struct Container {
    /// The JSON, in GLB with its padding.
    pub(super) json: Range<usize>,
    /// The bytes of GLB's own buffer.
    pub(super) bin: Option<Range<usize>>,
    /// Whole chunks, with their headers, that say whose the file is by a digest of all of it.
    pub(super) manifests: Vec<Range<usize>>,
    is_glb: bool,
}

/// Whether a file begins as GLB does.
pub(crate) fn is_glb(bytes: &[u8]) -> bool {
    bytes.starts_with(b"glTF")
}

impl Container {
    pub(super) fn of(bytes: &[u8]) -> Result<Self, Fault> {
        if is_glb(bytes) {
            return Self::of_glb(bytes);
        }
        let mark = bytes.len() - crate::format::without_bom(bytes).len();
        Ok(Self {
            json: mark..bytes.len(),
            bin: None,
            manifests: Vec::new(),
            is_glb: false,
        })
    }

    fn of_glb(bytes: &[u8]) -> Result<Self, Fault> {
        let cut = |at| Fault::at_byte(at, "GLB chunk", format!("goes beyond the end{CUT_SHORT}"));
        let version = number(bytes, 4).ok_or_else(|| cut(4))?;
        if version != 2 {
            let problem = format!("glTF {version} is not read, glTF 2.0 is: export the model anew");
            return Err(Fault::at_byte(4, "GLB version", problem));
        }
        let length = number(bytes, 8).ok_or_else(|| cut(8))? as usize;
        if length > bytes.len() {
            return Err(cut(8));
        }
        let (mut json, mut bin, mut manifests) = (None, None, Vec::new());
        let mut at = HEADER;
        while at + CHUNK_HEADER <= length {
            let size = number(bytes, at).ok_or_else(|| cut(at))? as usize;
            let content = at + CHUNK_HEADER..at.saturating_add(CHUNK_HEADER).saturating_add(size);
            if content.end > length {
                return Err(cut(at));
            }
            match number(bytes, at + 4) {
                // The first chunk, as glTF demands: a manifest before it would be carried on.
                Some(JSON) if at == HEADER => json = Some(content.clone()),
                Some(BIN) if bin.is_none() => bin = Some(content.clone()),
                Some(C2PA) => manifests.push(at..content.end),
                _ => {}
            }
            at = content.end;
        }
        let Some(json) = json else {
            let problem = format!("this GLB has no JSON chunk{CUT_SHORT}");
            return Err(Fault::in_file(problem));
        };
        Ok(Self {
            json,
            bin,
            manifests,
            is_glb: true,
        })
    }

    /// The file with another JSON and without manifests; all else stays as it is.
    pub(super) fn rebuilt(&self, bytes: &[u8], json: &[u8]) -> Vec<u8> {
        let mut out = bytes[..self.json.start].to_vec();
        out.extend_from_slice(json);
        if self.is_glb {
            // The old length, where the padding has room for the change.
            let text = json.len() - json.iter().rev().take_while(|&&b| b == b' ').count();
            let padded = text.next_multiple_of(4).max(self.json.len());
            out.resize(self.json.start + padded, b' ');
            out.truncate(self.json.start + padded);
            let start = self.json.start - CHUNK_HEADER;
            out[start..start + 4].copy_from_slice(&(padded as u32).to_le_bytes());
        }
        let mut from = self.json.end;
        // The JSON is the first chunk: manifests follow it.
        for manifest in &self.manifests {
            if manifest.start < from {
                continue;
            }
            out.extend_from_slice(&bytes[from..manifest.start]);
            from = manifest.end;
        }
        out.extend_from_slice(&bytes[from..]);
        if self.is_glb {
            let declared = number(bytes, 8).unwrap_or_default() as usize;
            let length = declared + out.len() - bytes.len();
            out[8..12].copy_from_slice(&(length as u32).to_le_bytes());
        }
        out
    }
}

fn number(bytes: &[u8], at: usize) -> Option<u32> {
    Scalar::U32
        .read(bytes, at, Endian::Little)
        .map(|number| number as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(kind: u32, content: &[u8]) -> Vec<u8> {
        let mut chunk = (content.len() as u32).to_le_bytes().to_vec();
        chunk.extend(kind.to_le_bytes());
        chunk.extend(content);
        chunk
    }

    fn glb(chunks: &[Vec<u8>]) -> Vec<u8> {
        let body = chunks.concat();
        let mut out = b"glTF".to_vec();
        out.extend(2_u32.to_le_bytes());
        out.extend((12 + body.len() as u32).to_le_bytes());
        out.extend(body);
        out
    }

    #[test]
    fn a_longer_text_moves_the_rest_and_nothing_else_changes() {
        let unknown = chunk(0x1234_5678, &[1, 2, 3, 4]);
        let parts = |json: &[u8]| [chunk(JSON, json), chunk(BIN, &[9; 8]), unknown.clone()];
        let file = glb(&parts(b"{\"a\":1} "));
        let container = Container::of(&file).unwrap();
        assert_eq!(&file[container.bin.clone().unwrap()], [9; 8]);
        assert_eq!(container.rebuilt(&file, b"{\"a\":1} "), file);
        assert_eq!(
            container.rebuilt(&file, b"{\"a\":12} "),
            glb(&parts(b"{\"a\":12}"))
        );
        assert_eq!(
            container.rebuilt(&file, b"{\"a\":123} "),
            glb(&parts(b"{\"a\":123}   "))
        );
    }

    #[test]
    fn a_manifest_goes_and_what_follows_the_file_stays() {
        let with = glb(&[
            chunk(JSON, b"{}  "),
            chunk(BIN, &[7; 4]),
            chunk(C2PA, b"who made it."),
        ]);
        let without = glb(&[chunk(JSON, b"{}  "), chunk(BIN, &[7; 4])]);
        let container = Container::of(&with).unwrap();
        assert_eq!(container.manifests.len(), 1);
        assert_eq!(container.rebuilt(&with, b"{}  "), without);
        let (with, without) = ([with, vec![5; 3]].concat(), [without, vec![5; 3]].concat());
        assert_eq!(container.rebuilt(&with, b"{}  "), without);
    }

    #[test]
    fn what_is_cut_short_or_of_another_version_is_refused() {
        let file = glb(&[chunk(JSON, b"{}  "), chunk(BIN, &[7; 4])]);
        for length in 4..file.len() {
            assert!(Container::of(&file[..length]).is_err(), "{length} bytes");
        }
        let mut old = file.clone();
        old[4] = 1;
        assert!(Container::of(&old).unwrap_err().problem.contains("glTF 1"));
        assert!(Container::of(&glb(&[chunk(BIN, &[0; 4])])).is_err());
    }
}
