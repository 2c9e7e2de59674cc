//! Other codes of the same length and payload: which positions, and which convolution.

use anyhow::Result;
use code::{CheckNodes, PolarCode};

/// The plain polar code.
const PLAIN: u64 = 1;
/// (1, 0, 1, 1, 0, 1, 1) from g_0, as in the paper on PAC codes (octal 133 from the other end).
const SHORT: u64 = 0o155;
/// The digits of π − 3, as `PolarCode::new` takes them.
const PI: u64 = 0x243F_6A88_85A3_08D3;

/// Names and codes, ours first.
pub(super) fn all(bits: usize, length: usize) -> Result<Vec<(String, PolarCode)>> {
    let quarter = 2f64.powf(0.25);
    let of =
        |weights: Vec<f64>, generator| PolarCode::of_positions(length, &greatest(&weights, bits), generator);
    let ours = PolarCode::new(bits, length)?;
    let mut all = vec![
        (
            "ours: β-expansion, β = 2^¼, 64 coefficients".to_string(),
            ours.clone(),
        ),
        (
            "the same, min-sum".into(),
            ours.with_check_nodes(CheckNodes::MinSum),
        ),
        (
            "β = 2^¼, 7 coefficients".into(),
            of(expansion(length, quarter), SHORT)?,
        ),
        ("β = 2^¼, plain".into(), of(expansion(length, quarter), PLAIN)?),
    ];
    for beta in [1.15, 1.22] {
        all.push((
            format!("β = {beta}, 64 coefficients"),
            of(expansion(length, beta), PI)?,
        ));
    }
    // Around the strength at which the longest list fails once in a thousand frames.
    let snr = 10.0 * (2.1 * bits as f64 / length as f64).log10();
    for offset in [-0.5, 0.5] {
        let design = snr + offset;
        let weights = gaussian(length, design);
        all.push((
            format!("Gaussian approximation at {design:.1} dB, 64 coefficients"),
            of(weights.clone(), PI)?,
        ));
        all.push((
            format!("Gaussian approximation at {design:.1} dB, plain"),
            of(weights, PLAIN)?,
        ));
    }
    let least = hybrid_weight(&expansion(length, 1.22), bits);
    let name = format!(
        "Reed–Muller hybrid: rows of weight {} and more, β = 1.22, 64 coefficients",
        1 << least
    );
    all.push((name, of(hybrid(expansion(length, 1.22), least), PI)?));
    Ok(all)
}

fn greatest(weights: &[f64], count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..weights.len()).collect();
    order.sort_by(|&a, &b| weights[b].total_cmp(&weights[a]).then(b.cmp(&a)));
    order.truncate(count);
    order
}

/// Σ β^s over the bits s of each position that are 1.
fn expansion(length: usize, beta: f64) -> Vec<f64> {
    let bits = |i: usize| (0..usize::BITS).filter(move |s| i >> s & 1 == 1);
    (0..length)
        .map(|i| bits(i).map(|s| beta.powi(s as i32)).sum())
        .collect()
}

/// One more than the weight, in powers of two, of the lightest row that the positions of greatest weights hold.
fn hybrid_weight(weights: &[f64], count: usize) -> u32 {
    let lightest = greatest(weights, count).into_iter().map(usize::count_ones).min();
    lightest.unwrap_or(0) + 1
}

/// Rows of at least 2^`least` ones before all others (Li, Shen and Tse 2014).
fn hybrid(mut weights: Vec<f64>, least: u32) -> Vec<f64> {
    for (i, weight) in weights.iter_mut().enumerate() {
        if i.count_ones() < least {
            *weight -= 1e6;
        }
    }
    weights
}

/// Means of the ratios at each position (Trifonov 2012; φ of Chung, Richardson and Urbanke 2001).
fn gaussian(length: usize, snr_db: f64) -> Vec<f64> {
    let mut means = vec![2.0 * 10f64.powf(snr_db / 10.0)];
    while means.len() < length {
        means = means.iter().flat_map(|&mean| [check(mean), 2.0 * mean]).collect();
    }
    means
}

fn check(mean: f64) -> f64 {
    let wrong = phi(mean);
    let both = wrong * (2.0 - wrong);
    let (mut low, mut high) = (0.0, mean);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if phi(middle) > both {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

fn phi(mean: f64) -> f64 {
    if mean < 10.0 {
        (0.0218 - 0.4527 * mean.powf(0.86)).exp().min(1.0)
    } else {
        (std::f64::consts::PI / mean).sqrt() * (-0.25 * mean).exp() * (1.0 - 10.0 / (7.0 * mean))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hybrid_has_no_row_that_is_lighter_and_the_approximation_keeps_the_partial_order() {
        let weights = expansion(256, 1.22);
        let least = hybrid_weight(&weights, 64);
        assert!(
            greatest(&hybrid(weights, least), 64)
                .iter()
                .all(|i| i.count_ones() >= least)
        );
        let means = gaussian(64, -2.0);
        assert!((0..64).all(|i| (0..6).all(|s| means[i | 1 << s] >= means[i])));
    }
}
