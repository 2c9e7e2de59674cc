//! How the cost of ours grows with the number of patches, and with the number of pairs of one patch.

use std::path::Path;

use anyhow::{Context, Result};
use evaluation::{
    inputs::{mesh_files, named},
    table::Table,
};
use mesh_io::Asset;
use mhb_core::Laplacian;
use sigmark::mark::PatchCount;

use super::{
    ours::{ours, ours_alone},
    problem::{self, EigenProblem, HARMONICS},
    task::{EigenTask, SolveOutcome},
};

const TOLERANCE: f64 = 1e-6;

/// Rows of the first table: after so many patches, and after all.
const PATCHES: [usize; 4] = [4, 8, 16, 24];

/// Rows of the second: from a watermark's to those of Laplacian basis functions.
const COUNTS: [usize; 4] = [325, 1000, 2500, 5000];

const GIBIBYTE: f64 = (1u64 << 30) as f64;

/// Both tables, of one mesh in `patches` patches.
pub(crate) fn tables(meshes: &Path, name: &str, patches: usize, folder: &Path) -> Result<[Table; 2]> {
    let files = mesh_files(meshes)?;
    let file = named(&files, name).context("the mesh that the scaling needs is missing")?;
    let patches = problem::cut(Asset::open(file)?.mesh(), PatchCount::Exactly(patches))?;
    let largest = EigenProblem::new(&format!("{name}_patch"), &patches[0], folder)?;
    Ok([against_patches(name, &patches)?, against_pairs(name, &largest)?])
}

/// One patch after the other on one thread, assembly included; sums on the way.
fn against_patches(name: &str, patches: &[mesh::TriMesh]) -> Result<Table> {
    let header = "patches | vertices | CPU (s) | CPU per patch (s) | CPU per vertex (µs) | worst residual";
    let title = format!("Against the number of patches: {name}, {HARMONICS} pairs a patch, {TOLERANCE:e}");
    let mut table = Table::new(&title, header.split(" | "));
    let task = EigenTask {
        count: HARMONICS,
        tolerance: TOLERANCE,
    };
    let (mut vertices, mut cpu, mut worst) = (0, 0.0, 0.0f64);
    for (index, patch) in patches.iter().enumerate() {
        let outcome = ours(&Laplacian::cotangent(patch)?, task, 1)?;
        println!("{name}, patch {}: {outcome}", index + 1);
        if let SolveOutcome::Done {
            cpu: own, residual, ..
        } = outcome
        {
            vertices += patch.vertex_count();
            cpu += own;
            worst = worst.max(residual);
        }
        let done = index + 1;
        if PATCHES.contains(&done) || done == patches.len() {
            table.row([
                done.to_string(),
                vertices.to_string(),
                format!("{cpu:.1}"),
                format!("{:.2}", cpu / done as f64),
                format!("{:.1}", 1e6 * cpu / vertices as f64),
                format!("{worst:.1e}"),
            ]);
        }
    }
    Ok(table)
}

/// Each count in a process of its own, whose memory the system counts.
fn against_pairs(name: &str, largest: &EigenProblem) -> Result<Table> {
    let header =
        "pairs | CPU (s) | CPU per pair (ms) | wall (s) | peak memory (GiB) | peak / basis | worst residual";
    let title = format!(
        "Against the number of pairs: the largest patch of {name}, {} vertices, {TOLERANCE:e}",
        largest.size()
    );
    let mut table = Table::new(&title, header.split(" | "));
    for count in COUNTS.into_iter().filter(|&count| 4 * count <= largest.size()) {
        let task = EigenTask {
            count,
            tolerance: TOLERANCE,
        };
        let (outcome, peak) = ours_alone(largest, task)?;
        println!("{}: {count} pairs: {outcome}", largest.name);
        let SolveOutcome::Done { cpu, wall, residual } = outcome else {
            continue;
        };
        let basis = (count * largest.size() * size_of::<f64>()) as f64;
        let memory = |unit: f64| peak.map_or_else(String::new, |peak| format!("{:.2}", peak as f64 / unit));
        table.row([
            count.to_string(),
            format!("{cpu:.1}"),
            format!("{:.2}", 1e3 * cpu / count as f64),
            format!("{wall:.1}"),
            memory(GIBIBYTE),
            memory(basis),
            format!("{residual:.1e}"),
        ]);
    }
    Ok(table)
}
