//! The page of what one waits for.

use anyhow::Result;
use evaluation::{machine, python::Python, sources, table::Table};

use super::{
    program::THREADS,
    runs::{Layout, Timed, Work},
};
use crate::results;

/// What the code of commit 01cf122 took, before patches shared one signature: wall seconds and gigabytes. Measured once by hand, on a machine that had other work
/// to do, and so not by this benchmark; the default layout of that code on the mesh [`BEFORE_ON`].
const BEFORE: [(Work, f64, f64); 3] = [
    (Work::Embed, 77.6, 1.07),
    (Work::Untouched, 155.0, 1.29),
    (Work::Decimated(30), 93.0, 1.74),
];

const BEFORE_ON: &str = "ct_skull_1081k_closed";

const GIGABYTE: f64 = 1e9;

/// Writes the page and its CSV file. `code`: the digest of what the figures depend on.
pub(super) fn write(all: &[Timed], attacks: &Python, code: &str) -> Result<()> {
    let results = results::folder()?;
    let table = table(all);
    table.write_csv(&results.join("seconds.csv"))?;
    let page = format!(
        "# How long one waits\n\nWritten by `cargo xtask bench seconds`.\n\n{}\n\n{}\n{}, {}; {}. Code {}, digest of sources and program {code}.\n",
        words(),
        table.markdown(),
        machine::description(),
        attacks.versions()?,
        machine::load(),
        sources::commit(),
    );
    results::write_page(&results.join("seconds.md"), &page)
}

fn words() -> String {
    format!(
        "Each row is the release build of `sigmark` in a process of its own, with {THREADS} threads, from its start to its end: reading and writing files is included. Models and copies are binary PLY files in single precision. \
         *_divided* is the same surface with every triangle split in four at the midpoints of its edges. *Moved* copies are half as large and turned by a quarter about z, which is exact in floating point, and have vertices and triangles \
         in random order. *Decimated* copies are made by fast-simplification and have so many per cent of the triangles. The *paper*'s layout is that of `--profile paper`: patches below 30 000 vertices, 325 harmonics in each, \
         a signature of 324 bits; all patches are read. *Patches* are those of the mark; where the program says how many of them it read, that stands before. \
         Seconds are medians over the rounds. CPU seconds are user and system time of all threads; memory is the most that the process held, in gigabytes (10⁹ bytes).\n\n\
         *Before* is what the code of commit 01cf122 took, whose default wrote the whole signature into every patch and read all of them. It was measured once, by hand, on a machine that had other work to do: it says how much was gained, not to the per cent. \
         The rows of the paper's layout are the comparison that anyone can run again."
    )
}

fn table(all: &[Timed]) -> Table {
    let header = [
        "mesh",
        "layout",
        "command",
        "answer",
        "vertices",
        "patches",
        "rounds",
        "wall (s)",
        "CPU (s)",
        "memory (GB)",
        "before: wall (s)",
        "before: memory (GB)",
    ];
    let mut table = Table::new("Signing and verifying", header).text_columns(4);
    let figure = |value: Option<f64>, digits: usize| {
        value.map_or_else(String::new, |value| format!("{value:.digits$}"))
    };
    for timed in all {
        let before = before(timed);
        let memory = timed.spent.memory.map(|bytes| bytes as f64 / GIGABYTE);
        table.row([
            timed.mesh.clone(),
            timed.layout.to_string(),
            timed.work.to_string(),
            timed.answer.clone(),
            timed.vertices.to_string(),
            patches(timed),
            timed.rounds.to_string(),
            figure(Some(timed.spent.wall), 1),
            figure(timed.spent.cpu, 1),
            figure(memory, 2),
            figure(before.map(|(wall, _)| wall), 1),
            figure(before.map(|(_, memory)| memory), 2),
        ]);
    }
    table
}

/// Wall seconds and gigabytes of [`BEFORE`].
fn before(timed: &Timed) -> Option<(f64, f64)> {
    let mut known = BEFORE.iter();
    let is_known = timed.mesh == BEFORE_ON && timed.layout == Layout::Default;
    let &(_, wall, memory) = known.find(|(work, ..)| is_known && *work == timed.work)?;
    Some((wall, memory))
}

fn patches(timed: &Timed) -> String {
    match timed.patches_read {
        Some(read) => format!("{read} of {}", timed.patches),
        None => timed.patches.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::{super::program::Spent, *};

    #[test]
    fn earlier_figures_stand_beside_the_same_mesh_and_the_same_layout_only() {
        let timed = |mesh: &str, layout, work| Timed {
            mesh: mesh.into(),
            vertices: 10,
            layout,
            work,
            answer: "verified".into(),
            patches: 99,
            patches_read: Some(4),
            rounds: 1,
            spent: Spent {
                wall: 9.94,
                cpu: None,
                memory: Some(1_250_000_000),
            },
        };
        let table = table(&[
            timed(BEFORE_ON, Layout::Default, Work::Decimated(30)),
            timed(BEFORE_ON, Layout::Default, Work::Decimated(5)),
            timed(BEFORE_ON, Layout::Paper, Work::Untouched),
            timed("another", Layout::Default, Work::Untouched),
        ]);
        assert_eq!(
            table.rows[0][5..],
            ["4 of 99", "1", "9.9", "", "1.25", "93.0", "1.74"]
        );
        for row in &table.rows[1..] {
            assert_eq!(row[10..], ["", ""]);
        }
    }
}
