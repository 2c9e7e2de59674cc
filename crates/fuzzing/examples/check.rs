//! Reads a file as a target does, on any compiler: `cargo run -p sigmark-fuzzing --example check -- TARGET FILE`.
#![allow(clippy::print_stderr)]

use std::{process::ExitCode, time::Instant};

use fuzzing::Target;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [target, file] = arguments.as_slice() else {
        eprintln!("usage: check TARGET FILE");
        return ExitCode::from(2);
    };
    let Some((target, bytes)) = Target::named(target).zip(std::fs::read(file).ok()) else {
        eprintln!("check: there is no such target or no such file");
        return ExitCode::from(2);
    };
    let start = Instant::now();
    target.check(&bytes);
    eprintln!("{} bytes: nothing found in {:?}", bytes.len(), start.elapsed());
    ExitCode::SUCCESS
}
