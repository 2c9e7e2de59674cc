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
