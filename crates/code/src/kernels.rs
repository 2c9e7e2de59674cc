//! The loops over log-likelihood ratios. Plain sums, products and comparisons in single precision, always in the same order, so that
//! every platform computes the same bits.

/// ln(1 + e^−x) for x ≥ 0, to within 0.02: ln 2 (1 − x / (8 ln 2))⁴ up to where that is 0. Value and slope at 0 are exact, and the
/// slope is nowhere below −1/2, so that check nodes never turn a sign.
#[inline(always)]
fn correction(x: f32) -> f32 {
    const LN2: f32 = std::f32::consts::LN_2;
    let rest = 1.0 - x * (1.0 / (8.0 * LN2));
    let rest = if rest > 0.0 { rest } else { 0.0 };
    let square = rest * rest;
    LN2 * (square * square)
}

#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn positive(a: f32) -> f32 {
    if a > 0.0 { a } else { 0.0 }
}

const SIGN: u32 = 1 << 31;

/// 2 artanh(tanh(a/2) tanh(b/2)) = sign(a b) min(|a|, |b|) + ln(1 + e^−|a+b|) − ln(1 + e^−|a−b|).
#[inline(always)]
fn check_node<const ACCURATE: bool>(a: f32, b: f32) -> f32 {
    let sign = (a.to_bits() ^ b.to_bits()) & SIGN;
    let least = lesser(a.abs(), b.abs());
    let signed = f32::from_bits(least.to_bits() | sign);
    if ACCURATE {
        signed + (correction((a + b).abs()) - correction((a - b).abs()))
    } else {
        signed
    }
}

/// Ratios of a left child, half as many as its parent's.
#[inline(always)]
pub(crate) fn check<const ACCURATE: bool>(parent: &[f32], child: &mut [f32]) {
    let (a, b) = parent.split_at(child.len());
    for ((out, &a), &b) in child.iter_mut().zip(a).zip(b) {
        *out = check_node::<ACCURATE>(a, b);
    }
}

/// [`check`] for all paths, path p in slot p; the sizes of small children are known to the compiler.
pub(crate) fn check_all<const ACCURATE: bool>(stage: usize, parents: &[f32], children: &mut [f32]) {
    match stage {
        0 => check_each::<ACCURATE>(1, parents, children),
        1 => check_each::<ACCURATE>(2, parents, children),
        2 => check_each::<ACCURATE>(4, parents, children),
        _ => check_each::<ACCURATE>(1 << stage, parents, children),
    }
}

#[inline(always)]
fn check_each<const ACCURATE: bool>(size: usize, parents: &[f32], children: &mut [f32]) {
    let pairs = children
        .chunks_exact_mut(size)
        .zip(parents.chunks_exact(2 * size));
    for (child, parent) in pairs {
        check::<ACCURATE>(parent, child);
    }
}

/// Of each byte the signs of eight numbers: bit j of the byte is the sign of number j.
static SIGNS: [[u32; 8]; 256] = signs();

const fn signs() -> [[u32; 8]; 256] {
    let mut table = [[0; 8]; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut j = 0;
        while j < 8 {
            table[byte][j] = ((byte >> j & 1) as u32) << 31;
            j += 1;
        }
        byte += 1;
    }
    table
}

#[inline(always)]
fn with_sign(x: f32, sign: u32) -> f32 {
    f32::from_bits(x.to_bits() ^ sign)
}

/// Ratios of a right child: b ± a, minus where the sister's bit is 1.
#[inline(always)]
pub(crate) fn variable(parent: &[f32], sister: &[u64], child: &mut [f32]) {
    let (a, b) = parent.split_at(child.len());
    if child.len() < 8 {
        let signs = &SIGNS[(sister[0] & 255) as usize];
        for (((out, &a), &b), &sign) in child.iter_mut().zip(a).zip(b).zip(signs) {
            *out = b + with_sign(a, sign);
        }
        return;
    }
    let eights = child
        .chunks_exact_mut(8)
        .zip(a.chunks_exact(8))
        .zip(b.chunks_exact(8));
    for (i, ((out, a), b)) in eights.enumerate() {
        let signs = &SIGNS[(sister[i / 8] >> (i % 8 * 8) & 255) as usize];
        for j in 0..8 {
            out[j] = b[j] + with_sign(a[j], signs[j]);
        }
    }
}

/// What a path's metric grows by: −ln P(bits | ratios) = Σ ln(1 + e^−(1 − 2 bit) λ), for these bits of a leaf and for their complement.
#[inline(always)]
pub(crate) fn penalties<const ACCURATE: bool>(ratios: &[f32], bits: u64) -> [f32; 2] {
    let (mut against, mut with, mut both) = ([0f32; 8], [0f32; 8], [0f32; 8]);
    let mut add = |j: usize, x: f32| {
        against[j] += positive(-x);
        with[j] += positive(x);
        if ACCURATE {
            both[j] += correction(x.abs());
        }
    };
    if ratios.len() < 8 {
        let signs = &SIGNS[(bits & 255) as usize];
        for (j, &ratio) in ratios.iter().enumerate() {
            add(j, with_sign(ratio, signs[j]));
        }
    } else {
        for (i, ratios) in ratios.chunks_exact(8).enumerate() {
            let signs = &SIGNS[(bits >> (8 * i) & 255) as usize];
            for j in 0..8 {
                add(j, with_sign(ratios[j], signs[j]));
            }
        }
    }
    let both: f32 = both.iter().sum();
    [
        against.iter().sum::<f32>() + both,
        with.iter().sum::<f32>() + both,
    ]
}
