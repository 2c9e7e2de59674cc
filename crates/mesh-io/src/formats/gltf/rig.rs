//! Which joints and morph targets move which vertices.

use std::collections::HashMap;

use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use mesh::MorphTarget;

use super::accessor::Accessor;
use super::buffers::Store;
use super::container::Container;
use super::document::{Document, accessor_fault};
use super::vertices::Vertices;
use crate::buffer::Buffer;
use crate::error::Fault;
use crate::slots::scene::SceneSlots;

/// Sets of four that a vertex may have. Programs write one or two; a file could name the same bytes any number of times.
const MOST_SETS: u32 = 4;

/// Joints are numbered through all skins, and every node that shows a mesh without one is a joint of its own.
type Joints = HashMap<(Option<usize>, usize), u32>;

/// What poses the vertices of a file.
pub(crate) struct RigOfFile {
    /// Of each vertex some (joint, weight).
    pub(crate) weights: Vec<Vec<(u32, f64)>>,
    pub(crate) targets: Vec<MorphTarget>,
}

/// What poses the file's vertices; `None` where nothing has a skin or a morph target. What is shown several times is moved as it is the first time.
pub(crate) fn rig(buffers: &[Buffer], slots: &SceneSlots) -> Result<Option<RigOfFile>, Fault> {
    let container = Container::of(&buffers[0].bytes)?;
    let document = Document::of(&buffers[0].bytes[container.json.clone()], container.json.start)?;
    let store = Store {
        buffers: buffers.to_vec(),
        places: slots.places.clone(),
    };
    let (mut vertices, mut joints, mut has_skin) = (Vertices::default(), Joints::new(), false);
    let mut all: Vec<Vec<(u32, f64)>> = Vec::new();
    let mut targets = Targets::new(&store);
    super::for_each_primitive(&document, &store, |primitive, positions, (placement, placed)| {
        let known = vertices.count();
        let numbers = vertices.add(&document, &store, positions, placement)?;
        all.resize(vertices.count(), Vec::new());
        let Some((node, skin)) = placed.shown_by.filter(|_| vertices.count() > known) else {
            return Ok(());
        };
        let own = match skin {
            Some(_) => of_primitive(&document, &store, primitive)?,
            None => Vec::new(),
        };
        has_skin |= !own.is_empty();
        targets.add(&document, &store, node, primitive, |element, offset| {
            let vertex = *numbers.get(element)?;
            let turned = placement.map_or(offset, |placement| placement.apply_vector(offset));
            (vertex as usize >= known).then_some((vertex, turned))
        })?;
        let mut number = |joint| {
            let next = joints.len() as u32;
            *joints.entry(joint).or_insert(next)
        };
        let rigid = number((None, node));
        for (element, &vertex) in numbers.iter().enumerate() {
            let weights = &mut all[vertex as usize];
            if (vertex as usize) < known || !weights.is_empty() {
                continue;
            }
            *weights = match own.get(element) {
                Some(own) => own
                    .iter()
                    .map(|&(joint, weight)| (number((skin, joint)), weight))
                    .collect(),
                None => vec![(rigid, 1.0)],
            };
        }
        Ok(())
    })?;
    let targets = targets.found;
    Ok((has_skin || !targets.is_empty()).then_some(RigOfFile {
        weights: all,
        targets,
    }))
}

/// The morph targets of a file, those of each node in their order.
struct Targets {
    found: Vec<MorphTarget>,
    /// By node, and number among the node's.
    numbers: HashMap<(usize, usize), usize>,
    /// How many elements may still be read: each takes bytes of its own, unless a file names the same ones again and again.
    room: usize,
}

impl Targets {
    fn new(store: &Store) -> Self {
        Self {
            found: Vec::new(),
            numbers: HashMap::new(),
            room: store.bytes(),
        }
    }

    /// Adds those of a primitive that a node shows; `place` says which vertex an element is, and what its offset is in the scene.
    fn add(
        &mut self,
        document: &Document,
        store: &Store,
        node: usize,
        primitive: &Primitive,
        place: impl Fn(usize, [f64; 3]) -> Option<(u32, [f64; 3])>,
    ) -> Result<(), Fault> {
        for (k, target) in primitive.targets.iter().flatten().enumerate() {
            let Some(index) = target.positions.map(|index| index.value()) else {
                continue;
            };
            let accessor = Accessor::of(document, store, index)?;
            if accessor.shape.components != 3 {
                return Err(accessor_fault(index, "holds no offsets of positions"));
            }
            let room = self.room.checked_sub(accessor.written_count());
            self.room = room.ok_or_else(|| {
                accessor_fault(index, "is one of more morph targets than the file has bytes for")
            })?;
            let written = accessor.written::<3>(store).into_iter();
            let offsets: MorphTarget = written
                .filter(|(_, offset)| *offset != [0.0; 3])
                .filter_map(|(element, offset)| place(element, offset))
                .collect();
            if offsets.is_empty() {
                continue;
            }
            let next = self.found.len();
            let number = *self.numbers.entry((node, k)).or_insert(next);
            self.found
                .resize(self.found.len().max(number + 1), MorphTarget::new());
            self.found[number].extend(offsets);
        }
        Ok(())
    }
}

/// The joints and weights of a primitive's elements; empty where it has none.
fn of_primitive(
    document: &Document,
    store: &Store,
    primitive: &Primitive,
) -> Result<Vec<Vec<(usize, f64)>>, Fault> {
    let attribute = |semantic| {
        let index = primitive.attributes.get(&Checked::Valid(semantic))?;
        Some(index.value())
    };
    let mut all: Vec<Vec<(usize, f64)>> = Vec::new();
    for set in 0..MOST_SETS {
        let (joints, weights) = (
            attribute(Semantic::Joints(set)),
            attribute(Semantic::Weights(set)),
        );
        let (Some(joints), Some(weights)) = (joints, weights) else {
            break;
        };
        let numbers = four(document, store, joints)?;
        let shares = four(document, store, weights)?;
        all.resize(numbers.len().max(all.len()), Vec::new());
        for ((own, joints), shares) in all.iter_mut().zip(numbers).zip(shares) {
            let pairs = joints.into_iter().zip(shares);
            own.extend(
                pairs
                    .filter(|&(_, share)| share > 0.0)
                    .map(|(joint, share)| (joint as usize, share)),
            );
        }
    }
    Ok(all)
}

/// The four numbers of each element. Those that are normalised need not be brought to 1 here: the rig does that.
fn four(document: &Document, store: &Store, index: usize) -> Result<Vec<[f64; 4]>, Fault> {
    let accessor = Accessor::of(document, store, index)?;
    if accessor.shape.components != 4 {
        return Err(accessor_fault(index, "holds no joints or weights"));
    }
    Ok(accessor.numbers(store))
}
