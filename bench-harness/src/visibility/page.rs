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
        "# What one sees of a mark\n\nWritten by `cargo xtask bench visibility`.\n\n{WORDS}\n\n{}\n{}\n{}{}; {}. Code {}, sources' digest {code}.\n",
        seen.markdown(),
        read.markdown(),
        machine::description(),
        versions.map_or_else(String::new, |versions| format!(", {versions}")),
        machine::load(),
        sources::commit(),
    );
    results::write_page(&results.join("visibility.md"), &page)
}

const WORDS: &str = "Each model carries the same 512 random bits in every layout. A layout is named KIND:PATCHES:CHIP RATE:STRENGTH. *Free* is the paper's: harmonics end with any value where \
    patches meet, and every patch carries every bit so often; in *fixed* ones they are zero there; *pooled* ones are fixed, too, and all patches together carry every bit so often. `auto` is what the library chooses: \
    free patches as few as keep each below 30 000 vertices, which with chip rate 3 was the default until version 3 of certificates; pooled ones are the default. The strength is the root mean square displacement in diagonals. \
    *At borders* are the triangles with a corner beside another patch; a model in one patch has none. \
    T₀ = T / √(1 − T² / 512) is the signal-to-noise ratio of a matched filter; it grows without bound where all bits are exact, and is cut off at 1000. One draw of bits and attacks each: repeated draws differ by some per cent. \
    Seconds are wall time for the harmonics of all patches.";

fn turns(turn: &Turn) -> String {
    if turn.max == 0.0 {
        return "–".into();
    }
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
        let cell = |read: &Read| match read.margin {
            ..1000.0 => format!("{:.1} ({:.1})", read.margin, 100.0 * read.rate),
            _ => format!("> 1000 ({:.1})", 100.0 * read.rate),
        };
        let cells = trial.read.iter().map(cell);
        table.row(
            [trial.model.clone(), trial.layout.to_string()]
                .into_iter()
                .chain(cells),
        );
    }
    table
}
