//! The wheel that the benchmarks of Python install.

use std::{
    env, fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use evaluation::{process::output, python::Python};

/// Installs a wheel into an environment; without one, the latest that `cargo xtask wheel` wrote.
pub(crate) fn install(python: &Python, wheel: Option<&Path>) -> Result<()> {
    let wheel = wheel.map_or_else(latest, |wheel| Ok(wheel.into()))?;
    let install = "install --quiet --disable-pip-version-check --no-deps --force-reinstall".split(' ');
    output(python.module("pip", install).arg(&wheel)).context("the wheel can't be installed")?;
    Ok(())
}

/// The latest of `wheels` in the folder of this program's build.
fn latest() -> Result<PathBuf> {
    let program = env::current_exe()?;
    let wheels = program.ancestors().nth(2).map(|target| target.join("wheels"));
    let wheels = wheels.context("this program lies in no target folder; name the wheel with --wheel")?;
    let missing = || {
        format!(
            "{}: no wheel is there; make it with `cargo xtask wheel`",
            wheels.display()
        )
    };
    let mut found = Vec::new();
    for entry in fs::read_dir(&wheels).with_context(missing)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "whl") {
            found.push((fs::metadata(&path)?.modified()?, path));
        }
    }
    found.sort();
    found.pop().map(|(_, path)| path).with_context(missing)
}
