use crate::RegistrationError;
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stage {
    /// Looking for vertices that survived.
    Connectivity,
    /// Sampling surfaces and building search trees.
    Preparation,
    /// Trying first guesses.
    Guesses {
        /// How many were tried.
        done: usize,
        /// How many there are in this round.
        total: usize,
    },
    /// Refining the best guess.
    Refinement,
}

/// Watches an alignment, possibly from several threads at once, and may end it: at a time limit, for
/// instance, since the library does not read the clock. Every method has a default that does nothing.
pub trait Observer: Sync {
    /// A stage begins, or a step of it.
    fn stage(&self, _stage: Stage) {}

    /// Asked in every loop. Answer `true` to make the alignment end soon with
    /// [`RegistrationError::Stopped`]: within about a second a million vertices.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Watches nothing.
impl Observer for () {}

pub(crate) fn go_on(observer: &dyn Observer) -> Result<(), RegistrationError> {
    if observer.cancelled() {
        Err(RegistrationError::Stopped)
    } else {
        Ok(())
    }
}

pub(crate) fn begin(observer: &dyn Observer, stage: Stage) -> Result<(), RegistrationError> {
    observer.stage(stage);
    go_on(observer)
}

/// Can be cancelled as another observer, and tells it nothing: for work on the side.
pub(crate) struct Quiet<'a>(pub(crate) &'a dyn Observer);

impl Observer for Quiet<'_> {
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

/// An observer that asks a closure at each stage.
pub(crate) struct Watch<'a> {
    closure: Mutex<&'a mut (dyn FnMut(Stage) -> ControlFlow<()> + Send)>,
    stopped: AtomicBool,
}

impl<'a> Watch<'a> {
    pub(crate) fn new(closure: &'a mut (dyn FnMut(Stage) -> ControlFlow<()> + Send)) -> Self {
        Self {
            closure: Mutex::new(closure),
            stopped: AtomicBool::new(false),
        }
    }
}

impl Observer for Watch<'_> {
    fn stage(&self, stage: Stage) {
        // A closure that panicked has ended the alignment anyway.
        let asked = self.closure.lock().map(|mut closure| closure(stage));
        if asked.is_ok_and(|answer| answer.is_break()) {
            self.stopped.store(true, Ordering::Relaxed);
        }
    }

    fn cancelled(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }
}
