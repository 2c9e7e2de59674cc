//! The library, made once for some code, models and size, and kept.

use std::{fs, time::Instant};

use anyhow::{Context, Result};
use evaluation::sources;
use job::Job;
use library::{Entry, Index, Library, OriginalId};
use serde::{Deserialize, Serialize};

use super::models::{Base, original};
use crate::kept::{self, Key};

/// What has no part in the library.
const NO_PART: [&str; 24] = [
    "crates/cli",
    "crates/evaluation/src/output",
    "crates/evaluation/src/pages",
    "crates/evaluation/src/store.rs",
    "crates/evaluation/src/study",
    "crates/sigmark",
    "crates/baselines",
    "crates/code",
    "crates/fuzzing",
    "crates/mhb-core",
    "crates/partition",
    "crates/quality",
    "crates/registration",
    "crates/time-stamp",
    "crates/library/tests",
    "crates/library/src/index",
    "bench-harness/src/formats",
    "bench-harness/src/library/page.rs",
    "bench-harness/src/library/mod.rs",
    "bench-harness/src/library/suspects.rs",
    "bench-harness/src/library/trials.rs",
    "bench-harness/src/pose",
    "bench-harness/src/robustness",
    "bench-harness/src/security",
];

/// Originals that are made at a time.
const AT_A_TIME: usize = 64;

/// A library and its index.
pub(super) struct Built {
    pub(super) library: Library,
    pub(super) index: Index,
    pub(super) ids: Vec<OriginalId>,
    pub(super) figures: Figures,
}

/// What it took.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Figures {
    pub(super) size: usize,
    /// To open the file and read all descriptors.
    pub(super) seconds_to_open: f64,
    /// Of the index in memory.
    pub(super) bytes_in_memory: usize,
    pub(super) bytes_in_file: u64,
    pub(super) code: String,
}

/// The library of so many originals; what an earlier run made of it is gone on with.
pub(super) fn library(bases: &[Base], size: usize, job: &Job) -> Result<Built> {
    let code = sources::digest_of_all_but(&NO_PART)?;
    let path = kept::folder(&format!("library/{}", key(&code, bases, size)))?.join("originals.sigmark");
    let mut library = Library::create(&path)?;
    let begun = Instant::now();
    let first = library.count()?;
    let mut told = first;
    for start in (first..size).step_by(AT_A_TIME) {
        let count = AT_A_TIME.min(size - start);
        let entries = job.map(count, 1, |i| {
            let model = original(bases, start + i);
            Entry::of(&model.name, &model.mesh, false)
        })?;
        for (i, entry) in entries.into_iter().enumerate() {
            library.add(&entry.with_context(|| format!("original {}", start + i))?)?;
        }
        if start - told >= 2000 {
            told = start;
            let seconds = begun.elapsed().as_secs_f64();
            println!(
                "{start} originals, {:.1} a second",
                (start - first) as f64 / seconds
            );
        }
    }
    drop(library);
    let begun = Instant::now();
    let library = Library::open(&path)?;
    let index = Index::load(&library, job)?;
    let seconds_to_open = begun.elapsed().as_secs_f64();
    let ids = library
        .originals()?
        .into_iter()
        .map(|original| original.id)
        .collect();
    let figures = Figures {
        size: index.len(),
        seconds_to_open,
        bytes_in_memory: index.bytes(),
        bytes_in_file: fs::metadata(&path)?.len(),
        code,
    };
    Ok(Built {
        library,
        index,
        ids,
        figures,
    })
}

/// What tells a library from others: all that its originals are made of, and how many they are.
fn key(code: &str, bases: &[Base], size: usize) -> Key {
    let key = Key::new(format!("{code}-{size}"));
    bases.iter().fold(key, |key, base| {
        let key = key.of(base.name.as_bytes()).of_mesh(&base.small);
        base.whole.iter().fold(key, Key::of_mesh)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    #[test]
    fn a_library_of_other_models_or_of_another_size_is_another() {
        let base = |name: &str, side| Base {
            name: name.into(),
            whole: None,
            small: shapes::cube(side),
            tunes: false,
        };
        let of = |bases: &[Base], size| key("code", bases, size).to_string();
        let libraries = [
            of(&[base("cube", 1.0)], 10),
            of(&[base("cube", 1.0)], 20),
            of(&[base("cube", 2.0)], 10),
            of(&[base("block", 1.0)], 10),
            of(&[base("cube", 1.0), base("cube", 2.0)], 10),
        ];
        for (i, library) in libraries.iter().enumerate() {
            assert!(!libraries[..i].contains(library), "{library}");
        }
    }

    #[test]
    fn what_is_left_out_is_there() {
        kept::assert_is_there(&NO_PART);
    }
}
