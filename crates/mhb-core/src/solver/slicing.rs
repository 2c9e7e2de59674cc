//! Cuts of the spectrum, placed by counting eigenvalues.

use std::f64::consts::PI;

use job::Job;

use super::factor::Analysis;
use crate::{InertiaCount, SpectrumError};

/// A cut with `wanted` + 1 to `wanted` + `band` / 2 eigenvalues below it, if no cluster prevents that.
pub(crate) fn top(
    analysis: &Analysis,
    bottom: InertiaCount,
    wanted: usize,
    band: usize,
    job: &Job,
) -> Result<InertiaCount, SpectrumError> {
    let size = analysis.operator().size();
    let target = wanted + 2;
    let everything = InertiaCount {
        shift: 1.01 * analysis.operator().norm_bound(),
        below: size,
    };
    if target >= size {
        return Ok(everything);
    }
    let (mut lower, mut upper) = (
        InertiaCount {
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
        job.go_on()?;
        let cut = analysis.factorise_near(shift, 1e-3 * shift)?.inertia();
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

/// InertiaCounts from `bottom` to `top`, both included, with about `band` eigenvalues between neighbours.
pub(crate) fn subdivide(
    analysis: &Analysis,
    bottom: InertiaCount,
    top: InertiaCount,
    band: usize,
    job: &Job,
) -> Result<Vec<InertiaCount>, SpectrumError> {
    let mut cuts = vec![bottom, top];
    loop {
        let shifts: Vec<(f64, f64)> = cuts
            .windows(2)
            .flat_map(|pair| inner(pair[0], pair[1], band))
            .collect();
        if shifts.is_empty() {
            return Ok(cuts);
        }
        let new = job.map(shifts.len(), 1, |i| {
            job.go_on()?;
            let (shift, step) = shifts[i];
            Ok(analysis.factorise_near(shift, step)?.inertia())
        })?;
        cuts.extend(new.into_iter().collect::<Result<Vec<_>, SpectrumError>>()?);
        cuts.sort_by(|a, b| a.shift.total_cmp(&b.shift));
    }
}

/// Evenly spaced shifts that split an interval with too many eigenvalues, each with a step to move it by if need be.
fn inner(a: InertiaCount, b: InertiaCount, band: usize) -> Vec<(f64, f64)> {
    let (lower, count) = (a.shift.max(0.0), b.below - a.below);
    let width = b.shift - lower;
    let parts = if 2 * count > 3 * band && width > 1e-3 * b.shift {
        count.div_ceil(band)
    } else {
        1
    };
    let step = 0.013 * width / parts as f64;
    let shift = |k: usize| lower + width * k as f64 / parts as f64;
    (1..parts).map(|k| (shift(k), step)).collect()
}
