//! Divisions of the same graphs by ours, METIS and KaFFPa-strong.
//!
//! `problem.rs` is what is divided, `ours.rs`, `metis.rs` and `kaffpa.rs` are those who divide, `compared.rs` measures them side by side, `page.rs`
//! writes.

mod compared;
mod kaffpa;
mod metis;
mod ours;
mod page;
mod problem;

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use self::compared::ComparedDivision;
pub use self::ours::LoneDivision;
use crate::peers;

/// What to measure, and on what.
#[derive(Args)]
pub struct PartitionBench {
    /// METIS graph files, .graph or .graph.gz
    #[arg(long, value_name = "DIR")]
    pub graphs: PathBuf,
    /// Mesh files; the edges of some of them are graphs too
    #[arg(long, value_name = "DIR")]
    pub meshes: PathBuf,
    /// Times are medians over so many rounds
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub rounds: usize,
    /// Leave KaFFPa-strong out: it takes a hundred times as long as the others
    #[arg(long)]
    pub no_kaffpa: bool,
}

impl PartitionBench {
    /// Divides, and writes `results/partition.md` and `partition.csv`.
    pub fn run(&self) -> Result<()> {
        metis::check()?;
        let python = (!self.no_kaffpa).then(peers::prepare).and_then(|python| {
            let python = python.inspect_err(|missing| eprintln!("No KaFFPa: {missing:#}."));
            python.ok()
        });
        let rounds = self.rounds.max(1);
        let mut all = Vec::new();
        for problem in problem::problems(&self.graphs, &self.meshes)? {
            for &parts in problem.parts {
                let compared = ComparedDivision::of(&problem, parts, rounds, python.as_ref())?;
                println!("{}", compared.words());
                all.push(compared);
            }
        }
        page::write(&all, rounds)
    }
}
