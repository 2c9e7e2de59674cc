//! Values as plain objects of Python.

use pyo3::prelude::*;
use serde_json::Value;

/// What `json.loads` makes of a value: dictionaries, lists, numbers, texts.
pub(crate) fn plain<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (value.to_string(),))
}

/// So many things, in words.
pub(crate) fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// A probability as it is shown: an upper bound is never nothing, though a float may be.
pub(crate) fn shown(p_value: f64) -> f64 {
    p_value.max(1e-300)
}
