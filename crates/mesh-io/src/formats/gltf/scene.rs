//! Where the scene puts its meshes.

use gltf::json::{self, Node};

use super::accessor::Accessor;
use super::buffers::Store;
use super::document::Document;
use crate::error::Fault;

/// A 4 × 4 matrix whose columns follow each other.
pub(super) type Columns = [f64; 16];

const IDENTITY: Columns = [
    1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0,
];

/// A mesh where it is seen.
#[derive(Debug)]
pub(super) struct Placed {
    /// Number of the mesh.
    pub(super) mesh: usize,
    /// From its own coordinates to the scene's.
    pub(super) columns: Columns,
    /// What the node is called, or else the mesh.
    pub(super) name: Option<String>,
    /// The node that shows it, and the skin by which it does; no node in files without any.
    pub(super) shown_by: Option<(usize, Option<usize>)>,
}

/// Every mesh that a scene shows, as often as it does: the default scene's first. Of a file without scenes and nodes, all meshes as they are.
///
/// A skinned mesh lies where its first joint puts it, for its node's own place does not count; joints that agree, as those of a
/// figure at rest do, all put it there.
pub(super) fn placed_meshes(document: &Document, store: &Store) -> Result<Vec<Placed>, Fault> {
    let root = &document.root;
    let world = world_matrices(document)?;
    let mut placed: Vec<Placed> = Vec::new();
    for node in shown_nodes(document)? {
        let Some(mesh) = document.node(node)?.mesh.map(|mesh| mesh.value()) else {
            continue;
        };
        if mesh >= root.meshes.len() {
            return Err(super::document::missing("mesh", mesh));
        }
        placed.push(Placed {
            mesh,
            columns: skin_matrix(document, store, &world, node)?.unwrap_or(world[node]),
            name: document
                .node(node)?
                .name
                .clone()
                .or_else(|| root.meshes[mesh].name.clone()),
            shown_by: Some((node, document.node(node)?.skin.map(|skin| skin.value()))),
        });
    }
    if root.nodes.iter().all(|node| node.mesh.is_none()) {
        placed.extend((0..root.meshes.len()).map(|mesh| Placed {
            mesh,
            columns: IDENTITY,
            name: root.meshes[mesh].name.clone(),
            shown_by: None,
        }));
    }
    Ok(placed)
}

/// The nodes of all scenes from the roots down, those of the default scene first; of a file without scenes, all nodes.
fn shown_nodes(document: &Document) -> Result<Vec<usize>, Fault> {
    let root = &document.root;
    let default = root.scene.map_or(0, |scene| scene.value());
    let mut scenes: Vec<&json::Scene> = root.scenes.iter().collect();
    if default < scenes.len() {
        scenes[..=default].rotate_right(1);
    }
    let mut shown = Vec::new();
    let mut seen = vec![false; root.nodes.len()];
    for scene in &scenes {
        let mut open: Vec<usize> = scene.nodes.iter().rev().map(gltf::json::Index::value).collect();
        while let Some(index) = open.pop() {
            let node = document.node(index)?;
            if std::mem::replace(&mut seen[index], true) {
                continue;
            }
            shown.push(index);
            open.extend(children(node).rev());
        }
    }
    if scenes.is_empty() {
        shown = (0..root.nodes.len()).collect();
    }
    Ok(shown)
}

fn children(node: &Node) -> impl DoubleEndedIterator<Item = usize> {
    node.children.iter().flatten().map(gltf::json::Index::value)
}

/// Each node's way to the scene.
fn world_matrices(document: &Document) -> Result<Vec<Columns>, Fault> {
    let nodes = &document.root.nodes;
    let mut has_parent = vec![false; nodes.len()];
    for child in nodes.iter().flat_map(children) {
        document.node(child)?;
        has_parent[child] = true;
    }
    let mut world: Vec<Columns> = nodes.iter().map(local_matrix).collect();
    let mut open: Vec<usize> = (0..nodes.len()).filter(|&node| !has_parent[node]).collect();
    let mut done = vec![false; nodes.len()];
    while let Some(node) = open.pop() {
        if std::mem::replace(&mut done[node], true) {
            let problem = format!("node {node} has two parents: export the model anew");
            return Err(Fault::in_file(problem));
        }
        for child in children(&nodes[node]) {
            world[child] = product(&world[node], &world[child]);
            open.push(child);
        }
    }
    Ok(world)
}

/// How a skin puts its mesh into the scene, by its first joint; `None` of a node without a skin.
fn skin_matrix(
    document: &Document,
    store: &Store,
    world: &[Columns],
    node: usize,
) -> Result<Option<Columns>, Fault> {
    let Some(skin) = document.node(node)?.skin else {
        return Ok(None);
    };
    let skins = &document.root.skins;
    let skin = skins
        .get(skin.value())
        .ok_or_else(|| super::document::missing("skin", skin.value()))?;
    let Some(joint) = skin.joints.first().map(gltf::json::Index::value) else {
        return Ok(None);
    };
    document.node(joint)?;
    let Some(index) = skin.inverse_bind_matrices else {
        return Ok(Some(world[joint]));
    };
    let matrices = Accessor::of(document, store, index.value())?;
    if matrices.shape.components != 16 {
        return Err(super::document::accessor_fault(
            index.value(),
            "holds no matrices",
        ));
    }
    let first = matrices.numbers::<16>(store).first().copied();
    Ok(first.map(|inverse_bind| product(&world[joint], &inverse_bind)))
}

/// A node's own matrix, or the product of its translation, rotation and scale.
fn local_matrix(node: &Node) -> Columns {
    if let Some(matrix) = node.matrix {
        return matrix.map(f64::from);
    }
    let [tx, ty, tz] = node.translation.unwrap_or_default().map(f64::from);
    let [x, y, z, w] = node.rotation.unwrap_or_default().0.map(f64::from);
    let scale = node.scale.unwrap_or([1.0; 3]).map(f64::from);
    let rotation = [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y + z * w),
            2.0 * (x * z - y * w),
        ],
        [
            2.0 * (x * y - z * w),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z + x * w),
        ],
        [
            2.0 * (x * z + y * w),
            2.0 * (y * z - x * w),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ];
    let [a, b, c]: [[f64; 3]; 3] = std::array::from_fn(|i| rotation[i].map(|r| r * scale[i]));
    [
        a[0], a[1], a[2], 0.0, b[0], b[1], b[2], 0.0, c[0], c[1], c[2], 0.0, tx, ty, tz, 1.0,
    ]
}

fn product(a: &Columns, b: &Columns) -> Columns {
    std::array::from_fn(|at| {
        let (column, row) = (at / 4, at % 4);
        (0..4).map(|k| a[4 * k + row] * b[4 * column + k]).sum()
    })
}
