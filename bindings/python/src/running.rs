//! The one place that runs work: on a thread of its own, with the interpreter free, so that Ctrl-C is seen and other threads of Python go on.

use std::{
    any::Any,
    panic,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{self, Receiver, RecvTimeoutError},
    },
    thread,
    time::Duration,
};

use job::{Job, Observer, Stage};
use pyo3::prelude::*;

use crate::errors::Failure;

/// How often signals are looked for, and progress is told.
const TICK: Duration = Duration::from_millis(20);

/// How long work that was cancelled is waited for. What has not asked by then ends by itself, later, and its result is dropped.
const PATIENCE: Duration = Duration::from_millis(100);

/// As much as the main thread of a program has.
const STACK: usize = 8 << 20;

/// How a caller wants work to be run.
pub(crate) struct Running {
    threads: Option<usize>,
    /// Is called with the name of a stage and how much of it is done, from 0 to 1.
    progress: Option<Py<PyAny>>,
}

impl Running {
    /// On so many threads, by default as many as there are processors.
    pub(crate) fn new(threads: Option<usize>, progress: Option<Py<PyAny>>) -> Self {
        Self { threads, progress }
    }

    fn job(&self) -> Job {
        let processors = || thread::available_parallelism().map_or(1, usize::from);
        Job::new(self.threads.unwrap_or_else(processors))
    }

    fn tell(&self, py: Python<'_>, watch: &Watch) -> PyResult<()> {
        let Some(progress) = &self.progress else {
            return Ok(());
        };
        for (stage, done) in watch.take() {
            progress.call1(py, (stage, done))?;
        }
        Ok(())
    }
}

/// What work and the thread that waits for it tell each other.
#[derive(Default)]
struct Watch {
    cancelled: AtomicBool,
    is_told: bool,
    news: Mutex<News>,
}

/// What was not told yet: of each stage that began, how much is done.
#[derive(Default)]
struct News {
    stage: &'static str,
    untold: Vec<(&'static str, f64)>,
}

impl Watch {
    fn take(&self) -> Vec<(&'static str, f64)> {
        std::mem::take(&mut self.news.lock().unwrap_or_else(PoisonError::into_inner).untold)
    }
}

impl Observer for Watch {
    fn stage(&self, stage: &dyn Stage) {
        if self.is_told {
            let mut news = self.news.lock().unwrap_or_else(PoisonError::into_inner);
            news.stage = stage.name();
            news.untold.push((stage.name(), 0.0));
        }
    }

    fn fraction(&self, done: f64) {
        if self.is_told {
            let mut news = self.news.lock().unwrap_or_else(PoisonError::into_inner);
            let stage = news.stage;
            match news.untold.last_mut() {
                Some((of, known)) if *of == stage => *known = done,
                _ => news.untold.push((stage, done)),
            }
        }
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// Runs `work`, and waits for it. An exception of a signal's handler (Ctrl-C raises `KeyboardInterrupt`) or of `progress` ends it.
pub(crate) fn run<T: Send + 'static>(
    py: Python<'_>,
    running: Running,
    work: impl FnOnce(&Job) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let watch = Arc::new(Watch {
        is_told: running.progress.is_some(),
        ..Watch::default()
    });
    let job = running.job().shared_with(Arc::<Watch>::clone(&watch));
    let (result, mut done) = mpsc::sync_channel(1);
    // Where nobody waits any more, nobody misses the result.
    let worker = move || drop(result.send(panic::catch_unwind(panic::AssertUnwindSafe(|| work(&job)))));
    thread::Builder::new().stack_size(STACK).spawn(worker)?;
    loop {
        let outcome;
        (outcome, done) = py.detach(|| wait(done, TICK));
        match outcome {
            Ok(result) => {
                let result = result.unwrap_or_else(|cause| panic::resume_unwind(cause));
                running.tell(py, &watch)?;
                return Ok(result?);
            }
            Err(RecvTimeoutError::Timeout) => {}
            // Work sends in any case.
            Err(RecvTimeoutError::Disconnected) => return Err(Failure::Lost.into()),
        }
        if let Err(exception) = py.check_signals().and_then(|()| running.tell(py, &watch)) {
            watch.cancelled.store(true, Ordering::Relaxed);
            py.detach(|| drop(wait(done, PATIENCE)));
            return Err(exception);
        }
    }
}

/// What comes of work: its result, or the cause of its panic.
type Outcome<T> = Result<Result<T, Failure>, Box<dyn Any + Send>>;

/// Waits for an outcome; the receiver comes back, since only one thread at a time may have it.
fn wait<T: Send>(
    done: Receiver<Outcome<T>>,
    limit: Duration,
) -> (Result<Outcome<T>, RecvTimeoutError>, Receiver<Outcome<T>>) {
    (done.recv_timeout(limit), done)
}
