//! Divides a graph file and prints the figures.
//!
//! ```text
//! cargo run --release -p sigmark-partition --example partition_graph -- GRAPH PARTS[,PARTS…] [key=value…]
//! ```
//! Keys: imbalance, seed, threads, effort (fast, default, high), method (direct, bisection), contiguous (true, false),
//! runs (best time of so many is printed).
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::time::Instant;

use job::Job;
use partition::{Effort, Graph, Method, Options, partition, read_metis};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, parts, settings @ ..] = arguments.as_slice() else {
        return Err("usage: partition_graph GRAPH PARTS[,PARTS...] [key=value...]".into());
    };
    let graph = read_metis(&std::fs::read_to_string(path)?)?;
    let mut options = Options::default();
    let (mut runs, mut threads) = (1, 1);
    for setting in settings {
        let (key, value) = setting
            .split_once('=')
            .ok_or("settings have the form key=value")?;
        match key {
            "runs" => runs = value.parse()?,
            "threads" => threads = value.parse()?,
            _ => set(&mut options, key, value)?,
        }
    }
    for parts in parts.split(',') {
        options.parts = parts.parse()?;
        report(&graph, &options, runs, &Job::new(threads))?;
    }
    Ok(())
}

fn set(options: &mut Options, key: &str, value: &str) -> Result<(), Box<dyn Error>> {
    match (key, value) {
        ("imbalance", _) => options.imbalance = value.parse()?,
        ("seed", _) => options.seed = value.parse()?,
        ("contiguous", _) => options.contiguous = value.parse()?,
        ("effort", "fast") => options.effort = Effort::Fast,
        ("effort", "default") => options.effort = Effort::Default,
        ("effort", "high") => options.effort = Effort::High,
        ("method", "direct") => options.method = Method::Direct,
        ("method", "bisection") => options.method = Method::RecursiveBisection,
        _ => return Err(format!("unknown setting {key}={value}").into()),
    }
    Ok(())
}

fn report(graph: &Graph, options: &Options, runs: usize, job: &Job) -> Result<(), Box<dyn Error>> {
    let mut seconds = f64::INFINITY;
    let mut best = None;
    for _ in 0..runs.max(1) {
        let start = Instant::now();
        let result = partition(graph, options, job)?;
        seconds = seconds.min(start.elapsed().as_secs_f64());
        best = Some(result);
    }
    if let Some(result) = best {
        println!(
            "parts {} cut {} imbalance {:.4} balanced {} components {} volume {} seconds {seconds:.4}",
            result.parts(),
            result.cut,
            result.imbalance,
            result.balanced,
            result.components.iter().sum::<usize>(),
            result.communication_volume,
        );
    }
    Ok(())
}
