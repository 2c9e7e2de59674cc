//! The tasks of the project, run as `cargo xtask TASK`: parses arguments, and calls the crate that does the work.
#![allow(clippy::print_stderr)]

mod bench;
mod dist;
mod fuzz;
mod wheel;

use std::{path::PathBuf, process::ExitCode};

use clap::{Parser, Subcommand};
use evaluation::{meshes, patches, pictures, reproduce};

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
    /// The quick set is a bunny that comes with a package, under all attacks, for the paper's three algorithms and Sigmark: a quarter of an hour on two
    /// idle cores. With --full it is six models from a folder of yours, and hours; README.md says which. Finished work is kept in .cache/reproduce, so
    /// that an interrupted run goes on where it stopped.
    ///
    /// Makes a Python environment for the attacks in attacks/.venv. Needs Python 3.11 or later with venv and the network
    /// the first time; without Python it does what it can, and says what is missing.
    Reproduce(reproduce::Options),
    /// Sign every mesh file of a folder and verify it: untouched, moved, shuffled, converted; refuse what is not it; and hold what is read of today's layout after a few attacks (ER and T0) beside the paper's
    Meshes {
        /// The folder; files in it that are no meshes are passed over
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Meshes with more vertices are passed over
        #[arg(long, value_name = "N", default_value_t = 50_000)]
        most_vertices: usize,
        /// Only cut them into patches, whatever their size, and look at these
        #[arg(long, conflicts_with = "most_vertices")]
        patches_only: bool,
    },
    /// Measure ours and its peers on the same inputs in one run, and write what came out into results/
    #[command(subcommand)]
    Bench(bench::Bench),
    /// Feed the readers of files with what nobody thought of, under a nightly compiler, until something breaks or the time is up
    ///
    /// Needs `rustup toolchain install nightly` and `cargo install --locked cargo-fuzz`. What it learns is kept in fuzz/corpus, what breaks
    /// in fuzz/artifacts.
    Fuzz(fuzz::Options),
    /// Make the archive of a release: the program, its documents, completions and manual pages, and the bill of what it is made of
    ///
    /// Needs `cargo install --locked cargo-auditable cargo-cyclonedx`.
    Dist(dist::Options),
    /// Make the wheel for Python, which brings the module and the command `sigmark`
    ///
    /// Needs Python 3.11 or later with venv and the network the first time: maturin goes into .cache/wheel.
    Wheel(wheel::Options),
    /// Paint the patches of the igea and of the skull, a cropped armadillo, and marks on the igea under a raking light, into results/
    Pictures {
        /// The folder with igea_134k.ply.gz, ct_skull_1081k_closed.ply.gz and armadillo_43k.ply.gz; what is missing is left out
        #[arg(long, value_name = "DIR")]
        meshes: PathBuf,
    },
}

fn main() -> ExitCode {
    let done = match Arguments::parse().task {
        Task::Reproduce(options) => reproduce::run(&options),
        Task::Meshes {
            folder,
            patches_only: true,
            ..
        } => patches::run(&folder),
        Task::Meshes {
            folder,
            most_vertices,
            ..
        } => meshes::run(&folder, most_vertices),
        Task::Bench(bench) => bench.run(),
        Task::Fuzz(options) => fuzz::run(&options),
        Task::Dist(options) => dist::run(&options),
        Task::Wheel(options) => wheel::run(&options),
        Task::Pictures { meshes } => pictures::run(&meshes),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}
