//! KaFFPa-strong, by its Python package. It takes a hundred times as long as the others, so that what it finished is kept.

use anyhow::{Context, Result};
use evaluation::python::Python;
use serde::{Deserialize, Serialize};

use super::problem::{GraphProblem, IMBALANCE};
use crate::kept;

/// What it found, and in how many CPU seconds.
#[derive(Serialize, Deserialize)]
struct KaffpaCut {
    cut: i64,
    cpu: f64,
}

/// What `peers/kaffpa.py` prints first.
#[derive(Deserialize)]
struct KaffpaCost {
    cpu: f64,
}

/// The cut of KaFFPa-strong, once, with seed 0.
pub(crate) fn cut(problem: &GraphProblem, parts: usize, python: &Python) -> Result<i64> {
    let folder = kept::folder("partition")?;
    let name = format!("kaffpa-{}-{parts}", problem.name);
    let found: KaffpaCut = kept::figures(&folder, &name, || {
        let arguments = [
            problem.file.as_os_str().to_owned(),
            parts.to_string().into(),
            IMBALANCE.to_string().into(),
            "0".into(),
        ];
        let printed = python.run("kaffpa.py", arguments)?;
        let (cost, part_of) = printed
            .split_once('\n')
            .context("kaffpa.py printed no partition")?;
        let KaffpaCost { cpu } = serde_json::from_str(cost)?;
        let cut = problem.judged(part_of, parts)?.cut;
        Ok(KaffpaCut { cut, cpu })
    })?;
    Ok(found.cut)
}
