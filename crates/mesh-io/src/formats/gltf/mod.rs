//! glTF 2.0: JSON with its buffers beside it (.gltf), or all in one file (.glb).
//!
//! The gltf crate reads the JSON. Triangles, strips and fans are taken from every mesh that a scene shows, each once and where it is seen first; lines
//! and points are not. New positions go where the old ones lie in the buffers; of the JSON, the bounds of their accessors change with
//! them, and a buffer that is kept in the text.

mod accessor;
mod buffers;
mod bytes;
mod container;
mod directions;
mod document;
mod rewrite;
mod rig;
mod scene;
mod seams;
mod vertices;

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;
use std::path::Path;

use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

use super::geometry::{Geometry, Instance};
use crate::Companion;
use crate::buffer::Buffer;
use crate::error::{AssetError, Fault};
use crate::packing::Beside;
use crate::slots::Slots;
use crate::slots::binary::BinaryRun;
use crate::slots::placement::Placement;
use crate::slots::scene::SceneSlots;
use accessor::Accessor;
use buffers::Store;
use container::Container;
pub(crate) use container::is_glb;
pub(crate) use directions::directions;
use document::Document;
pub(crate) use rewrite::rewrite;
pub(crate) use rig::{RigOfFile, rig};
use scene::Placed;
use vertices::Vertices;

/// Reads a file, and the files that it refers to.
pub(crate) fn read(
    path: &Path,
    file: Buffer,
    beside: &Beside<'_>,
) -> Result<(Vec<Buffer>, Geometry), AssetError> {
    let fault = |fault: Fault| fault.of(path);
    let container = Container::of(&file.bytes).map_err(fault)?;
    let document = Document::of(&file.bytes[container.json.clone()], container.json.start).map_err(fault)?;
    let store = Store::read(path, file, beside, &container, &document)?;
    let mut geometry = geometry(&document, &store).map_err(fault)?;
    geometry.manifests = container.manifests.len();
    Ok((store.buffers, geometry))
}

/// Files that a document refers to by name: buffers, which change with the positions, and textures, which do not.
pub(crate) fn companions(path: &Path, bytes: &[u8]) -> Result<Vec<Companion>, AssetError> {
    let fault = |fault: Fault| fault.of(path);
    let container = Container::of(bytes).map_err(fault)?;
    let document = Document::of(&bytes[container.json.clone()], container.json.start).map_err(fault)?;
    Ok(buffers::companions(&document))
}

/// Where the positions lie.
fn runs(document: &Document, store: &Store) -> Result<Vec<BinaryRun>, Fault> {
    let mut vertices = Vertices::default();
    for_each_primitive(document, store, |_, positions, (placement, _)| {
        vertices.add(document, store, positions, placement).map(drop)
    })?;
    vertices.lock_what_others_use(document, store)?;
    Ok(vertices.runs)
}

/// The accessors of positions, each once.
fn position_accessors(document: &Document, store: &Store) -> Result<BTreeSet<usize>, Fault> {
    let mut accessors = BTreeSet::new();
    for_each_primitive(document, store, |_, positions, _| {
        accessors.insert(positions);
        Ok(())
    })?;
    Ok(accessors)
}

fn geometry(document: &Document, store: &Store) -> Result<Geometry, Fault> {
    let mut vertices = Vertices::default();
    let mut triangles = Vec::new();
    // Which triangles a primitive has, and where they lie: whoever has the same comes second, and is an instance.
    let mut first: HashMap<_, (Range<usize>, Option<Placement>)> = HashMap::new();
    let mut instances = Vec::new();
    let [mut room, mut corners_left] = [store.bytes(); 2];
    let mut names = Vec::new();
    for_each_primitive(document, store, |primitive, positions, (placement, placed)| {
        let indices = primitive.indices.map(|index| index.value());
        let key = (positions, indices, mode(primitive).map(Mode::as_gl_enum));
        if let Some((range, from)) = first.get(&key) {
            if placement != from.as_ref() && range.len() <= room {
                room -= range.len();
                instances.push(Instance {
                    triangles: triangles[range.clone()].to_vec(),
                    from: *from,
                    to: placement.copied(),
                });
            }
            return Ok(());
        }
        let first_vertex = vertices.count();
        let numbers = vertices.add(document, store, positions, placement)?;
        if let Some(name) = placed.name.as_ref().filter(|_| vertices.count() > first_vertex) {
            names.push((first_vertex..vertices.count(), name.clone()));
        }
        let corners = corners(document, store, indices, &numbers)?;
        let left = corners_left.checked_sub(corners.len());
        corners_left = left.ok_or_else(|| {
            Fault::in_file("it has more corners of triangles than bytes: export the model anew")
        })?;
        let start = triangles.len();
        let flip = placement.is_some_and(Placement::mirrors);
        cut(&corners, mode(primitive), flip, &mut triangles);
        first.insert(key, (start..triangles.len(), placement.copied()));
        Ok(())
    })?;
    check_lists(document, store)?;
    vertices.lock_what_others_use(document, store)?;
    let scene = SceneSlots {
        runs: vertices.runs,
        places: store.places.clone(),
    };
    let slots = Slots::Scene(scene.clone());
    let mut positions = slots.positions(&store.buffers);
    seams::close(&scene.runs, &triangles, &mut positions);
    Ok(Geometry {
        positions,
        triangles,
        slots,
        names,
        instances,
        manifests: 0,
    })
}

/// So many elements may all lists of a file have for each of its bytes.
const MOST_ELEMENTS: u64 = 16;

/// Refuses a file whose lists name the same bytes again and again: every element of each is looked at.
fn check_lists(document: &Document, store: &Store) -> Result<(), Fault> {
    let mut elements = 0_u64;
    for (_, index) in vertices::references(document) {
        let accessor = document.accessor(index)?;
        let replaced = accessor.sparse.as_ref().map_or(0, |sparse| sparse.count.0);
        elements = elements.saturating_add(accessor.count.0).saturating_add(replaced);
    }
    match elements <= MOST_ELEMENTS * store.bytes() as u64 {
        true => Ok(()),
        false => Err(Fault::in_file(
            "its lists name the same bytes again and again: export the model anew",
        )),
    }
}

/// Calls `each` for every primitive that has triangles, with the accessor of its positions, its place in the scene and what shows it. Meshes that
/// the scene flattens to nothing are passed over.
fn for_each_primitive(
    document: &Document,
    store: &Store,
    mut each: impl FnMut(&Primitive, usize, (Option<&Placement>, &Placed)) -> Result<(), Fault>,
) -> Result<(), Fault> {
    for placed in scene::placed_meshes(document, store)? {
        let Some(placement) = Placement::of_columns(&placed.columns) else {
            continue;
        };
        let placement = Some(&placement).filter(|placement| !placement.is_identity());
        for primitive in &document.root.meshes[placed.mesh].primitives {
            let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            if let (Some(positions), Some(_)) = (positions, mode(primitive)) {
                each(primitive, positions.value(), (placement, &placed))?;
            }
        }
    }
    Ok(())
}

/// How a primitive's corners make triangles; `None` of points, lines and what is unknown.
fn mode(primitive: &Primitive) -> Option<Mode> {
    match primitive.mode {
        Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => Some(mode),
        _ => None,
    }
}

/// The file vertices of a primitive's corners. `numbers` are those of the elements of its positions.
fn corners(
    document: &Document,
    store: &Store,
    indices: Option<usize>,
    numbers: &[u32],
) -> Result<Vec<u32>, Fault> {
    let Some(index) = indices else {
        return Ok(numbers.to_vec());
    };
    let accessor = Accessor::of(document, store, index)?;
    if !accessor.shape.scalar.is_integer() || accessor.shape.components != 1 {
        return Err(document::accessor_fault(index, "holds no indices"));
    }
    let corner = |[element]: [f64; 1]| numbers.get(element as usize).copied();
    let corners: Option<Vec<u32>> = accessor.numbers(store).into_iter().map(corner).collect();
    corners.ok_or_else(|| document::accessor_fault(index, "names a vertex that there is not"))
}

/// Cuts corners into triangles; turned round if `flip`.
fn cut(corners: &[u32], mode: Option<Mode>, flip: bool, triangles: &mut Vec<[u32; 3]>) {
    let first = triangles.len();
    match mode {
        Some(Mode::TriangleStrip) => {
            let windows = corners.windows(3).enumerate();
            triangles.extend(windows.map(|(i, corners)| match i % 2 {
                0 => [corners[0], corners[1], corners[2]],
                _ => [corners[1], corners[0], corners[2]],
            }));
        }
        Some(Mode::TriangleFan) => super::geometry::fan(corners, triangles),
        _ => triangles.extend(corners.as_chunks().0),
    }
    if flip {
        triangles[first..]
            .iter_mut()
            .for_each(|corners| corners.swap(1, 2));
    }
}
