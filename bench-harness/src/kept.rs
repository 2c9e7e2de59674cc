//! Figures that an earlier run finished: kept in files, so that a run that was interrupted goes on.

use std::{
    fmt, fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use evaluation::{process::root, sources::digest};
use mesh::TriMesh;
use mesh_io::Asset;
use serde::{Serialize, de::DeserializeOwned};

use crate::results;

/// A folder for a comparison's files: inputs that peers read, what they write, figures that are finished.
pub(crate) fn folder(comparison: &str) -> Result<PathBuf> {
    let folder = root().join(".cache/bench").join(comparison);
    fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    Ok(folder)
}

/// By what figures are kept: words that people understand, with all options among them, and a digest of what was measured on. Files of one name
/// need not hold one mesh.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Key {
    words: String,
    inputs: Option<String>,
}

impl Key {
    /// Of figures that no input has a part in.
    pub(crate) fn new(words: impl Into<String>) -> Self {
        Self {
            words: words.into(),
            inputs: None,
        }
    }

    /// The same of figures that depend on these bytes, too.
    pub(crate) fn of(self, bytes: &[u8]) -> Self {
        let before = self.inputs.unwrap_or_default();
        Self {
            inputs: Some(digest((before + &digest(bytes)).as_bytes())),
            ..self
        }
    }

    /// And on this mesh.
    pub(crate) fn of_mesh(self, mesh: &TriMesh) -> Self {
        let positions = mesh.positions().as_flattened().iter();
        let positions: Vec<u8> = positions.flat_map(|x| x.to_le_bytes()).collect();
        let triangles = mesh.triangles().as_flattened().iter();
        let triangles: Vec<u8> = triangles.flat_map(|v| v.to_le_bytes()).collect();
        self.of(&positions).of(&triangles)
    }

    /// And on this model, with all that its files hold.
    pub(crate) fn of_asset(self, asset: &Asset) -> Self {
        let companions = asset.companions();
        companions.fold(self.of(asset.content()), |key, (_, bytes)| key.of(bytes))
    }

    fn path(&self, folder: &Path) -> PathBuf {
        folder.join(format!("{self}.json"))
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.words)?;
        match &self.inputs {
            Some(inputs) => write!(f, "-{inputs}"),
            None => Ok(()),
        }
    }
}

/// The figures of this key in `folder`: as they were finished before, or measured now.
pub(crate) fn figures<T: Serialize + DeserializeOwned>(
    folder: &Path,
    key: &Key,
    measure: impl FnOnce() -> Result<T>,
) -> Result<T> {
    figures_if(folder, key, |_| true, measure)
}

/// As [`figures`], but only those that are `good` are taken, or kept: what failed is tried again by the next run.
pub(crate) fn figures_if<T: Serialize + DeserializeOwned>(
    folder: &Path,
    key: &Key,
    good: impl Fn(&T) -> bool,
    measure: impl FnOnce() -> Result<T>,
) -> Result<T> {
    if let Some(finished) = finished(folder, key).filter(&good) {
        return Ok(finished);
    }
    let measured = measure()?;
    if good(&measured) {
        results::write(&key.path(folder), serde_json::to_string(&measured)?)?;
    }
    Ok(measured)
}

/// The finished figures of this key. A file that can't be understood counts as none.
fn finished<T: DeserializeOwned>(folder: &Path, key: &Key) -> Option<T> {
    let path = key.path(folder);
    let text = fs::read_to_string(&path).ok()?;
    serde_json::from_str(&text)
        .inspect_err(|error| eprintln!("{}: {error}; measured again", path.display()))
        .ok()
}

/// Whether figures of this key are finished.
pub(crate) fn is_finished<T: DeserializeOwned>(folder: &Path, key: &Key) -> bool {
    finished::<T>(folder, key).is_some()
}

/// For the tests of lists of what has no part in some figures.
#[cfg(test)]
pub(crate) fn assert_is_there(paths: &[&str]) {
    for path in paths {
        assert!(evaluation::process::root().join(path).exists(), "{path}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;
    use mesh_io::{Format, Precision, write_mesh};

    #[test]
    fn figures_are_found_again_by_the_same_words_and_inputs_alone() {
        let folder = tempfile::tempdir().unwrap();
        let asset = |mesh: &TriMesh| {
            let bytes = write_mesh(mesh, Format::Ply, Precision::Double);
            Asset::from_bytes(bytes, Format::Ply).unwrap()
        };
        let key = || Key::new("model-25");
        let (one, other) = (shapes::cube(1.0), shapes::cube(2.0));
        let keys = [
            key(),
            Key::new("model-26"),
            key().of_mesh(&one),
            key().of_mesh(&other),
            key().of_mesh(&one).of_mesh(&other),
            key().of_mesh(&other).of_mesh(&one),
            key().of_asset(&asset(&one)),
            key().of_asset(&asset(&other)),
        ];
        for (number, key) in keys.iter().enumerate() {
            assert_eq!(figures(folder.path(), key, || Ok(number)).unwrap(), number);
        }
        for (number, key) in keys.iter().enumerate() {
            let again: Result<usize> = figures(folder.path(), key, || panic!("{key} is finished"));
            assert_eq!(again.unwrap(), number);
        }
    }

    #[test]
    fn what_failed_and_what_is_damaged_is_measured_again() {
        let folder = tempfile::tempdir().unwrap();
        let key = Key::new("attack").of(b"mesh");
        let measured =
            |now: Option<i32>| figures_if(folder.path(), &key, Option::is_some, || Ok(now)).unwrap();
        assert_eq!(measured(None), None);
        assert!(!is_finished::<Option<i32>>(folder.path(), &key));
        assert_eq!(measured(Some(1)), Some(1));
        assert_eq!(measured(Some(2)), Some(1));
        fs::write(key.path(folder.path()), "{\"of\": ").unwrap();
        assert!(!is_finished::<Option<i32>>(folder.path(), &key));
        assert_eq!(measured(Some(3)), Some(3));
        assert_eq!(measured(Some(4)), Some(3));
    }
}
