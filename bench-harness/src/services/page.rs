//! The page of the services.

use anyhow::Result;
use evaluation::{machine, table::Table};

use super::{Batch, Batches, Sold};
use crate::results;

/// Writes the page.
pub(super) fn write(sold: &[(String, Sold)], batches: (&str, &Batches)) -> Result<()> {
    let folder = results::folder()?;
    let page = format!(
        "# A copy at download, and batches\n\nWritten by `cargo xtask bench services`, on the wheel as its users have it.\n\n\
         ## A copy at download\n\nThe shop of [bindings/python/examples/downloads](../bindings/python/examples/downloads/README.md): `prepare` is what does not depend on the buyer, `embed` a copy after that, in one process on all cores. \
         The service then signs for so many buyers at once, each of whom asks for one order after the other; p50 and p99 are seconds from the question to the last byte.\n\n{}\n{}\n\
         Killed (SIGKILL) in the middle of a load and started again, with four buyers who then ask for all orders:\n\n{}\n\
         ## Batches\n\nBy `sigmark.batch`, as serial runs and by Daft on this machine; core hours are wall time by cores, those that wait included.\n\n{}\n{}\n{}; {}.\n",
        prepared(sold).markdown(),
        loads(sold).markdown(),
        killed(sold),
        costs(batches).markdown(),
        on_paper(batches.1),
        machine::description(),
        machine::load(),
    );
    results::write_page(&folder.join("services.md"), &page)
}

fn prepared(sold: &[(String, Sold)]) -> Table {
    let header = [
        "model",
        "vertices",
        "file (MB)",
        "prepare (s)",
        "embed (s)",
        "first answer (s)",
    ];
    let mut table = Table::new("What a copy takes", header);
    for (name, model) in sold {
        table.row([
            name.clone(),
            model.vertices.to_string(),
            format!("{:.1}", model.bytes as f64 / 1e6),
            format!("{:.2}", model.prepare),
            format!("{:.3}", model.embed),
            format!("{:.2}", model.first),
        ]);
    }
    table
}

fn loads(sold: &[(String, Sold)]) -> Table {
    let header = [
        "model",
        "buyers at once",
        "answered",
        "p50 (s)",
        "p99 (s)",
        "copies a second",
    ];
    let mut table = Table::new("The service under load", header);
    for (name, model) in sold {
        for load in &model.loads {
            table.row([
                name.clone(),
                load.clients.to_string(),
                format!("{} of {}", load.answered, load.asked),
                format!("{:.3}", load.p50),
                format!("{:.3}", load.p99),
                format!("{:.1}", load.per_second),
            ]);
        }
    }
    table
}

fn killed(sold: &[(String, Sold)]) -> String {
    let lines = sold.iter().map(|(name, model)| {
        let killed = &model.killed;
        let named = if killed.leak_named { "and no other" } else { "WRONG" };
        format!(
            "- **{name}**: {} of {} orders were answered before; {:.1} s after the start all {} are. Of the copies that were out, {} of {} have the same bytes when they are asked for again; {} copies have no certificate on the disk. \
             One copy traced among {} certificates names its order, {named}.\n",
            killed.answered_before,
            killed.orders,
            killed.seconds_until_all_are_answered,
            killed.answered_after,
            killed.same_bytes,
            killed.answered_before,
            killed.without_certificate,
            killed.certificates,
        )
    });
    lines.collect()
}

fn costs((name, batches): (&str, &Batches)) -> Table {
    let header = [
        "operation",
        "engine",
        "rows",
        "errors",
        "wall (s)",
        "cores",
        "core hours a thousand",
        "same rows",
    ];
    let mut table = Table::new(&format!("{name}, {} vertices", batches.vertices), header).text_columns(2);
    for (operation, batch) in operations(batches) {
        for (engine, cost) in [("serial", &batch.serial), ("Daft", &batch.native)] {
            table.row([
                operation.into(),
                engine.into(),
                cost.rows.to_string(),
                cost.errors.to_string(),
                format!("{:.1}", cost.wall),
                cost.cores.to_string(),
                format!("{:.2}", cost.of_a_thousand()),
                if batch.same { "yes" } else { "NO" }.into(),
            ]);
        }
    }
    table
}

fn operations(batches: &Batches) -> [(&'static str, &Batch); 2] {
    [("embed", &batches.embed), ("verify", &batches.verify)]
}

/// Ten million rows at the price of those that were measured, start of the engine and preparation included.
fn on_paper(batches: &Batches) -> String {
    let lines = operations(batches).map(|(operation, batch)| {
        let hours = 1e4 * batch.native.of_a_thousand();
        format!(
            "- `{operation}`: {hours:.0} core hours for ten million, {:.1} hours on 1000 cores\n",
            hours / 1000.0
        )
    });
    format!(
        "On paper, at the same price a row (rows of one original follow each other, and its preparation and the engine's start are shared by {} of them here; where every row has another original, add one preparation a row):\n\n{}",
        batches.embed.native.rows,
        lines.concat()
    )
}
