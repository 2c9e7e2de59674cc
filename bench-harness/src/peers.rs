//! The peers in Python.

use anyhow::Result;
use evaluation::{process::root, python::Python};

/// One thread, whatever library a peer computes with.
pub(crate) const ONE_THREAD: [(&str, &str); 4] = [
    ("OMP_NUM_THREADS", "1"),
    ("OPENBLAS_NUM_THREADS", "1"),
    ("MKL_NUM_THREADS", "1"),
    ("PYTHONHASHSEED", "0"),
];

/// The environment of `bench-harness/peers`, for one thread.
pub(crate) fn prepare() -> Result<Python> {
    let harness = root().join("bench-harness");
    Ok(Python::prepare_in(harness.join("peers"), harness.join(".venv"))?.with_variables(&ONE_THREAD))
}
