//! The packages that npm installs, and our scripts that use them.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result};
use evaluation::process::{output, root};

use crate::results;

/// The scripts' folder.
pub(super) fn scripts() -> PathBuf {
    root().join("bench-harness/peers/formats")
}

/// Installs what `package.json` asks for, unless it is there, and puts the scripts beside it.
pub(super) fn install(folder: &Path) -> Result<PathBuf> {
    fs::create_dir_all(folder)?;
    for name in [
        "package.json",
        "validate.js",
        "render.js",
        "scene.html",
        "scene.mjs",
    ] {
        let script = scripts().join(name);
        fs::copy(&script, folder.join(name)).with_context(|| script.display().to_string())?;
    }
    let wanted = fs::read(folder.join("package.json"))?;
    let stamp = folder.join("package.installed");
    if !fs::read(&stamp).is_ok_and(|installed| installed == wanted) {
        println!("installing npm's packages into {} (once)", folder.display());
        output(
            Command::new("npm")
                .args(["install", "--silent", "--no-audit", "--no-fund"])
                .current_dir(folder),
        )?;
        results::write(&stamp, wanted)?;
    }
    Ok(folder.into())
}
