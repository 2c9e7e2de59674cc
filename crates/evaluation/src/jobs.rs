//! Work that runs side by side, as far as there is memory.

use std::{
    sync::{Condvar, Mutex, PoisonError},
    thread,
};

use crate::machine::available_memory;

/// Bytes that are kept free.
const RESERVE: u64 = 1 << 30;

/// What the system says is free, less a reserve; on systems that do not say, enough for one job at a time.
pub(crate) fn free_memory() -> u64 {
    available_memory().map_or(0, |bytes| bytes.saturating_sub(RESERVE))
}

/// Runs every job on one of `threads` threads, and gives what came out of each. A job begins when its `bytes` fit beside those that run;
/// one that never fits runs alone. Jobs begin in their order.
pub(crate) fn run<J: Sync, T: Send>(
    jobs: &[J],
    threads: usize,
    memory: u64,
    bytes: impl Fn(&J) -> u64 + Sync,
    work: impl Fn(&J) -> T + Sync,
) -> Vec<T> {
    struct State<T> {
        next: usize,
        running: usize,
        held: u64,
        done: Vec<Option<T>>,
    }
    let state = Mutex::new(State {
        next: 0,
        running: 0,
        held: 0,
        done: jobs.iter().map(|_| None).collect(),
    });
    let ended = Condvar::new();
    let worker = || {
        let mut now = state.lock().unwrap_or_else(PoisonError::into_inner);
        while let Some(job) = jobs.get(now.next) {
            let index = now.next;
            let needed = bytes(job);
            if now.running > 0 && now.held + needed > memory {
                now = ended.wait(now).unwrap_or_else(PoisonError::into_inner);
                continue;
            }
            now.next += 1;
            now.running += 1;
            now.held += needed;
            drop(now);
            let result = work(job);
            now = state.lock().unwrap_or_else(PoisonError::into_inner);
            now.done[index] = Some(result);
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
    let state = state.into_inner().unwrap_or_else(PoisonError::into_inner);
    state.done.into_iter().flatten().collect()
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
            let work = |&job: &u64| {
                let now = held.fetch_add(job, SeqCst) + job;
                assert!(now <= memory.max(job), "{now} of {memory}");
                thread::yield_now();
                held.fetch_sub(job, SeqCst);
                runs.fetch_add(1, SeqCst);
                job
            };
            assert_eq!(run(&jobs, 3, memory, |&job| job, work), jobs);
            assert_eq!(runs.load(SeqCst), jobs.len());
        }
    }
}
