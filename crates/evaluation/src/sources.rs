//! The code that figures come from: its commit, and the digest of its sources.

use std::{
    fs, io,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};

use crate::process::{output, root};

/// SHA-256, its first half in hexadecimal.
pub fn digest(bytes: &[u8]) -> String {
    let octets = Sha256::digest(bytes);
    octets[..16].iter().map(|octet| format!("{octet:02x}")).collect()
}

/// Of the sources of some of our crates, of some files of ours, of the attacks, and of the versions of what they use.
pub fn digest_of(crates: &[&str], files: &[&str]) -> Result<String> {
    let root = root();
    digest_below(&root, crates, files).with_context(|| format!("{}: sources can't be read", root.display()))
}

/// As [`digest_of`], of all Rust sources of the crates and the benchmarks but these files and folders: what is new is in it unless somebody
/// leaves it out.
///
/// # Errors
/// When the sources can't be read.
pub fn digest_of_all_but(left_out: &[&str]) -> Result<String> {
    let root = root();
    let digest = all_but(&root, left_out).and_then(|paths| digest_with_attacks(&root, paths));
    digest.with_context(|| format!("{}: sources can't be read", root.display()))
}

fn all_but(root: &Path, left_out: &[&str]) -> io::Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for folder in ["crates", "bench-harness/src"] {
        sources(&root.join(folder), "rs", &mut paths)?;
    }
    paths.retain(|path| {
        !left_out
            .iter()
            .any(|left_out| path.starts_with(root.join(left_out)))
    });
    Ok(paths)
}

fn digest_below(root: &Path, crates: &[&str], files: &[&str]) -> io::Result<String> {
    let mut paths = Vec::new();
    for name in crates {
        sources(&root.join("crates").join(name).join("src"), "rs", &mut paths)?;
    }
    paths.extend(files.iter().map(|file| root.join(file)));
    digest_with_attacks(root, paths)
}

fn digest_with_attacks(root: &Path, mut paths: Vec<PathBuf>) -> io::Result<String> {
    paths.extend([root.join("Cargo.lock"), root.join("attacks/requirements.txt")]);
    for extension in ["py", "toml"] {
        sources(&root.join("attacks"), extension, &mut paths)?;
    }
    paths.sort();
    let mut all = Sha256::new();
    for path in paths {
        let name = path.strip_prefix(root).unwrap_or(&path);
        all.update(name.to_string_lossy().as_bytes());
        all.update(Sha256::digest(fs::read(&path)?));
    }
    Ok(digest(&all.finalize()))
}

/// The files below a folder with an extension; folders whose names begin with a point are passed over.
fn sources(folder: &Path, extension: &str, into: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let path = entry.path();
        if entry.file_name().to_string_lossy().starts_with('.') {
            continue;
        }
        if entry.file_type()?.is_dir() {
            sources(&path, extension, into)?;
        } else if path.extension().is_some_and(|own| own == extension) {
            into.push(path);
        }
    }
    Ok(())
}

/// The commit that is checked out, and whether files differ from it.
pub fn commit() -> String {
    let git = |words: &[&str]| {
        let mut command = Command::new("git");
        output(command.current_dir(root()).args(words)).ok()
    };
    let Some(head) = git(&["rev-parse", "--short", "HEAD"]) else {
        return "of an unknown commit".into();
    };
    let changed = git(&[
        "status",
        "--porcelain",
        "--",
        "crates",
        "attacks",
        "bench-harness",
        "xtask",
    ]);
    let changed = changed.is_some_and(|files| !files.trim().is_empty());
    format!("{}{}", head.trim(), if changed { " with changes" } else { "" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_sources_are_in_but_those_that_are_left_out() {
        let root = root();
        let left_out = ["crates/cli", "bench-harness/src/registration/page.rs"];
        let paths = all_but(&root, &left_out).unwrap();
        let has = |path: &str| paths.contains(&root.join(path));
        assert!(has("crates/job/src/lib.rs") && has("crates/mesh-io/src/lib.rs"));
        assert!(has("crates/evaluation/src/sources.rs") && has("bench-harness/src/registration/runs.rs"));
        assert!(!has("crates/cli/src/main.rs") && !has("bench-harness/src/registration/page.rs"));
        for path in left_out {
            assert!(root.join(path).exists(), "{path}");
        }
    }
}
