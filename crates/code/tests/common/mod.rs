//! Noise and slow decoders.
#![allow(dead_code, clippy::unwrap_used)] // every test uses a part

use code::PolarCode;
use rand_chacha::{
    ChaCha12Rng,
    rand_core::{Rng, SeedableRng},
};

pub(crate) fn random(seed: u64) -> ChaCha12Rng {
    ChaCha12Rng::seed_from_u64(seed)
}

pub(crate) fn random_bits(count: usize, random: &mut ChaCha12Rng) -> Vec<bool> {
    (0..count).map(|_| random.next_u32() & 1 == 1).collect()
}

/// Box and Muller's.
fn normal(random: &mut ChaCha12Rng) -> f64 {
    let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let (radius, angle) = (1.0 - uniform(), uniform());
    (-2.0 * radius.ln()).sqrt() * (std::f64::consts::TAU * angle).cos()
}

/// What a Gaussian channel with this signal-to-noise ratio a²/σ² of a code bit says of a word.
pub(crate) fn received(word: &[bool], snr: f64, random: &mut ChaCha12Rng) -> Vec<f64> {
    let sent = word.iter().map(|&bit| if bit { -1.0 } else { 1.0 });
    sent.map(|sign| 2.0 * snr * (sign + normal(random) / snr.sqrt()))
        .collect()
}

/// −ln P(word | ratios).
pub(crate) fn metric(word: &[bool], ratios: &[f64]) -> f64 {
    let terms = word.iter().zip(ratios);
    terms
        .map(|(&bit, &ratio)| (if bit { ratio } else { -ratio }).exp().ln_1p())
        .sum()
}

/// Plain successive cancellation as Arıkan writes it down: bit after bit, each by recursion over the whole tree. `known` says what u_i is where the
/// position is frozen, from the bits before it; `check` is what check nodes compute. u comes back.
pub(crate) fn successive(
    ratios: &[f64],
    check: fn(f64, f64) -> f64,
    mut known: impl FnMut(&[bool]) -> Option<bool>,
) -> Vec<bool> {
    let mut u: Vec<bool> = Vec::new();
    for i in 0..ratios.len() {
        let bit = known(&u).unwrap_or_else(|| ratio_of(ratios, check, &u, i) < 0.0);
        u.push(bit);
    }
    u
}

/// ln P(u_i = 0) / P(u_i = 1), given the bits before.
fn ratio_of(ratios: &[f64], check: fn(f64, f64) -> f64, before: &[bool], i: usize) -> f64 {
    let Some(half) = Some(ratios.len() / 2).filter(|&half| half > 0) else {
        return ratios[0];
    };
    let (a, b) = ratios.split_at(half);
    if i < half {
        let sums: Vec<f64> = a.iter().zip(b).map(|(&a, &b)| check(a, b)).collect();
        return ratio_of(&sums, check, before, i);
    }
    let left = multiplied(&before[..half]);
    let sums: Vec<f64> = (0..half)
        .map(|j| if left[j] { b[j] - a[j] } else { b[j] + a[j] })
        .collect();
    ratio_of(&sums, check, &before[half..], i - half)
}

pub(crate) fn exact(a: f64, b: f64) -> f64 {
    2.0 * ((a / 2.0).tanh() * (b / 2.0).tanh()).atanh()
}

pub(crate) fn min_sum(a: f64, b: f64) -> f64 {
    a.signum() * b.signum() * a.abs().min(b.abs())
}

/// u F^⊗n by the matrix's definition: entry (i, j) is 1 where the bits of j are among those of i.
pub(crate) fn multiplied(u: &[bool]) -> Vec<bool> {
    let entry = |j: usize| {
        u.iter()
            .enumerate()
            .filter(|&(i, &bit)| bit && j & i == j)
            .count()
    };
    (0..u.len()).map(|j| entry(j) % 2 == 1).collect()
}

/// All payloads with their metrics, the likeliest first.
pub(crate) fn brute_force(code: &PolarCode, ratios: &[f64]) -> Vec<(Vec<bool>, f64)> {
    let k = code.payload_bits();
    let payloads = (0..1u32 << k).map(|number| (0..k).map(|j| number >> j & 1 == 1).collect::<Vec<bool>>());
    let mut all: Vec<(Vec<bool>, f64)> = payloads
        .map(|payload| {
            let metric = metric(&code.encode(&payload).unwrap(), ratios);
            (payload, metric)
        })
        .collect();
    all.sort_by(|a, b| a.1.total_cmp(&b.1));
    all
}
