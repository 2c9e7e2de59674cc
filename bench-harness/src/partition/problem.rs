//! The graphs that are divided, and into how many parts.

use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use evaluation::inputs::{edge_graph, graph_files, mesh_files, name_of, named, read_graph};
use job::Job;
use mesh_io::Asset;
use partition::{Effort, Graph, Options, Partition, write_metis};

use crate::{
    kept::{self, Key},
    results,
};

/// METIS' default, and the bound of all divisions here.
pub(crate) const IMBALANCE: f64 = 0.03;

const PARTS: [usize; 6] = [2, 4, 8, 16, 32, 64];

/// Meshes have their own numbers of parts.
const MESH_PARTS: [(&str, &[usize]); 5] = [
    ("stanford_bunny_closed_35k", &[2, 8, 32]),
    ("igea_134k", &[5, 16]),
    ("ct_skull_179k_boundary", &[6, 16]),
    ("dragon_vrip_438k", &[16, 64]),
    ("ct_skull_1081k_closed", &[33, 128]),
];

/// A graph, and where METIS reads it.
pub(crate) struct GraphProblem {
    pub(crate) name: String,
    /// What tells it from others of its name.
    pub(crate) key: Key,
    pub(crate) graph: Graph,
    pub(crate) file: PathBuf,
    pub(crate) parts: &'static [usize],
    /// Whether its edges are those of a mesh; KaFFPa-strong would take hours for these.
    pub(crate) is_mesh: bool,
}

impl GraphProblem {
    /// A division by its list of parts, judged by our code, whoever made it.
    pub(crate) fn judged(&self, part_of: &str, parts: usize) -> Result<Partition> {
        let part_of = part_of.split_ascii_whitespace().map(str::parse);
        let part_of: Vec<u32> = part_of.collect::<Result<_, _>>()?;
        let (options, job) = (options(parts, Effort::Default), Job::default());
        Ok(Partition::evaluate(&self.graph, part_of, &options, &job)?)
    }
}

/// Options for so many parts.
pub(crate) fn options(parts: usize, effort: Effort) -> Options {
    Options {
        parts,
        imbalance: IMBALANCE,
        effort,
        ..Default::default()
    }
}

/// All graphs of the one folder, and some meshes of the other.
pub(crate) fn problems(graphs: &Path, meshes: &Path) -> Result<Vec<GraphProblem>> {
    let folder = kept::folder("partition")?;
    let mut problems = Vec::new();
    let mut add = |name: String, graph: Graph, parts, is_mesh| {
        let text = write_metis(&graph);
        let key = Key::new(name.as_str()).of(text.as_bytes());
        let file = folder.join(format!("{key}.graph"));
        results::write(&file, text)?;
        problems.push(GraphProblem {
            name,
            key,
            graph,
            file,
            parts,
            is_mesh,
        });
        anyhow::Ok(())
    };
    for path in graph_files(graphs)? {
        add(name_of(&path), read_graph(&path)?, &PARTS, false)?;
    }
    let mesh_files = mesh_files(meshes)?;
    for (name, parts) in MESH_PARTS {
        let Some(path) = named(&mesh_files, name) else {
            continue;
        };
        add(name.into(), edge_graph(Asset::open(path)?.mesh())?, parts, true)?;
    }
    ensure!(
        !problems.is_empty(),
        "no graphs: give folders with METIS graph files and mesh files"
    );
    Ok(problems)
}
