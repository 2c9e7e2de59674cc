//! `sigmark` for Python: arrays in, frozen results out.
//!
//! Every class holds what the libraries computed, behind an `Arc`, and every function turns its arguments into values of Rust, computes in
//! `running.rs`, with the interpreter free, and wraps the result. Nothing is computed here.
//!
//! - Points are float64 of shape (n, 3), triangles integers of shape (m, 3), indices from 0. Arrays are copied once on their way in, since another thread
//!   of Python might write to them meanwhile, and handed out as read-only views of Rust's own memory.
//! - One exception class an error enum: `errors.rs`.
//! - What functions do, with shapes and units, is said once: in the doc comments of this crate, which Python's `help` shows. The types are in `python/sigmark/_sigmark.pyi`.

mod aligning;
mod arrays;
mod assets;
mod certificates;
mod command;
mod comparing;
mod dividing;
mod errors;
mod input;
mod keys;
mod matrices;
mod meshes;
mod objects;
mod running;
mod shapes;
mod signing;
mod spectra;
mod tracing;
mod verifying;

use pyo3::prelude::*;

/// The part of `sigmark` that is written in Rust.
#[pymodule]
mod _sigmark {
    #[pymodule_export]
    use crate::{
        aligning::{Alignment, align},
        assets::{Asset, read},
        certificates::Certificate,
        command::command,
        comparing::{Comparison, compare},
        dividing::{Partition, partition},
        keys::{PublicKey, SigningKey},
        matrices::{laplacian, spectrum_of_matrices},
        meshes::Mesh,
        shapes::{bumpy_torus, sphere},
        signing::{Prepared, Signed, embed, prepare},
        spectra::{Spectrum, spectrum},
        tracing::{Accused, Trace, Tracer, trace},
        verifying::{Verdict, Verifier, verify},
    };
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
