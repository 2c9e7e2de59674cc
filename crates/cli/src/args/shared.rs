//! What several commands have.

use std::{path::Path, time::Duration};

use clap::Args;

use super::numbers;

#[derive(Debug, Args)]
pub(crate) struct TimeLimit {
    /// Give up after so many seconds; where there are several suspects, each has so many [default: never]
    #[arg(long = "time-limit", value_name = "SECONDS", allow_negative_numbers = true, value_parser = numbers::seconds)]
    limit: Option<Duration>,
}

impl TimeLimit {
    /// The same limit for a part of a command's work.
    pub(crate) fn of(limit: Option<Duration>) -> Self {
        Self { limit }
    }

    pub(crate) fn duration(&self) -> Option<Duration> {
        self.limit
    }

    /// That it was reached.
    pub(crate) fn exceeded(&self) -> anyhow::Error {
        let seconds = self.limit.unwrap_or_default().as_secs_f64();
        anyhow::anyhow!("stopped at the time limit of {seconds} s; allow more with --time-limit")
    }

    /// That it was reached with a suspect.
    pub(crate) fn exceeded_at(&self, suspect: &Path) -> anyhow::Error {
        self.exceeded().context(suspect.display().to_string())
    }
}

// A doc comment would stand in place of what the command is for.
#[derive(Debug, Args)]
pub(crate) struct Common {
    /// How many threads may work; results do not depend on it [default: all cores]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = numbers::threads)]
    threads: Option<usize>,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

impl Common {
    /// The same for a part of a command's work.
    pub(crate) fn of(other: &Self) -> Self {
        Self { ..*other }
    }

    pub(crate) fn threads(&self) -> usize {
        let all = || std::thread::available_parallelism().map_or(1, usize::from);
        self.threads.unwrap_or_else(all)
    }
}
