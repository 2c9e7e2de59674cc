//! Our partitioner in a process of its own, whose memory can be told from others'.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result};
use clap::Args;
use evaluation::{inputs::read_graph, machine, process::output};
use job::Job;
use partition::{Effort, partition};
use serde::{Deserialize, Serialize};

use super::problem::options;

/// One graph for a process of its own.
#[derive(Args)]
pub struct LoneDivision {
    /// METIS graph file
    pub file: PathBuf,
    /// Into so many
    pub parts: usize,
}

/// What [`LoneDivision::run`] prints, as JSON.
#[derive(Serialize, Deserialize)]
struct LoneReport {
    /// The most memory held after the file was read, in bytes.
    peak: Option<u64>,
}

impl LoneDivision {
    /// Divides at default effort on one thread and prints the most memory held after the file was read, in bytes, as JSON.
    pub fn run(&self) -> Result<()> {
        let graph = read_graph(&self.file)?;
        machine::forget_peak_memory();
        partition(&graph, &options(self.parts, Effort::Default), &Job::default())?;
        let peak = machine::peak_memory();
        println!("{}", serde_json::to_string(&LoneReport { peak })?);
        Ok(())
    }
}

/// The most memory that a process holds which divides a file's graph, in bytes; none where the system does not say.
pub(crate) fn memory(file: &Path, parts: usize) -> Result<Option<u64>> {
    let mut alone = Command::new(std::env::current_exe()?);
    alone.args(["bench", "divide"]).arg(file).arg(parts.to_string());
    let report: LoneReport = serde_json::from_str(&output(&mut alone)?).context("our own report")?;
    Ok(report.peak)
}
