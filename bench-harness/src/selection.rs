//! Which of a folder's files take part.

use std::path::PathBuf;

use evaluation::inputs::name_of;

/// Whether a name begins as one of these; any name does where none is asked for.
pub(crate) fn is_chosen(name: &str, beginnings: &[String]) -> bool {
    beginnings.is_empty() || beginnings.iter().any(|wanted| name.starts_with(wanted.as_str()))
}

/// The file that has this name, of its end apart.
pub(crate) fn named<'a>(files: &'a [PathBuf], name: &str) -> Option<&'a PathBuf> {
    files.iter().find(|path| name_of(path) == name)
}
