//! The page of the formats.

use anyhow::Result;
use evaluation::{machine, sources, table::Table};
use sigmark::{Outcome, Verdict};

use super::{Row, Tried, converters::Converters};
use crate::results;

/// Writes the page and its CSV.
pub(super) fn write(rows: &[Row], converters: &Converters) -> Result<()> {
    let results = results::folder()?;
    let table = table(rows);
    table.write_csv(&results.join("formats.csv"))?;
    let page = format!(
        "# Through other programs, and back in another format\n\nWritten by `cargo xtask bench formats --assets DIR`. Each model is signed with the default strength, taken through \
         the program (at rest, where it has a skeleton), and what comes back is verified with the original file.\n\n{}\n{}\n{}\n{}{}, {}; {}.\n",
        words(rows),
        table.markdown(),
        files(rows).markdown(),
        refused(rows),
        machine::description(),
        converters.versions()?,
        sources::commit(),
    );
    results::write_page(&results.join("formats.md"), &page)
}

fn tried(rows: &[Row]) -> impl Iterator<Item = (&Row, &Tried)> {
    rows.iter()
        .filter_map(|row| row.tried.as_ref().ok().map(|tried| (row, tried)))
}

fn words(rows: &[Row]) -> String {
    let verdicts: Vec<&Result<Verdict, String>> = tried(rows)
        .flat_map(|(_, tried)| &tried.trials)
        .map(|trial| &trial.verdict)
        .collect();
    let count = |is: fn(&Verdict) -> bool| {
        verdicts
            .iter()
            .filter(|verdict| verdict.as_ref().is_ok_and(is))
            .count()
    };
    let verified = count(|verdict| verdict.outcome == Outcome::Verified);
    let found = count(|verdict| verdict.outcome.is_found());
    let judged = verdicts.iter().filter(|verdict| verdict.is_ok()).count();
    format!(
        "Of {judged} copies that could be read, {verified} are verified (every bit), {} are detected, {} are not found; {} files could not be made or read.\n",
        found - verified,
        judged - found,
        verdicts.len() - judged
    )
}

/// A row for each thing that was done, a column for each model.
fn table(rows: &[Row]) -> Table {
    let mut header = vec!["done with the signed model".to_string()];
    header.extend(tried(rows).map(|(row, _)| row.name.clone()));
    let mut table = Table::new("What is found", header).text_columns(1 + tried(rows).count());
    let mut whats: Vec<&str> = Vec::new();
    for what in tried(rows)
        .flat_map(|(_, tried)| &tried.trials)
        .map(|trial| trial.what.as_str())
    {
        if !whats.contains(&what) {
            whats.push(what);
        }
    }
    for what in whats {
        let mut cells = vec![what.to_string()];
        cells.extend(tried(rows).map(|(_, tried)| {
            let trial = tried.trials.iter().find(|trial| trial.what == what);
            trial.map_or_else(String::new, |trial| cell(&trial.verdict))
        }));
        table.row(cells);
    }
    table.note("*verified*: every bit; else the share of the bits and the bound on the probability of chance; *failed*: see below")
}

fn cell(verdict: &Result<Verdict, String>) -> String {
    match verdict {
        Ok(verdict) => match verdict.outcome {
            Outcome::Verified => "verified".into(),
            Outcome::Detected { p } => {
                format!("{:.0} %, {p:.0e}", 100.0 * verdict.extraction_rate.unwrap_or(0.0))
            }
            _ => format!("not found, {:.1e}", verdict.p_value),
        },
        Err(_) => "failed".into(),
    }
}

/// What became of the files themselves.
fn files(rows: &[Row]) -> Table {
    let header = [
        "model",
        "vertices",
        "parts with chips",
        "differs from the model in",
        "new to Khronos' validator",
    ];
    let mut table = Table::new("The signed files", header).text_columns(5);
    for (row, tried) in tried(rows) {
        let outside = match tried.outside_positions.as_deref() {
            Some("same") => "positions and their bounds alone",
            Some(other) => other,
            None => "(no GLB)",
        };
        let issues = match &tried.new_issues {
            Some(issues) if issues.is_empty() => "nothing".into(),
            Some(issues) => issues.join(", "),
            None => "(not asked)".into(),
        };
        table.row([
            row.name.clone(),
            tried.vertices.to_string(),
            tried.marked_parts.to_string(),
            outside.into(),
            issues,
        ]);
    }
    table
}

/// Models that can't be signed, and files that could not be made or read.
fn refused(rows: &[Row]) -> String {
    let mut lines = Vec::new();
    for row in rows {
        match &row.tried {
            Err(error) => lines.push(format!("- {}: {error}", row.name)),
            Ok(tried) => lines.extend(tried.trials.iter().filter_map(|trial| {
                let error = trial.verdict.as_ref().err()?;
                Some(format!("- {}, {}: {error}", row.name, trial.what))
            })),
        }
    }
    match lines.is_empty() {
        true => String::new(),
        false => format!("Not signed, not made, or not read:\n\n{}\n\n", lines.join("\n")),
    }
}
