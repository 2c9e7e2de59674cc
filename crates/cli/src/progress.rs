//! Stages with their seconds, and a progress bar on terminals when the work takes over a second.

use std::{
    io::IsTerminal,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{self, RecvTimeoutError},
    },
    thread,
    time::{Duration, Instant},
};

use anyhow::Result;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use job::Job;
use serde_json::Value;

use crate::{
    interrupt,
    report::{self, Lines},
};

/// Watches a computation: what it is doing goes to the terminal (if standard error is one), how long each stage took is kept.
///
/// The bar goes away with this, whether the work succeeded or failed.
pub(crate) struct Progress {
    bar: ProgressBar,
    stages: Mutex<Vec<(&'static str, Instant)>>,
    /// When the work is to be given up.
    deadline: Option<Instant>,
    /// Dropped, it tells the thread that waits to show the bar that the work is over.
    _over: mpsc::Sender<()>,
}

/// Work that is over before this is not worth a bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// The clock of the bar goes on while a stage has nothing to report.
const TICK: Duration = Duration::from_millis(250);

const STEPS: u64 = 1000;

impl Progress {
    pub(crate) fn new() -> Self {
        Self::within(None)
    }

    /// Asks computations to stop after a time, if there is a limit, and at Ctrl-C.
    pub(crate) fn within(limit: Option<Duration>) -> Self {
        interrupt::watch();
        let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::hidden());
        if let Ok(style) =
            ProgressStyle::with_template("{prefix}{msg:24} {wide_bar} {percent:>3} %  {elapsed}")
        {
            bar.set_style(style);
        }
        let (over, is_over) = mpsc::channel::<()>();
        if std::io::stderr().is_terminal() {
            let bar = bar.clone();
            thread::spawn(move || {
                if is_over.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                    bar.set_draw_target(ProgressDrawTarget::stderr());
                    bar.enable_steady_tick(TICK);
                }
            });
        }
        Self {
            bar,
            stages: Mutex::new(Vec::new()),
            deadline: limit.and_then(|limit| Instant::now().checked_add(limit)),
            _over: over,
        }
    }

    /// The bar says that this is one of several.
    pub(crate) fn number(&self, number: usize, of: usize) {
        if of > 1 {
            self.bar.set_prefix(format!("{number} of {of}: "));
        }
    }

    /// A stage begins; the one before it is over. `name` stands in the JSON report, `doing` beside the bar.
    pub(crate) fn begin(&self, name: &'static str, doing: &'static str) {
        self.stages
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push((name, Instant::now()));
        self.bar.set_message(doing);
        self.bar.set_position(0);
    }

    /// Prints a report while the work goes on.
    pub(crate) fn tell(&self, lines: &Lines) -> Result<()> {
        self.bar.suspend(|| report::print(false, &Value::Null, lines))
    }

    /// A job that this watches.
    pub(crate) fn job(self: &Arc<Self>, threads: usize) -> Job {
        Job::new(threads).shared_with(Arc::<Self>::clone(self))
    }

    /// The work is over: the bar goes away; the answer is how many seconds each stage took, in the order in which they first
    /// began. A stage that came twice counts together.
    pub(crate) fn finish(&self) -> Vec<(&'static str, f64)> {
        self.bar.finish_and_clear();
        let stages = self.stages.lock().unwrap_or_else(PoisonError::into_inner);
        let ends = stages
            .iter()
            .skip(1)
            .map(|&(_, begun)| begun)
            .chain([Instant::now()]);
        let mut seconds: Vec<(&'static str, f64)> = Vec::new();
        for (&(name, begun), end) in stages.iter().zip(ends) {
            let took = (end - begun).as_secs_f64();
            match seconds.iter_mut().find(|(known, _)| *known == name) {
                Some((_, sum)) => *sum += took,
                None => seconds.push((name, took)),
            }
        }
        seconds
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

impl job::Observer for Progress {
    fn stage(&self, stage: &dyn job::Stage) {
        self.begin(stage.name(), doing(stage.name()));
    }

    fn fraction(&self, done: f64) {
        self.bar
            .set_position((done.clamp(0.0, 1.0) * STEPS as f64) as u64);
    }

    fn cancelled(&self) -> bool {
        interrupt::is_asked_for() || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

/// What people read of a stage.
fn doing(stage: &'static str) -> &'static str {
    match stage {
        "patches" => "cutting into patches",
        "harmonics" => "manifold harmonics",
        "embedding" => "signing",
        "registration" => "aligning",
        "detection" => "reading the bits",
        "assembly" => "assembling the matrices",
        "slicing" => "counting eigenvalues",
        "finishing" => "joining",
        "distance" => "measuring distances",
        "shape_dna" => "computing eigenvalues",
        "msdm2" => "comparing curvatures",
        "dame" => "comparing angles",
        "heatmap" => "painting",
        "connectivity" => "looking for vertices",
        "preparation" => "sampling surfaces",
        "guesses" => "trying positions",
        "refinement" => "aligning finely",
        other => other,
    }
}
