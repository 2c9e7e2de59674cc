//! Formats: a signed model goes through other programs and comes back in another format, quantised, re-ordered, without indices; and parts of it
//! come back alone. Is it found?

mod converters;
mod page;
mod trial;

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;
use evaluation::inputs::{is_chosen, name_of};
use mesh_io::Format;

use self::{
    converters::Converters,
    trial::{SignedAsset, Trial, in_short},
};
use crate::kept;

/// Which models.
#[derive(Args)]
pub struct FormatsBench {
    /// A folder of models, with folders in it
    #[arg(long, value_name = "DIR")]
    pub assets: PathBuf,
    /// Only files whose name begins so; may be given again
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
}

/// A model, and what came of it.
struct Row {
    name: String,
    /// Why it can't be signed, or what was tried with the signed one.
    tried: Result<Tried, String>,
}

struct Tried {
    vertices: usize,
    marked_parts: usize,
    /// Whether a GLB differs in anything but positions; `None` of other formats.
    outside_positions: Option<String>,
    /// What Khronos' validator finds that it did not find before; `None` where it can't be asked.
    new_issues: Option<Vec<String>>,
    trials: Vec<Trial>,
}

impl FormatsBench {
    /// Signs each model, takes it through every program that there is, and verifies what comes back; writes `results/formats.md` and `formats.csv`.
    pub fn run(&self) -> Result<()> {
        let folder = kept::folder("formats")?;
        let converters = Converters::prepare(&folder)?;
        let mut rows = Vec::new();
        for path in models(&self.assets)? {
            let name = name_of(&path);
            if !is_chosen(&name, &self.only) {
                continue;
            }
            println!("{name}");
            let tried = match SignedAsset::make(&path, &folder) {
                Ok(signed) => Ok(signed.try_all(&converters)?),
                Err(error) => Err(in_short(&error)),
            };
            rows.push(Row { name, tried });
        }
        if rows.is_empty() {
            bail!("{}: holds no model that was asked for", self.assets.display());
        }
        page::write(&rows, &converters)
    }
}

/// The models in a folder and in the folders in it, by their names.
fn models(folder: &PathBuf) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            found.append(&mut models(&path)?);
        } else if Format::of_path(&path).is_some() {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}
