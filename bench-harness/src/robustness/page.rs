//! The page of the robustness.

use anyhow::Result;
use evaluation::{
    attacks::tables,
    machine,
    python::Python,
    sources,
    table::{MOST_MARGIN, Table},
};
use sigmark::PayloadKind;

use super::{Attacked, Read};
use crate::results;

/// Writes the page and its CSV file. `code`: the digest of what the figures depend on.
pub(super) fn write(models: &[Attacked], payload: PayloadKind, python: &Python, code: &str) -> Result<()> {
    let results = results::folder()?;
    let (name, option, held) = match payload {
        PayloadKind::Tag => ("robustness_tag", " --tag", "a tag of 128 bits"),
        _ => ("robustness", "", "the whole signature, 512 bits"),
    };
    long(models).write_csv(&results.join(format!("{name}.csv")))?;
    let page = format!(
        "# What is left after attacks\n\nWritten by `cargo xtask bench robustness{option}`. Each model is signed once as `sigmark embed` does it, with {held}; attacked; moved, turned and scaled at random; and judged by the code of \
         `sigmark verify`. **V** is verified: the payload was read back, whole. *d* is detected, p ≤ 10⁻⁶ (all of these but those in brackets are evidence, p ≤ 2⁻¹²⁰), – is not found. The number is T₀, the signal-to-noise ratio of the patches that were read: reading stops at the first look that \
         has all, so where it is verified it is no measure of what is left. {name}.csv has the share of right bits and p. An empty cell is an attack that could not be carried out.\n\n{}\n{}\n\n{}, {}; {}. Code {}, sources' digest {code}.\n",
        wide(models).markdown(),
        counted(models),
        machine::description(),
        python.versions()?,
        machine::load(),
        sources::commit(),
    );
    results::write_page(&results.join(format!("{name}.md")), &page)
}

fn counted(models: &[Attacked]) -> String {
    let read = || {
        models
            .iter()
            .flat_map(|model| &model.read)
            .filter_map(|(_, read)| read.as_ref())
    };
    let count = |is: &dyn Fn(&Read) -> bool| read().filter(|read| is(read)).count();
    format!(
        "Of {} attacked copies {} are verified, in {} more p < 10⁻¹², and {} are not found.",
        read().count(),
        count(&|read| read.outcome == "verified"),
        count(&|read| read.outcome != "verified" && read.outcome != "not found" && read.p < 1e-12),
        count(&|read| read.outcome == "not found"),
    )
}

fn wide(models: &[Attacked]) -> Table {
    let header = std::iter::once("attack".to_string()).chain(models.iter().map(|model| model.model.clone()));
    let header: Vec<String> = header.collect();
    let mut table = Table::new("Verdicts", header.iter().map(String::as_str));
    table.row(
        std::iter::once("foretold T₀, noise 0.1 %".to_string())
            .chain(models.iter().map(|model| format!("{:.0}", model.foretold))),
    );
    for (i, attack) in tables().of_marks().enumerate() {
        let cells = models.iter().map(|model| {
            let read = model.read.get(i).and_then(|(_, read)| read.as_ref());
            read.map_or_else(String::new, cell)
        });
        table.row(std::iter::once(attack.name.clone()).chain(cells));
    }
    table
}

fn cell(read: &Read) -> String {
    let margin = read
        .margin
        .map_or_else(String::new, |margin| format!(" {:.0}", margin.min(MOST_MARGIN)));
    match read.outcome.as_str() {
        "verified" => format!("**V**{margin}"),
        "detected" if read.is_evidence => format!("*d*{margin}"),
        "detected" => format!("(*d*{margin})"),
        _ => format!("–{margin}"),
    }
}

fn long(models: &[Attacked]) -> Table {
    let header = "model | attack | outcome | evidence | T0 | p | bits | wrong | patches";
    let mut table = Table::new("Verdicts", header.split(" | "));
    for model in models {
        for (spec, read) in &model.read {
            let Some(read) = read else { continue };
            table.row([
                model.model.clone(),
                spec.clone(),
                read.outcome.clone(),
                read.is_evidence.to_string(),
                read.margin
                    .map_or_else(String::new, |margin| format!("{margin:.1}")),
                format!("{:.1e}", read.p),
                read.bits.to_string(),
                read.errors.map_or_else(String::new, |errors| errors.to_string()),
                read.patches.to_string(),
            ]);
        }
    }
    table
}
