//! Cuts of the spectrum, placed by counting eigenvalues.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::factor::Analysis;
use crate::SpectrumError;

/// A shift, and how many eigenvalues inertia proves below it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut {
    pub(crate) shift: f64,
    pub(crate) below: usize,
}

fn count(analysis: &Analysis, shift: f64, step: f64) -> Result<Cut, SpectrumError> {
    let factor = analysis.factorise_near(shift, step)?;
    Ok(Cut {
        shift: factor.shift(),
        below: factor.below(),
    })
}

/// A cut with `wanted` + 1 to `wanted` + `band` / 2 eigenvalues below it, if no cluster prevents that.
pub(crate) fn top(
    analysis: &Analysis,
    bottom: Cut,
    wanted: usize,
    band: usize,
) -> Result<Cut, SpectrumError> {
    let size = analysis.operator().size();
    let target = wanted + 2;
    let everything = Cut {
        shift: 1.01 * analysis.operator().norm_bound(),
        below: size,
    };
    if target >= size {
        return Ok(everything);
    }
    let (mut lower, mut upper) = (
        Cut {
            shift: bottom.shift.max(0.0),
            below: bottom.below,
        },
        everything,
    );
    // Weyl's law for a surface of area 1. Surfaces with curvature and boundaries have a few more.
    let mut shift = 4.0 * PI * target as f64;
    loop {
        if !(shift > lower.shift && shift < upper.shift) {
            shift = 0.5 * (lower.shift + upper.shift);
        }
        let cut = count(analysis, shift, 1e-3 * shift)?;
        let narrow = upper.shift - lower.shift < 1e-4 * upper.shift;
        if cut.below > wanted && (cut.below <= wanted + band / 2 || narrow) {
            return Ok(cut);
        }
        if cut.below <= wanted {
            lower = cut;
        } else {
            upper = cut;
        }
        shift = if upper.below == size {
            cut.shift * (target as f64 / cut.below.max(1) as f64).clamp(1.05, 4.0)
        } else {
            let fraction = (target as f64 - lower.below as f64) / (upper.below - lower.below).max(1) as f64;
            lower.shift + fraction.clamp(0.05, 0.95) * (upper.shift - lower.shift)
        };
    }
}

/// Cuts from `bottom` to `top`, both included, with about `band` eigenvalues between neighbours.
pub(crate) fn subdivide(
    analysis: &Analysis,
    bottom: Cut,
    top: Cut,
    band: usize,
) -> Result<Vec<Cut>, SpectrumError> {
    let mut cuts = vec![bottom, top];
    loop {
        let shifts: Vec<(f64, f64)> = cuts
            .windows(2)
            .flat_map(|pair| inner(pair[0], pair[1], band))
            .collect();
        if shifts.is_empty() {
            return Ok(cuts);
        }
        let new: Result<Vec<Cut>, _> = shifts
            .par_iter()
            .map(|&(shift, step)| count(analysis, shift, step))
            .collect();
        cuts.extend(new?);
        cuts.sort_by(|a, b| a.shift.total_cmp(&b.shift));
    }
}

/// Evenly spaced shifts that split an interval with too many eigenvalues, each with a step to move it by if need be.
fn inner(a: Cut, b: Cut, band: usize) -> Vec<(f64, f64)> {
    let (lower, count) = (a.shift.max(0.0), b.below - a.below);
    let width = b.shift - lower;
    let parts = if 2 * count > 3 * band && width > 1e-3 * b.shift {
        count.div_ceil(band)
    } else {
        1
    };
    (1..parts)
        .map(|k| {
            (
                lower + width * k as f64 / parts as f64,
                0.013 * width / parts as f64,
            )
        })
        .collect()
}
