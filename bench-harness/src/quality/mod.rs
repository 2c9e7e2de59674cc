//! Metrics of the same meshes by ours and by the peers: distances beside MeshLab's filter, Shape-DNA beside scipy and LaPy.
//!
//! `inputs.rs` is what is measured, `distances.rs` and `shape_dna.rs` measure and tabulate, `page.rs` writes.

mod distances;
mod inputs;
mod page;
mod shape_dna;

use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::Args;
use evaluation::inputs::{is_chosen, mesh_files, name_of};
use mesh_io::Asset;

use self::{distances::ComparedDistance, inputs::SharedMesh, shape_dna::ComparedSpectra};
use crate::{kept, peers};

/// The peers need minutes for larger meshes.
const LARGEST: usize = 140_000;

/// What to measure, and on what.
#[derive(Args)]
pub struct QualityBench {
    /// Mesh files; those with more than 140 000 vertices are passed over
    #[arg(long, value_name = "DIR")]
    pub meshes: PathBuf,
    /// Only files whose name begins so; may be given again
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Times are medians over so many rounds
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub rounds: usize,
}

impl QualityBench {
    /// Measures, and writes `results/quality.md`, `quality_distances.csv` and `quality_shape_dna.csv`.
    /// Without Python there are no peers, which is said.
    pub fn run(&self) -> Result<()> {
        let folder = kept::folder("quality")?;
        let rounds = self.rounds.max(1);
        let python = peers::prepare().inspect_err(|missing| eprintln!("No peers: {missing:#}."));
        let python = python.ok();
        let (mut distances, mut spectra) = (Vec::new(), Vec::new());
        for path in mesh_files(&self.meshes)? {
            let name = name_of(&path);
            if !is_chosen(&name, &self.only) {
                continue;
            }
            let mesh = Asset::open(&path)?.mesh().clone();
            if mesh.vertex_count() > LARGEST {
                println!("{name}: too large for the peers, passed over");
                continue;
            }
            let original = SharedMesh::new(name, mesh, &folder)?;
            for distorted in original.distorted(&folder) {
                let python = python.as_ref();
                let compared = ComparedDistance::of(&distorted?, &original, python, rounds)?;
                println!("{}", compared.words());
                distances.push(compared);
            }
            let compared = ComparedSpectra::of(&original, python.as_ref(), rounds)?;
            println!("{}", compared.words());
            spectra.push(compared);
        }
        let shown = self.meshes.display();
        ensure!(
            !spectra.is_empty(),
            "{shown}: no mesh file there has a name that was asked for"
        );
        page::write(&distances, &spectra, rounds, python.as_ref())
    }
}
