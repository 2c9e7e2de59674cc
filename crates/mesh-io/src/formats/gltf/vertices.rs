//! The vertices of a scene: every place in the buffers where a position lies, once.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;

use super::accessor::{Accessor, Elements};
use super::buffers::Store;
use super::bytes::Bytes;
use super::directions::run;
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
    elements: HashMap<usize, Arc<[u32]>>,
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
    ) -> Result<Arc<[u32]>, Fault> {
        if let Some(known) = self.elements.get(&accessor) {
            return Ok(Arc::clone(known));
        }
        let vertices: Arc<[u32]> = self.vertices_of(document, store, accessor, placement)?.into();
        self.elements.insert(accessor, Arc::clone(&vertices));
        Ok(vertices)
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
        if self.count() + accessor.shape.count > store.bytes() {
            let problem = "is one of more lists of positions than the file has bytes for";
            return Err(accessor_fault(index, problem));
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
        let count = elements.shape.count;
        let first = self.take_numbers(count)?;
        self.runs.push(BinaryRun {
            placement: placement.copied(),
            ..run(elements, [0, 1, 2], normalised)
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

    /// Where all vertices of an accessor that was added are placed; `None` if not all alike.
    pub(super) fn common_placement(&self, accessor: usize) -> Option<Option<Placement>> {
        let mut ends = Vec::with_capacity(self.runs.len());
        for run in &self.runs {
            ends.push(ends.last().copied().unwrap_or(0) + run.count as u32);
        }
        let mut placements = self.elements[&accessor].iter().map(|&vertex| {
            let run = ends.partition_point(|&end| end <= vertex);
            self.runs[run].placement
        });
        let first = placements.next().unwrap_or(None);
        placements.all(|placement| placement == first).then_some(first)
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
            let replaced = Accessor::of(document, store, *accessor)?.replaced;
            replaced.iter().for_each(|numbers| others.mark_all(numbers));
        }
        let of_others = references(document).into_iter();
        for (_, accessor) in of_others.filter(|(meaning, _)| *meaning != Meaning::Position) {
            let accessor = Accessor::of(document, store, accessor)?;
            accessor.lists().for_each(|elements| others.mark_all(elements));
        }
        others.mark_images(document, store)?;
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

/// What an accessor is referred to as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Meaning {
    /// Positions of a primitive.
    Position,
    /// Normals, tangents, or offsets of a morph target.
    Direction,
    Other,
}

/// All accessors that are referred to, once for each meaning.
pub(super) fn references(document: &Document) -> BTreeSet<(Meaning, usize)> {
    let root = &document.root;
    let primitives = || root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let attributes = primitives().flat_map(|primitive| &primitive.attributes);
    let attributes = attributes.map(|(name, accessor)| match name {
        Checked::Valid(Semantic::Positions) => (Meaning::Position, *accessor),
        Checked::Valid(Semantic::Normals | Semantic::Tangents) => (Meaning::Direction, *accessor),
        _ => (Meaning::Other, *accessor),
    });
    let targets = primitives().flat_map(|primitive| primitive.targets.iter().flatten());
    let targets = targets.flat_map(|target| [target.positions, target.normals, target.tangents]);
    let targets = targets.flatten().map(|accessor| (Meaning::Direction, accessor));
    let samplers = root.animations.iter().flat_map(|animation| &animation.samplers);
    let others = primitives()
        .flat_map(|primitive| primitive.indices)
        .chain(samplers.flat_map(|sampler| [sampler.input, sampler.output]))
        .chain(root.skins.iter().flat_map(|skin| skin.inverse_bind_matrices));
    attributes
        .chain(targets)
        .chain(others.map(|accessor| (Meaning::Other, accessor)))
        .map(|(meaning, accessor)| (meaning, accessor.value()))
        .collect()
}
