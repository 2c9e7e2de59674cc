//! The tasks of the project, run as `cargo xtask TASK`: one module a task, which parses its arguments and calls the crate that does the work.
#![allow(clippy::print_stderr)]

mod bench;
mod meshes;
mod pictures;
mod reproduce;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(name = "cargo xtask", about = "The tasks of the project")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Reproduce the paper: its tables and figures from real meshes, with what it prints beside what is measured
    ///
    /// The quick set is a bunny that comes with a package, under all attacks, for the paper's three algorithms: a few minutes. With
    /// --full it is six models from a folder of yours, and hours; README.md says which. Finished work is kept in .cache/reproduce, so
    /// that an interrupted run goes on where it stopped.
    ///
    /// Makes a Python environment for the attacks in attacks/.venv. Needs Python 3.11 or later with venv and the network
    /// the first time; without Python it does what it can, and says what is missing.
    Reproduce(reproduce::Reproduce),
    /// Sign every mesh file of a folder and verify it: untouched, moved, shuffled, converted; and refuse what is not it
    Meshes(meshes::Meshes),
    /// Measure ours and its peers on the same inputs in one run, and write what came out into results/
    #[command(subcommand)]
    Bench(bench::Bench),
    /// Paint the patches of the igea and of the skull, and a cropped armadillo, into results/
    Pictures(pictures::Pictures),
}

fn main() -> ExitCode {
    let done = match Arguments::parse().task {
        Task::Reproduce(task) => task.run(),
        Task::Meshes(task) => task.run(),
        Task::Bench(task) => task.run(),
        Task::Pictures(task) => task.run(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}
