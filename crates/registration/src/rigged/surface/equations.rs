//! Least squares of which each equation names few of the unknowns.

use faer::{Mat, MatRef, Side, linalg::solvers::Solve};

/// What nothing is told of is damped as if it was told this share of the mean.
const LEAST_DAMPED: f64 = 0.01;

/// Normal equations, summed up one equation after the other.
pub(super) struct NormalEquations {
    count: usize,
    /// Row by row, of which only what isn't left of the diagonal is kept.
    matrix: Vec<f64>,
    right: Vec<f64>,
    /// The numbers of the equation that is added, and of each run of unknowns that follow each other the first, and where its numbers end.
    numbers: Vec<f64>,
    runs: Vec<(usize, usize)>,
}

impl NormalEquations {
    pub(super) fn of_unknowns(count: usize) -> Self {
        Self {
            count,
            matrix: vec![0.0; count * count],
            right: vec![0.0; count],
            numbers: Vec::new(),
            runs: Vec::new(),
        }
    }

    /// Adds Σ number × unknown = rest. Unknowns ascend, each is named once.
    pub(super) fn add(&mut self, numbers: &[(usize, f64)], rest: f64, weight: f64) {
        self.numbers.clear();
        self.numbers.extend(numbers.iter().map(|&(_, number)| number));
        self.runs.clear();
        let mut end = 0;
        for run in numbers.chunk_by(|a, b| a.0 + 1 == b.0) {
            end += run.len();
            self.runs.push((run[0].0, end));
        }
        let mut begin = 0;
        for (i, &(first, end)) in self.runs.iter().enumerate() {
            for at in begin..end {
                let unknown = first + at - begin;
                let weighted = weight * self.numbers[at];
                self.right[unknown] += weighted * rest;
                let row = &mut self.matrix[unknown * self.count..(unknown + 1) * self.count];
                add_to(&mut row[unknown..], weighted, &self.numbers[at..end]);
                let mut before = end;
                for &(first, end) in &self.runs[i + 1..] {
                    add_to(&mut row[first..], weighted, &self.numbers[before..end]);
                    before = end;
                }
            }
            begin = end;
        }
    }

    /// Adds a number to each of the diagonal's.
    pub(super) fn hold_all(&mut self, by: f64) {
        (0..self.count).for_each(|i| self.matrix[i * (self.count + 1)] += by);
    }

    /// These equations and others.
    pub(super) fn and(mut self, other: &Self) -> Self {
        let sums = self.matrix.iter_mut().chain(&mut self.right);
        sums.zip(other.matrix.iter().chain(&other.right))
            .for_each(|(sum, number)| *sum += number);
        self
    }

    /// The unknowns, damped (Marquardt 1963); none where the equations say nothing.
    pub(super) fn solved(&self, damping: f64) -> Option<Mat<f64>> {
        let count = self.count;
        let diagonal = |i: usize| self.matrix[i * (count + 1)];
        let mean = (0..count).map(diagonal).sum::<f64>() / count as f64;
        // Row by row what isn't left of the diagonal is column by column what isn't above it.
        let mut damped = MatRef::from_column_major_slice(&self.matrix, count, count).to_owned();
        for i in 0..count {
            damped[(i, i)] += damping * (diagonal(i) + LEAST_DAMPED * mean) + f64::MIN_POSITIVE;
        }
        let right = Mat::from_fn(count, 1, |i, _| self.right[i]);
        let step = damped.llt(Side::Lower).ok()?.solve(&right);
        let is_finite = (0..count).all(|i| step[(i, 0)].is_finite());
        is_finite.then_some(step)
    }
}

/// Adds a multiple of numbers to the first of sums.
fn add_to(sums: &mut [f64], factor: f64, numbers: &[f64]) {
    for (sum, number) in sums.iter_mut().zip(numbers) {
        *sum += factor * number;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Equations of some of seven unknowns, which are met by 1, −2, 3, −4, 5, −6, 7.
    #[test]
    fn unknowns_that_meet_all_equations_are_found() {
        let truth =
            |unknown: usize| (unknown as f64 + 1.0) * if unknown.is_multiple_of(2) { 1.0 } else { -1.0 };
        let equations = |range: std::ops::Range<usize>| {
            let mut sum = NormalEquations::of_unknowns(7);
            for i in range {
                let named = (0..7).filter(|unknown| (i * 5 + unknown * 3) % 4 != 0);
                let numbers: Vec<_> = named
                    .map(|unknown| (unknown, ((i * 7 + unknown * 11) as f64).sin()))
                    .collect();
                let rest = numbers
                    .iter()
                    .map(|&(unknown, number)| number * truth(unknown))
                    .sum();
                sum.add(&numbers, rest, 1.0 + i as f64);
            }
            sum
        };
        let all = equations(0..12).and(&equations(12..30));
        let found = all.solved(0.0).unwrap();
        for unknown in 0..7 {
            assert!((found[(unknown, 0)] - truth(unknown)).abs() < 1e-9, "{unknown}");
        }
    }
}
