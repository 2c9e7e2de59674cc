use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// The stages of a computation, in the order in which they begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Phase {
    /// Stiffness and mass.
    Assembly,
    /// Fill-reducing ordering and structure of the factors.
    Ordering,
    /// Counting eigenvalues to cut the spectrum into bands.
    Slicing,
    /// Eigenpairs of the bands.
    Solving,
    /// Joint orthonormalisation, canonical choice and residuals.
    Finishing,
}

/// Told how far a computation has come; says whether it goes on.
///
/// May be called from several threads, and does not influence the result. Closures
/// `Fn(Phase, f64) -> ControlFlow<()>` are observers.
pub trait Observer: Sync {
    /// `fraction` of `phase` is done, between 0 and 1. `Break` cancels.
    fn progress(&self, phase: Phase, fraction: f64) -> ControlFlow<()>;
}

impl<F: Fn(Phase, f64) -> ControlFlow<()> + Sync> Observer for F {
    fn progress(&self, phase: Phase, fraction: f64) -> ControlFlow<()> {
        self(phase, fraction)
    }
}

/// Lets everything pass.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unobserved;

impl Observer for Unobserved {
    fn progress(&self, _: Phase, _: f64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// How long each phase took, by a clock that the caller gives: this crate reads none itself.
///
/// ```
/// use std::time::Instant;
/// use mhb_core::{Spectrum, Stopwatch};
///
/// let begun = Instant::now();
/// let stopwatch = Stopwatch::new(|| begun.elapsed());
/// Spectrum::builder().count(9).observer(&stopwatch).compute(&mesh::shapes::icosphere(3))?;
/// for (phase, time) in stopwatch.timings() {
///     println!("{phase:?}: {:.3} s", time.as_secs_f64());
/// }
/// # Ok::<(), mhb_core::SpectrumError>(())
/// ```
pub struct Stopwatch<'a, C> {
    clock: C,
    observer: &'a dyn Observer,
    laps: Mutex<Laps>,
}

#[derive(Default)]
struct Laps {
    running: Option<(Phase, Duration)>,
    sums: Vec<(Phase, Duration)>,
}

impl<C: Fn() -> Duration + Sync> Stopwatch<'static, C> {
    /// Starts with the first phase. `clock` says how much time has passed since any fixed moment.
    pub fn new(clock: C) -> Self {
        Stopwatch::watched_by(clock, &Unobserved)
    }
}

impl<'a, C: Fn() -> Duration + Sync> Stopwatch<'a, C> {
    /// [`new`](Stopwatch::new), and passes on what it sees.
    pub fn watched_by(clock: C, observer: &'a dyn Observer) -> Self {
        Self {
            clock,
            observer,
            laps: Mutex::default(),
        }
    }

    /// Phases in the order in which they first began, up to the last report. One that came twice counts together.
    pub fn timings(&self) -> Vec<(Phase, Duration)> {
        self.laps
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .sums
            .clone()
    }
}

impl<C: Fn() -> Duration + Sync> Observer for Stopwatch<'_, C> {
    fn progress(&self, phase: Phase, fraction: f64) -> ControlFlow<()> {
        let now = (self.clock)();
        self.laps
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .enter(phase, now);
        self.observer.progress(phase, fraction)
    }
}

impl Laps {
    fn enter(&mut self, phase: Phase, now: Duration) {
        if !self.sums.iter().any(|(known, _)| *known == phase) {
            self.sums.push((phase, Duration::ZERO));
        }
        let before = self.running.replace((phase, now));
        for (known, sum) in &mut self.sums {
            if let Some((_, since)) = before.filter(|(phase, _)| phase == known) {
                *sum += now.saturating_sub(since);
            }
        }
    }
}
