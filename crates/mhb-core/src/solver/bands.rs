//! All pairs between two cuts, with proof.

use std::sync::atomic::{AtomicUsize, Ordering};

use job::Job;

use super::band::{self, Band, Count, Pairs, Workspaces};
use super::factor::{Analysis, Factor};
use super::slicing::subdivide;
use super::tall::Tall;
use crate::{InertiaCount, SpectrumError, SpectrumOptions};

/// Pairs of several bands, all of them counted.
#[derive(Default)]
pub(crate) struct Certified {
    /// Where eigenvalues were counted, ascending.
    pub(crate) cuts: Vec<InertiaCount>,
    /// Ascending by value.
    pub(crate) pairs: Vec<Pair>,
    /// The matrices that hold the vectors.
    pub(crate) vectors: Vec<Tall>,
}

/// An eigenvalue, the residual of its vector, and where that is: which column of which matrix.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    pub(crate) value: f64,
    pub(crate) residual: f64,
    pub(crate) matrix: usize,
    pub(crate) column: usize,
}

impl Certified {
    /// Adds those of the pairs that pass.
    fn add(&mut self, pairs: Pairs, passes: impl Fn(f64) -> bool) {
        let matrix = self.vectors.len();
        for (column, (&value, &residual)) in pairs.values.iter().zip(&pairs.residuals).enumerate() {
            if passes(value) {
                self.pairs.push(Pair {
                    value,
                    residual,
                    matrix,
                    column,
                });
            }
        }
        self.vectors.push(pairs.vectors);
    }
}

/// What all bands share.
pub(crate) struct Bands<'a> {
    pub(crate) analysis: &'a Analysis,
    /// Known vectors of eigenvalue 0, in the analysis's ordering.
    pub(crate) kernel: &'a Tall,
    /// How many these are.
    pub(crate) zeros: usize,
    pub(crate) options: &'a SpectrumOptions,
    pub(crate) job: &'a Job,
    pub(crate) workspaces: Workspaces,
}

impl Bands<'_> {
    /// Adds all pairs between `bottom` and `top`, the kernel left out.
    ///
    /// Shifts are placed by interpolation, for about `options.band` pairs each. Each shift's factor gives the pairs
    /// around it, half-way to its neighbours, and counts the eigenvalues below it. Where fewer or more pairs were found
    /// between two shifts than their counts say, the interval is solved again, more carefully.
    pub(crate) fn solve(
        &self,
        bottom: InertiaCount,
        top: InertiaCount,
        certified: &mut Certified,
    ) -> Result<(), SpectrumError> {
        let lower = bottom.shift.max(0.0);
        // An even number keeps two threads busy to the end; it may not depend on the number of threads.
        let number = match (top.below - bottom.below).div_ceil(self.options.band.max(1)) {
            0 | 1 => 1,
            more => more.next_multiple_of(2),
        };
        let width = (top.shift - lower) / number as f64;
        let expected = (top.below - bottom.below).div_ceil(number);
        let blocks = AtomicUsize::new(0);
        let likely = number * band::likely_blocks(expected, self.options.block);
        let advance = || {
            let done = 1 + blocks.fetch_add(1, Ordering::Relaxed);
            self.job.progress((done as f64 / likely as f64).min(0.99))
        };
        let solved = self.job.map(number, 1, |k| {
            self.job.go_on()?;
            let start = lower + width * k as f64;
            let factor = self.analysis.factorise_near(start + 0.5 * width, 0.013 * width)?;
            let band = Band {
                lower: if k == 0 { bottom.shift } else { start },
                upper: if k + 1 == number {
                    top.shift
                } else {
                    lower + width * (k + 1) as f64
                },
                count: Count::About(expected),
            };
            Ok((factor.inertia(), self.around(&factor, band, &advance)?))
        })?;
        let solved = solved.into_iter().collect::<Result<_, SpectrumError>>()?;
        self.certify(bottom, solved, top, certified)
    }

    /// Keeps the pairs of every interval between shifts where their number is what inertia proves; solves the others
    /// again.
    fn certify(
        &self,
        bottom: InertiaCount,
        solved: Vec<(InertiaCount, Pairs)>,
        top: InertiaCount,
        certified: &mut Certified,
    ) -> Result<(), SpectrumError> {
        let cuts: Vec<InertiaCount> = std::iter::once(bottom)
            .chain(solved.iter().map(|(cut, _)| *cut))
            .chain([top])
            .collect();
        let (agreed, open): (Vec<[InertiaCount; 2]>, Vec<[InertiaCount; 2]>) = cuts
            .windows(2)
            .map(|ends| [ends[0], ends[1]])
            .partition(|[a, b]| {
                let inside = |l: &&f64| **l >= a.shift && **l < b.shift;
                let found: usize = solved
                    .iter()
                    .map(|(_, p)| p.values.iter().filter(inside).count())
                    .sum();
                found == self.count(*a, *b)
            });
        for (_, pairs) in solved {
            certified.add(pairs, |l| agreed.iter().any(|[a, b]| l >= a.shift && l < b.shift));
        }
        certified.cuts.extend(agreed.iter().map(|[_, b]| *b));
        for [a, b] in open {
            self.carefully(a, b, certified)?;
        }
        certified.cuts.sort_by(|a, b| a.shift.total_cmp(&b.shift));
        certified.pairs.sort_by(|a, b| a.value.total_cmp(&b.value));
        Ok(())
    }

    /// Pairs between two cuts that are not in the kernel.
    fn count(&self, a: InertiaCount, b: InertiaCount) -> usize {
        b.below - if a.shift < 0.0 { self.zeros } else { a.below }
    }

    /// Adds all pairs between two cuts, by bands whose exact number of pairs is counted first.
    fn carefully(
        &self,
        bottom: InertiaCount,
        top: InertiaCount,
        certified: &mut Certified,
    ) -> Result<(), SpectrumError> {
        let cuts = subdivide(self.analysis, bottom, top, self.options.band, self.job)?;
        let solved = self.job.map(cuts.len() - 1, 1, |k| {
            let [a, b] = [cuts[k], cuts[k + 1]];
            let lower = a.shift.max(0.0);
            let width = b.shift - lower;
            let factor = self.analysis.factorise_near(lower + 0.5 * width, 0.013 * width)?;
            let count = self.count(a, b);
            let band = Band {
                lower: a.shift,
                upper: b.shift,
                count: Count::Exactly(count),
            };
            let pairs = self.around(&factor, band, &|| self.job.go_on())?;
            // More pairs than exist mean that the count or a Ritz value at the band's edge is not to be trusted.
            match pairs.values.len() {
                found if found == count => Ok(pairs),
                found => Err(SpectrumError::Incomplete {
                    shift: b.shift,
                    proven: b.below,
                    found: b.below - count + found,
                }),
            }
        })?;
        let solved = solved.into_iter().collect::<Result<Vec<_>, _>>()?;
        for pairs in solved {
            certified.add(pairs, |_| true);
        }
        certified.cuts.extend(&cuts[1..]);
        Ok(())
    }

    /// The pairs of a band; `advance` is called after each block.
    fn around(
        &self,
        factor: &Factor<'_>,
        band: Band,
        advance: band::Advance<'_>,
    ) -> Result<Pairs, SpectrumError> {
        let nothing = Tall::zeros(self.kernel.rows(), 0);
        let deflated = if band.lower < 0.0 { self.kernel } else { &nothing };
        band::solve(
            factor,
            band,
            deflated,
            self.options.block,
            self.options.tolerance,
            &self.workspaces,
            advance,
        )
    }
}
