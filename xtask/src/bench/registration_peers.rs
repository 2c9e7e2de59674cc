//! Queries and fine alignment beside the peers.

use std::path::PathBuf;

use anyhow::Result;

use crate::python::Python;

pub(super) fn run(_files: &[PathBuf], _attacks: &Python) -> Result<String> {
    Ok(String::new())
}
