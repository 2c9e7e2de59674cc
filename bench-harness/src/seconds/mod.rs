//! What one waits for when a large mesh is signed and verified: the program itself, as people run it, with the layout that is the default
//! and with the paper's.
//!
//! `program.rs` runs the program and watches it, `files.rs` has the meshes that it reads, `runs.rs` what is timed; `page.rs` writes.

mod files;
mod page;
mod program;
mod runs;

use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::Args;
use evaluation::{
    inputs::{is_chosen, mesh_files, name_of},
    python::Python,
    sources,
};
use mesh::shapes;
use mesh_io::Asset;

use self::{
    program::Sigmark,
    runs::{Layout, MeshRuns},
};
use crate::kept::{self, Key};

/// From so many vertices on a mesh is measured without being asked for, and one round has to do.
const MANY: usize = 1_000_000;

/// Rounds of smaller meshes, whose seconds are few enough to differ.
const ROUNDS: usize = 3;

/// The strongest decimation leaves so many per cent of the triangles; of a mesh whose triangles were divided fast-simplification leaves more than one.
const LEAST: u32 = 1;
const LEAST_OF_DIVIDED: u32 = 5;

/// Which meshes, and how often.
#[derive(Args)]
pub struct SecondsBench {
    /// Mesh files
    #[arg(long, value_name = "DIR")]
    pub meshes: PathBuf,
    /// Only files whose name begins so; may be given again [default: those with a million vertices or more]
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Times are medians over so many rounds [default: 1 from a million vertices on, else 3]
    #[arg(long, value_name = "N")]
    pub rounds: Option<usize>,
}

impl SecondsBench {
    /// Measures each mesh, and the same surface with four times as many triangles; writes `results/seconds.md` and `seconds.csv`.
    pub fn run(&self) -> Result<()> {
        let program = Sigmark::beside_this_program()?;
        let attacks = Python::prepare()?;
        // Of the program, too: it may be older than the sources.
        let both = sources::digest_of_all_but(&NO_PART)? + &program.digest()?;
        let code = sources::digest(both.as_bytes());
        let figures = kept::folder(&format!("seconds/{code}"))?;
        let mut all = Vec::new();
        for file in mesh_files(&self.meshes)? {
            let name = name_of(&file);
            if !is_chosen(&name, &self.only) {
                continue;
            }
            let mesh = Asset::open(&file)?.mesh().clone();
            if self.only.is_empty() && mesh.vertex_count() < MANY {
                continue;
            }
            let divided = shapes::divided(&mesh);
            // The paper's layout reads every patch: once is enough to compare with.
            for (name, mesh, layouts, least) in [
                (name.clone(), mesh, &[Layout::Default, Layout::Paper][..], LEAST),
                (
                    format!("{name}_divided"),
                    divided,
                    &[Layout::Default],
                    LEAST_OF_DIVIDED,
                ),
            ] {
                let key = Key::new(&code).of_mesh(&mesh).to_string();
                let runs = MeshRuns {
                    program: &program,
                    attacks: &attacks,
                    figures: &figures,
                    rounds: self.rounds_of(mesh.vertex_count()),
                    vertices: mesh.vertex_count(),
                    files: files::MeshFiles::of(&name, mesh, &key)?,
                    name,
                    key,
                    least,
                };
                all.extend(runs.all(layouts)?);
            }
        }
        ensure!(
            !all.is_empty(),
            "{}: no such mesh file there",
            self.meshes.display()
        );
        page::write(&all, &attacks, &code)
    }

    fn rounds_of(&self, vertices: usize) -> usize {
        let usual = if vertices < MANY { ROUNDS } else { 1 };
        self.rounds.unwrap_or(usual).max(1)
    }
}

/// What has no part in the figures.
const NO_PART: [&str; 12] = [
    "crates/baselines",
    "crates/cli/tests",
    "crates/evaluation/src/pages",
    "crates/evaluation/src/study",
    "crates/sigmark/tests",
    "bench-harness/src/eigen",
    "bench-harness/src/partition",
    "bench-harness/src/quality",
    "bench-harness/src/registration",
    "bench-harness/src/security",
    "bench-harness/src/visibility",
    "bench-harness/src/seconds/page.rs",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_part_is_there() {
        kept::assert_is_there(&NO_PART);
    }
}
