//! The page of the partitioner.

use anyhow::Result;
use evaluation::{machine, table::Table};
use partition::Partition;

use super::compared::ComparedDivision;
use crate::{
    measure::{geometric_mean, greatest},
    results,
};

/// Below this, METIS' clock, which counts milliseconds, says nothing about a ratio.
const LEAST_SECONDS: f64 = 0.010;

/// Writes the page and its CSV file.
pub(crate) fn write(all: &[ComparedDivision], rounds: usize) -> Result<()> {
    let results = results::folder()?;
    let (cuts, summary) = (cut_table(all), summary(all));
    cuts.write_csv(&results.join("partition.csv"))?;
    let page = format!(
        "# The partitioner beside METIS\n\nWritten by `cargo xtask bench partition`: METIS 5.1 (`gpmetis`, defaults, one run) and ours, default effort and seed 0, on the same graphs, \
         at 3 % imbalance. Everyone's parts are judged by the same code. METIS' seconds are those that it reports for the partitioning alone; ours are CPU seconds on one thread and \
         wall seconds on two; medians of {rounds} round(s). Memory is the most that a process held which divides on one thread: of METIS' from its start, of ours since it has read the graph. \"Pieces\" counts connected components of all parts.\n\n\
         {summary}\n{}\n{}; {}.\n",
        cuts.markdown(),
        machine::description(),
        machine::load(),
    );
    print!("\n{summary}");
    results::write_page(&results.join("partition.md"), &page)
}

/// Means over all cases, in words.
fn summary(all: &[ComparedDivision]) -> String {
    let ratios = || all.iter().map(ComparedDivision::ratio);
    let to_kaffpa = || all.iter().filter_map(ComparedDivision::ratio_to_kaffpa);
    let metis_to_kaffpa = |case: &ComparedDivision| Some(case.metis.cut as f64 / case.kaffpa? as f64);
    let timed = || all.iter().filter(|case| case.metis_seconds >= LEAST_SECONDS);
    let mut text = format!(
        "- cut / METIS' cut: {:.3} (geometric mean of {}), worst {:.3}\n\
         - CPU time / METIS' on one thread: {:.2}; wall time on two: {:.2} (geometric means of the cases in which METIS needs {LEAST_SECONDS} s or more)\n\
         - high effort: cut / METIS' cut {:.3}, CPU time / METIS' {:.1}\n",
        geometric_mean(ratios()),
        all.len(),
        greatest(ratios()),
        geometric_mean(timed().map(|case| case.one_thread.cpu / case.metis_seconds)),
        geometric_mean(timed().map(|case| case.two_threads.wall / case.metis_seconds)),
        geometric_mean(all.iter().map(ComparedDivision::high_ratio)),
        geometric_mean(timed().map(|case| case.high_seconds / case.metis_seconds)),
    );
    let memory = |case: &ComparedDivision| Some(case.our_memory? as f64 / case.metis_memory? as f64);
    let memory: Vec<f64> = all.iter().filter_map(memory).collect();
    if !memory.is_empty() {
        let (mean, worst) = (geometric_mean(memory.iter().copied()), greatest(memory));
        text += &format!("- memory / METIS': {mean:.2} (geometric mean), worst {worst:.2}\n");
    }
    if to_kaffpa().next().is_some() {
        text += &format!(
            "- high effort: cut / KaFFPa-strong's cut (one run, seed 0) {:.3} (geometric mean of {}), worst {:.3}; METIS' {:.3}\n",
            geometric_mean(to_kaffpa()),
            to_kaffpa().count(),
            greatest(to_kaffpa()),
            geometric_mean(all.iter().filter_map(metis_to_kaffpa)),
        );
    }
    text
}

/// A line a case.
fn cut_table(all: &[ComparedDivision]) -> Table {
    let header = "graph | k | METIS cut | our cut | ratio | high effort | KaFFPa-strong | METIS imbalance | our imbalance | METIS volume | our volume | METIS pieces | our pieces | METIS (s) | ours, 1 thread (s) | ours, 2 threads (s) | high effort (s) | METIS (MB) | ours (MB)";
    let mut table = Table::new("Divisions", header.split(" | "));
    for case in all {
        let pieces = |partition: &Partition| partition.components.iter().sum::<usize>().to_string();
        table.row([
            case.graph.clone(),
            case.parts.to_string(),
            case.metis.cut.to_string(),
            case.ours.cut.to_string(),
            format!("{:.3}", case.ratio()),
            case.high.cut.to_string(),
            case.kaffpa.map_or_else(String::new, |cut| cut.to_string()),
            format!("{:.3}", case.metis.imbalance),
            format!("{:.3}", case.ours.imbalance),
            case.metis.communication_volume.to_string(),
            case.ours.communication_volume.to_string(),
            pieces(&case.metis),
            pieces(&case.ours),
            format!("{:.3}", case.metis_seconds),
            format!("{:.3}", case.one_thread.cpu),
            format!("{:.3}", case.two_threads.wall),
            format!("{:.3}", case.high_seconds),
            megabytes(case.metis_memory),
            megabytes(case.our_memory),
        ]);
    }
    table
}

fn megabytes(bytes: Option<u64>) -> String {
    bytes.map_or_else(String::new, |bytes| format!("{:.1}", bytes as f64 / 1e6))
}
