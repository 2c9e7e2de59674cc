//! `cargo xtask dist`: the archive of a release, with the program, what it was made of, and what goes with it.

mod archive;
mod bill;
mod program;

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};

use archive::Entry;
use program::Program;
pub(crate) use program::{flags, target_folder};

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// What everybody gets besides the program.
const DOCUMENTS: [&str; 5] = [
    "README.md",
    "SECURITY.md",
    "LICENSE-MIT",
    "LICENSE-APACHE",
    "docs/certificate.md",
];

#[derive(clap::Args)]
pub(crate) struct Options {
    /// The system that the archive is for, such as x86_64-unknown-linux-musl; by default this one
    ///
    /// Another one needs its standard library (`rustup target add TRIPLE`) and a linker for it.
    #[arg(long, value_name = "TRIPLE")]
    target: Option<String>,
    /// Where the archive and SHA256SUMS are written
    #[arg(long, value_name = "DIR", default_value = "dist")]
    output: PathBuf,
}

pub(crate) fn run(options: &Options) -> Result<()> {
    let program = Program::build(options.target.as_deref())?;
    let name = format!("sigmark-{VERSION}-{}", program.target);
    let mut entries = documents()?;
    entries.push(Entry::program(program.file_name(), program.bytes()?));
    entries.push(Entry::file(
        "sigmark.cdx.json",
        bill::of_materials(&program.target)?,
    ));
    entries.extend(program.helpers()?);
    entries.sort_by(|a, b| a.path.cmp(&b.path));

    fs::create_dir_all(&options.output)?;
    let (file, bytes) = match program.is_for_windows() {
        true => (format!("{name}.zip"), archive::zip(&name, &entries)?),
        false => (format!("{name}.tar.gz"), archive::tar_gz(&name, &entries)?),
    };
    let path = options.output.join(file);
    fs::write(&path, bytes).with_context(|| path.display().to_string())?;
    write_sums(&options.output)?;
    eprintln!("{} holds {} files", path.display(), entries.len());
    Ok(())
}

fn documents() -> Result<Vec<Entry>> {
    let read = |path: &str| {
        let bytes = fs::read(path).with_context(|| format!("{path}: run this in the repository's root"))?;
        Ok(Entry::file(path, bytes))
    };
    DOCUMENTS.into_iter().map(read).collect()
}

/// The digests of all archives in the folder, as `sha256sum --check` reads them.
fn write_sums(folder: &Path) -> Result<()> {
    let mut lines = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if name.ends_with(".tar.gz") || name.ends_with(".zip") {
            let digest = Sha256::digest(fs::read(&path)?);
            let digits: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
            lines.push(format!("{digits}  {name}\n"));
        }
    }
    lines.sort_by(|a, b| a[64..].cmp(&b[64..]));
    fs::write(folder.join("SHA256SUMS"), lines.concat())?;
    Ok(())
}
