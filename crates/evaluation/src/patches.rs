//! What a patch of a real mesh has to be: small enough, in one piece, and whole up to its border.

use std::path::Path;

use anyhow::{Context, Result};
use job::Job;
use mesh::{Components, Edges, TriMesh, components};
use sigmark::mark::{Patch, PatchCount, Patches};

use crate::meshes::{Checked, check_files};

/// The paper's number of manifold harmonics.
const FUNCTIONS: usize = 325;

/// Components with fewer vertices stay unmarked.
const LEAST: usize = 2 * FUNCTIONS;

/// The paper's patches have fewer vertices.
const LIMIT: usize = 30_000;

/// Cuts every mesh file below a folder into patches, and says what is not as it should be.
pub fn run(folder: &Path) -> Result<()> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    check_files(folder, |asset| {
        let mesh = asset.mesh();
        let parts = components(mesh);
        let counted = format!("components {}, ", parts.count);
        let patches = Patches::cut(mesh, FUNCTIONS, PatchCount::Paper, &Job::new(threads))
            .with_context(|| format!("{counted}not cut"))?;
        let failed = check(mesh, &parts, &patches).unwrap_or_else(|error| vec![format!("{error:#}")]);
        Ok(Checked {
            what: format!("{counted}{}; ", described(&patches)),
            failed,
            ..Checked::default()
        })
    })
}

fn described(patches: &Patches) -> String {
    let sizes = || patches.iter().map(|patch| patch.vertices().len());
    format!(
        "patches {} of {} to {} vertices, unmarked vertices {}",
        patches.len(),
        sizes().min().unwrap_or(0),
        sizes().max().unwrap_or(0),
        patches.unmarked_vertices()
    )
}

/// What is not as it should be.
fn check(mesh: &TriMesh, parts: &Components, patches: &Patches) -> Result<Vec<String>> {
    let mut failed = Vec::new();
    let pieces = pieces_by_edges(mesh.triangles());
    let inside = triangles_by_patch(mesh, patches);
    for (index, patch) in patches.iter().enumerate() {
        let number = index + 1;
        let vertices = patch.vertices().len();
        if vertices >= LIMIT {
            failed.push(format!("patch {number} has {vertices} vertices"));
        }
        if components(patch.mesh()).count != 1 {
            failed.push(format!("patch {number} is in pieces"));
        }
        if inside[index].len() != patch.mesh().triangle_count() {
            failed.push(format!("patch {number} lacks triangles that its labels cover"));
            continue;
        }
        let slivers = cut_off(patch, &pieces, &inside[index]);
        if slivers > 0 {
            failed.push(format!(
                "{slivers} triangles of patch {number} hang by single vertices"
            ));
        }
    }
    let labels = patches.labels();
    if Patches::from_labels(mesh, labels)?.labels() != labels {
        failed.push("the labels do not describe the patches".into());
    }
    let mut marked = vec![false; parts.count];
    for (&label, &component) in labels.iter().zip(&parts.of_vertex) {
        marked[component as usize] |= label > 0;
    }
    let wrongly = (0..parts.count)
        .filter(|&c| marked[c] != (parts.sizes[c] >= LEAST))
        .count();
    if wrongly > 0 {
        failed.push(format!(
            "{wrongly} components are marked and too small, or neither"
        ));
    }
    let inside = stranded(mesh, parts, labels);
    if inside > 0 {
        failed.push(format!("{inside} unmarked vertices lie at no border"));
    }
    Ok(failed)
}

/// The mesh's triangles whose corners all bear the label of each patch.
fn triangles_by_patch(mesh: &TriMesh, patches: &Patches) -> Vec<Vec<u32>> {
    let mut inside = vec![Vec::new(); patches.len()];
    for (t, corners) in (0..).zip(mesh.triangles()) {
        let [a, b, c] = corners.map(|v| patches.labels()[v as usize]);
        if a == b && b == c && a > 0 {
            inside[a as usize - 1].push(t);
        }
    }
    inside
}

/// Triangles that the border cut off from the largest part of the patch but for single vertices: no chain of common edges joins
/// them inside the patch, while one does in the mesh. `pieces` are the mesh's, `inside` the mesh's triangles of the patch.
fn cut_off(patch: &Patch, pieces: &[u32], inside: &[u32]) -> usize {
    let own = pieces_by_edges(patch.mesh().triangles());
    let mut sizes = vec![0; own.len()];
    own.iter().for_each(|&piece| sizes[piece as usize] += 1);
    let most = (0..own.len())
        .max_by_key(|&t| sizes[own[t] as usize])
        .unwrap_or(0);
    let whole = |t: usize| pieces[inside[t] as usize];
    (0..own.len())
        .filter(|&t| own[t] != own[most] && whole(t) == whole(most))
        .count()
}

/// For each triangle a number that it shares with those that a chain of common edges joins it to.
fn pieces_by_edges(triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut edges: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * triangles.len());
    for (t, &[a, b, c]) in (0..).zip(triangles) {
        edges.extend([[a, b], [b, c], [c, a]].map(|[a, b]| ([a.min(b), a.max(b)], t)));
    }
    edges.sort_unstable();
    let mut root: Vec<u32> = (0..triangles.len() as u32).collect();
    for pair in edges.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        let [a, b] = [find(&mut root, pair[0].1), find(&mut root, pair[1].1)];
        root[a as usize] = b;
    }
    (0..triangles.len() as u32).map(|t| find(&mut root, t)).collect()
}

/// The representative, with paths halved on the way.
fn find(root: &mut [u32], mut t: u32) -> u32 {
    while root[t as usize] != t {
        root[t as usize] = root[root[t as usize] as usize];
        t = root[t as usize];
    }
    t
}

/// Unmarked vertices of components that are large enough, none of whose neighbours is marked otherwise.
fn stranded(mesh: &TriMesh, parts: &Components, labels: &[u32]) -> usize {
    let mut at_border = vec![false; labels.len()];
    for &[a, b] in Edges::of(mesh).vertices() {
        if labels[a as usize] != labels[b as usize] {
            at_border[a as usize] = true;
            at_border[b as usize] = true;
        }
    }
    let large = |v: usize| parts.sizes[parts.of_vertex[v] as usize] >= LEAST;
    (0..labels.len())
        .filter(|&v| labels[v] == 0 && large(v) && !at_border[v])
        .count()
}
