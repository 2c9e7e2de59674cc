//! Formats: a signed model goes through other programs and comes back in another format, quantised, re-ordered, without indices; and parts of it
//! come back alone. Is it found? And does one see that it is signed, where it is drawn as people draw it?

mod converters;
mod npm;
mod page;
mod painter;
mod trial;

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::Args;
use evaluation::inputs::{is_chosen, name_of};
use mesh_io::Format;

use self::{
    converters::Converters,
    painter::{Drawn, Painter},
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
    /// Only draw the models before and after; of what other programs make of them the page keeps what it says
    #[arg(long)]
    pub drawn_only: bool,
    /// Write the pictures into this folder, too, in a folder for each model
    #[arg(long, value_name = "DIR")]
    pub pictures: Option<PathBuf>,
}

/// A model, and what came of it.
struct Row {
    name: String,
    /// Why it can't be signed.
    refused: Option<String>,
    /// What was tried with the signed one; not where it was to be drawn alone.
    tried: Option<Tried>,
    /// How its pictures differ, or why it can't be drawn; `None` where nothing draws it.
    drawn: Option<Result<Drawn, String>>,
}

struct Tried {
    vertices: usize,
    marked_parts: usize,
    /// Whether a glTF, GLB or OBJ differs in anything but positions; `None` of other formats.
    outside_positions: Option<String>,
    /// What Khronos' validator finds that it did not find before; `None` where it can't be asked.
    new_issues: Option<Vec<String>>,
    trials: Vec<Trial>,
    /// The signed model, verified with what the programs made of its original.
    of_originals: Vec<Trial>,
}

impl FormatsBench {
    /// Signs each model, draws it before and after, takes it through every program that there is, and verifies what comes back; writes
    /// `results/formats.md`, `formats.csv` and `formats-drawn.csv`.
    ///
    /// # Errors
    /// Where a model can't be drawn, too, when all is written.
    pub fn run(&self) -> Result<()> {
        let folder = kept::folder("formats")?;
        let npm = npm::install(&folder.join("npm"));
        let painter = Painter::find(&npm);
        if let Err(error) = &painter {
            println!("pictures are not compared: {error:#}");
            if self.drawn_only {
                bail!("there is nothing else to do");
            }
        }
        let converters = match self.drawn_only {
            true => None,
            false => Some(Converters::prepare(&folder, &npm)?),
        };
        let rows = self.rows(&folder, painter.as_ref().ok(), converters.as_ref())?;
        page::write(&rows, &painter, converters.as_ref())?;
        let failed = |row: &&Row| matches!(row.drawn, Some(Err(_)));
        match rows.iter().filter(failed).count() {
            0 => Ok(()),
            count => bail!("{count} models can't be drawn: the page says why"),
        }
    }

    fn rows(
        &self,
        folder: &Path,
        painter: Option<&Painter>,
        converters: Option<&Converters>,
    ) -> Result<Vec<Row>> {
        let mut rows = Vec::new();
        for path in models(&self.assets)? {
            let name = name_of(&path);
            if !is_chosen(&name, &self.only) {
                continue;
            }
            println!("{name}");
            let signed = SignedAsset::make(&path, folder);
            let painter = painter.filter(|_| Painter::knows(&path));
            let pictures = self.pictures.as_ref().map(|folder| folder.join(&name));
            let (refused, tried, drawn) = match &signed {
                Ok(signed) => (
                    None,
                    converters.map(|all| signed.try_all(all)).transpose()?,
                    painter.map(|painter| painter.draw(signed, pictures.as_deref())),
                ),
                Err(error) => (Some(in_short(error)), None, None),
            };
            rows.push(Row {
                name,
                refused,
                tried,
                drawn,
            });
        }
        if rows.is_empty() {
            bail!("{}: holds no model that was asked for", self.assets.display());
        }
        Ok(rows)
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
