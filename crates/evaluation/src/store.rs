//! Finished pieces of work on disk, by the digest of what went into them.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::atomic::{AtomicUsize, Ordering},
};

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::Value;

use crate::sources::{self, digest};

/// What finished work does not depend on: all that only shows what was computed, and crates that this one does not use.
const NO_PART: [&str; 7] = [
    "bench-harness",
    "crates/cli",
    "crates/evaluation/src/audit.rs",
    "crates/evaluation/src/output",
    "crates/evaluation/src/pages",
    "crates/fuzzing",
    "crates/library",
];

/// A folder of finished work. Each piece remembers the source code that computed it; what other code computed is done again, unless
/// it was asked to be taken.
pub(crate) struct Store {
    folder: PathBuf,
    code: String,
    takes_other_code: bool,
    found: AtomicUsize,
    of_other_code: AtomicUsize,
}

#[derive(Serialize, Deserialize)]
struct Entry {
    kind: String,
    inputs: Value,
    code: String,
    value: Value,
}

impl Store {
    pub(crate) fn open(folder: &Path, takes_other_code: bool) -> Result<Self> {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        Ok(Self {
            folder: folder.to_path_buf(),
            code: sources::digest_of_all_but(&NO_PART)?,
            takes_other_code,
            found: AtomicUsize::new(0),
            of_other_code: AtomicUsize::new(0),
        })
    }

    /// The digest of the code that computes now.
    pub(crate) fn code(&self) -> &str {
        &self.code
    }

    /// How many pieces were found finished, and how many of these other code had computed.
    pub(crate) fn counts(&self) -> (usize, usize) {
        let read = |count: &AtomicUsize| count.load(Ordering::Relaxed);
        (read(&self.found), read(&self.of_other_code))
    }

    /// A finished piece, if there is one. A file that can't be understood counts as none.
    pub(crate) fn get<T: DeserializeOwned>(&self, kind: &str, inputs: &Value) -> Option<T> {
        let text = fs::read_to_string(self.path(kind, inputs, "json")).ok()?;
        let entry: Entry = serde_json::from_str(&text).ok()?;
        let same_code = entry.code == self.code;
        if entry.inputs != *inputs || !(same_code || self.takes_other_code) {
            return None;
        }
        let value = serde_json::from_value(entry.value).ok()?;
        self.found.fetch_add(1, Ordering::Relaxed);
        if !same_code {
            self.of_other_code.fetch_add(1, Ordering::Relaxed);
        }
        Some(value)
    }

    /// Keeps a finished piece.
    pub(crate) fn put<T: Serialize>(&self, kind: &str, inputs: &Value, value: &T) -> Result<()> {
        let entry = Entry {
            kind: kind.into(),
            inputs: inputs.clone(),
            code: self.code.clone(),
            value: serde_json::to_value(value)?,
        };
        let path = self.path(kind, inputs, "json");
        self.write(&path, serde_json::to_string(&entry)?.as_bytes())
    }

    /// Keeps bytes beside a finished piece.
    pub(crate) fn put_bytes(&self, kind: &str, inputs: &Value, extension: &str, bytes: &[u8]) -> Result<()> {
        self.write(&self.path(kind, inputs, extension), bytes)
    }

    /// The bytes that were kept beside a piece.
    pub(crate) fn bytes(&self, kind: &str, inputs: &Value, extension: &str) -> Option<Vec<u8>> {
        fs::read(self.path(kind, inputs, extension)).ok()
    }

    fn path(&self, kind: &str, inputs: &Value, extension: &str) -> PathBuf {
        let name = digest(format!("{kind} {inputs}").as_bytes());
        self.folder.join(format!("{name}.{extension}"))
    }

    /// Under a name of its own until it is whole.
    fn write(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        let partial = path.with_extension("partial");
        let written = fs::write(&partial, bytes).and_then(|()| fs::rename(&partial, path));
        if written.is_err() {
            let _ = fs::remove_file(&partial);
        }
        written.with_context(|| format!("{}: finished work can't be kept", path.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::process::root;
    use serde_json::json;

    #[test]
    fn work_is_found_again_by_the_same_inputs_and_code_only() {
        let folder = std::env::temp_dir().join(format!("sigmark-store-{}", std::process::id()));
        let store = Store::open(&folder, false).unwrap();
        let inputs = json!({"attack": "noise", "seed": 1});
        assert_eq!(store.get::<f64>("cell", &inputs), None);
        store.put("cell", &inputs, &0.75).unwrap();
        assert_eq!(store.get("cell", &inputs), Some(0.75));
        assert_eq!(
            store.get::<f64>("cell", &json!({"attack": "noise", "seed": 2})),
            None
        );
        assert_eq!(store.get::<f64>("mark", &inputs), None);

        let mut changed = Store::open(&folder, false).unwrap();
        changed.code = "other".into();
        assert_eq!(changed.get::<f64>("cell", &inputs), None);
        changed.takes_other_code = true;
        assert_eq!(changed.get("cell", &inputs), Some(0.75));
        assert_eq!((store.counts(), changed.counts()), ((1, 0), (1, 1)));
        fs::write(store.path("cell", &inputs, "json"), "{\"kind\": \"ce").unwrap();
        assert_eq!(store.get::<f64>("cell", &inputs), None);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn what_poses_and_judges_every_cell_is_part_of_the_code() {
        let files = sources::all_but(&NO_PART).unwrap();
        let folder = root().join("crates/evaluation/src");
        for (file, defined) in [
            ("attacks.rs", "pub fn random_similarity("),
            ("reproduce.rs", "fn strangers("),
            ("study/by_bits.rs", "fn rated("),
            ("study/product.rs", "fn rated("),
        ] {
            let path = folder.join(file);
            assert!(fs::read_to_string(&path).unwrap().contains(defined), "{file}");
            assert!(files.contains(&path), "{file}");
        }
        for path in NO_PART {
            assert!(root().join(path).exists(), "{path}");
        }
    }
}
