//! Meshes and graphs that are read or made up.

use std::{
    fs,
    io::Read,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use flate2::read::MultiGzDecoder;
use mesh::{TriMesh, shapes};
use mesh_io::Format;
use partition::{Graph, read_metis};

/// An irregular closed surface of at least `vertices` vertices, and fewer than four times as many. Deterministic.
pub fn surface(vertices: usize) -> TriMesh {
    let level = (0..12)
        .find(|&level| 10 * 4usize.pow(level) + 2 >= vertices)
        .unwrap_or(12);
    shapes::bumpy_sphere(level, 1)
}

/// The mesh files of a folder, by name. Folders in it are not searched.
pub fn mesh_files(folder: &Path) -> Result<Vec<PathBuf>> {
    files(folder, |path| Format::of_path(path).is_some())
}

/// The mesh files below a folder, by name.
pub fn mesh_files_below(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(mesh_files_below(&path)?);
        } else if Format::of_path(&path).is_some() {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// The METIS graph files of a folder, `.graph` or `.graph.gz`, by name.
pub fn graph_files(folder: &Path) -> Result<Vec<PathBuf>> {
    files(folder, |path| {
        let name = path.to_string_lossy();
        name.ends_with(".graph") || name.ends_with(".graph.gz")
    })
}

fn files(folder: &Path, wanted: impl Fn(&Path) -> bool) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        if path.is_file() && wanted(&path) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// The file's name up to its first point, as it stands in the tables.
pub fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.split('.').next().unwrap_or_default().to_string()
}

/// Whether a name begins as one of these; any name does where none is asked for.
pub fn is_chosen(name: &str, beginnings: &[String]) -> bool {
    beginnings.is_empty() || beginnings.iter().any(|wanted| name.starts_with(wanted.as_str()))
}

/// The file that has this name, of its end apart. Where there is none, that is said.
pub fn named<'a>(files: &'a [PathBuf], name: &str) -> Option<&'a PathBuf> {
    let found = files.iter().find(|path| name_of(path) == name);
    if found.is_none() {
        eprintln!("no file {name}, left out");
    }
    found
}

/// Reads a METIS graph file, gzipped or not.
pub fn read_graph(path: &Path) -> Result<Graph> {
    let shown = || path.display().to_string();
    let bytes = fs::read(path).with_context(shown)?;
    let mut text = String::new();
    if bytes.starts_with(&[0x1f, 0x8b]) {
        MultiGzDecoder::new(bytes.as_slice()).read_to_string(&mut text)
    } else {
        bytes.as_slice().read_to_string(&mut text)
    }
    .with_context(shown)?;
    read_metis(&text).with_context(shown)
}

/// The graph of a mesh's vertices and edges, all weights 1.
pub fn edge_graph(mesh: &TriMesh) -> Result<Graph> {
    let neighbours = mesh.neighbours();
    Ok(Graph::new(
        neighbours.offsets().to_vec(),
        neighbours.entries().to_vec(),
        None,
        None,
    )?)
}
