//! `index.csv` in the folder of the copies: who has which.

use std::{
    collections::HashSet,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Result, anyhow, bail};

use super::Copy;
use crate::files::{self, Output};

/// Recipient, mesh and certificate, from the folder of the index.
type Row = [String; 3];

const HEADER: [&str; 3] = ["recipient", "copy", "certificate"];

/// The list of all copies in a folder.
pub(super) struct Index {
    pub(super) path: PathBuf,
    /// What it said before this run.
    before: Vec<Row>,
}

impl Index {
    /// The index of a folder, which may have none yet; a file that is no index is refused, unless it may be replaced.
    pub(super) fn of(folder: &Path, force: bool) -> Result<Self> {
        let path = folder.join("index.csv");
        let before = match rows(&path) {
            Some(rows) => rows,
            None if force || fs::symlink_metadata(&path).is_err() => Vec::new(),
            None => bail!(
                "{}: is no list of copies that `sigmark embed` wrote; use --force to replace it, or another folder",
                path.display()
            ),
        };
        Ok(Self { path, before })
    }

    /// Writes the copies of this run, and those of others that are still there.
    pub(super) fn write(&self, copies: &[Copy]) -> Result<()> {
        let new: Vec<Row> = copies.iter().map(row).collect();
        let named: HashSet<&str> = new.iter().map(|[recipient, ..]| recipient.as_str()).collect();
        let folder = files::folder_of(&self.path);
        let is_other = |[recipient, _, certificate]: &&Row| {
            !named.contains(recipient.as_str()) && folder.join(certificate).is_file()
        };
        let mut rows = csv::Writer::from_writer(Vec::new());
        rows.write_record(HEADER)?;
        for row in self.before.iter().filter(is_other).chain(&new) {
            rows.write_record(row)?;
        }
        let bytes = rows
            .into_inner()
            .map_err(|error| anyhow!("{}: can't be written: {error}", self.path.display()))?;
        let index = Output {
            path: &self.path,
            bytes: &bytes,
            private: true,
        };
        files::write_together(&[index], true)
    }
}

/// The rows of an index, if it is one.
fn rows(path: &Path) -> Option<Vec<Row>> {
    let text = fs::read(path).ok()?;
    let mut rows = csv::Reader::from_reader(text.as_slice());
    if rows.headers().ok()? != HEADER.as_slice() {
        return None;
    }
    rows.deserialize().collect::<Result<_, _>>().ok()
}

fn row(copy: &Copy) -> Row {
    let task = &copy.task;
    [
        copy.recipient.clone(),
        in_its_folder(&task.output),
        in_its_folder(&task.certificate),
    ]
}

/// The last folder of a path and the name in it, as text.
fn in_its_folder(path: &Path) -> String {
    let folder = files::folder_of(path).file_name().unwrap_or_default();
    let name = path.file_name().unwrap_or_default();
    format!("{}/{}", folder.to_string_lossy(), name.to_string_lossy())
}
