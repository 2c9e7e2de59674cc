//! What reproduces the paper: its models and printed figures, attacks, studies, tables, figures and pages; and what the benchmarks share
//! with it.
//!
//! `cargo xtask reproduce` is [`reproduce::run`]. From the outside in: a run goes through `models`; of each, a `campaign` runs what is
//! in the `plan`; a `study` is one way to mark one mesh, and one cell of a table is made in `study/cell.rs`. What is finished stands in
//! the `store`, by what it depends on and the code that computed it. `pages` writes what came out, and `audit` fails the run where a
//! figure is missing or can't be right.
//!
//! ```
//! use evaluation::{attacks, table::{Entry, Measured, Table}};
//!
//! // The one list of attacks, attacks/attacks.toml, says what tables have for columns.
//! let smoothing = attacks::tables().table4.iter().find(|attack| attack.spec == "laplacian:5").unwrap();
//! assert!(smoothing.keeps(attacks::Survivor::Connectivity) && !smoothing.is_random());
//!
//! // Three signatures' extraction rates in per cent, beside the printed one.
//! let mut table = Table::new("Rates", &["model", &smoothing.name]);
//! table.row([Entry::from("bunny"), Measured::rates(vec![74.1, 75.6, 73.2], Some(74.07)).into()]);
//! assert!(table.markdown().contains("| bunny | 74.3 ± 1.2 (74.07) |"));
//! ```
//!
//! Rates are shares of right bits (eq. 18): from 0 to 1 in the store, in per cent in tables. Distortions are per cent of the original's
//! diagonal. Attacks and poses come from the seed of a signature's number, so that a run repeats.
#![allow(clippy::print_stdout, clippy::print_stderr)]

// What the benchmarks use, too.
pub mod attacks;
mod environment;
pub mod inputs;
pub mod margin;
mod output;

pub use environment::{machine, process, python, sources};
pub use output::{chart, markup, table};

// The reproduction, lowest first.
mod audit;
mod bare;
mod beside_paper;
mod campaign;
mod heat;
mod jobs;
mod models;
mod options;
mod pages;
mod paper;
mod plan;
mod progress;
mod reading;
pub mod reproduce;
mod results;
mod store;
mod study;

// Other tasks on folders of meshes.
pub mod meshes;
pub mod patches;
pub mod pictures;
