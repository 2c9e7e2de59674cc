//! KaFFPa-strong, by its Python package. It takes a hundred times as long as the others, so that what it finished is kept.

use anyhow::{Context, Result};
use evaluation::python::Python;

use super::problem::{GraphProblem, IMBALANCE};
use crate::kept::{self, Key};

/// The cut of KaFFPa-strong, once, with seed 0.
pub(crate) fn cut(problem: &GraphProblem, parts: usize, python: &Python) -> Result<i64> {
    let key = Key::new(format!("kaffpa-cut-{}-{parts}", problem.key));
    kept::figures(&kept::folder("partition")?, &key, || {
        let [parts_word, imbalance] = [parts.to_string(), IMBALANCE.to_string()];
        let words = [parts_word.as_ref(), imbalance.as_ref(), "0".as_ref()];
        let arguments = [problem.file.as_os_str()].into_iter().chain(words);
        let printed = python.run("kaffpa.py", arguments)?;
        // The first line says what it cost.
        let (_, part_of) = printed
            .split_once('\n')
            .context("kaffpa.py printed no partition")?;
        Ok(problem.judged(part_of, parts)?.cut)
    })
}
