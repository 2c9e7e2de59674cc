//! The tables: 1–5, what they leave unexplained, and what lies beyond the paper. Each is a function of the results.

mod cells;
mod costs;
mod marks;
mod rates;

use crate::{attacks, output::table::Table, results::Results};

/// All tables that have rows, by their files' names.
pub(super) fn all(results: &Results) -> Vec<(&'static str, Table)> {
    let tables = attacks::tables();
    let note = format!(
        "Ours, mean ± standard deviation over {} signatures (paper's). Bold: more than five points below the printed figure. Rows without brackets are not in the paper. \
         At d_rmse of the paper's own table for that size class, in per cent of the diagonal.",
        results.signatures
    );
    let all = [
        ("table1", costs::table1(results)),
        ("table2", costs::table2(results)),
        ("table3", costs::table3(results)),
        (
            "table4",
            rates::robustness(
                results,
                "Table 4: extraction rate (%) under attacks",
                &note,
                &tables.table4,
            ),
        ),
        (
            "table5",
            rates::robustness(
                results,
                "Table 5: extraction rate (%) under combinations of attacks",
                &note,
                &tables.table5,
            ),
        ),
        (
            "meshlab",
            rates::robustness(
                results,
                "Table 4, simplification by MeshLab",
                "As Table 4. MeshLab removes the cheapest edge of all each time, as in the paper's source; fast-simplification, which stands in Table 4, removes all edges below a rising threshold.",
                &tables.meshlab,
            ),
        ),
        (
            "beyond",
            rates::robustness(
                results,
                "Beyond the paper: extraction rate (%) under other attacks",
                "Crops keep that share of the vertices. Bits: coordinates rounded to so many. LIRIS: noise and smoothing as the benchmark of Wang, Lavoué et al. (2010) defines them.",
                &tables.beyond,
            ),
        ),
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

/// Every cell, a line for each detector. It is written as CSV alone.
pub(super) fn cells(results: &Results) -> Table {
    cells::cells(results)
}

/// A table of the reproduction: model and algorithm, or the like, come first.
fn table(title: &str, note: &str, header: &[&str]) -> Table {
    Table::new(title, header).note(note).text_columns(2)
}
