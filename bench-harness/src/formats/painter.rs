//! Models drawn before and after they were signed: by three.js, in Chromium without its window.

use std::{
    collections::BTreeMap,
    env,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, bail};
use evaluation::process::output;
use serde::Deserialize;

use super::trial::{SignedAsset, in_short};

/// Chromium, and the script that draws in it.
pub(super) struct Painter {
    npm: PathBuf,
    chromium: String,
    version: String,
}

/// How far pictures differ in each light.
#[derive(Deserialize)]
pub(super) struct Drawn {
    pub(super) lights: BTreeMap<String, Compared>,
}

/// What is held against the picture of the original.
#[derive(Deserialize)]
pub(super) struct Compared {
    /// The picture of the signed model.
    pub(super) signed: Difference,
    /// The same picture, as it comes out of a JPEG of quality 90.
    pub(super) jpeg: Difference,
}

/// The difference of two pictures where they show the model: of each pixel the channel that differs most, of 255.
#[derive(Deserialize)]
pub(super) struct Difference {
    pub(super) mean: f64,
    /// One pixel in a thousand differs by more.
    pub(super) p999: u8,
    pub(super) max: u8,
    /// Of pixels that look different to pixelmatch.
    pub(super) share: f64,
}

impl Painter {
    /// `npm` is where its packages are, or why there are none.
    ///
    /// # Errors
    /// Without the packages or Chromium; says how to get it.
    pub(super) fn find(npm: &Result<PathBuf>) -> Result<Self> {
        let Ok(npm) = npm else {
            bail!("three.js can't be had without npm's packages");
        };
        let (chromium, version) = chromium()?;
        Ok(Self {
            npm: npm.clone(),
            chromium,
            version,
        })
    }

    /// Whether it can draw models of this format.
    pub(super) fn knows(model: &Path) -> bool {
        model
            .extension()
            .is_some_and(|ending| ["glb", "gltf", "obj"].iter().any(|known| ending == *known))
    }

    /// Draws a model before and after; puts the pictures into a folder, too, if one is named. Says why it failed.
    pub(super) fn draw(&self, asset: &SignedAsset, pictures: Option<&Path>) -> Result<Drawn, String> {
        let mut command = Command::new("node");
        command.arg(self.npm.join("render.js")).arg(&self.chromium);
        command.args([asset.original(), asset.signed()]).args(pictures);
        let printed = output(&mut command);
        let drawn = printed.and_then(|figures| Ok(serde_json::from_str(&figures)?));
        drawn.map_err(|error| in_short(&error))
    }

    /// What draws, as the page says it.
    pub(super) fn versions(&self) -> String {
        format!("{}, three and pixelmatch as package.json says", self.version)
    }
}

/// The first Chromium there is, and its version.
fn chromium() -> Result<(String, String)> {
    let version = |name: &str| output(Command::new(name).arg("--version"));
    if let Ok(name) = env::var("CHROMIUM") {
        let version = version(&name).context("CHROMIUM names no program that runs")?;
        return Ok((name, version.trim().into()));
    }
    for name in ["chromium", "chromium-browser", "google-chrome", "chrome"] {
        if let Ok(version) = version(name) {
            return Ok((name.into(), version.trim().into()));
        }
    }
    bail!("there is no Chromium (Debian: apt-get install chromium; elsewhere set CHROMIUM to its path)")
}
