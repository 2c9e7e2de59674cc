//! The page of what is seen.

use anyhow::Result;
use evaluation::{machine, python::Python, sources, table::Table};

use super::trial::{ATTACKS, Read, Trial, Turn};
use crate::results;

/// Writes the page and its CSV file. `code`: the digest of what the figures depend on.
pub(super) fn write(trials: &[Trial], attacks: Option<&Python>, code: &str) -> Result<()> {
    let results = results::folder()?;
    let (seen, read) = (seen(trials), read(trials));
    seen.write_csv(&results.join("visibility.csv"))?;
    let versions = attacks.map(Python::versions).transpose()?;
    let page = format!(
        "# What one sees of a mark\n\nWritten by `cargo xtask bench visibility`.\n\n{}\n{}\n{}{}; {}. Code {}, sources' digest {code}.\n",
        seen.markdown(),
        read.markdown(),
        machine::description(),
        versions.map_or_else(String::new, |versions| format!(", {versions}")),
        machine::load(),
        sources::commit(),
    );
    results::write_page(&results.join("visibility.md"), &page)
}

fn turns(turn: &Turn) -> String {
    format!("{:.2}, {:.1}, {:.0}", turn.median, turn.p99, turn.max)
}

fn seen(trials: &[Trial]) -> Table {
    let header = [
        "model",
        "layout",
        "patches",
        "harmonics (s)",
        "turn inside (median, 99 %, max)",
        "at borders",
        "flipped",
        "MSDM2",
        "DAME",
    ];
    let mut table = Table::new("Turn of the facets, in degrees", header).text_columns(2);
    for trial in trials {
        table.row([
            trial.model.clone(),
            trial.layout.to_string(),
            trial.patches.to_string(),
            format!("{:.1}", trial.seconds),
            turns(&trial.inside),
            turns(&trial.at_borders),
            trial.flipped.to_string(),
            format!("{:.3}", trial.msdm2),
            format!("{:.4}", trial.dame),
        ]);
    }
    table
}

fn read(trials: &[Trial]) -> Table {
    let header = ["model", "layout"].into_iter().chain(ATTACKS);
    let mut table = Table::new("Read after attacks: T₀ (extraction rate, %)", header).text_columns(2);
    for trial in trials.iter().filter(|trial| !trial.read.is_empty()) {
        let cell = |read: &Read| format!("{:.1} ({:.1})", read.margin, 100.0 * read.rate);
        let cells = trial.read.iter().map(cell);
        table.row(
            [trial.model.clone(), trial.layout.to_string()]
                .into_iter()
                .chain(cells),
        );
    }
    table
}
