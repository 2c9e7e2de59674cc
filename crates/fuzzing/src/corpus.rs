//! Seeds as files, where libFuzzer looks for them.

use std::fs;
use std::io;
use std::path::Path;

use crate::{TARGETS, Target};

/// Larger files of a folder are no seeds: a fuzzer would try few of them, slowly.
const LARGEST_ASSET: u64 = 64 << 10;

impl Target {
    /// Writes the seeds into `corpus/NAME`, and beside them those files of `assets` that the target may read. Answers how many there are.
    ///
    /// # Errors
    /// When a file can't be read or written.
    pub fn write_seeds(&self, corpus: &Path, assets: Option<&Path>) -> io::Result<usize> {
        let folder = corpus.join(self.name);
        fs::create_dir_all(&folder)?;
        let mut seeds = self.seeds();
        if let Some(assets) = assets {
            self.gather(assets, &mut seeds)?;
        }
        for (number, seed) in seeds.iter().enumerate() {
            fs::write(folder.join(format!("seed-{number:04}")), seed)?;
        }
        Ok(seeds.len())
    }

    /// Small files below a folder whose names end as the target is called.
    fn gather(&self, folder: &Path, seeds: &mut Vec<Vec<u8>>) -> io::Result<()> {
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            let (path, metadata) = (entry.path(), entry.metadata()?);
            let ending = path.extension();
            let fits = ending.is_some_and(|ending| ending.eq_ignore_ascii_case(self.ending()));
            if metadata.is_dir() {
                self.gather(&path, seeds)?;
            } else if fits && metadata.len() <= LARGEST_ASSET {
                seeds.push(fs::read(&path)?);
            }
        }
        Ok(())
    }

    fn ending(&self) -> &str {
        match self.name {
            "gzip" => "gz",
            "threemf" => "3mf",
            name => name,
        }
    }
}

/// Writes the seeds of all targets.
///
/// # Errors
/// As [`Target::write_seeds`].
pub fn write_seeds(corpus: &Path, assets: Option<&Path>) -> io::Result<()> {
    TARGETS
        .iter()
        .try_for_each(|target| target.write_seeds(corpus, assets).map(drop))
}
