//! Which joints move which vertices.

use std::collections::HashMap;

use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;

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

/// Of each vertex of a file some (joint, weight).
pub(crate) type Weights = Vec<Vec<(u32, f64)>>;

/// The weights of the file's vertices; `None` where nothing has a skin. What is shown several times is moved as it is the first time.
pub(crate) fn weights(buffers: &[Buffer], slots: &SceneSlots) -> Result<Option<Weights>, Fault> {
    let container = Container::of(&buffers[0].bytes)?;
    let document = Document::of(&buffers[0].bytes[container.json.clone()], container.json.start)?;
    let store = Store {
        buffers: buffers.to_vec(),
        places: slots.places.clone(),
    };
    let (mut vertices, mut joints, mut has_skin) = (Vertices::default(), Joints::new(), false);
    let mut all = Weights::new();
    super::for_each_primitive(&document, &store, |primitive, positions, (placement, placed)| {
        let known = vertices.count();
        let numbers = vertices.add(&document, &store, positions, placement)?.to_vec();
        all.resize(vertices.count(), Vec::new());
        let Some((node, skin)) = placed.shown_by.filter(|_| vertices.count() > known) else {
            return Ok(());
        };
        let own = match skin {
            Some(_) => of_primitive(&document, &store, primitive)?,
            None => Vec::new(),
        };
        has_skin |= !own.is_empty();
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
    Ok(has_skin.then_some(all))
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
