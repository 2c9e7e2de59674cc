//! `cargo xtask wheel`: the wheel for Python, and its tests as somebody else would run them.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, bail};
use evaluation::{
    process::{output, root},
    python::Python,
};

use crate::dist::{flags, target_folder};

/// What a wheel may weigh at most, in bytes.
const LARGEST: u64 = 12 << 20;

#[derive(clap::Args)]
pub(crate) struct Options {
    /// Where the wheel is written [default: wheels in the target folder]
    #[arg(long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Install it into a fresh environment, and run its tests, its examples and two type checkers
    #[arg(long)]
    test: bool,
    /// Compile all anew, so that the wheel does not tell in which folders it was built: for an upload
    #[arg(long)]
    publish: bool,
}

pub(crate) fn run(options: &Options) -> Result<()> {
    let project = root().join("bindings/python");
    let tools = Python::prepare_in(project.clone(), root().join(".cache/wheel/tools"))?;
    let folder = match &options.output {
        Some(folder) => std::path::absolute(folder)?,
        None => target_folder()?.join("wheels"),
    };
    let wheel = build(&tools, &project, &folder, options.publish)?;
    let size = fs::metadata(&wheel)?.len();
    let megabytes = size as f64 / f64::from(1 << 20);
    eprintln!("{} has {megabytes:.1} MiB", wheel.display());
    if size > LARGEST {
        bail!("that is more than {} MiB", LARGEST >> 20);
    }
    match options.test {
        true => test(&project, &wheel),
        false => Ok(()),
    }
}

/// Builds the wheel alone into a folder, with what other builds of this profile left.
fn build(tools: &Python, project: &Path, folder: &Path, publish: bool) -> Result<PathBuf> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    // A wheel of another version or system may lie there.
    let fresh = tempfile::tempdir_in(folder)?;
    let mut maturin = tools.module("maturin", ["build", "--release", "--locked", "--out"]);
    maturin.arg(fresh.path()).current_dir(project);
    if publish {
        maturin.env("RUSTFLAGS", flags()?);
    }
    let built = maturin.status().context("maturin can't be started")?;
    if !built.success() {
        bail!("the wheel was not built ({built})");
    }
    let wheels = fs::read_dir(fresh.path())?.collect::<Result<Vec<_>, _>>()?;
    let [wheel] = &wheels[..] else {
        bail!("maturin wrote {} files in place of one wheel", wheels.len());
    };
    let kept = folder.join(wheel.file_name());
    fs::rename(wheel.path(), &kept)?;
    Ok(kept)
}

/// Installs the wheel as a user would, and runs all that is said of it.
fn test(project: &Path, wheel: &Path) -> Result<()> {
    let tests = project.join("tests");
    let folder = root().join(".cache/wheel/fresh");
    if folder.exists() {
        fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
    }
    let python = Python::prepare_in(tests.clone(), folder)?;
    output(
        python
            .module("pip", ["install", "--quiet", "--disable-pip-version-check"])
            .arg(wheel),
    )
    .context("the wheel can't be installed")?;
    install_peers(&python, &tests)?;
    let allowed = tests.join("stubtest-allowed.txt");
    checked(python.module("pytest", ["--quiet"]).current_dir(project))?;
    checked(
        python
            .module(
                "mypy",
                ["--strict", "tests", "python/sigmark", "examples/downloads"],
            )
            .current_dir(project),
    )?;
    checked(
        python
            .module("mypy.stubtest", ["sigmark._sigmark", "--allowlist"])
            .arg(allowed)
            .current_dir(&tests),
    )?;
    // Its package fetches a program for Node the first time.
    match output(&mut python.module("pyright", ["--version"])) {
        Ok(_) => {
            let own = output(&mut python.command_of_code("import sys; print(sys.executable)"))?;
            let arguments = [
                "tests",
                "python/sigmark/batch",
                "examples/downloads",
                "--pythonpath",
                own.trim(),
            ];
            checked(python.module("pyright", arguments).current_dir(project))
        }
        Err(error) => {
            eprintln!("NOT CHECKED: pyright, since it can't be run: {error:#}");
            Ok(())
        }
    }
}

/// Libraries whose meshes are taken as they are. Not all of them are there for every system and version of Python; tests say what is missing.
fn install_peers(python: &Python, tests: &Path) -> Result<()> {
    let list = tests.join("peers.txt");
    let text = fs::read_to_string(&list).with_context(|| list.display().to_string())?;
    for peer in text.lines().filter(|line| line.contains("==")) {
        let install = [
            "install",
            "--quiet",
            "--disable-pip-version-check",
            "--only-binary=:all:",
            peer,
        ];
        if let Err(error) = output(&mut python.module("pip", install)) {
            eprintln!("NOT CHECKED: {peer}, since it can't be installed: {error:#}");
        }
    }
    Ok(())
}

/// Runs a check whose words the caller reads.
fn checked(command: &mut Command) -> Result<()> {
    let ended = command
        .status()
        .with_context(|| format!("{command:?}: can't be started"))?;
    match ended.success() {
        true => Ok(()),
        false => bail!("{command:?}: {ended}"),
    }
}
