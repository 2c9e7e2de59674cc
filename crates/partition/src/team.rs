//! The threads of one call: a pool of their own, or none. Results never depend on how many there are.

use rayon::prelude::*;

use crate::PartitionError;

pub(crate) struct Team(Option<rayon::ThreadPool>);

impl Team {
    pub(crate) fn new(threads: usize) -> Result<Self, PartitionError> {
        if threads <= 1 {
            return Ok(Self(None));
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let failed = |e: rayon::ThreadPoolBuildError| PartitionError::Threads {
            threads,
            reason: e.to_string(),
        };
        Ok(Self(Some(pool.map_err(failed)?)))
    }

    /// Runs `work` on one of the threads: what it hands to the others then starts sooner.
    pub(crate) fn run<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        match &self.0 {
            None => work(),
            Some(pool) => pool.install(work),
        }
    }

    /// Both results, computed at the same time when there is a pool.
    pub(crate) fn join<A: Send, B: Send>(
        &self,
        a: impl FnOnce() -> A + Send,
        b: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        match &self.0 {
            None => (a(), b()),
            Some(pool) => pool.join(a, b),
        }
    }

    /// The results of `task` for `0..count`, in this order.
    pub(crate) fn map<T: Send>(&self, count: u64, task: impl Fn(u64) -> T + Sync + Send) -> Vec<T> {
        match &self.0 {
            None => (0..count).map(task).collect(),
            Some(pool) => pool.install(|| (0..count).into_par_iter().map(task).collect()),
        }
    }

    /// Runs `task` on consecutive chunks of `items`, with the index of each.
    pub(crate) fn for_chunks<T: Send>(
        &self,
        items: &mut [T],
        size: usize,
        task: impl Fn(usize, &mut [T]) + Sync + Send,
    ) {
        match &self.0 {
            None => items
                .chunks_mut(size)
                .enumerate()
                .for_each(|(i, chunk)| task(i, chunk)),
            Some(pool) => {
                pool.install(|| {
                    items
                        .par_chunks_mut(size)
                        .enumerate()
                        .for_each(|(i, chunk)| task(i, chunk));
                });
            }
        }
    }

    pub(crate) fn size(&self) -> usize {
        self.0.as_ref().map_or(1, rayon::ThreadPool::current_num_threads)
    }
}
