//! The peer in C++: `peers/spectra.cpp`, compiled for this machine.

use std::{
    ffi::OsStr,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::Result;
use evaluation::process::{output, root};

use crate::peers::ONE_THREAD;

/// The program, and what it is made of.
pub(crate) struct SpectraProgram {
    program: PathBuf,
    pub(crate) has_cholmod: bool,
    /// The compiler and its version.
    pub(crate) compiler: String,
}

impl SpectraProgram {
    /// Compiles it into `folder`, without CHOLMOD where that is not there.
    pub(crate) fn compile(folder: &Path) -> Result<Self> {
        let source = root().join("bench-harness/peers/spectra.cpp");
        let program = folder.join("spectra");
        let compiler = output(Command::new("g++").arg("--version"))?;
        let compile = |cholmod: &[&str]| {
            let mut command = Command::new("g++");
            command.args(["-std=c++17", "-O3", "-march=native", "-DNDEBUG", "-w"]);
            for headers in ["/usr/include/eigen3", "/usr/include/suitesparse"] {
                command.args(["-isystem", headers]);
            }
            output(command.arg(&source).arg("-o").arg(&program).args(cholmod))
        };
        let has_cholmod = compile(&["-DCHOLMOD", "-lcholmod"]).is_ok();
        if !has_cholmod {
            compile(&[])?;
        }
        Ok(Self {
            program,
            has_cholmod,
            compiler: compiler.lines().next().unwrap_or_default().into(),
        })
    }

    pub(crate) fn command(&self, arguments: &[impl AsRef<OsStr>]) -> Command {
        let mut command = Command::new(&self.program);
        command.args(arguments).envs(ONE_THREAD);
        command
    }
}
