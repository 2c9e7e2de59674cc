//! The lowest eigenpairs of a mesh file, and how long each phase takes.
//!
//! ```text
//! cargo run --release -p sigmark-mhb-core --example lowest -- model.ply 325 1e-6 2
//! ```
#![allow(clippy::print_stdout)]

use std::{path::Path, time::Instant};

use mesh_io::Asset;
use mhb_core::{Spectrum, Stopwatch};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, count, tolerance, threads] = &arguments[..] else {
        return Err("usage: lowest MESH COUNT TOLERANCE THREADS".into());
    };
    let asset = Asset::open(Path::new(model))?;
    let begun = Instant::now();
    let stopwatch = Stopwatch::new(|| begun.elapsed());
    let spectrum = Spectrum::builder()
        .count(count.parse()?)
        .tolerance(tolerance.parse()?)
        .threads(threads.parse()?)
        .observer(&stopwatch)
        .compute(asset.mesh())?;
    for (phase, time) in stopwatch.timings() {
        println!("{phase:?}: {:.3} s", time.as_secs_f64());
    }
    let worst = spectrum.residuals().iter().copied().fold(0.0, f64::max);
    println!("worst relative residual: {worst:.1e}");
    println!("none missing: {}", spectrum.certificate().complete);
    Ok(())
}
