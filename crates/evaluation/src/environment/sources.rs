//! The code that figures come from: its commit, and the digest of its sources.

use std::{
    fs,
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

/// Of the attacks' scripts and the versions of all packages.
pub fn digest_of_attacks() -> Result<String> {
    digest_with_attacks(Vec::new())
}

/// Of all Rust sources of the crates and the benchmarks but their tests, and of the attacks, but without these files and folders: what is new is in it
/// unless somebody leaves it out. Paths begin at the repository's root.
pub fn digest_of_all_but(left_out: &[&str]) -> Result<String> {
    digest_with_attacks(all_but(left_out)?)
}

/// The Rust sources that [`digest_of_all_but`] reads.
pub(crate) fn all_but(left_out: &[&str]) -> Result<Vec<PathBuf>> {
    let root = root();
    let mut paths = Vec::new();
    for folder in ["crates", "bench-harness/src"] {
        collect(&root.join(folder), "rs", &mut paths)?;
    }
    let left_out: Vec<PathBuf> = left_out.iter().map(|path| root.join(path)).collect();
    paths.retain(|path| !left_out.iter().any(|left_out| path.starts_with(left_out)));
    Ok(paths)
}

fn digest_with_attacks(mut paths: Vec<PathBuf>) -> Result<String> {
    let root = root();
    paths.extend(["Cargo.lock", "attacks/requirements.txt"].map(|file| root.join(file)));
    for extension in ["py", "toml"] {
        collect(&root.join("attacks"), extension, &mut paths)?;
    }
    paths.sort();
    let mut all = Sha256::new();
    for path in paths {
        let name = path.strip_prefix(&root).unwrap_or(&path);
        all.update(name.to_string_lossy().as_bytes());
        let bytes = fs::read(&path).with_context(|| path.display().to_string())?;
        all.update(Sha256::digest(bytes));
    }
    Ok(digest(&all.finalize()))
}

/// The files below a folder with an extension; folders of tests, and those whose names begin with a point, are passed over.
fn collect(folder: &Path, extension: &str, into: &mut Vec<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let entry = entry?;
        let path = entry.path();
        let name = entry.file_name();
        if name.to_string_lossy().starts_with('.') || name == "tests" {
            continue;
        }
        if entry.file_type()?.is_dir() {
            collect(&path, extension, into)?;
        } else if path.extension().is_some_and(|own| own == extension) {
            into.push(path);
        }
    }
    Ok(())
}

/// The commit that is checked out, and whether files differ from it.
pub fn commit() -> String {
    let git = |words: &str| output(Command::new("git").current_dir(root()).args(words.split(' '))).ok();
    let Some(head) = git("rev-parse --short HEAD") else {
        return "of an unknown commit".into();
    };
    let changed = git("status --porcelain -- crates attacks bench-harness xtask");
    let changed = changed.is_some_and(|files| !files.trim().is_empty());
    format!("{}{}", head.trim(), if changed { " with changes" } else { "" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_sources_are_in_but_those_that_are_left_out() {
        let root = root();
        let left_out = ["crates/cli", "crates/evaluation/src/environment/process.rs"];
        let paths = all_but(&left_out).unwrap();
        let has = |path: &str| paths.contains(&root.join(path));
        assert!(has("crates/job/src/lib.rs") && has("crates/mesh-io/src/lib.rs"));
        assert!(has("crates/evaluation/src/environment/sources.rs") && has("bench-harness/src/lib.rs"));
        assert!(!has("crates/sigmark/tests/all.rs"));
        assert!(!has("crates/cli/src/main.rs") && !has("crates/evaluation/src/environment/process.rs"));
        for path in left_out {
            assert!(root.join(path).exists(), "{path}");
        }
    }
}
