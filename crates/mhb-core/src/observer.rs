use std::ops::ControlFlow;

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
