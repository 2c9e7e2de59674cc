//! The bill of materials: every package that is in the program, with its licence and digest, in CycloneDX's JSON.

use std::{fs, path::Path, process::Command};

use anyhow::{Context, Result, bail};

/// cargo-cyclonedx writes beside every Cargo.toml of the workspace; under this name nothing else lies there.
const NAME: &str = "sigmark-dist-bill";

pub(super) fn of_materials(target: &str) -> Result<Vec<u8>> {
    let mut command = Command::new("cargo");
    command.args([
        "cyclonedx",
        "--format",
        "json",
        "--spec-version",
        "1.5",
        "--no-build-deps",
    ]);
    command.args(["--manifest-path", "crates/cli/Cargo.toml", "--target", target]);
    // Without it the bill says when it was made, and is another each time.
    command
        .args(["--override-filename", NAME])
        .env("SOURCE_DATE_EPOCH", "0");
    let status = command.status().context("cargo can't be run")?;
    let bill = fs::read_to_string(format!("crates/cli/{NAME}.json"));
    for folder in [Path::new("crates"), Path::new(".")] {
        remove_bills(folder)?;
    }
    if !status.success() {
        bail!(
            "no bill of materials was written ({status}). It needs `cargo install --locked cargo-cyclonedx`"
        );
    }
    let bill = bill.context("cargo cyclonedx wrote no bill for crates/cli")?;
    // Our own packages are named by where they lie, which is nobody's business and not the same everywhere.
    let root = std::env::current_dir()?.display().to_string().replace('\\', "/");
    Ok(bill.replace(root.trim_start_matches('/'), "sigmark").into_bytes())
}

/// Removes those of all packages right below a folder.
fn remove_bills(folder: &Path) -> Result<()> {
    for package in fs::read_dir(folder)? {
        let bill = package?.path().join(format!("{NAME}.json"));
        if bill.exists() {
            fs::remove_file(bill)?;
        }
    }
    Ok(())
}
