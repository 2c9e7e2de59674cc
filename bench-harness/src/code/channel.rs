//! Frames through a Gaussian channel, and how many of them each list reads.

use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::Result;
use code::PolarCode;
use cpu_time::ThreadTime;
use rand_chacha::{
    ChaCha12Rng,
    rand_core::{Rng, SeedableRng},
};
use serde::{Deserialize, Serialize};

/// How long a point is measured.
#[derive(Clone, Copy)]
pub(super) struct Effort {
    /// Frames at most.
    pub(super) frames: usize,
    /// It is enough when the longest list has missed so many.
    pub(super) errors: usize,
    pub(super) seed: u64,
    pub(super) threads: usize,
}

/// What was counted at one T₀.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Point {
    pub(super) t0: f64,
    pub(super) frames: usize,
    /// Frames that neither this list nor a shorter one has read, for each list.
    pub(super) missed: Vec<usize>,
}

impl Point {
    pub(super) fn rate(&self, list: usize) -> f64 {
        self.missed[list] as f64 / self.frames as f64
    }
}

/// Frames are counted in batches, so that a count does not depend on the number of threads.
const BATCH: usize = 2000;

/// Frames at this T₀ through lists that ascend; those that a list has read are not tried again.
pub(super) fn point(code: &PolarCode, t0: f64, lists: &[usize], effort: &Effort) -> Result<Point> {
    let mut point = Point {
        t0,
        frames: 0,
        missed: vec![0; lists.len()],
    };
    while point.frames < effort.frames && point.missed.last().is_some_and(|&missed| missed < effort.errors) {
        let batch = point.frames..(point.frames + BATCH).min(effort.frames);
        point.frames = batch.end;
        let next = AtomicUsize::new(batch.start);
        let work = || -> Result<Vec<usize>> {
            let mut missed = vec![0; lists.len()];
            loop {
                let number = next.fetch_add(1, Ordering::Relaxed);
                if number >= batch.end {
                    return Ok(missed);
                }
                let frame = Frame::new(code, t0, effort.seed, number as u64)?;
                for (missed, &list) in missed.iter_mut().zip(lists) {
                    if code
                        .decode(&frame.ratios, list)?
                        .any(|candidate| candidate.payload == frame.payload)
                    {
                        break;
                    }
                    *missed += 1;
                }
            }
        };
        for missed in on_threads(effort.threads, work)? {
            for (sum, missed) in point.missed.iter_mut().zip(missed) {
                *sum += missed;
            }
        }
    }
    println!(
        "{} in {}, T0 {t0:.2}: {:?} of {}",
        code.payload_bits(),
        code.length(),
        point.missed,
        point.frames
    );
    Ok(point)
}

/// The same work on each thread.
pub(super) fn on_threads<T: Send>(threads: usize, work: impl Fn() -> Result<T> + Sync) -> Result<Vec<T>> {
    std::thread::scope(|scope| {
        let started: Vec<_> = (0..threads.max(1)).map(|_| scope.spawn(&work)).collect();
        let ended = started.into_iter().map(std::thread::ScopedJoinHandle::join);
        ended
            .map(|ended| ended.unwrap_or_else(|_| anyhow::bail!("a thread panicked")))
            .collect()
    })
}

/// A payload, and what the channel says of its codeword.
pub(super) struct Frame {
    pub(super) payload: Vec<bool>,
    pub(super) ratios: Vec<f64>,
}

impl Frame {
    /// As many chips as code bits, ±1, and noise of the variance n / T₀².
    pub(super) fn new(code: &PolarCode, t0: f64, seed: u64, number: u64) -> Result<Self> {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        random.set_stream(number);
        let payload: Vec<bool> = (0..code.payload_bits())
            .map(|_| random.next_u32() & 1 == 1)
            .collect();
        let snr = t0 * t0 / code.length() as f64;
        let deviation = 1.0 / snr.sqrt();
        let word = code.encode(&payload)?;
        let sent = word.iter().map(|&bit| if bit { -1.0 } else { 1.0 });
        let ratios = sent
            .map(|chip| 2.0 * snr * (chip + deviation * normal(&mut random)))
            .collect();
        Ok(Self { payload, ratios })
    }
}

/// A standard normal number (Box and Muller 1958).
pub(super) fn normal(random: &mut ChaCha12Rng) -> f64 {
    let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let (radius, angle) = (1.0 - uniform(), uniform());
    (-2.0 * radius.ln()).sqrt() * (std::f64::consts::TAU * angle).cos()
}

/// The median of the CPU time that a list takes for a frame, in seconds.
pub(super) fn seconds(code: &PolarCode, t0: f64, list: usize, seed: u64) -> Result<f64> {
    let frames = if list > 1000 { 7 } else { 25 };
    let mut seconds = Vec::new();
    for number in 0..frames {
        let frame = Frame::new(code, t0, seed, number)?;
        let start = ThreadTime::now();
        let best = code.decode(&frame.ratios, list)?.next();
        seconds.push(start.elapsed().as_secs_f64());
        std::hint::black_box(best);
    }
    seconds.sort_by(f64::total_cmp);
    Ok(seconds[frames as usize / 2])
}

/// T₀ where the frame error rate of a list is `rate`, with its standard error: ln FER between two neighbouring points is taken to be a straight line. None where
/// the points do not reach so low, or the lower one has no error.
pub(super) fn t0_at(points: &[Point], list: usize, rate: f64) -> Option<(f64, f64)> {
    points.windows(2).find_map(|pair| {
        let [above, below] = [&pair[0], &pair[1]];
        let [a, b] = [above, below].map(|point| point.rate(list));
        if a < rate || b > rate || b == 0.0 || a == b {
            return None;
        }
        let drop = (a / b).ln();
        let share = (a / rate).ln() / drop;
        let width = below.t0 - above.t0;
        let [from_above, from_below] = [(1.0 - share, above), (share, below)]
            .map(|(weight, point)| weight * weight / point.missed[list] as f64);
        Some((
            above.t0 + share * width,
            width / drop * (from_above + from_below).sqrt(),
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn t0_lies_on_the_line_through_two_points() {
        let point = |t0, missed| Point {
            t0,
            frames: 10_000,
            missed: vec![missed],
        };
        let (t0, error) =
            t0_at(&[point(1.0, 1000), point(2.0, 100), point(3.0, 1)], 0, 1e-3).unwrap_or_default();
        assert!((t0 - 2.5).abs() < 1e-9 && error > 0.1, "{t0} {error}");
        assert_eq!(t0_at(&[point(1.0, 1000), point(2.0, 0)], 0, 1e-3), None);
    }

    #[test]
    fn counts_do_not_depend_on_the_number_of_threads() -> Result<()> {
        let code = PolarCode::new(16, 64)?;
        let count = |threads| {
            let effort = Effort {
                frames: 300,
                errors: 1000,
                seed: 1,
                threads,
            };
            Ok::<_, anyhow::Error>(point(&code, 5.0, &[1, 4], &effort)?.missed)
        };
        let missed = count(1)?;
        assert_eq!(missed, count(3)?);
        assert!(missed[0] > missed[1] && missed[1] > 0);
        Ok(())
    }
}
