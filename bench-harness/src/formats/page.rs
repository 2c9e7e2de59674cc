//! The page of the formats: what came of the signed models in other programs, and how their pictures differ. Each part says by what it was made,
//! since pictures can be compared alone.

use std::{fs, path::Path};

use anyhow::{Context, Result};
use evaluation::{machine, sources, table::Table};
use sigmark::{Compared, Outcome, Verdict};

use super::{
    Row, Tried,
    converters::Converters,
    painter::{Difference, Painter},
    trial::{FAILED, Trial},
};
use crate::results;

/// With what the part of the pictures begins.
const DRAWN: &str = "Drawn before and after";

/// Writes the page and its CSV. Where no programs were asked, the page keeps what it says of them.
pub(super) fn write(rows: &[Row], painter: &Result<Painter>, converters: Option<&Converters>) -> Result<()> {
    let results = results::folder()?;
    let path = results.join("formats.md");
    let programs = match converters {
        Some(converters) => programs(rows, converters, &results)?,
        None => programs_of(&path)?,
    };
    let pictures = match painter {
        Ok(painter) => pictures(rows, painter, &results)?,
        Err(error) => format!("## {DRAWN}\n\nPictures were not compared: {error:#}.\n"),
    };
    results::write_page(&path, &format!("{programs}\n{pictures}"))
}

/// What an earlier run wrote of the programs.
fn programs_of(page: &Path) -> Result<String> {
    let text = fs::read_to_string(page).with_context(|| page.display().to_string())?;
    let (programs, _) = text.split_once(&format!("\n## {DRAWN}\n")).unwrap_or((&text, ""));
    Ok(programs.into())
}

fn programs(rows: &[Row], converters: &Converters, results: &Path) -> Result<String> {
    let table = found(rows);
    table.write_csv(&results.join("formats.csv"))?;
    let originals = originals(rows);
    originals.write_csv(&results.join("formats-originals.csv"))?;
    Ok(format!(
        "# Through other programs, and back in another format\n\nWritten by `cargo xtask bench formats --assets DIR`. Each model is signed with the default strength, taken through \
         the program (at rest, where it has a skeleton), and what comes back is verified with the original file.\n\n{}\n{}\n{}\n{}\n{}{}, {}; {}.\n",
        words(rows),
        table.markdown(),
        originals.markdown(),
        files(rows).markdown(),
        refused(rows),
        machine::description(),
        converters.versions()?,
        sources::commit(),
    ))
}

fn pictures(rows: &[Row], painter: &Painter, results: &Path) -> Result<String> {
    let table = drawn(rows);
    table.write_csv(&results.join("formats-drawn.csv"))?;
    Ok(format!(
        "{}\n{}{}, {}; {}.\n",
        table.markdown(),
        not_drawn(rows),
        machine::description(),
        painter.versions(),
        sources::commit(),
    ))
}

fn tried(rows: &[Row]) -> impl Iterator<Item = (&Row, &Tried)> {
    rows.iter()
        .filter_map(|row| row.tried.as_ref().map(|tried| (row, tried)))
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

/// Of each thing that was done with a signed model, whether it is found.
fn found(rows: &[Row]) -> Table {
    let table = table(
        rows,
        "What is found",
        "done with the signed model",
        |tried| &tried.trials,
        cell,
    );
    table.note("*verified*: every bit; else the share of the bits and the bound on the probability of chance; *failed*: see below")
}

/// Whether what programs made of the originals is recognised.
fn originals(rows: &[Row]) -> Table {
    let table = table(
        rows,
        "Originals that were exported anew",
        "done with the original",
        |tried| &tried.of_originals,
        recognised,
    );
    table.note(
        "*recognised*: the signed model is verified with that file for its owner's information, and the verdict says that a claim needs the very file; *the same*: the file holds the very \
         geometry, and the verdict is as with the original. The others hold other geometry: quads that were split the other way; wheels and morph targets where the file's animation \
         has them at first; coordinates so coarse that parts grow together; or, of parts that a scene shows in several places, another one first.",
    )
}

/// A row for each thing that was done, a column for each model.
fn table(
    rows: &[Row],
    title: &str,
    done: &str,
    trials: fn(&Tried) -> &Vec<Trial>,
    cell: fn(&Result<Verdict, String>) -> String,
) -> Table {
    let mut header = vec![done.to_string()];
    header.extend(tried(rows).map(|(row, _)| row.name.clone()));
    let mut table = Table::new(title, header).text_columns(1 + tried(rows).count());
    let mut whats: Vec<&str> = Vec::new();
    for what in tried(rows)
        .flat_map(|(_, tried)| trials(tried))
        .map(|trial| trial.what.as_str())
    {
        if !whats.contains(&what) {
            whats.push(what);
        }
    }
    for what in whats {
        let mut cells = vec![what.to_string()];
        cells.extend(tried(rows).map(|(_, tried)| {
            let trial = trials(tried).iter().find(|trial| trial.what == what);
            trial.map_or_else(String::new, |trial| cell(&trial.verdict))
        }));
        table.row(cells);
    }
    table
}

fn recognised(verdict: &Result<Verdict, String>) -> String {
    match verdict {
        Ok(verdict) => match verdict.compared_with {
            _ if verdict.outcome != Outcome::Verified => "not verified",
            Compared::SameGeometry { .. } => "recognised",
            Compared::Original => "the same",
            _ => "?",
        },
        Err(error) if error.starts_with(FAILED) => "failed",
        Err(_) => "no",
    }
    .into()
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
            Some("same") => "positions (and their bounds) alone",
            Some(other) => other,
            None => "(not asked)",
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
        lines.extend(row.refused.iter().map(|error| format!("- {}: {error}", row.name)));
        for trial in row.tried.iter().flat_map(|tried| &tried.trials) {
            if let Err(error) = &trial.verdict {
                lines.push(format!("- {}, {}: {error}", row.name, trial.what));
            }
        }
    }
    match lines.is_empty() {
        true => String::new(),
        false => format!("Not signed, not made, or not read:\n\n{}\n\n", lines.join("\n")),
    }
}

/// How pictures of the signed models differ from those of the originals.
fn drawn(rows: &[Row]) -> Table {
    let header = [
        "model",
        "light",
        "mean",
        "99.9 % below",
        "most",
        "look different",
        "JPEG: mean",
        "99.9 % below",
        "most",
        "look different",
    ];
    let mut table = Table::new(DRAWN, header).text_columns(2);
    for row in rows {
        let Some(Ok(drawn)) = &row.drawn else { continue };
        for (light, compared) in &drawn.lights {
            let mut cells = vec![row.name.clone(), light.clone()];
            cells.extend(figures(&compared.signed));
            cells.extend(figures(&compared.jpeg));
            table.row(cells);
        }
    }
    table.note(
        "Each model is drawn before and after it was signed, at rest, by the same camera from two sides. *day* is its own materials and normals in a bright room; *raking* its facets as \
         of plaster in light that grazes them: where a change of positions shows most, and what programs show that pass over the file's normals. Of each pixel that shows the model the \
         channel that differs most counts, from 0 to 255; pixels on edges differ most, since an edge moves by a part of a pixel. *Look different* is \
         the share of them that pixelmatch counts (threshold 0.1, smoothed edges left out). The same file drawn twice gives the same picture to the last bit. *JPEG*, for comparison: what quality 90 makes of the original's picture.",
    )
}

fn figures(difference: &Difference) -> [String; 4] {
    let Difference {
        mean,
        p999,
        max,
        share,
    } = difference;
    [
        format!("{mean:.2}"),
        p999.to_string(),
        max.to_string(),
        format!("{:.3} %", 100.0 * share),
    ]
}

/// Models that were signed but of which there are no pictures.
fn not_drawn(rows: &[Row]) -> String {
    let reason = |row: &Row| match &row.drawn {
        Some(Ok(_)) => None,
        Some(Err(error)) => Some(error.clone()),
        None if row.refused.is_some() => None,
        None => Some("its format is not drawn".into()),
    };
    let lines: Vec<String> = rows
        .iter()
        .filter_map(|row| Some(format!("- {}: {}\n", row.name, reason(row)?)))
        .collect();
    match lines.is_empty() {
        true => String::new(),
        false => format!("Not drawn:\n\n{}\n", lines.concat()),
    }
}
