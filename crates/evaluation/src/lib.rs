//! What `cargo xtask reproduce` runs: models, attacks, studies, cells, tables, figures, pages.
#![allow(clippy::print_stdout, clippy::print_stderr)]

pub mod attacks;
mod audit;
mod bare;
mod campaign;
pub mod chart;
mod figures;
pub mod inputs;
mod jobs;
pub mod machine;
pub mod markup;
pub mod meshes;
mod models;
mod page;
mod paper;
pub mod patches;
pub mod pictures;
pub mod process;
pub mod python;
mod reading;
pub mod reproduce;
mod results;
mod roc;
mod sheet;
pub mod sources;
mod store;
mod study;
pub mod table;
mod tables;
