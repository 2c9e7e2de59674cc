//! The vertices of a scene: every place in the buffers where a position lies, once.

use std::collections::HashMap;

use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;

use super::accessor::{Accessor, Elements};
use super::buffers::Store;
use super::document::{Document, accessor_fault};
use crate::error::Fault;
use crate::scalar::{Endian, Scalar};
use crate::slots::binary::{BinaryRun, Quantisation};
use crate::slots::placement::Placement;

const ZERO: &str = "the file leaves this vertex out, which means zero, and has no place for another number: export the model without sparse accessors";
const SHARED: &str = "the file uses the bytes of this vertex for something else, too: export the model anew";

/// The vertices that were found so far.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    /// Where they lie.
    pub(super) runs: Vec<BinaryRun>,
    count: u32,
    /// The vertex of each element, by accessor.
    elements: HashMap<usize, Vec<u32>>,
    /// The vertex whose position begins at a byte of a buffer.
    at: HashMap<(usize, usize), u32>,
}

impl Vertices {
    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.count as usize
    }

    /// Adds the elements of an accessor, placed by whoever comes first; returns which vertices they are.
    pub(super) fn add(
        &mut self,
        document: &Document,
        store: &Store,
        accessor: usize,
        placement: Option<&Placement>,
    ) -> Result<&[u32], Fault> {
        if !self.elements.contains_key(&accessor) {
            let vertices = self.vertices_of(document, store, accessor, placement)?;
            self.elements.insert(accessor, vertices);
        }
        Ok(&self.elements[&accessor])
    }

    fn vertices_of(
        &mut self,
        document: &Document,
        store: &Store,
        index: usize,
        placement: Option<&Placement>,
    ) -> Result<Vec<u32>, Fault> {
        let accessor = Accessor::of(document, store, index)?;
        if accessor.shape.components != 3 || accessor.shape.scalar == Scalar::U32 {
            return Err(accessor_fault(index, "holds no positions"));
        }
        let mut vertices = match &accessor.base {
            Some(elements) => self.push(elements, accessor.normalised, placement)?,
            None => self.push_zeros(accessor.shape.count, placement)?,
        };
        if let Some((replaced, values)) = &accessor.sparse {
            let values = self.push(values, accessor.normalised, placement)?;
            for (&element, value) in replaced.iter().zip(values) {
                vertices[element] = value;
            }
        }
        Ok(vertices)
    }

    /// A run of elements; those that begin where a vertex lies already are that vertex.
    fn push(
        &mut self,
        elements: &Elements,
        normalised: bool,
        placement: Option<&Placement>,
    ) -> Result<Vec<u32>, Fault> {
        let (kind, count) = (elements.shape.scalar, elements.shape.count);
        let first = self.take_numbers(count)?;
        self.runs.push(BinaryRun {
            buffer: elements.buffer,
            start: elements.start,
            stride: elements.stride,
            vertices: vec![[0, kind.size(), 2 * kind.size()]],
            count,
            types: [kind; 3],
            endian: Endian::Little,
            quantisation: kind.is_integer().then_some(Quantisation {
                scale: [1.0; 3],
                offset: [0.0; 3],
                normalised,
            }),
            placement: placement.copied(),
            locked: None,
        });
        let vertex = |(i, own)| {
            let at = (elements.buffer, elements.bytes(i).start);
            *self.at.entry(at).or_insert(own)
        };
        Ok((first..).enumerate().take(count).map(vertex).collect())
    }

    /// Vertices that the file does not write down.
    fn push_zeros(&mut self, count: usize, placement: Option<&Placement>) -> Result<Vec<u32>, Fault> {
        let first = self.take_numbers(count)?;
        // Quantised with a scale of zero, whatever lies at the beginning of the file says zero.
        self.runs.push(BinaryRun {
            buffer: 0,
            start: 0,
            stride: 0,
            vertices: vec![[0; 3]],
            count,
            types: [Scalar::U8; 3],
            endian: Endian::Little,
            quantisation: Some(Quantisation {
                scale: [0.0; 3],
                offset: [0.0; 3],
                normalised: false,
            }),
            placement: placement.copied(),
            locked: Some(ZERO),
        });
        Ok((first..).take(count).collect())
    }

    /// The number of the first of some new vertices.
    fn take_numbers(&mut self, count: usize) -> Result<u32, Fault> {
        let first = self.count;
        let next = u32::try_from(count)
            .ok()
            .and_then(|count| first.checked_add(count));
        self.count = next.ok_or_else(|| Fault::in_file("it has more than 2^32 vertices: divide it"))?;
        Ok(first)
    }

    /// Locks runs of which a byte belongs to anything but positions too, or to two positions that do not begin together.
    pub(super) fn lock_what_others_use(&mut self, document: &Document, store: &Store) -> Result<(), Fault> {
        let mut others = Bytes::of(store);
        for accessor in self.elements.keys() {
            if let Some(numbers) = &Accessor::of(document, store, *accessor)?.replaced {
                (0..numbers.shape.count).for_each(|i| others.mark(numbers.buffer, numbers.bytes(i)));
            }
        }
        for accessor in accessors_of_others(document) {
            for elements in Accessor::of(document, store, accessor)?.lists() {
                (0..elements.shape.count).for_each(|i| others.mark(elements.buffer, elements.bytes(i)));
            }
        }
        for view in document.root.images.iter().flat_map(|image| image.buffer_view) {
            let (buffer, bytes, _) = store.view(document, view.value())?;
            others.mark(buffer, bytes);
        }
        let mut positions = Bytes::of(store);
        let mut first = 0;
        for run in &mut self.runs {
            let size = 3 * run.types[0].size();
            let is_own = |vertex: usize| {
                self.at.get(&(run.buffer, run.start + vertex * run.stride)) == Some(&(first + vertex as u32))
            };
            for vertex in (0..run.count)
                .filter(|_| run.locked.is_none())
                .collect::<Vec<_>>()
            {
                let start = run.start + vertex * run.stride;
                let bytes = start..start + size;
                let is_shared = others.has(run.buffer, bytes.clone())
                    || (is_own(vertex) && positions.has(run.buffer, bytes.clone()));
                if is_shared {
                    run.locked = Some(SHARED);
                }
                positions.mark(run.buffer, bytes);
            }
            first += run.count as u32;
        }
        Ok(())
    }
}

/// Accessors that mean anything but positions of a primitive.
fn accessors_of_others(document: &Document) -> impl Iterator<Item = usize> {
    let root = &document.root;
    let primitives = || root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let attributes = primitives().flat_map(|primitive| &primitive.attributes);
    let attributes = attributes.filter(|(name, _)| !matches!(name, Checked::Valid(Semantic::Positions)));
    let targets = primitives().flat_map(|primitive| primitive.targets.iter().flatten());
    let targets = targets.flat_map(|target| [target.positions, target.normals, target.tangents]);
    let samplers = root.animations.iter().flat_map(|animation| &animation.samplers);
    let mut all: Vec<usize> = (attributes.map(|(_, accessor)| *accessor))
        .chain(primitives().flat_map(|primitive| primitive.indices))
        .chain(targets.flatten())
        .chain(samplers.flat_map(|sampler| [sampler.input, sampler.output]))
        .chain(root.skins.iter().flat_map(|skin| skin.inverse_bind_matrices))
        .map(|accessor| accessor.value())
        .collect();
    all.sort_unstable();
    all.dedup();
    all.into_iter()
}

/// A set of bytes of the asset's buffers.
struct Bytes(Vec<Vec<u64>>);

impl Bytes {
    fn of(store: &Store) -> Self {
        let words = |length: usize| vec![0; length.div_ceil(64)];
        Self(
            store
                .buffers
                .iter()
                .map(|buffer| words(buffer.bytes.len()))
                .collect(),
        )
    }

    fn mark(&mut self, buffer: usize, bytes: std::ops::Range<usize>) {
        for byte in bytes {
            self.0[buffer][byte / 64] |= 1 << (byte % 64);
        }
    }

    fn has(&self, buffer: usize, bytes: std::ops::Range<usize>) -> bool {
        bytes
            .into_iter()
            .any(|byte| self.0[buffer][byte / 64] >> (byte % 64) & 1 == 1)
    }
}
