//! The Python environment of the attacks.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, bail};

use crate::process::{output, root};

/// An interpreter that has what `attacks/requirements.txt` asks for.
pub(crate) struct Python {
    interpreter: PathBuf,
    attacks: PathBuf,
}

const REMEDY: &str =
    "install Python 3.10 or later with its venv module (Debian: apt-get install python3-venv)";

impl Python {
    /// Makes the environment in attacks/.venv, or takes it as it is if it was made from the same requirements.
    pub(crate) fn prepare() -> Result<Self> {
        let attacks = root().join("attacks");
        let environment = attacks.join(".venv");
        let interpreter = environment.join(if cfg!(windows) {
            "Scripts/python.exe"
        } else {
            "bin/python"
        });
        let wanted =
            fs::read_to_string(attacks.join("requirements.txt")).context("attacks/requirements.txt")?;
        let stamp = environment.join("requirements.installed");
        if fs::read_to_string(&stamp).is_ok_and(|installed| installed == wanted) {
            return Ok(Self { interpreter, attacks });
        }
        println!("making the Python environment of the attacks in attacks/.venv (once)");
        let system = find_system_python()?;
        output(
            Command::new(system)
                .args(["-m", "venv", "--clear"])
                .arg(&environment),
        )
        .context(REMEDY)?;
        let install = [
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
            "--requirement",
        ];
        output(Command::new(&interpreter).args(install).arg(attacks.join("requirements.txt")))
            .context("the attacks' packages can't be installed; a network and a package index are needed the first time")?;
        fs::write(&stamp, wanted).context("attacks/.venv")?;
        Ok(Self { interpreter, attacks })
    }

    /// Runs a script of `attacks/` and gives what it printed.
    pub(crate) fn run<I: AsRef<std::ffi::OsStr>>(
        &self,
        script: &str,
        arguments: impl IntoIterator<Item = I>,
    ) -> Result<String> {
        output(
            Command::new(&self.interpreter)
                .arg(self.attacks.join(script))
                .args(arguments),
        )
    }

    /// The bunny that comes with pymeshlab.
    pub(crate) fn bunny(&self) -> Result<PathBuf> {
        let path = PathBuf::from(self.run("bunny.py", [""; 0])?.trim());
        if !path.is_file() {
            bail!(
                "{}: pymeshlab came without its sample meshes; delete attacks/.venv and try again",
                path.display()
            );
        }
        Ok(path)
    }

    /// Python and packages, as they stand in the tables.
    pub(crate) fn versions(&self) -> Result<String> {
        let python = output(Command::new(&self.interpreter).arg("--version"))?;
        let requirements = fs::read_to_string(self.attacks.join("requirements.txt"))?;
        let packages = requirements
            .lines()
            .filter(|line| line.contains("=="))
            .map(|line| line.replace("==", " "));
        Ok(std::iter::once(python.trim().to_string())
            .chain(packages)
            .collect::<Vec<_>>()
            .join(", "))
    }
}

fn find_system_python() -> Result<&'static Path> {
    let recent = "import sys, venv; sys.exit(sys.version_info < (3, 10))";
    ["python3", "python"]
        .into_iter()
        .map(Path::new)
        .find(|python| output(Command::new(python).args(["-c", recent])).is_ok())
        .context(REMEDY)
}
