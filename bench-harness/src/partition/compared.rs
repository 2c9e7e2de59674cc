//! One division of one graph by ours and by the peers.

use anyhow::Result;
use evaluation::python::Python;
use job::Job;
use partition::{Effort, Partition, partition};

use super::{
    kaffpa, metis, ours,
    problem::{GraphProblem, options},
};
use crate::measure::{Cost, median, timed};

/// What everyone made of a graph, and at what cost.
pub(crate) struct ComparedDivision {
    pub(crate) graph: String,
    pub(crate) parts: usize,
    pub(crate) metis: Partition,
    pub(crate) ours: Partition,
    /// Ours at high effort.
    pub(crate) high: Partition,
    /// The cut; none of meshes.
    pub(crate) kaffpa: Option<i64>,
    pub(crate) metis_seconds: f64,
    pub(crate) one_thread: Cost,
    pub(crate) two_threads: Cost,
    /// CPU seconds on one thread.
    pub(crate) high_seconds: f64,
    /// The most memory of a process that divides, in bytes.
    pub(crate) metis_memory: Option<u64>,
    pub(crate) our_memory: Option<u64>,
}

impl ComparedDivision {
    /// Divides, in turns, and judges everyone's parts by the same code.
    pub(crate) fn of(
        problem: &GraphProblem,
        parts: usize,
        rounds: usize,
        python: Option<&Python>,
    ) -> Result<Self> {
        let by_us = |effort, threads| {
            let divide = || partition(&problem.graph, &options(parts, effort), &Job::new(threads));
            let (divided, cost) = timed(divide);
            anyhow::Ok((divided?, cost))
        };
        let (mut metis, mut one, mut two) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..rounds {
            metis.push(metis::divide(&problem.file, parts)?);
            one.push(by_us(Effort::Default, 1)?.1);
            two.push(by_us(Effort::Default, 2)?.1);
        }
        let (high, high_cost) = by_us(Effort::High, 1)?;
        let (ours, _) = by_us(Effort::Default, 1)?;
        Ok(Self {
            graph: problem.name.clone(),
            parts,
            metis: problem.judged(&metis::parts(&problem.file, parts)?, parts)?,
            ours,
            high,
            kaffpa: match python.filter(|_| !problem.is_mesh) {
                Some(python) => Some(kaffpa::cut(problem, parts, python)?),
                None => None,
            },
            metis_seconds: median(metis),
            one_thread: Cost::median(&one),
            two_threads: Cost::median(&two),
            high_seconds: high_cost.cpu,
            metis_memory: metis::memory(&problem.file, parts)?,
            our_memory: ours::memory(&problem.file, parts)?,
        })
    }

    /// Our cut over METIS'.
    pub(crate) fn ratio(&self) -> f64 {
        self.ours.cut as f64 / self.metis.cut as f64
    }

    /// Our cut at high effort over METIS'.
    pub(crate) fn high_ratio(&self) -> f64 {
        self.high.cut as f64 / self.metis.cut as f64
    }

    /// Our cut at high effort over that of KaFFPa-strong.
    pub(crate) fn ratio_to_kaffpa(&self) -> Option<f64> {
        self.kaffpa.map(|cut| self.high.cut as f64 / cut as f64)
    }

    /// A line of progress.
    pub(crate) fn words(&self) -> String {
        let kaffpa = self.kaffpa.map(|cut| format!(", KaFFPa-strong {cut}"));
        format!(
            "{} in {}: METIS {}, ours {} ({:.3}), high effort {} ({:.3}){}",
            self.graph,
            self.parts,
            self.metis.cut,
            self.ours.cut,
            self.ratio(),
            self.high.cut,
            self.high_ratio(),
            kaffpa.unwrap_or_default(),
        )
    }
}
