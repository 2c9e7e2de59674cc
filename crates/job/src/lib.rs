//! What a long computation is given by its caller: threads, a way to stop it, and somebody to tell how far it is.
//!
//! A [`Job`] goes through every long call of the workspace. Libraries take all three from it and from nowhere else: they never
//! touch rayon's global pool, read a clock, or print. Results do not depend on the job.
//!
//! ```
//! use std::sync::atomic::{AtomicBool, Ordering};
//! use job::{Job, JobError, Observer, Stage};
//!
//! #[derive(Clone, Copy, Debug)]
//! enum Adding { Sums }
//! impl Stage for Adding {
//!     fn name(&self) -> &'static str { "sums" }
//! }
//!
//! fn squares(count: usize, job: &Job) -> Result<Vec<usize>, JobError> {
//!     job.begin(Adding::Sums)?;
//!     job.map_reported(count, 64, |i| i * i)
//! }
//!
//! struct Stop(AtomicBool);
//! impl Observer for Stop {
//!     fn cancelled(&self) -> bool { self.0.load(Ordering::Relaxed) }
//! }
//!
//! assert_eq!(squares(4, &Job::new(2))?, [0, 1, 4, 9]);
//! let stopped = Job::new(2).observed_by(Stop(AtomicBool::new(true)));
//! assert_eq!(squares(4, &stopped), Err(JobError::Cancelled));
//! # Ok::<(), JobError>(())
//! ```
//!
//! **Stages.** Each crate has one enum of the stages of its long calls, which implements [`Stage`]. A call that makes another
//! crate's long call hands it a job [`within`](Job::within) its own, whose stages are not reported.

mod observer;
mod threads;

pub use observer::{Observer, Stage};

use std::sync::Arc;

use observer::Audience;
use threads::Threads;

/// Why a job could not be done, whatever it was.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum JobError {
    /// The observer asked to stop.
    #[error("stopped on request")]
    Cancelled,
    /// The operating system did not give the threads.
    #[error("{threads} threads can't be started: {reason}; ask for fewer")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// The system's reason.
        reason: String,
    },
}

/// Threads, cancellation and progress of a computation. Clones share all three.
#[derive(Clone)]
pub struct Job {
    threads: Arc<Threads>,
    audience: Audience,
    /// Which part of the stage this job's own progress from 0 to 1 is.
    part: (f64, f64),
}

impl Default for Job {
    /// One thread, and nobody watches.
    fn default() -> Self {
        Self::new(1)
    }
}

impl std::fmt::Debug for Job {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Job")
            .field("threads", &self.threads())
            .finish_non_exhaustive()
    }
}

impl Job {
    /// At most so many threads at a time (0 counts as 1, and more than 1024 as 1024), and nobody watches. Threads are started when they are first needed.
    pub fn new(threads: usize) -> Self {
        Self {
            threads: Arc::new(Threads::new(threads)),
            audience: Audience::Nobody,
            part: (0.0, 1.0),
        }
    }

    /// The same threads, watched by `observer`.
    pub fn observed_by(self, observer: impl Observer + 'static) -> Self {
        self.shared_with(Arc::new(observer))
    }

    /// As [`observed_by`](Self::observed_by), for an observer that its owner goes on using.
    pub fn shared_with(self, observer: Arc<dyn Observer>) -> Self {
        Self {
            audience: Audience::Observer(observer),
            ..self
        }
    }

    /// A job for one step of this one: its stages are not reported. Of its progress, that of the stage `shown` is.
    pub fn within(&self, shown: impl Stage) -> Self {
        Self {
            audience: self.audience.within(shown.name()),
            ..self.clone()
        }
    }

    /// A job for work on the side: it can be cancelled as this one, and tells nothing.
    pub fn quiet(&self) -> Self {
        Self {
            audience: self.audience.quiet(),
            ..self.clone()
        }
    }

    /// This job on one thread of its own, for tasks that run side by side.
    pub fn alone(&self) -> Self {
        Self {
            threads: Arc::new(Threads::new(1)),
            ..self.clone()
        }
    }

    /// A job whose progress from 0 to 1 is that of this one between two fractions: for a stage of several steps.
    pub fn part(&self, from: f64, to: f64) -> Self {
        Self {
            part: (self.whole(from), self.whole(to)),
            ..self.clone()
        }
    }

    /// The fraction of the stage that is done when `done` of this part is.
    fn whole(&self, done: f64) -> f64 {
        let (from, to) = self.part;
        from + done * (to - from)
    }

    /// How many threads may work at a time; at least 1.
    pub fn threads(&self) -> usize {
        self.threads.count()
    }

    /// A stage begins; the one before it is over.
    ///
    /// # Errors
    /// [`JobError::Cancelled`].
    pub fn begin(&self, stage: impl Stage) -> Result<(), JobError> {
        self.audience.stage(&stage);
        self.go_on()
    }

    /// How much of the present stage, or of this [`part`](Self::part) of it, is done, from 0 to 1.
    ///
    /// # Errors
    /// [`JobError::Cancelled`].
    pub fn progress(&self, done: f64) -> Result<(), JobError> {
        self.audience.fraction(self.whole(done));
        self.go_on()
    }

    /// To be asked in every loop that may take long.
    ///
    /// # Errors
    /// [`JobError::Cancelled`].
    pub fn go_on(&self) -> Result<(), JobError> {
        match self.is_cancelled() {
            true => Err(JobError::Cancelled),
            false => Ok(()),
        }
    }

    /// Whether the observer asks to stop.
    pub fn is_cancelled(&self) -> bool {
        self.audience.cancelled()
    }
}
