//! Clocks, and figures over rounds.

use std::time::Instant;

use cpu_time::ProcessTime;

/// What a computation cost, in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cost {
    /// User and system time of all threads. Says more than the wall clock on a machine that has other work to do.
    pub(crate) cpu: f64,
    pub(crate) wall: f64,
}

impl Cost {
    /// The medians of either time.
    pub(crate) fn median(rounds: &[Self]) -> Self {
        Self {
            cpu: median(rounds.iter().map(|cost| cost.cpu)),
            wall: median(rounds.iter().map(|cost| cost.wall)),
        }
    }
}

/// Runs `work`, which must be all that this process does meanwhile.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (T, Cost) {
    let (cpu, wall) = (ProcessTime::now(), Instant::now());
    let result = work();
    let cost = Cost {
        cpu: cpu.elapsed().as_secs_f64(),
        wall: wall.elapsed().as_secs_f64(),
    };
    (result, cost)
}

/// What `work` gives, and the median of its CPU seconds over at least one round.
pub(crate) fn timed_in_rounds<T, E>(rounds: usize, work: impl Fn() -> Result<T, E>) -> Result<(T, f64), E> {
    let (result, first) = timed(&work);
    let more = (1..rounds).map(|_| timed(&work).1);
    let cpu = median([first].into_iter().chain(more).map(|cost| cost.cpu));
    Ok((result?, cpu))
}

/// The median; of an even number, the mean of the middle two; NaN of none.
pub(crate) fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n => 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]),
    }
}

/// The geometric mean: what an average of ratios is; NaN of none.
pub(crate) fn geometric_mean(ratios: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for ratio in ratios {
        sum += ratio.ln();
        count += 1;
    }
    (sum / f64::from(count)).exp()
}

/// The greatest; NaN of none. Of errors and ratios, of which less is better: where one is NaN, which is no number to pass by, infinity.
pub(crate) fn greatest(values: impl IntoIterator<Item = f64>) -> f64 {
    let values = values.into_iter();
    let values = values.map(|value| if value.is_nan() { f64::INFINITY } else { value });
    values.fold(f64::NAN, f64::max)
}

/// The least; NaN of none.
pub(crate) fn least(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(f64::NAN, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_and_geometric_means_are_those_of_the_definitions() {
        assert_eq!(median([3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median([4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median([]).is_nan() && geometric_mean([]).is_nan());
        assert!((geometric_mean([2.0, 8.0]) - 4.0).abs() < 1e-15);
        assert_eq!([greatest([1.0, 3.0, 2.0]), least([2.0, 1.0, 3.0])], [3.0, 1.0]);
    }

    #[test]
    fn what_could_not_be_computed_is_the_greatest() {
        assert_eq!(greatest([1.0, f64::NAN, 2.0]), f64::INFINITY);
        assert_eq!(greatest([f64::NAN]), f64::INFINITY);
        assert!(greatest([]).is_nan());
    }
}
