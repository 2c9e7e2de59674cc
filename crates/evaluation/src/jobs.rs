//! Work that runs side by side, as far as there is memory, and a line for each piece that ends.

use std::{
    sync::{Condvar, Mutex, PoisonError},
    thread,
    time::{Duration, Instant},
};

use crate::machine::available_memory;

/// Bytes that are kept free.
const RESERVE: u64 = 1 << 30;

/// What the system says is free, less a reserve; on systems that do not say, enough for one job at a time.
pub(crate) fn free_memory() -> u64 {
    available_memory().map_or(0, |bytes| bytes.saturating_sub(RESERVE))
}

/// Runs every job on one of `threads` threads. A job begins when its `bytes` fit beside those that run; one that never fits runs
/// alone. Jobs begin in their order.
pub(crate) fn run<J: Sync>(
    jobs: &[J],
    threads: usize,
    memory: u64,
    bytes: impl Fn(&J) -> u64 + Sync,
    work: impl Fn(&J) + Sync,
) {
    struct State {
        next: usize,
        running: usize,
        held: u64,
    }
    let state = Mutex::new(State {
        next: 0,
        running: 0,
        held: 0,
    });
    let ended = Condvar::new();
    let worker = || {
        let mut now = state.lock().unwrap_or_else(PoisonError::into_inner);
        while let Some(job) = jobs.get(now.next) {
            let needed = bytes(job);
            if now.running > 0 && now.held + needed > memory {
                now = ended.wait(now).unwrap_or_else(PoisonError::into_inner);
                continue;
            }
            now.next += 1;
            now.running += 1;
            now.held += needed;
            drop(now);
            work(job);
            now = state.lock().unwrap_or_else(PoisonError::into_inner);
            now.running -= 1;
            now.held -= needed;
            ended.notify_all();
        }
    };
    thread::scope(|scope| {
        for _ in 0..threads.min(jobs.len()) {
            scope.spawn(worker);
        }
    });
}

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
        println!(
            "[{:>3}/{}] {words}; about {} left",
            state.pieces,
            self.total,
            duration(rest)
        );
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
    use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::SeqCst};

    #[test]
    fn every_job_runs_once_and_what_runs_together_fits() {
        let jobs: Vec<u64> = (0..40).map(|i| 1 + i % 7).collect();
        for memory in [0, 7, 12] {
            let (held, runs) = (AtomicU64::new(0), AtomicUsize::new(0));
            run(
                &jobs,
                3,
                memory,
                |&job| job,
                |&job| {
                    let now = held.fetch_add(job, SeqCst) + job;
                    assert!(now <= memory.max(job), "{now} of {memory}");
                    thread::yield_now();
                    held.fetch_sub(job, SeqCst);
                    runs.fetch_add(1, SeqCst);
                },
            );
            assert_eq!(runs.load(SeqCst), jobs.len());
        }
    }

    #[test]
    fn durations_read_well() {
        let said = [0.2, 89.0, 90.0, 3599.0, 9000.0].map(duration);
        assert_eq!(said, ["0 s", "89 s", "2 min", "60 min", "2 h 30 min"]);
    }
}
