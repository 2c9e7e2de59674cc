//! Normals, tangents and morph targets: where they lie, and what they mean.

use std::collections::{BTreeMap, HashMap, HashSet};

use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;

use super::accessor::{Accessor, Elements};
use super::buffers::Store;
use super::bytes::Bytes;
use super::container::Container;
use super::document::Document;
use super::vertices::{Meaning, Vertices, references};
use crate::buffer::Buffer;
use crate::error::Fault;
use crate::scalar::{Endian, Scalar};
use crate::slots::Slots;
use crate::slots::binary::{BinaryRun, Quantisation};
use crate::slots::directions::{Directions, Found, Role, Unturned};
use crate::slots::placement::Placement;
use crate::slots::scene::SceneSlots;

const ODD: &str = "of another type than glTF has for them";
const SHARED: &str = "its bytes are used for something else, too";
const PLACED: &str = "it belongs to vertices that nodes place differently, or has two meanings";
const BENDS: &str =
    "its joints and inverse bind matrices stay: the mesh lies right at rest, and bends about where it was";
const MOVES: &str =
    "what moves nodes stays: the mesh lies right where the nodes stand, and moves as it did where it was";

/// What an accessor's numbers mean and where its vertices are placed; `None` if there is more than one answer.
type Uses = BTreeMap<usize, Option<(Role, Option<Placement>)>>;

/// All that turns with the meshes that the scene shows.
pub(crate) fn directions(buffers: &[Buffer], slots: &SceneSlots) -> Result<Found, Fault> {
    let container = Container::of(&buffers[0].bytes)?;
    let document = Document::of(&buffers[0].bytes[container.json.clone()], container.json.start)?;
    let store = Store {
        buffers: buffers.to_vec(),
        places: slots.places.clone(),
    };
    let uses = uses(&document, &store)?;
    let others = bytes_of_others(&document, &store, &uses)?;
    let mut gathered = Gathered {
        found: Found::default(),
        others,
        own: Bytes::of(&store),
        at: HashMap::new(),
    };
    for (index, found) in uses {
        let accessor = Accessor::of(&document, &store, index)?;
        gathered.add(index, &accessor, found);
    }
    let mut found = gathered.found;
    if document.root.nodes.iter().any(|node| node.skin.is_some()) {
        found.left.push(Unturned::new("the skeleton", BENDS));
    }
    if !document.root.animations.is_empty() {
        found.left.push(Unturned::new("the animations", MOVES));
    }
    Ok(found)
}

/// The accessors of a primitive that turn with it, and what they mean.
fn of_primitive(primitive: &Primitive) -> Vec<(usize, Role)> {
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
    let mut all = vec![
        (attribute(Semantic::Normals), Role::Normal),
        (attribute(Semantic::Tangents), Role::Tangent),
    ];
    for target in primitive.targets.iter().flatten() {
        all.push((target.positions, Role::PositionOffset));
        all.push((target.normals, Role::NormalOffset));
        all.push((target.tangents, Role::TangentOffset));
    }
    let given = all.into_iter();
    given
        .filter_map(|(accessor, role)| Some((accessor?.value(), role)))
        .collect()
}

/// Every accessor whose numbers may turn, of all primitives.
pub(super) fn accessors(document: &Document) -> impl Iterator<Item = usize> {
    let primitives = document.root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let all: HashSet<usize> = primitives
        .flat_map(of_primitive)
        .map(|(accessor, _)| accessor)
        .collect();
    all.into_iter()
}

fn uses(document: &Document, store: &Store) -> Result<Uses, Fault> {
    let mut vertices = Vertices::default();
    let mut seen = HashSet::new();
    let mut uses = Uses::new();
    super::for_each_primitive(document, store, |primitive, positions, (placement, _)| {
        vertices.add(document, store, positions, placement)?;
        let own = of_primitive(primitive);
        if !own.is_empty() && seen.insert((positions, own.clone())) {
            // A mesh that is placed twice moves so that the first lies right, and its normals with it.
            let placement = vertices.common_placement(positions);
            for (index, role) in own {
                let meaning = placement.map(|placement| (role, placement));
                let known = uses.entry(index).or_insert(meaning);
                if *known != meaning {
                    *known = None;
                }
            }
        }
        Ok(())
    })?;
    Ok(uses)
}

/// The bytes that mean anything but what is to be turned.
fn bytes_of_others(document: &Document, store: &Store, uses: &Uses) -> Result<Bytes, Fault> {
    let mut others = Bytes::of(store);
    for (meaning, index) in references(document) {
        let accessor = Accessor::of(document, store, index)?;
        if meaning != Meaning::Direction || !uses.contains_key(&index) {
            accessor.lists().for_each(|elements| others.mark_all(elements));
        }
        accessor
            .replaced
            .iter()
            .for_each(|elements| others.mark_all(elements));
    }
    others.mark_images(document, store)?;
    Ok(others)
}

/// What was found so far.
struct Gathered {
    found: Found,
    others: Bytes,
    /// Bytes that are to be turned.
    own: Bytes,
    /// What begins at a byte of a buffer, by the accessor that came first.
    at: HashMap<(usize, usize), (Role, Option<Placement>, Scalar)>,
}

impl Gathered {
    /// Takes an accessor as a whole, or says why it is left.
    fn add(&mut self, index: usize, accessor: &Accessor, found: Option<(Role, Option<Placement>)>) {
        let what = |role| format!("{} (accessor {index})", name(role));
        let Some((role, placement)) = found else {
            let left = Unturned::new(format!("accessor {index}"), PLACED);
            return self.found.left.push(left);
        };
        let meaning = (role, placement, accessor.shape.scalar);
        let starts = |elements: &Elements| {
            let (buffer, elements) = (elements.buffer, *elements);
            (0..elements.shape.count).map(move |i| (buffer, elements.bytes(i).start))
        };
        let mut all = accessor.lists().flat_map(starts);
        if accessor.lists().next().is_none() || all.all(|at| self.at.get(&at) == Some(&meaning)) {
            // Another accessor of the same bytes.
            return;
        }
        let is_shared = |elements: &Elements| self.others.has_any(elements) || self.own.has_any(elements);
        let why = match () {
            () if !is_typical(role, accessor) => Some(ODD),
            () if accessor.lists().any(is_shared) => Some(SHARED),
            () => None,
        };
        if let Some(why) = why {
            return self.found.left.push(Unturned::new(what(role), why));
        }
        for elements in accessor.lists() {
            self.own.mark_all(elements);
            self.at.extend(starts(elements).map(|at| (at, meaning)));
            let directions = |role, first: [usize; 3]| Directions {
                slots: Slots::Binary(vec![run(elements, first, accessor.normalised)]),
                role,
                placement,
                of_vertices: false,
                what: what(role),
            };
            self.found.lists.push(directions(role, [0, 1, 2]));
            if role == Role::Tangent {
                self.found.lists.push(directions(Role::Handedness, [3, 3, 3]));
            }
        }
    }
}

fn name(role: Role) -> &'static str {
    match role {
        Role::Normal => "the normals",
        Role::Tangent => "the tangents",
        Role::Handedness => "the signs of tangents",
        Role::PositionOffset => "the positions of a morph target",
        Role::NormalOffset => "the normals of a morph target",
        Role::TangentOffset => "the tangents of a morph target",
    }
}

/// Whether numbers of a role are so many and of such a type as glTF and KHR_mesh_quantization say.
fn is_typical(role: Role, accessor: &Accessor) -> bool {
    let components = if role == Role::Tangent { 4 } else { 3 };
    let is_signed = match accessor.shape.scalar {
        Scalar::F32 => true,
        Scalar::I8 | Scalar::I16 => accessor.normalised || role == Role::PositionOffset,
        _ => false,
    };
    accessor.shape.components == components && is_signed
}

/// Three components of every element, where no scene places them.
pub(super) fn run(elements: &Elements, components: [usize; 3], normalised: bool) -> BinaryRun {
    let kind = elements.shape.scalar;
    BinaryRun {
        buffer: elements.buffer,
        start: elements.start,
        stride: elements.stride,
        vertices: vec![components.map(|component| component * kind.size())],
        count: elements.shape.count,
        types: [kind; 3],
        endian: Endian::Little,
        quantisation: kind.is_integer().then_some(Quantisation {
            scale: [1.0; 3],
            offset: [0.0; 3],
            normalised,
        }),
        placement: None,
        locked: None,
    }
}
