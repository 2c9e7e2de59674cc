//! Sets of bytes.

use std::ops::Range;

use super::accessor::Elements;
use super::buffers::Store;
use super::document::Document;
use crate::error::Fault;

/// A set of bytes of the asset's buffers.
pub(super) struct Bytes(Vec<Vec<u64>>);

impl Bytes {
    /// None yet.
    pub(super) fn of(store: &Store) -> Self {
        let words = |length: usize| vec![0; length.div_ceil(64)];
        Self(
            store
                .buffers
                .iter()
                .map(|buffer| words(buffer.bytes.len()))
                .collect(),
        )
    }

    pub(super) fn mark(&mut self, buffer: usize, bytes: Range<usize>) {
        for byte in bytes {
            self.0[buffer][byte / 64] |= 1 << (byte % 64);
        }
    }

    pub(super) fn mark_all(&mut self, elements: &Elements) {
        (0..elements.shape.count).for_each(|i| self.mark(elements.buffer, elements.bytes(i)));
    }

    /// Adds the pictures that lie in buffers.
    pub(super) fn mark_images(&mut self, document: &Document, store: &Store) -> Result<(), Fault> {
        for view in document.root.images.iter().flat_map(|image| image.buffer_view) {
            let (buffer, bytes, _) = store.view(document, view.value())?;
            self.mark(buffer, bytes);
        }
        Ok(())
    }

    pub(super) fn has(&self, buffer: usize, bytes: Range<usize>) -> bool {
        bytes
            .into_iter()
            .any(|byte| self.0[buffer][byte / 64] >> (byte % 64) & 1 == 1)
    }

    pub(super) fn has_any(&self, elements: &Elements) -> bool {
        (0..elements.shape.count).any(|i| self.has(elements.buffer, elements.bytes(i)))
    }
}
