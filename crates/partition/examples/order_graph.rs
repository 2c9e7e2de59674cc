//! Orders a graph file for Cholesky factorisation and prints the fill.
//!
//! ```text
//! cargo run --release -p partition --example order_graph -- GRAPH [ORDER]
//! ```
//! ORDER: a file of positions, one a line in vertex order (what ndmetis writes), to be judged instead.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::time::Instant;

use partition::{Ordering, OrderingOptions, column_counts, nested_dissection, read_metis};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let path = arguments.first().ok_or("usage: order_graph GRAPH [ORDER]")?;
    let graph = read_metis(&std::fs::read_to_string(path)?)?;
    let start = Instant::now();
    let ordering = match arguments.get(1) {
        Some(file) => read_positions(&std::fs::read_to_string(file)?)?,
        None => nested_dissection(&graph, &OrderingOptions::default())?,
    };
    let seconds = start.elapsed().as_secs_f64();
    let counts = column_counts(&graph, &ordering);
    let operations: f64 = counts.iter().map(|&c| c as f64 * c as f64).sum();
    println!(
        "nnz(L) {} operations {operations:.4e} seconds {seconds:.3}",
        counts.iter().sum::<u64>()
    );
    Ok(())
}

fn read_positions(text: &str) -> Result<Ordering, Box<dyn Error>> {
    let positions: Vec<u32> = text
        .split_ascii_whitespace()
        .map(str::parse)
        .collect::<Result<_, _>>()?;
    let inverse = Ordering::from_order(positions).ok_or("the file is no permutation")?;
    Ordering::from_order(inverse.position).ok_or_else(|| "the file is no permutation".into())
}
