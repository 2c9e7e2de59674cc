//! The whole way of a million vertices back onto a million vertices, in seconds and bytes.

use std::{path::PathBuf, thread};

use anyhow::Result;
use evaluation::{
    attacks::{Attack, random_similarity},
    inputs::named,
    machine::{forget_peak_memory, peak_memory},
    python::Python,
    table::Table,
};
use job::Job;
use mesh::{TriMesh, shapes};
use mesh_io::Asset;
use registration::{AlignOptions, ResampleOptions, align, resample};

use super::trial;
use crate::{measure::timed, suspects::attacked};

const MESH: &str = "ct_skull_1081k_closed";

/// Of the attacks, those that say something about time.
const SUSPECTS: [&str; 5] = ["crop:100", "crop:50", "noise:0.5", "simplify:5", "remesh:100"];

/// A table, and what it says; nothing where the mesh is not there.
pub(crate) fn run(files: &[PathBuf], attacks: &Python) -> Result<String> {
    let Some(path) = named(files, MESH) else {
        return Ok(String::new());
    };
    let original = Asset::open(path)?.mesh().clone();
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let header = "attack | vertices | alignment (s) | resampling (s) | both (s) | peak memory (MiB)";
    let mut table = Table::new("A million vertices", header.split(" | "));
    let attacked = trial::attacks().iter();
    for attack in attacked.filter(|attack| SUSPECTS.contains(&attack.spec.as_str())) {
        table.row(row(&original, attack, attacks, threads)?);
    }
    Ok(format!(
        "{}\nWall time with {threads} threads, from two meshes in memory to the suspect sampled at every vertex of {MESH} ({} vertices), search structures included. Memory is that of the process, \
         with both meshes.\n\n",
        table.markdown(),
        original.vertex_count()
    ))
}

fn row(original: &TriMesh, attack: &Attack, attacks: &Python, threads: usize) -> Result<[String; 6]> {
    let suspect = attacked(attacks, original, MESH, &attack.spec, 0)?;
    let suspect = shapes::moved(&suspect, &random_similarity(original, 1));
    forget_peak_memory();
    let (found, aligning) = timed(|| align(original, &suspect, &AlignOptions::default(), &Job::new(threads)));
    let transform = found?.transform;
    let (seen, resampling) = timed(|| {
        let (options, job) = (ResampleOptions::default(), Job::new(threads));
        resample(original, &suspect, &transform, &options, &job)
    });
    seen?;
    let memory = peak_memory().map_or_else(String::new, |bytes| (bytes >> 20).to_string());
    Ok([
        attack.name.clone(),
        suspect.vertex_count().to_string(),
        format!("{:.1}", aligning.wall),
        format!("{:.1}", resampling.wall),
        format!("{:.1}", aligning.wall + resampling.wall),
        memory,
    ])
}
