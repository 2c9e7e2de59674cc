//! The benchmarks, and the peers that ours is held against on the same inputs in one run.
//!
//! Each comparison has a folder of its own, with its inputs, its runs and its page in `results/`: [`mod@code`], [`eigen`], [`formats`], [`mod@library`], [`partition`], [`pose`], [`python`], [`quality`],
//! [`registration`], [`robustness`], [`seconds`], [`security`], [`tracing`], [`visibility`]. Each is a struct of options, which `cargo xtask bench` parses, with a method `run`. Peers in other languages are in `peers/`, each in a process of its
//! own; what they finished is kept in `.cache/bench`. `benches/` measures the steps of ours alone, with criterion.
//!
//! Seconds are CPU seconds, user and system time of all threads, unless wall time is said; inputs are the files of a folder, or made-up surfaces
//! of a wished size ([`surface`]). [`worst_residual`](eigen::worst_residual) judges eigenpairs, whoever computed them:
//!
//! ```
//! use bench_harness::{edge_graph, eigen::worst_residual, surface};
//! use mhb_core::{Laplacian, Spectrum, SpectrumOptions};
//!
//! let mesh = surface(600);
//! assert_eq!((mesh.vertex_count(), edge_graph(&mesh)?.edge_count()), (642, 1920));
//!
//! let laplacian = Laplacian::cotangent(&mesh)?;
//! let options = SpectrumOptions { count: 8, ..Default::default() };
//! let spectrum = Spectrum::of_laplacian(&laplacian, &options, &job::Job::default())?;
//! assert!(worst_residual(&laplacian, spectrum.eigenvalues(), |k| spectrum.eigenfunction(k)) < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![allow(clippy::print_stdout, clippy::print_stderr)]

pub mod code;
pub mod eigen;
pub mod formats;
mod kept;
pub mod library;
mod measure;
pub mod partition;
mod peers;
pub mod pose;
pub mod python;
pub mod quality;
pub mod registration;
mod results;
pub mod robustness;
pub mod seconds;
pub mod security;
pub mod services;
mod suspects;
pub mod tracing;
pub mod visibility;
mod wheel;

pub use evaluation::inputs::{edge_graph, surface};
