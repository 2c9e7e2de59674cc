use crate::RegistrationError;
use rayon::prelude::*;

/// Runs `work` in a pool of its own, so that rayon's global pool stays the caller's.
pub(crate) fn in_pool<T: Send>(
    threads: usize,
    work: impl FnOnce() -> T + Send,
) -> Result<T, RegistrationError> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.max(1))
        .build();
    let pool = pool.map_err(|e| RegistrationError::Threads {
        threads,
        reason: e.to_string(),
    })?;
    Ok(pool.install(work))
}

/// f(0), …, f(count − 1), in this order whatever the number of threads.
pub(crate) fn map<T: Send>(count: usize, f: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    (0..count).into_par_iter().with_min_len(256).map(f).collect()
}
