//! Python environments: of the attacks, and of the peers of the benchmarks.

use std::{
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, bail};

use crate::process::{output, root};

/// An interpreter that has what `requirements.txt` beside the scripts asks for.
pub struct Python {
    interpreter: PathBuf,
    scripts: PathBuf,
    variables: &'static [(&'static str, &'static str)],
}

const REMEDY: &str =
    "install Python 3.11 or later with its venv module (Debian: apt-get install python3-venv)";

impl Python {
    /// The environment of the attacks, in attacks/.venv.
    ///
    /// # Errors
    /// Without Python, or where the packages can't be installed; the remedy is what the error shows first.
    pub fn prepare() -> Result<Self> {
        let attacks = root().join("attacks");
        let environment = attacks.join(".venv");
        Self::prepare_in(attacks, environment)
    }

    /// Makes the environment, or takes it as it is if it was made from the same requirements.
    pub fn prepare_in(scripts: PathBuf, environment: PathBuf) -> Result<Self> {
        let interpreter = environment.join(match cfg!(windows) {
            true => "Scripts/python.exe",
            false => "bin/python",
        });
        let requirements = scripts.join("requirements.txt");
        let wanted = fs::read_to_string(&requirements).with_context(|| requirements.display().to_string())?;
        let stamp = environment.join("requirements.installed");
        let python = Self {
            interpreter,
            scripts,
            variables: &[],
        };
        if fs::read_to_string(&stamp).is_ok_and(|installed| installed == wanted) {
            return Ok(python);
        }
        println!("making the Python environment {} (once)", environment.display());
        let system = find_system_python()?;
        let mut venv = Command::new(system);
        output(venv.args(["-m", "venv", "--clear"]).arg(&environment)).context(REMEDY)?;
        python.install(&requirements).context(
            "the packages can't be installed; a network and a package index are needed the first time",
        )?;
        fs::write(&stamp, wanted).with_context(|| stamp.display().to_string())?;
        Ok(python)
    }

    /// Installs what a file of requirements asks for.
    pub fn install(&self, requirements: &Path) -> Result<()> {
        let install = "-m pip install --quiet --disable-pip-version-check --requirement".split(' ');
        output(Command::new(&self.interpreter).args(install).arg(requirements)).map(drop)
    }

    /// The same environment, whose scripts run with these environment variables.
    pub fn with_variables(self, variables: &'static [(&'static str, &'static str)]) -> Self {
        Self { variables, ..self }
    }

    /// The folder of the scripts.
    pub fn scripts(&self) -> &Path {
        &self.scripts
    }

    /// Runs a script and gives what it printed.
    pub fn run(&self, script: &str, arguments: impl IntoIterator<Item: AsRef<OsStr>>) -> Result<String> {
        output(&mut self.command(script, arguments))
    }

    /// What runs a script.
    pub fn command(&self, script: &str, arguments: impl IntoIterator<Item: AsRef<OsStr>>) -> Command {
        let mut command = Command::new(&self.interpreter);
        command.arg(self.scripts.join(script)).args(arguments);
        command.envs(self.variables.iter().copied());
        command
    }

    /// What runs a module, as `python -m` does.
    pub fn module(&self, module: &str, arguments: impl IntoIterator<Item: AsRef<OsStr>>) -> Command {
        let mut command = Command::new(&self.interpreter);
        command.args(["-m", module]).args(arguments);
        command.envs(self.variables.iter().copied());
        command
    }

    /// What runs a line of code.
    pub fn command_of_code(&self, code: &str) -> Command {
        let mut command = Command::new(&self.interpreter);
        command.args(["-c", code]);
        command
    }

    /// The bunny that comes with pymeshlab.
    pub fn bunny(&self) -> Result<PathBuf> {
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
    pub fn versions(&self) -> Result<String> {
        let python = output(Command::new(&self.interpreter).arg("--version"))?;
        let requirements = fs::read_to_string(self.scripts.join("requirements.txt"))?;
        let packages = requirements.lines().filter(|line| line.contains("=="));
        let mut versions = vec![python.trim().to_string()];
        versions.extend(packages.map(|line| line.replace("==", " ")));
        Ok(versions.join(", "))
    }
}

fn find_system_python() -> Result<&'static Path> {
    let recent = "import sys, venv; sys.exit(sys.version_info < (3, 11))";
    ["python3", "python"]
        .into_iter()
        .map(Path::new)
        .find(|python| output(Command::new(python).args(["-c", recent])).is_ok())
        .context(REMEDY)
}
