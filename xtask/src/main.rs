//! The tasks of the project, run as `cargo xtask TASK`. Thin orchestration: the work is done by the crates and by `attacks/`.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod bench;
mod machine;
mod meshes;
mod patches;
mod pictures;
mod process;
mod python;
mod reproduce;
mod table;

use std::{path::PathBuf, process::ExitCode};

use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(name = "cargo xtask", about = "The tasks of the project")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Sign a real mesh, attack it, find the signature again, and write what came out into results/
    ///
    /// Makes a Python environment for the attacks in attacks/.venv. Needs Python 3.11 or later with venv and the network
    /// the first time; without Python it does what it can, and says what is missing.
    Reproduce {
        /// Where the tables go
        #[arg(long, value_name = "DIR", default_value = "results")]
        output: PathBuf,
    },
    /// Sign every mesh file of a folder and verify it: untouched, moved, shuffled, converted; and refuse what is not it
    Meshes {
        /// The folder; files in it that are no meshes are passed over
        folder: PathBuf,
        /// Meshes with more vertices are passed over
        #[arg(long, default_value_t = 50_000)]
        most_vertices: usize,
        /// Only cut them into patches, whatever their size, and look at these
        #[arg(long, conflicts_with = "most_vertices")]
        patches_only: bool,
    },
    /// Hold the partitioner, the eigen-solver or the metrics against their peers, and write what came out into results/
    #[command(subcommand)]
    Bench(bench::Bench),
    /// Paint the patches of the igea and of the skull, and a cropped armadillo, into results/
    Pictures {
        /// The folder with igea_134k.ply.gz, ct_skull_1081k_closed.ply.gz and armadillo_43k.ply.gz; what is missing is left out
        #[arg(long, value_name = "DIR")]
        meshes: PathBuf,
    },
}

fn main() -> ExitCode {
    let done = match Arguments::parse().task {
        Task::Reproduce { output } => reproduce::run(&output),
        Task::Meshes {
            folder,
            most_vertices,
            patches_only,
        } => {
            if patches_only {
                patches::run(&folder)
            } else {
                meshes::run(&folder, most_vertices)
            }
        }
        Task::Bench(bench) => bench::run(bench),
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
