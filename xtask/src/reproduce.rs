//! `cargo xtask reproduce`

use std::{path::PathBuf, time::Duration};

use anyhow::Result;
use clap::Args;
use evaluation::{process::root, reproduce};

#[derive(Args)]
pub(crate) struct Reproduce {
    /// Where the tables go; results/quick without it, or results/ with --full
    #[arg(long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// All six models; needs --meshes
    #[arg(long, requires = "meshes")]
    full: bool,
    /// The folder with the models' meshes
    #[arg(long, value_name = "DIR", requires = "full")]
    meshes: Option<PathBuf>,
    /// Only these models, by the paper's name or the file's; may be given again
    #[arg(long, value_name = "MODEL", requires = "full")]
    only: Vec<String>,
    /// Only these algorithms: mhb, lbf, rbf, or with --full others, too; may be given again
    #[arg(long, value_name = "NAME")]
    algorithm: Vec<String>,
    /// How many signatures each figure is a mean over
    #[arg(long, value_name = "N", default_value_t = 3)]
    signatures: usize,
    /// Take finished work that another version of the code did; the page then says how much of it there is
    #[arg(long)]
    keep: bool,
    /// Begin nothing after so many minutes, and write what there is; 0: what was finished before
    #[arg(long, value_name = "N")]
    minutes: Option<u64>,
}

impl Reproduce {
    pub(crate) fn run(self) -> Result<()> {
        let usual = if self.full { "results" } else { "results/quick" };
        reproduce::run(&reproduce::Options {
            output: self.output.unwrap_or_else(|| root().join(usual)),
            meshes: self.meshes,
            only: self.only,
            algorithms: self.algorithm,
            signatures: self.signatures,
            keep: self.keep,
            closing: self.minutes.map(|minutes| Duration::from_secs(60 * minutes)),
        })
    }
}
