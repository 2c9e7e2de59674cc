use std::{
    ops::Range,
    sync::{
        OnceLock,
        atomic::{AtomicUsize, Ordering},
    },
};

use rayon::{ThreadPool, ThreadPoolBuilder, prelude::*};

use crate::{Job, JobError};

/// More threads than any machine has processors for would hang it.
const MOST: usize = 1024;

/// Threads that are started when they are first needed.
pub(crate) struct Threads {
    count: usize,
    pool: OnceLock<Result<ThreadPool, JobError>>,
}

impl Threads {
    pub(crate) fn new(count: usize) -> Self {
        Self {
            count: count.clamp(1, MOST),
            pool: OnceLock::new(),
        }
    }

    pub(crate) fn count(&self) -> usize {
        self.count
    }

    fn pool(&self) -> Result<&ThreadPool, JobError> {
        let threads = self.count;
        let start = || {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build();
            pool.map_err(|error| JobError::Threads {
                threads,
                reason: error.to_string(),
            })
        };
        self.pool.get_or_init(start).as_ref().map_err(Clone::clone)
    }
}

/// Tasks into which work is divided for each thread: rayon makes fewer by itself, and the last thread would be left with many that nobody can take from it.
const TASKS_A_THREAD: usize = 64;

/// Parallel work. With one thread nothing is started, and everything runs in order on the caller's.
impl Job {
    /// Runs `work` where rayon's own iterators use this job's threads and no others.
    ///
    /// # Errors
    /// [`JobError::Threads`].
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> Result<T, JobError> {
        Ok(self.threads.pool()?.install(work))
    }

    /// Both results, computed at the same time where there are threads.
    ///
    /// # Errors
    /// [`JobError::Threads`].
    pub fn join<A: Send, B: Send>(
        &self,
        a: impl FnOnce() -> A + Send,
        b: impl FnOnce() -> B + Send,
    ) -> Result<(A, B), JobError> {
        if self.threads() == 1 {
            return Ok((a(), b()));
        }
        Ok(self.threads.pool()?.join(a, b))
    }

    /// f(0), …, f(count − 1), in this order. A thread takes at least `least` of them at a time.
    ///
    /// # Errors
    /// [`JobError::Threads`].
    pub fn map<T: Send>(
        &self,
        count: usize,
        least: usize,
        f: impl Fn(usize) -> T + Sync + Send,
    ) -> Result<Vec<T>, JobError> {
        if self.threads() == 1 {
            return Ok((0..count).map(f).collect());
        }
        let least = least.max(1);
        let most = least.max(count / (TASKS_A_THREAD * self.threads()));
        self.install(|| {
            (0..count)
                .into_par_iter()
                .with_min_len(least)
                .with_max_len(most)
                .map(f)
                .collect()
        })
    }

    /// As [`map`](Self::map), in chunks of `chunk` after each of which progress is reported and cancellation asked for.
    ///
    /// # Errors
    /// [`JobError::Threads`]; [`JobError::Cancelled`] soon after the observer asked for it.
    pub fn map_reported<T: Send>(
        &self,
        count: usize,
        chunk: usize,
        f: impl Fn(usize) -> T + Sync + Send,
    ) -> Result<Vec<T>, JobError> {
        let chunks = self.map_chunks(count, chunk, |range| range.map(&f).collect::<Vec<T>>())?;
        Ok(chunks.into_iter().flatten().collect())
    }

    /// f of each range of `chunk` numbers below `count` (the last may be shorter), in their order. After each of them
    /// progress is reported and cancellation asked for.
    ///
    /// # Errors
    /// As [`map_reported`](Self::map_reported).
    pub fn map_chunks<T: Send>(
        &self,
        count: usize,
        chunk: usize,
        f: impl Fn(Range<usize>) -> T + Sync + Send,
    ) -> Result<Vec<T>, JobError> {
        let chunk = chunk.max(1);
        let done = AtomicUsize::new(0);
        let task = |i: usize| {
            self.go_on()?;
            let range = i * chunk..((i + 1) * chunk).min(count);
            let length = range.len();
            let result = f(range);
            let done = done.fetch_add(length, Ordering::Relaxed) + length;
            self.progress(done as f64 / count as f64)?;
            Ok(result)
        };
        let chunks = 0..count.div_ceil(chunk);
        if self.threads() == 1 {
            return chunks.map(task).collect();
        }
        self.install(|| chunks.into_par_iter().with_max_len(1).map(task).collect())?
    }

    /// Runs `task` on consecutive chunks of `items`, with the index of each.
    ///
    /// # Errors
    /// [`JobError::Threads`].
    pub fn for_chunks<T: Send>(
        &self,
        items: &mut [T],
        chunk: usize,
        task: impl Fn(usize, &mut [T]) + Sync + Send,
    ) -> Result<(), JobError> {
        let chunk = chunk.max(1);
        if self.threads() == 1 {
            items
                .chunks_mut(chunk)
                .enumerate()
                .for_each(|(i, items)| task(i, items));
            return Ok(());
        }
        self.install(|| {
            items
                .par_chunks_mut(chunk)
                .with_max_len(1)
                .enumerate()
                .for_each(|(i, items)| task(i, items));
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Observer;
    use std::{
        sync::{Arc, Mutex, atomic::AtomicBool},
        time::{Duration, Instant},
    };

    /// Work of which the first part is not done before all others are, unless it has waited in vain.
    #[derive(Default)]
    struct FirstIsLast {
        done: AtomicUsize,
        in_vain: AtomicBool,
    }

    impl FirstIsLast {
        const PARTS: usize = 100;

        fn work(&self, part: usize) {
            let begun = Instant::now();
            while part == 0 && self.done.load(Ordering::Relaxed) < Self::PARTS - 1 {
                std::thread::yield_now();
                if begun.elapsed() > Duration::from_secs(60) {
                    self.in_vain.store(true, Ordering::Relaxed);
                    break;
                }
            }
            self.done.fetch_add(1, Ordering::Relaxed);
        }

        fn assert_done(self) {
            assert_eq!(self.done.into_inner(), Self::PARTS);
            assert!(!self.in_vain.into_inner());
        }
    }

    #[test]
    fn nothing_waits_for_a_thread_that_is_busy() {
        let (job, parts) = (Job::new(2), FirstIsLast::PARTS);
        let first = FirstIsLast::default();
        job.map(parts, 1, |i| first.work(i)).unwrap();
        first.assert_done();
        let first = FirstIsLast::default();
        job.map_reported(parts, 1, |i| first.work(i)).unwrap();
        first.assert_done();
        let first = FirstIsLast::default();
        job.for_chunks(&mut vec![(); parts], 1, |i, _| first.work(i))
            .unwrap();
        first.assert_done();
    }

    #[derive(Default)]
    struct Greatest(Mutex<f64>, f64);

    impl Observer for Greatest {
        fn fraction(&self, done: f64) {
            let mut greatest = self.0.lock().unwrap();
            *greatest = greatest.max(done);
        }

        fn cancelled(&self) -> bool {
            self.1 > 0.0 && *self.0.lock().unwrap() > self.1
        }
    }

    #[test]
    fn results_come_in_order_on_any_number_of_threads_and_the_last_report_says_that_all_is_done() {
        let squares: Vec<usize> = (0..3000).map(|i| i * i).collect();
        for threads in [1, 2, 5] {
            let observer = Arc::new(Greatest::default());
            let job = Job::new(threads).shared_with(observer.clone());
            assert_eq!(job.map(3000, 7, |i| i * i).unwrap(), squares);
            assert_eq!(job.map_reported(3000, 512, |i| i * i).unwrap(), squares);
            assert_eq!(*observer.0.lock().unwrap(), 1.0);
            let mut items = vec![0; 1000];
            job.for_chunks(&mut items, 64, |i, items| items.fill(i)).unwrap();
            assert!(items.iter().enumerate().all(|(i, &chunk)| chunk == i / 64));
            assert_eq!(job.join(|| 1, || 2).unwrap(), (1, 2));
        }
    }

    #[test]
    fn work_ends_soon_after_the_observer_asks_for_it() {
        for threads in [1, 2] {
            let job = Job::new(threads).observed_by(Greatest(Mutex::default(), 0.5));
            assert_eq!(job.map_reported(3000, 16, |i| i), Err(JobError::Cancelled));
        }
    }

    #[test]
    fn installed_work_sees_the_jobs_threads_alone() {
        for threads in [1, 3] {
            let seen = Job::new(threads).install(rayon::current_num_threads).unwrap();
            assert_eq!(seen, threads);
        }
    }

    #[test]
    fn no_work_is_done_at_once() {
        assert_eq!(
            Job::default().map_reported(0, 16, |i| i).unwrap(),
            Vec::<usize>::new()
        );
    }
}
