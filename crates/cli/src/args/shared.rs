//! What several commands have.

use std::time::Duration;

use clap::Args;

use super::numbers;

#[derive(Debug, Args)]
pub(crate) struct TimeLimit {
    /// Give up after so many seconds [default: never]
    #[arg(long = "time-limit", value_name = "SECONDS", allow_negative_numbers = true, value_parser = numbers::seconds)]
    limit: Option<Duration>,
}

impl TimeLimit {
    pub(crate) fn duration(&self) -> Option<Duration> {
        self.limit
    }

    /// That it was reached.
    pub(crate) fn exceeded(&self) -> anyhow::Error {
        let seconds = self.limit.unwrap_or_default().as_secs_f64();
        anyhow::anyhow!("stopped at the time limit of {seconds} s; allow more with --time-limit")
    }
}

#[derive(Debug, Args)]
pub(crate) struct Threads {
    /// How many threads may work; results do not depend on it [default: all cores]
    #[arg(long = "threads", value_name = "N", allow_negative_numbers = true, value_parser = numbers::threads)]
    wanted: Option<usize>,
}

impl Threads {
    pub(crate) fn count(&self) -> usize {
        let all = || std::thread::available_parallelism().map_or(1, usize::from);
        self.wanted.unwrap_or_else(all)
    }
}
