use std::{path::PathBuf, time::Duration};

/// What to reproduce, and where the pages go.
pub struct Options {
    /// Where the tables go.
    pub output: PathBuf,
    /// The folder of the six models; the bunny alone without one.
    pub meshes: Option<PathBuf>,
    /// Models or files by name; all when empty.
    pub only: Vec<String>,
    /// Algorithms by their ids; all when empty.
    pub algorithms: Vec<String>,
    /// How many signatures each figure is a mean over.
    pub signatures: usize,
    /// Takes finished work of other versions of the code.
    pub keep: bool,
    /// When no more work begins, and what there is is written.
    pub closing: Option<Duration>,
}

impl Options {
    /// Whether all six models are asked for.
    pub(crate) fn is_full(&self) -> bool {
        self.meshes.is_some()
    }
}
