use std::borrow::Cow;
use std::io::{Read, Write};
use std::sync::Arc;

use flate2::bufread::MultiGzDecoder;
use flate2::{Compression, GzBuilder, GzHeader};

use crate::{AssetProblem, source};

const MAGIC: &[u8] = &[0x1F, 0x8B];

/// Meshes pack at most some 20 to 1; more than this, and beyond some slack for tiny ones, is an attack on our memory.
const LARGEST_RATIO: u64 = 64;
const SLACK: u64 = 1 << 20;

/// How a file was gzipped.
#[derive(Clone, Debug)]
pub(crate) struct Gzip {
    header: Option<GzHeader>,
    /// The compressed file, while its content is unchanged.
    stored: Option<Arc<Vec<u8>>>,
}

/// The content of a file that is gzipped, or just the file: no more than `largest` bytes.
pub(crate) fn unpack(stored: Vec<u8>, largest: u64) -> Result<(Vec<u8>, Option<Gzip>), AssetProblem> {
    if !stored.starts_with(MAGIC) {
        source::check_size(stored.len() as u64, largest)?;
        return Ok((stored, None));
    }
    let compressed = stored.len();
    let limit = (LARGEST_RATIO * compressed as u64 + SLACK).min(largest);
    let mut decoder = MultiGzDecoder::new(stored.as_slice());
    let header = decoder.header().cloned();
    let mut content = Vec::new();
    let read = decoder.by_ref().take(limit + 1).read_to_end(&mut content);
    read.map_err(AssetProblem::Gzip)?;
    source::check_size(content.len() as u64, largest)?;
    if content.len() as u64 > limit {
        return Err(AssetProblem::GzipTooLarge { compressed, limit });
    }
    let stored = Some(Arc::new(stored));
    Ok((content, Some(Gzip { header, stored })))
}

impl Gzip {
    /// The same header for another content.
    pub(crate) fn changed(&self) -> Self {
        Self {
            header: self.header.clone(),
            stored: None,
        }
    }

    pub(crate) fn pack(&self, content: &[u8]) -> Cow<'_, [u8]> {
        match &self.stored {
            Some(stored) => Cow::Borrowed(stored),
            None => Cow::Owned(compress(self.header.as_ref(), content)),
        }
    }
}

/// One gzip member with the name, time, comment and extra field of `header`.
fn compress(header: Option<&GzHeader>, content: &[u8]) -> Vec<u8> {
    let mut builder = GzBuilder::new();
    if let Some(header) = header {
        builder = builder
            .mtime(header.mtime())
            .operating_system(header.operating_system());
        if let Some(name) = header.filename() {
            builder = builder.filename(name);
        }
        if let Some(comment) = header.comment() {
            builder = builder.comment(comment);
        }
        if let Some(extra) = header.extra() {
            builder = builder.extra(extra);
        }
    }
    let mut encoder = builder.write(Vec::new(), Compression::default());
    encoder
        .write_all(content)
        .and_then(|()| encoder.finish())
        .expect("a vector takes every byte")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_unpacks_beyond_the_largest_size_is_refused_before_it_is_unpacked() {
        let packed = compress(None, &[b'\n'; 5000]);
        assert_eq!(unpack(packed.clone(), 5000).unwrap().0.len(), 5000);
        for largest in [0, 1, 4999] {
            let refused = unpack(packed.clone(), largest).unwrap_err();
            assert!(matches!(refused, AssetProblem::TooLarge { .. }), "{refused}");
        }
        let plain = vec![b'\n'; 5000];
        assert!(unpack(plain.clone(), 5000).is_ok() && unpack(plain, 4999).is_err());
    }
}
