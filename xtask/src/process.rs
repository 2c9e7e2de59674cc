//! Running other programs.

use std::{
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use anyhow::{Context, Result, bail};

/// Runs a program to its end and gives what it printed. Its standard error is shown only if it fails.
pub(crate) fn output(command: &mut Command) -> Result<String> {
    output_with_code(command, &[0])
}

/// As [`output`], for programs that say something by exit codes other than 0.
pub(crate) fn output_with_code(command: &mut Command, accepted: &[i32]) -> Result<String> {
    let shown = format!("{command:?}");
    let result = command
        .stdin(Stdio::null())
        .output()
        .with_context(|| format!("{shown}: can't be started"))?;
    if !result.status.code().is_some_and(|code| accepted.contains(&code)) {
        bail!(
            "{shown}: {}\n{}",
            result.status,
            String::from_utf8_lossy(&result.stderr).trim_end()
        );
    }
    Ok(String::from_utf8_lossy(&result.stdout).into_owned())
}

/// The root of the repository.
pub(crate) fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}

/// Builds the command line in release mode; answers with the path of the binary.
pub(crate) fn build_sigmark() -> Result<PathBuf> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let arguments = [
        "build",
        "--release",
        "--package",
        "sigmark-cli",
        "--message-format",
        "json-render-diagnostics",
    ];
    let messages = output(Command::new(cargo).current_dir(root()).args(arguments))?;
    let mut executable = messages.lines().filter_map(|line| {
        let message: serde_json::Value = serde_json::from_str(line).ok()?;
        (message["target"]["name"] == "sigmark").then(|| message["executable"].as_str().map(PathBuf::from))?
    });
    executable
        .next_back()
        .context("cargo built no binary named sigmark")
}
