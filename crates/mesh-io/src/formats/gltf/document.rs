//! The JSON: what the gltf crate reads of it, and where in the text the numbers and names stand that may change.

use std::ops::Range;

use gltf::json::{self, Root};
use json::accessor::ComponentType;
use serde::Deserialize;
use serde_json::value::RawValue;

use crate::error::Fault;
use crate::scalar::Scalar;

/// Extensions that keep coordinates where this reader does not look.
const COMPRESSIONS: [(&str, &str); 3] = [
    ("KHR_draco_mesh_compression", "Draco"),
    ("EXT_meshopt_compression", "meshopt"),
    ("KHR_meshopt_compression", "meshopt"),
];

#[derive(Debug)]
pub(super) struct Document {
    pub(super) root: Root,
    /// Where an accessor's bounds stand, from the beginning of the text.
    pub(super) bounds: Vec<[Option<Range<usize>>; 2]>,
    /// Where a buffer's name or content stands, with its quotes.
    pub(super) uris: Vec<Option<Range<usize>>>,
}

#[derive(Deserialize)]
struct Spans<'a> {
    #[serde(borrow, default)]
    accessors: Vec<AccessorSpan<'a>>,
    #[serde(borrow, default)]
    buffers: Vec<BufferSpan<'a>>,
}

#[derive(Deserialize)]
struct AccessorSpan<'a> {
    #[serde(borrow)]
    min: Option<&'a RawValue>,
    #[serde(borrow)]
    max: Option<&'a RawValue>,
}

#[derive(Deserialize)]
struct BufferSpan<'a> {
    #[serde(borrow)]
    uri: Option<&'a RawValue>,
}

impl Document {
    /// Reads the JSON, which begins at byte `start` of its file.
    pub(super) fn of(json: &[u8], start: usize) -> Result<Self, Fault> {
        let text = std::str::from_utf8(json).map_err(|error| {
            let at = start + error.valid_up_to();
            Fault::at_byte(
                at,
                "JSON",
                "is not UTF-8, as glTF has to be: export the model anew",
            )
        })?;
        let malformed = |error: serde_json::Error| {
            let problem = format!("this is not the JSON of glTF 2.0 ({error}): export the model anew");
            match start {
                0 => Fault::at_json_line(error.line(), problem),
                _ => Fault::at_byte(start, "JSON chunk", problem),
            }
        };
        let root = Root::from_str(text).map_err(malformed)?;
        let spans: Spans<'_> = serde_json::from_str(text).map_err(malformed)?;
        let span = |value: Option<&RawValue>| {
            value.map(|value| {
                let at = value.get().as_ptr() as usize - text.as_ptr() as usize;
                at..at + value.get().len()
            })
        };
        let document = Self {
            bounds: spans
                .accessors
                .iter()
                .map(|a| [span(a.min), span(a.max)])
                .collect(),
            uris: spans.buffers.iter().map(|buffer| span(buffer.uri)).collect(),
            root,
        };
        document.check_extensions()?;
        Ok(document)
    }

    fn check_extensions(&self) -> Result<(), Fault> {
        let used = self
            .root
            .extensions_used
            .iter()
            .chain(&self.root.extensions_required);
        let compressed = used.flat_map(|name| COMPRESSIONS.iter().find(|(extension, _)| name == extension));
        match compressed.into_iter().next() {
            Some((extension, name)) => Err(Fault::in_file(format!(
                "its geometry is compressed ({name}: {extension}), and is not read like this: decompress it with \
                 `npx @gltf-transform/cli copy FILE plain.glb`, and compress the signed file again if you like"
            ))),
            None => Ok(()),
        }
    }

    pub(super) fn accessor(&self, index: usize) -> Result<&json::Accessor, Fault> {
        self.root
            .accessors
            .get(index)
            .ok_or_else(|| missing("accessor", index))
    }

    pub(super) fn node(&self, index: usize) -> Result<&json::Node, Fault> {
        self.root.nodes.get(index).ok_or_else(|| missing("node", index))
    }
}

/// What a reference leads to is not there.
pub(super) fn missing(what: &str, index: usize) -> Fault {
    Fault::in_file(format!(
        "{what} {index} is referred to, and is not there: export the model anew"
    ))
}

/// A fault of an accessor.
pub(super) fn accessor_fault(index: usize, problem: &str) -> Fault {
    Fault::in_file(format!("accessor {index} {problem}: export the model anew"))
}

/// The type of numbers.
pub(super) fn scalar(kind: ComponentType) -> Scalar {
    match kind {
        ComponentType::I8 => Scalar::I8,
        ComponentType::U8 => Scalar::U8,
        ComponentType::I16 => Scalar::I16,
        ComponentType::U16 => Scalar::U16,
        ComponentType::U32 => Scalar::U32,
        ComponentType::F32 => Scalar::F32,
    }
}
