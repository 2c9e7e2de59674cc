//! The tables: 1–5, what they leave unexplained, and what lies beyond the paper. Each is a function of the results.

mod cells;
mod costs;
mod marks;
mod rates;
mod steps;

use baselines::AlgorithmId;

pub(super) use cells::cells;

use crate::{attacks, output::table::Table, results::Results};

/// What the figures in brackets behind rates that are not the paper's rule's say.
const MARGINS: &str = " T₀: the signal-to-noise ratio of all bits together. Sigmark: what `sigmark embed` writes by default, at the same d_rmse, its rate that of the code's bits as `sigmark verify` reads them, with T₀ and how many of the signatures \
     were verified, every bit of them; reading stops where it has all, so that T₀ is then of the patches read so far. Its tag is written in one mesh each.";

/// All tables that have rows, by their files' names.
pub(super) fn all(results: &Results) -> Vec<(&'static str, Table)> {
    let tables = attacks::tables();
    let shows_margins = results.columns().any(|(_, column)| column.has_margins());
    let mut note = format!(
        "Ours, mean ± standard deviation over {} signatures (paper's). Bold: more than five points below the printed figure. Rows without brackets are not in the paper. \
         At d_rmse of the paper's own table for that size class, in per cent of the diagonal.",
        results.signatures
    );
    if shows_margins {
        note += MARGINS;
    }
    let beyond = "Crops keep that share of the vertices. Bits: coordinates rounded to so many. LIRIS: noise and smoothing as the benchmark of Wang, Lavoué et al. (2010) defines them.";
    let meshlab = "As Table 4. MeshLab removes the cheapest edge of all each time, as in the paper's source; fast-simplification, which stands in Table 4, removes all edges below a rising threshold.";
    let times = |title, note, algorithm| costs::times(results, title, note, algorithm);
    let rates = |title, note: &str, attacks| rates::robustness(results, title, note, attacks);
    let table4 = "Table 4: extraction rate (%) under attacks";
    let table5 = "Table 5: extraction rate (%) under combinations of attacks";
    let others = "Beyond the paper: extraction rate (%) under other attacks";
    let all = [
        (
            "table1",
            times("Table 1: run time of MHBs", costs::TIMES, &AlgorithmId::MHB),
        ),
        (
            "table2",
            times("Table 2: run time of LBFs", "As Table 1.", &AlgorithmId::LBF),
        ),
        (
            "table3",
            times("Table 3: run time of RBFs", "As Table 1.", &AlgorithmId::RBF),
        ),
        ("table4", rates(table4, &note, &tables.table4)),
        ("table5", rates(table5, &note, &tables.table5)),
        (
            "meshlab",
            rates("Table 4, simplification by MeshLab", meshlab, &tables.meshlab),
        ),
        ("beyond", rates(others, beyond, &tables.beyond)),
        ("readers", steps::steps(results)),
        ("shortfalls", rates::shortfalls(results)),
        ("distortion", marks::distortion(results)),
        ("fig2", marks::sweep(results)),
        ("controls", rates::controls(results)),
        ("costs", costs::costs(results)),
    ];
    all.into_iter()
        .filter(|(_, table)| !table.rows.is_empty())
        .collect()
}

/// A table of the reproduction: model and algorithm, or the like, come first.
fn table(title: &str, note: &str, header: impl IntoIterator<Item: AsRef<str>>) -> Table {
    Table::new(title, header).note(note).text_columns(2)
}
