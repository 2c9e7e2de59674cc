//! The lowest eigenpairs of a mesh file, and how long each stage takes.
//!
//! ```text
//! cargo run --release -p sigmark-mhb-core --example lowest -- model.ply 325 1e-6 2
//! ```
#![allow(clippy::print_stdout)]

use std::{
    path::Path,
    sync::{Arc, Mutex, PoisonError},
    time::Instant,
};

use job::{Job, Observer, Stage};
use mesh_io::Asset;
use mhb_core::{Spectrum, SpectrumOptions};

/// Stages with the moments at which they began.
#[derive(Default)]
struct Stages(Mutex<Vec<(&'static str, Instant)>>);

impl Observer for Stages {
    fn stage(&self, stage: &dyn Stage) {
        let mut stages = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        stages.push((stage.name(), Instant::now()));
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, count, tolerance, threads] = &arguments[..] else {
        return Err("usage: lowest MESH COUNT TOLERANCE THREADS".into());
    };
    let asset = Asset::open(Path::new(model))?;
    let options = SpectrumOptions {
        count: count.parse()?,
        tolerance: tolerance.parse()?,
        ..Default::default()
    };
    let stages = Arc::new(Stages::default());
    let job = Job::new(threads.parse()?).shared_with(stages.clone());
    let spectrum = Spectrum::compute(asset.mesh(), &options, &job)?;
    let stages = stages.0.lock().unwrap_or_else(PoisonError::into_inner);
    let ends = stages
        .iter()
        .skip(1)
        .map(|&(_, begun)| begun)
        .chain([Instant::now()]);
    for (&(name, begun), end) in stages.iter().zip(ends) {
        println!("{name}: {:.3} s", (end - begun).as_secs_f64());
    }
    let worst = spectrum.residuals().iter().copied().fold(0.0, f64::max);
    println!("worst relative residual: {worst:.1e}");
    Ok(())
}
