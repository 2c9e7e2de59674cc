//! Stages with their seconds, and a progress bar on terminals when the work takes over a second.

use std::{
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use sigmark::{Observer, Stage};

/// Watches a computation: what it is doing goes to the terminal (if standard error is one), how long each stage took is kept.
pub(crate) struct Progress {
    begun: Instant,
    bar: ProgressBar,
    stages: Mutex<Vec<(&'static str, Instant)>>,
}

/// Work that is over before this is not worth a bar.
const PATIENCE: Duration = Duration::from_secs(1);

const STEPS: u64 = 1000;

impl Progress {
    pub(crate) fn new() -> Self {
        let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::hidden());
        if let Ok(style) = ProgressStyle::with_template("{msg:24} {wide_bar} {percent:>3} %  {elapsed}") {
            bar.set_style(style);
        }
        Self {
            begun: Instant::now(),
            bar,
            stages: Mutex::new(Vec::new()),
        }
    }

    /// A stage begins; the one before it is over.
    pub(crate) fn begin(&self, name: &'static str, doing: &'static str) {
        self.stages
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push((name, Instant::now()));
        self.bar.set_position(0);
        self.bar.set_message(doing);
        self.show_if_slow();
    }

    /// How much of the present stage is done, from 0 to 1.
    pub(crate) fn done(&self, fraction: f64) {
        self.bar
            .set_position((fraction.clamp(0.0, 1.0) * STEPS as f64) as u64);
        self.show_if_slow();
    }

    /// The work is over: the bar goes away; the answer is how many seconds each stage took, in order.
    pub(crate) fn finish(self) -> Vec<(&'static str, f64)> {
        self.bar.finish_and_clear();
        let stages = self.stages.into_inner().unwrap_or_else(PoisonError::into_inner);
        let ends = stages
            .iter()
            .skip(1)
            .map(|&(_, begun)| begun)
            .chain([Instant::now()]);
        stages
            .iter()
            .zip(ends)
            .map(|(&(name, begun), end)| (name, (end - begun).as_secs_f64()))
            .collect()
    }

    fn show_if_slow(&self) {
        if self.bar.is_hidden() && self.begun.elapsed() > PATIENCE {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
    }
}

impl Observer for Progress {
    fn stage(&self, stage: Stage) {
        let doing = match stage {
            Stage::Patches => "cutting into patches",
            Stage::Harmonics => "manifold harmonics",
            Stage::Embedding => "signing",
            Stage::Registration => "aligning",
            Stage::Detection => "reading the bits",
        };
        self.begin(stage.name(), doing);
    }

    fn fraction(&self, done: f64) {
        self.done(done);
    }
}
