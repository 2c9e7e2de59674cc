//! How far a run is, and when it has to end.

use std::{
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

/// Counts what is done, and says how long the rest may take.
pub(crate) struct Progress {
    begun: Instant,
    state: Mutex<Done>,
    total: usize,
    /// When no more work begins.
    closing: Option<Duration>,
}

struct Done {
    pieces: usize,
    /// Vertices of the pieces that are left: their measure.
    left: f64,
    /// Of the pieces that had to be computed.
    computed: f64,
}

impl Progress {
    /// `pieces` have `vertices` in all; none begins after `closing`.
    pub(crate) fn new(pieces: usize, vertices: f64, closing: Option<Duration>) -> Self {
        Self {
            begun: Instant::now(),
            total: pieces,
            closing,
            state: Mutex::new(Done {
                pieces: 0,
                left: vertices,
                computed: 0.0,
            }),
        }
    }

    /// A piece is done; without `words` it was found finished, and costs nothing.
    pub(crate) fn done(&self, vertices: f64, words: Option<&str>) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.pieces += 1;
        state.left -= vertices;
        let Some(words) = words else { return };
        state.computed += vertices;
        let passed = self.begun.elapsed().as_secs_f64();
        let rest = passed * state.left.max(0.0) / state.computed.max(1.0);
        let (done, all, rest) = (state.pieces, self.total, duration(rest));
        println!("[{done:>3}/{all}] {words}; about {rest} left");
    }

    /// Whether it is too late to begin something.
    pub(crate) fn is_over(&self) -> bool {
        self.closing.is_some_and(|closing| self.passed() >= closing)
    }

    pub(crate) fn passed(&self) -> Duration {
        self.begun.elapsed()
    }
}

/// Seconds as people say them.
pub(crate) fn duration(seconds: f64) -> String {
    let whole = seconds.max(0.0).round() as u64;
    match whole {
        0..90 => format!("{whole} s"),
        90..5400 => format!("{} min", (whole + 30) / 60),
        _ => format!("{} h {:02} min", whole / 3600, whole % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_read_well() {
        let said = [0.2, 89.0, 90.0, 3599.0, 9000.0].map(duration);
        assert_eq!(said, ["0 s", "89 s", "2 min", "60 min", "2 h 30 min"]);
    }
}
