//! Writes the seeds of all targets into a folder, a folder a target: `cargo run -p sigmark-fuzzing --example seeds -- fuzz/corpus [ASSETS]`.
#![allow(clippy::print_stderr)]

use std::{path::Path, process::ExitCode};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let written = match arguments.as_slice() {
        [corpus] => fuzzing::write_seeds(Path::new(corpus), None),
        [corpus, assets] => fuzzing::write_seeds(Path::new(corpus), Some(Path::new(assets))),
        _ => {
            eprintln!("usage: seeds CORPUS [ASSETS]");
            return ExitCode::from(2);
        }
    };
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("seeds: {error}");
            ExitCode::FAILURE
        }
    }
}
