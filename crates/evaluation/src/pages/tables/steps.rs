//! What each part of the reader is worth.

use super::table;
use crate::{
    attacks::{self, Attack},
    output::table::{Entry, MOST_MARGIN, Measured, Table},
    results::{Column, Results, Trial},
    study::{
        product::{SIGMARK, VERIFIER},
        steps::READERS,
    },
};

pub(super) fn steps(results: &Results) -> Table {
    let note = format!(
        "T₀ of Sigmark's marks, mean ± standard deviation over signatures; {MOST_MARGIN} stands for all that is greater. The same attacked meshes are read by ever better readers, each of which has what those above it have: \
                all patches in one look, in the pose of the registration, which least squares better from where misalignment is an unknown. Whatever the code, reading 512 bits takes T₀ ≥ 26.6 (Shannon: √(2 ln 2 · 512)). The code: how many signatures \
                the verifier read whole; it tries other poses, too."
    );
    let attacks = &attacks::tables().table4;
    let names = attacks.iter().map(|attack| attack.name.as_str());
    let header = ["model", "reader"].into_iter().chain(names);
    let mut table = table("What each part of the reader is worth", &note, header);
    for (outcome, column) in results.columns() {
        let is_read = column.marked().any(|trial| !trial.cell.steps.is_empty());
        if column.algorithm != SIGMARK || !is_read {
            continue;
        }
        for (i, reader) in READERS.iter().enumerate() {
            let first = [outcome.title(), reader.adds.into()].map(Entry::from);
            let margins = attacks.iter().map(|attack| margins(column, attack, i).into());
            table.row(first.into_iter().chain(margins));
        }
        let first = [outcome.title(), "+ the code: verified".into()].map(Entry::from);
        let verified = attacks.iter().map(|attack| verified(column, attack).into());
        table.row(first.into_iter().chain(verified));
    }
    table
}

/// Of the reader of this number.
fn margins(column: &Column, attack: &Attack, reader: usize) -> Measured {
    let of = |trial: &Trial| {
        trial
            .cell
            .steps
            .get(reader)
            .map(|step| step.margin.min(MOST_MARGIN))
    };
    let trials = column.marked().filter(|trial| trial.attack == attack);
    Measured::new(trials.filter_map(of).collect(), None, 1)
}

fn verified(column: &Column, attack: &Attack) -> String {
    let verified: Vec<bool> = column
        .rated(attack, &VERIFIER)
        .map(|(_, rated)| rated.verified)
        .collect();
    let count = verified.iter().filter(|verified| **verified).count();
    format!("{count}/{}", verified.len())
}
