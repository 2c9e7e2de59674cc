//! The program of a release: built, and asked for what it can write about itself.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, bail};

use super::archive::Entry;

/// Shells whose completions are asked for.
const SHELLS: [(&str, &str); 4] = [
    ("bash", "sigmark.bash"),
    ("zsh", "_sigmark"),
    ("fish", "sigmark.fish"),
    ("powershell", "_sigmark.ps1"),
];

/// `sigmark`, built for a system.
pub(super) struct Program {
    pub(super) target: String,
    path: PathBuf,
    /// Whether it can be run on this machine.
    runs_here: bool,
}

impl Program {
    /// Builds it from Cargo.lock's versions, without symbols, and with the list of these versions inside (cargo-auditable).
    pub(super) fn build(target: Option<&str>) -> Result<Self> {
        let target = target.map_or_else(host, |target| Ok(target.to_owned()))?;
        let mut build = Command::new("cargo");
        build.args([
            "auditable",
            "build",
            "--release",
            "--locked",
            "--package",
            "sigmark-cli",
        ]);
        build.args(["--target", &target]).env("RUSTFLAGS", flags()?);
        let built = build.status().context("cargo can't be run")?;
        if !built.success() {
            bail!(
                "the program was not built ({built}). It needs `cargo install --locked cargo-auditable`, and for a system other than \
                 this one `rustup target add {target}` and a linker"
            );
        }
        let folder = target_folder()?.join(&target).join("release");
        let mut program = Self {
            target,
            path: folder,
            runs_here: false,
        };
        program.path.push(program.file_name());
        // One for musl does, and one for Windows may.
        let asked = Command::new(&program.path).arg("--version").output();
        program.runs_here = asked.is_ok_and(|output| output.status.success());
        Ok(program)
    }

    pub(super) fn is_for_windows(&self) -> bool {
        self.target.contains("windows")
    }

    pub(super) fn file_name(&self) -> &'static str {
        match self.is_for_windows() {
            true => "sigmark.exe",
            false => "sigmark",
        }
    }

    pub(super) fn bytes(&self) -> Result<Vec<u8>> {
        fs::read(&self.path).with_context(|| self.path.display().to_string())
    }

    /// Completions and manual pages, if the program writes some and runs here.
    pub(super) fn helpers(&self) -> Result<Vec<Entry>> {
        if !self.runs_here {
            eprintln!(
                "without completions and manual pages: a program for {} does not run here",
                self.target
            );
            return Ok(Vec::new());
        }
        let mut entries = self.completions()?;
        entries.extend(self.manual()?);
        if entries.is_empty() {
            eprintln!(
                "without completions and manual pages: the program knows neither `completions` nor `man`"
            );
        }
        Ok(entries)
    }

    fn completions(&self) -> Result<Vec<Entry>> {
        let mut entries = Vec::new();
        for (shell, name) in SHELLS {
            let output = Command::new(&self.path).args(["completions", shell]).output()?;
            if output.status.success() {
                entries.push(Entry::file(format!("completions/{name}"), output.stdout));
            }
        }
        Ok(entries)
    }

    fn manual(&self) -> Result<Vec<Entry>> {
        let folder = tempfile::tempdir()?;
        let output = Command::new(&self.path).arg("man").arg(folder.path()).output()?;
        let mut entries = Vec::new();
        if output.status.success() {
            for page in fs::read_dir(folder.path())? {
                let page = page?;
                let name = page.file_name().to_string_lossy().into_owned();
                entries.push(Entry::file(format!("man/{name}"), fs::read(page.path())?));
            }
        }
        Ok(entries)
    }
}

/// The caller's flags, and such that the program has no symbols and does not tell in which folders it was built. (A profile's `strip` says
/// nothing of packages for which the profile says something else.)
pub(crate) fn flags() -> Result<String> {
    let mut flags = env::var("RUSTFLAGS").unwrap_or_default() + " -C strip=symbols";
    let cargo = env::var_os("CARGO_HOME")
        .map(PathBuf::from)
        .or_else(|| Some(env::home_dir()?.join(".cargo")));
    for (folder, name) in [(Some(env::current_dir()?), "sigmark"), (cargo, "cargo")] {
        // Flags are divided by blanks: a folder with one is told after all.
        let folder = folder.map(|folder| folder.display().to_string());
        if let Some(folder) = folder.filter(|folder| !folder.contains(' ')) {
            flags += &format!(" --remap-path-prefix={folder}={name}");
        }
    }
    Ok(flags)
}

/// The kind of system that this is.
fn host() -> Result<String> {
    let about = output_of(Command::new("rustc").arg("-vV"))?;
    let host = about.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(host.context("rustc -vV does not name the host")?.to_owned())
}

/// Where cargo puts what it builds.
pub(crate) fn target_folder() -> Result<PathBuf> {
    let metadata = output_of(Command::new("cargo").args(["metadata", "--format-version", "1", "--no-deps"]))?;
    let metadata: serde_json::Value = serde_json::from_str(&metadata)?;
    let folder = metadata["target_directory"].as_str();
    Ok(Path::new(folder.context("cargo metadata does not name the target directory")?).to_owned())
}

fn output_of(command: &mut Command) -> Result<String> {
    let output = command.output().with_context(|| format!("{command:?}"))?;
    if !output.status.success() {
        bail!("{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    }
    Ok(String::from_utf8(output.stdout)?)
}
