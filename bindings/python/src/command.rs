//! The command `sigmark` of the wheel.

use std::{ffi::OsString, io::Write};

use pyo3::prelude::*;

/// Carries out a command line, the program's name first, and gives its exit code. Takes over Ctrl-C: the process is to do nothing else.
#[pyfunction]
pub(crate) fn command(py: Python<'_>, command_line: Vec<OsString>) -> u8 {
    py.detach(|| {
        let code = sigmark_cli::run(command_line);
        // A program does that when it ends. A reader that went away has read enough.
        let _ = std::io::stdout().flush();
        code
    })
}
