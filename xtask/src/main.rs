//! The tasks of the project, run as `cargo xtask TASK`. Thin orchestration: the work is done by the crates and by `attacks/`.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod bench;

use std::{path::PathBuf, process::ExitCode};

use clap::{Parser, Subcommand};
use evaluation::{meshes, patches, pictures, process, reproduce};

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
    Reproduce {
        /// Where the tables go; results/quick without it, or results/ with --full
        #[arg(long, value_name = "DIR")]
        output: Option<PathBuf>,
        /// All six models; needs --meshes
        #[arg(long, requires = "meshes")]
        full: bool,
        /// The folder with the models' meshes
        #[arg(long, value_name = "DIR", requires = "full")]
        meshes: Option<PathBuf>,
        /// Only these models, by the paper's name or the file's; may be given again
        #[arg(long, value_name = "MODEL", requires = "full")]
        only: Vec<String>,
        /// Only these algorithms, by their names in the tables; may be given again
        #[arg(long, value_name = "NAME")]
        algorithm: Vec<String>,
        /// How many signatures each figure is a mean over
        #[arg(long, default_value_t = 3)]
        signatures: usize,
        /// Take finished work that another version of the code did; the page then says how much of it there is
        #[arg(long)]
        keep: bool,
        /// Begin nothing after so many minutes, and write what there is; 0: what was finished before
        #[arg(long, value_name = "N")]
        minutes: Option<u64>,
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
        Task::Reproduce {
            output,
            full,
            meshes,
            only,
            algorithm,
            signatures,
            keep,
            minutes,
        } => reproduce::run(&reproduce::Options {
            output: output
                .unwrap_or_else(|| process::root().join(if full { "results" } else { "results/quick" })),
            meshes,
            only,
            algorithms: algorithm,
            signatures,
            keep,
            closing: minutes.map(|minutes| std::time::Duration::from_secs(60 * minutes)),
        }),
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
