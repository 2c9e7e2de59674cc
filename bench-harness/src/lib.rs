//! What every comparison and benchmark shares: the inputs, and one judge for all solvers.
//!
//! Inputs are files ([`mesh_files`], [`graph_files`]) or made-up surfaces of a wished size ([`surface`]). A graph is either read
//! ([`read_graph`]) or made of the edges of a mesh ([`edge_graph`]). Peers in other languages read a problem from files
//! ([`write_matrices`]); [`faer_lanczos`] is the peer in Rust. [`worst_residual`] judges eigenpairs, whoever computed them.
//!
//! ```
//! use bench_harness::{edge_graph, surface, worst_residual};
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

pub mod eigen;
mod kept;
mod lanczos;
mod matrices;
mod measure;
pub mod partition;
mod peers;
pub mod quality;
pub mod registration;
mod residual;
mod results;
mod selection;

pub use evaluation::inputs::{edge_graph, graph_files, mesh_files, name_of, read_graph, surface};
pub use lanczos::{Pairs, faer_lanczos};
pub use matrices::{fingerprint, read_matrices, write_matrices};
pub use residual::worst_residual;
