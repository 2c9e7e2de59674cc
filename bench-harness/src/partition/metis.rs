//! METIS 5.1, by its program `gpmetis`.

use std::{fs, path::Path, process::Command};

use anyhow::{Context, Result};
use evaluation::process::{output, peak_memory};

/// Fails, with the remedy, where METIS is not there.
pub(crate) fn check() -> Result<()> {
    output(Command::new("gpmetis").arg("-help"))
        .map(drop)
        .context("METIS is not there: install it (Debian: apt-get install metis)")
}

/// Divides a file's graph with the defaults, into a file beside it; answers with CPU seconds as METIS reports them.
pub(crate) fn divide(file: &Path, parts: usize) -> Result<f64> {
    let report = output(Command::new("gpmetis").arg(file).arg(parts.to_string()))?;
    figure(&report, "Partitioning:")
}

/// What [`divide`] wrote: the part of each vertex, a line each.
pub(crate) fn parts(file: &Path, parts: usize) -> Result<String> {
    let path = format!("{}.part.{parts}", file.display());
    fs::read_to_string(&path).context(path)
}

/// The most memory that METIS holds, in bytes; none where the system does not say.
pub(crate) fn memory(file: &Path, parts: usize) -> Result<Option<u64>> {
    let mut gpmetis = Command::new("gpmetis");
    peak_memory(gpmetis.arg("-nooutput").arg(file).arg(parts.to_string()))
}

/// The number that follows a label in METIS' report.
fn figure(report: &str, label: &str) -> Result<f64> {
    let number = report
        .lines()
        .find_map(|line| line.trim().strip_prefix(label)?.split_whitespace().next())
        .and_then(|word| word.parse().ok());
    number.with_context(|| format!("the report of METIS has no line \"{label}\""))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_seconds_of_the_partitioning_are_found_in_the_report() {
        let report = "Timing Information ----\n  I/O:          \t\t   0.012 sec\n  Partitioning: \t\t   0.034 sec   (METIS time)\n";
        assert_eq!(figure(report, "Partitioning:").unwrap(), 0.034);
        assert!(figure(report, "Nothing:").is_err());
    }
}
