//! Libraries: how often the original of an attacked model is among the first ten of very many, how long it takes, and what strangers' models bring up.
//!
//! `models.rs` makes originals, `suspects.rs` attacks them, `built.rs` has the library, `trials.rs` asks it, `page.rs` writes.

mod built;
mod draw;
mod models;
mod page;
mod suspects;
mod trials;

use std::{path::PathBuf, thread};

use anyhow::Result;
use clap::Args;
use job::Job;

/// What to search in, and for what.
#[derive(Args)]
pub struct LibraryBench {
    /// Mesh files
    #[arg(long, value_name = "DIR")]
    pub meshes: PathBuf,
    /// More mesh files, such as assets of artists
    #[arg(long, value_name = "DIR")]
    pub assets: Option<PathBuf>,
    /// Originals in the library
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    pub size: usize,
    /// Suspects of each attack
    #[arg(long, value_name = "N", default_value_t = 300)]
    pub suspects: usize,
    /// Suspects that are in no library
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    pub strangers: usize,
    /// Of candidates that strangers bring up, so many are aligned and read
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub read: usize,
    /// Only attacks in whose names this is; may be given again
    #[arg(long, value_name = "TEXT")]
    pub only: Vec<String>,
    /// Take suspects of the models on which thresholds were chosen, and write no page
    #[arg(long)]
    pub tune: bool,
}

/// How many candidates count.
const FIRST: usize = 10;

impl LibraryBench {
    /// Makes the library, asks it, and writes `results/library.md` and its CSV files.
    pub fn run(&self) -> Result<()> {
        let job = Job::new(thread::available_parallelism().map_or(1, usize::from));
        let mut folders = vec![self.meshes.as_path()];
        folders.extend(self.assets.as_deref());
        let bases = models::bases(&folders, &job)?;
        let built = built::library(&bases, self.size, &job)?;
        println!("{}", serde_json::to_string(&built.figures)?);
        let found = trials::attacked(&bases, &built, self, &job)?;
        let strangers = trials::strangers(&bases, &built, self, &job)?;
        if self.tune {
            return Ok(());
        }
        let speed = trials::speed(&bases)?;
        page::write(self, &bases, &built.figures, &found, &strangers, &speed)
    }
}
