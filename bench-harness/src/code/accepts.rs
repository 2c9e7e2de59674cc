//! Noise that is taken for a payload: candidates of random ratios, compared with one commitment.

use std::time::{Duration, Instant};

use anyhow::Result;
use code::PolarCode;
use rand_chacha::{
    ChaCha12Rng,
    rand_core::{Rng, SeedableRng},
};
use serde::{Deserialize, Serialize};

use super::channel::{normal, on_threads};

/// Payload, length and list.
pub(super) const SETTING: (usize, usize, usize) = (128, 1024, 32);

#[derive(Serialize, Deserialize)]
pub(super) struct Accepts {
    pub(super) vectors: usize,
    pub(super) candidates: usize,
    pub(super) accepted: usize,
    /// Most bits in which a candidate agreed with the commitment.
    pub(super) nearest: usize,
}

/// Ratios of noise alone, of the strength that they have where payloads are read.
pub(super) fn look(seconds: f64, seed: u64, threads: usize) -> Result<Accepts> {
    let (bits, length, list) = SETTING;
    let code = PolarCode::new(bits, length)?;
    let mut random = ChaCha12Rng::seed_from_u64(seed);
    let commitment: Vec<bool> = (0..bits).map(|_| random.next_u32() & 1 == 1).collect();
    let (start, patience) = (Instant::now(), Duration::from_secs_f64(seconds));
    let stream = std::sync::atomic::AtomicU64::new(1);
    let parts = on_threads(threads, || {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        random.set_stream(stream.fetch_add(1, std::sync::atomic::Ordering::Relaxed));
        let mut part = Accepts {
            vectors: 0,
            candidates: 0,
            accepted: 0,
            nearest: 0,
        };
        while start.elapsed() < patience {
            let ratios: Vec<f64> = (0..length).map(|_| normal(&mut random)).collect();
            part.vectors += 1;
            for candidate in code.decode(&ratios, list)? {
                let agrees = candidate
                    .payload
                    .iter()
                    .zip(&commitment)
                    .filter(|(a, b)| a == b)
                    .count();
                part.candidates += 1;
                part.accepted += usize::from(agrees == bits);
                part.nearest = part.nearest.max(agrees);
            }
        }
        Ok(part)
    })?;
    let sum = |of: fn(&Accepts) -> usize| parts.iter().map(of).sum();
    Ok(Accepts {
        vectors: sum(|part| part.vectors),
        candidates: sum(|part| part.candidates),
        accepted: sum(|part| part.accepted),
        nearest: parts.iter().map(|part| part.nearest).max().unwrap_or(0),
    })
}
