//! The bytes that a document refers to: GLB's own, in the text itself (Base64), and in files beside it.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::container::Container;
use super::document::{Document, missing};
use crate::buffer::Buffer;
use crate::companion::name_beside;
use crate::error::{AssetError, CUT_SHORT, Fault};
use crate::packing::Beside;
use crate::picture::is_picture;
use crate::{Companion, source};

/// The buffers of a document within those of an asset.
#[derive(Debug, Default)]
pub(super) struct Store {
    pub(super) buffers: Vec<Buffer>,
    /// For each buffer of the document, which of the asset's holds its bytes, and where in it.
    pub(super) places: Vec<(usize, Range<usize>)>,
}

impl Store {
    /// Reads what the document refers to.
    pub(super) fn read(
        path: &Path,
        file: Buffer,
        beside: &Beside<'_>,
        container: &Container,
        document: &Document,
    ) -> Result<Self, AssetError> {
        let mut store = Self {
            buffers: vec![file],
            places: Vec::new(),
        };
        for (index, buffer) in document.root.buffers.iter().enumerate() {
            let length = usize::try_from(buffer.byte_length.0).unwrap_or(usize::MAX);
            let refused = |problem: String| Fault::in_file(format!("buffer {index} {problem}")).of(path);
            let (at, held) = match (&buffer.uri, &container.bin) {
                (None, Some(bin)) if index == 0 => (0, bin.clone()),
                (None, _) => return Err(refused(format!("has no content{CUT_SHORT}"))),
                (Some(uri), _) => {
                    let at = store.open(path, uri, beside)?;
                    (at, 0..store.buffers[at].bytes.len())
                }
            };
            if length > held.len() {
                let problem = format!("should have {length} bytes, and has {}{CUT_SHORT}", held.len());
                return Err(refused(problem));
            }
            store.places.push((at, held.start..held.start + length));
        }
        store.read_images(document, beside);
        Ok(store)
    }

    /// How many bytes there are: every corner and every element of a list takes one of its own at least, unless a file names the same ones again and again.
    pub(super) fn bytes(&self) -> usize {
        self.buffers.iter().map(|buffer| buffer.bytes.len()).sum()
    }

    /// Which of the asset's buffers holds what a URI names.
    fn open(&mut self, path: &Path, uri: &str, beside: &Beside<'_>) -> Result<usize, AssetError> {
        let refused = |problem: &str| Fault::in_file(problem).of(path);
        let (name, bytes) = match uri.strip_prefix("data:") {
            Some(data) => {
                let encoded = data.split_once(";base64,").map(|(_, encoded)| encoded);
                let bytes = encoded.and_then(|encoded| STANDARD.decode(encoded).ok());
                let damaged = "a buffer in the text is not Base64: export the model anew";
                (String::new(), bytes.ok_or_else(|| refused(damaged))?)
            }
            None => {
                let name = file_name(uri).map_err(|problem| refused(&problem))?;
                if let Some(at) = self.buffers.iter().position(|buffer| buffer.name == name) {
                    return Ok(at);
                }
                let bytes = beside.read(path, &name)?;
                if bytes.starts_with(PEM) {
                    let problem = format!(
                        "refers to {name}, which holds a key or a certificate and no part of a model"
                    );
                    return Err(refused(&problem));
                }
                (name, bytes)
            }
        };
        self.buffers.push(Buffer {
            name,
            bytes: Arc::new(bytes),
        });
        Ok(self.buffers.len() - 1)
    }

    /// Takes the textures along that lie beside the file, so that a copy of it has them too. Those that are missing were missing before, and what is no
    /// picture is none: a stranger's model may name any file, and whoever gets the copy would get that, too.
    fn read_images(&mut self, document: &Document, beside: &Beside<'_>) {
        let Beside::Folder(folder) = beside else {
            return;
        };
        for name in images(document) {
            if self.buffers.iter().all(|buffer| buffer.name != name)
                && let Ok(bytes) = source::read(&folder.join(&name), source::LARGEST)
                && is_picture(&name, &bytes)
            {
                self.buffers.push(Buffer {
                    name,
                    bytes: Arc::new(bytes),
                });
            }
        }
    }

    /// Bytes of a buffer view: which of the asset's buffers, where in it, and from one record to the next if that is said.
    pub(super) fn view(
        &self,
        document: &Document,
        index: usize,
    ) -> Result<(usize, Range<usize>, Option<usize>), Fault> {
        let view = document
            .root
            .buffer_views
            .get(index)
            .ok_or_else(|| missing("buffer view", index))?;
        let (buffer, held) = self
            .places
            .get(view.buffer.value())
            .ok_or_else(|| missing("buffer", view.buffer.value()))?;
        let offset = view.byte_offset.map_or(0, |offset| offset.0);
        let within = offset
            .checked_add(view.byte_length.0)
            .is_some_and(|end| end <= held.len() as u64);
        if !within {
            let problem = format!("buffer view {index} goes beyond its buffer{CUT_SHORT}");
            return Err(Fault::in_file(problem));
        }
        let start = held.start + offset as usize;
        let stride = view.byte_stride.map(|stride| stride.0);
        Ok((*buffer, start..start + view.byte_length.0 as usize, stride))
    }
}

/// The names of files beside the document that it refers to, each once.
pub(super) fn companions(document: &Document) -> Vec<Companion> {
    let uris = document.root.buffers.iter().flat_map(|buffer| &buffer.uri);
    let named = uris
        .filter(|uri| !uri.starts_with("data:"))
        .flat_map(|uri| file_name(uri));
    let buffers = named.map(|name| (name, true));
    let mut companions: Vec<Companion> = Vec::new();
    for (name, is_buffer) in buffers.chain(images(document).map(|name| (name, false))) {
        if companions.iter().all(|companion| companion.name != name) {
            companions.push(Companion { name, is_buffer });
        }
    }
    companions
}

/// The names of textures beside the document.
fn images(document: &Document) -> impl Iterator<Item = String> {
    let uris = document.root.images.iter().flat_map(|image| &image.uri);
    uris.filter(|uri| !uri.starts_with("data:"))
        .flat_map(|uri| file_name(uri))
}

/// How keys begin.
const PEM: &[u8] = b"-----BEGIN ";

/// The name of a file beside the document, or in a folder beside it; of all spellings one.
fn file_name(uri: &str) -> Result<String, String> {
    let remedy = "put it beside the model and name it so, or save the model as GLB";
    let name = decoded(uri).ok_or_else(|| format!("{uri}: is no file name: {remedy}"))?;
    let beside = name_beside(&name).filter(|_| !uri.contains("://"));
    beside.ok_or_else(|| format!("{uri}: lies elsewhere than beside the model: {remedy}"))
}

/// A URI without its percent signs.
fn decoded(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.bytes();
    while let Some(byte) = rest.next() {
        match byte {
            b'%' => {
                let digits = [rest.next()?, rest.next()?].map(|digit| (digit as char).to_digit(16));
                let [Some(high), Some(low)] = digits else {
                    return None;
                };
                bytes.push((16 * high + low) as u8);
            }
            _ => bytes.push(byte),
        }
    }
    String::from_utf8(bytes).ok().filter(|name| !name.contains('\0'))
}

#[cfg(test)]
mod tests {
    use super::file_name;

    #[test]
    fn names_lead_beside_the_model_and_nowhere_else() {
        assert_eq!(file_name("my%20model.bin").unwrap(), "my model.bin");
        assert_eq!(file_name("parts/wheel.bin").unwrap(), "parts/wheel.bin");
        assert_eq!(file_name("r%C3%A4der.bin").unwrap(), "räder.bin");
        assert_eq!(file_name("parts/.//wheel.bin").unwrap(), "parts/wheel.bin");
        for outside in [
            "",
            "../secret",
            "/etc/passwd",
            "a/../../b",
            "https://example.org/a.bin",
            "%2e%2e/b",
            "a%00b",
            "%zz",
            "%f",
        ] {
            assert!(file_name(outside).is_err(), "{outside}");
        }
    }
}
