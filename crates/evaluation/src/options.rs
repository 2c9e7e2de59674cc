use std::{path::PathBuf, time::Duration};

use clap::Args;

use crate::process::root;

/// What to reproduce, and where the pages go.
#[derive(Args)]
pub struct Options {
    /// Where the tables go; results/quick without it, or results/ with --full
    #[arg(long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// All six models; needs --meshes
    #[arg(long, requires = "meshes")]
    pub full: bool,
    /// The folder with the models' meshes
    #[arg(long, value_name = "DIR", requires = "full")]
    pub meshes: Option<PathBuf>,
    /// Only these models, by the paper's name or the file's; may be given again. A full run can be made in such pieces: what they finish is kept, and one
    /// without this option then writes it all into one set of pages, if all of it is by the same code
    #[arg(long, value_name = "MODEL", requires = "full")]
    pub only: Vec<String>,
    /// Only these algorithms: mhb, lbf, rbf, sigmark, sigmark-tag, or with --full others, too; may be given again
    #[arg(long, value_name = "NAME")]
    pub algorithm: Vec<String>,
    /// How many signatures each figure is a mean over
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub signatures: usize,
    /// Take finished work that another version of the code did; the page then says how much of it there is
    #[arg(long)]
    pub keep: bool,
    /// Begin nothing after so many minutes, and write what there is; 0: what was finished before
    #[arg(long, value_name = "N")]
    pub minutes: Option<u64>,
}

impl Options {
    pub(crate) fn folder(&self) -> PathBuf {
        let usual = if self.full { "results" } else { "results/quick" };
        self.output.clone().unwrap_or_else(|| root().join(usual))
    }

    /// When no more work begins.
    pub(crate) fn closing(&self) -> Option<Duration> {
        self.minutes.map(|minutes| Duration::from_secs(60 * minutes))
    }
}
