//! Threads and progress.

use std::ops::{ControlFlow, Range};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::QualityError;

/// Told from time to time which fraction of a computation is done, from 0 to 1, perhaps by several threads; `Break` cancels.
///
/// Does not influence the result. [`unobserved`] lets everything pass.
pub type Observer<'a> = &'a (dyn Fn(f64) -> ControlFlow<()> + Sync);

/// The observer that watches nothing.
pub fn unobserved(_done: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Runs `work` in a pool of its own, so that rayon's global pool stays the caller's.
pub(crate) fn in_pool<T: Send>(
    threads: usize,
    work: impl FnOnce() -> Result<T, QualityError> + Send,
) -> Result<T, QualityError> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.max(1))
        .build();
    let pool = pool.map_err(|e| QualityError::Threads {
        threads,
        reason: e.to_string(),
    })?;
    pool.install(work)
}

/// f of each range of at most `size` numbers below `count`, in their order whatever the number of threads.
pub(crate) fn by_chunks<T: Send>(
    count: usize,
    size: usize,
    observer: Observer<'_>,
    f: impl Fn(Range<usize>) -> T + Sync + Send,
) -> Result<Vec<T>, QualityError> {
    let (done, cancelled) = (AtomicUsize::new(0), AtomicBool::new(false));
    let chunk = |c: usize| {
        if cancelled.load(Ordering::Relaxed) {
            return None;
        }
        let range = c * size..((c + 1) * size).min(count);
        let length = range.len();
        let result = f(range);
        let done = done.fetch_add(length, Ordering::Relaxed) + length;
        if observer(done as f64 / count as f64).is_break() {
            cancelled.store(true, Ordering::Relaxed);
        }
        Some(result)
    };
    let results: Option<Vec<T>> = (0..count.div_ceil(size)).into_par_iter().map(chunk).collect();
    match results {
        Some(results) if !cancelled.load(Ordering::Relaxed) => Ok(results),
        _ => Err(QualityError::Cancelled),
    }
}

/// f(0), …, f(count − 1), in this order whatever the number of threads.
pub(crate) fn map<T: Send>(
    count: usize,
    observer: Observer<'_>,
    f: impl Fn(usize) -> T + Sync + Send,
) -> Result<Vec<T>, QualityError> {
    const SIZE: usize = 512;
    let chunks = by_chunks(count, SIZE, observer, |range| range.map(&f).collect::<Vec<T>>())?;
    Ok(chunks.into_iter().flatten().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_order_on_any_number_of_threads_and_the_last_report_says_that_all_is_done() {
        let squares: Vec<usize> = (0..3000).map(|i| i * i).collect();
        for threads in [1, 2, 5] {
            let greatest = std::sync::Mutex::new(0.0_f64);
            let observer = |done: f64| {
                let mut greatest = greatest.lock().unwrap();
                *greatest = greatest.max(done);
                ControlFlow::Continue(())
            };
            let mapped = in_pool(threads, || map(3000, &observer, |i| i * i)).unwrap();
            assert_eq!(mapped, squares);
            assert_eq!(*greatest.lock().unwrap(), 1.0);
        }
    }

    #[test]
    fn an_observer_that_breaks_cancels() {
        let observer = |done: f64| match done > 0.5 {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        let cancelled = in_pool(2, || map(3000, &observer, |i| i));
        assert_eq!(cancelled, Err(QualityError::Cancelled));
    }
}
