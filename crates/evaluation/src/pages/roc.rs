//! Fig. 11: the distributions of extraction rates with and without a mark, and the ROC curve between them.

use crate::output::{
    chart::{Panel, THEIRS, page},
    markup::OURS,
};

/// Rates from 0 to 1.
pub(super) struct Roc {
    marked: Vec<f64>,
    unmarked: Vec<f64>,
}

/// A threshold, and how often it errs: rates of at least it count as marked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub(super) threshold: f64,
    pub(super) false_positives: f64,
    pub(super) false_negatives: f64,
}

impl Roc {
    pub(super) fn new(mut marked: Vec<f64>, mut unmarked: Vec<f64>) -> Self {
        marked.sort_by(f64::total_cmp);
        unmarked.sort_by(f64::total_cmp);
        Self { marked, unmarked }
    }

    pub(super) fn counts(&self) -> (usize, usize) {
        (self.marked.len(), self.unmarked.len())
    }

    pub(super) fn at(&self, threshold: f64) -> Point {
        let below = |rates: &[f64]| {
            rates.partition_point(|&rate| rate < threshold) as f64 / rates.len().max(1) as f64
        };
        Point {
            threshold,
            false_positives: 1.0 - below(&self.unmarked),
            false_negatives: below(&self.marked),
        }
    }

    /// The threshold in steps of one bit of `bits` at which both errors are most nearly equal; of several the middle one.
    pub(super) fn equal_error(&self, bits: usize) -> Point {
        let points: Vec<Point> = (0..=bits).map(|k| self.at(k as f64 / bits as f64)).collect();
        let gap = |point: &Point| (point.false_positives - point.false_negatives).abs();
        let least = points.iter().map(gap).fold(f64::INFINITY, f64::min);
        let equal: Vec<&Point> = points.iter().filter(|point| gap(point) <= least).collect();
        *equal[equal.len() / 2]
    }

    /// The probability that a marked mesh has a higher rate than an unmarked one, ties counting half: the area under the curve
    /// (Mann and Whitney).
    pub(super) fn area(&self) -> f64 {
        let wins: f64 = self
            .marked
            .iter()
            .map(|&rate| {
                let below = self.unmarked.partition_point(|&other| other < rate);
                let not_above = self.unmarked.partition_point(|&other| other <= rate);
                0.5 * (below + not_above) as f64
            })
            .sum();
        wins / (self.marked.len() * self.unmarked.len()).max(1) as f64
    }

    /// Both panels.
    pub(super) fn svg(&self, bits: usize) -> String {
        let panels = [
            self.histogram([60.0, 50.0, 340.0, 250.0]),
            self.curve([490.0, 50.0, 340.0, 250.0], bits),
        ];
        page(860.0, 360.0, &panels.each_ref().map(Panel::drawn).concat())
    }

    /// Shares of the meshes in bins of 2.5 points.
    fn histogram(&self, room: [f64; 4]) -> Panel {
        const BINS: usize = 24;
        const LEFT: f64 = 0.4;
        let shares = |rates: &[f64]| {
            let mut counts = [0.0; BINS];
            for rate in rates {
                let bin = ((rate - LEFT) / (1.0 - LEFT) * BINS as f64) as usize;
                counts[bin.min(BINS - 1)] += 1.0 / rates.len().max(1) as f64;
            }
            counts
        };
        let all = [
            (shares(&self.unmarked), THEIRS, "unmarked"),
            (shares(&self.marked), OURS, "marked"),
        ];
        let highest = all
            .iter()
            .flat_map(|(counts, ..)| counts)
            .fold(0.05_f64, |a, &b| a.max(b));
        let mut panel = Panel::new(room, "extraction rate (%)", "share of the meshes (%)");
        for tick in 0..=6 {
            let rate = LEFT + 0.1 * f64::from(tick);
            panel.tick_x((rate - LEFT) / (1.0 - LEFT), &format!("{:.0}", 100.0 * rate));
        }
        for tick in 0..=4 {
            let share = f64::from(tick) / 4.0;
            panel.tick_y(share, &format!("{:.0}", 100.0 * highest * share));
        }
        for (i, (counts, colour, name)) in all.iter().enumerate() {
            for (bin, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0.0) {
                let (x, width) = (bin as f64 / BINS as f64, 1.0 / BINS as f64);
                panel.column(x, width, count / highest, colour);
            }
            panel.legend(0.3, i, name, colour);
        }
        panel
    }

    /// False negatives over false positives, which are on a logarithmic axis from the least that so many meshes can show.
    fn curve(&self, room: [f64; 4], bits: usize) -> Panel {
        let least = 0.5 / self.unmarked.len().max(1) as f64;
        let across = |rate: f64| (rate.max(least) / least).log10() / (1.0 / least).log10();
        let mut panel = Panel::new(room, "false positives (%), logarithmic", "false negatives (%)");
        for rate in [0.001, 0.01, 0.1, 1.0].into_iter().filter(|rate| *rate > least) {
            panel.tick_x(across(rate), &format!("{}", 100.0 * rate));
        }
        panel.tick_x(0.0, "0");
        let points: Vec<Point> = (0..=bits)
            .rev()
            .map(|k| self.at(k as f64 / bits as f64))
            .collect();
        let spotless = points.iter().filter(|point| point.false_positives <= 0.0);
        let highest = spotless.map(|point| point.false_negatives).fold(1.0, f64::min);
        let highest = (1.2 * highest).clamp(0.05, 1.0);
        for tick in 0..=4 {
            let share = f64::from(tick) / 4.0;
            panel.tick_y(share, &format!("{:.1}", 100.0 * highest * share));
        }
        let place = |point: &Point| (across(point.false_positives), point.false_negatives / highest);
        let inside = points.iter().filter(|point| point.false_negatives <= highest);
        panel.curve(inside.map(place), OURS);
        let equal = self.equal_error(bits);
        panel.dot(place(&equal), &format!("{:.1} %", 100.0 * equal.threshold));
        panel
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_area_is_the_share_of_pairs_in_the_right_order() {
        assert_eq!(Roc::new(vec![0.8, 0.9], vec![0.5, 0.6]).area(), 1.0);
        assert_eq!(Roc::new(vec![0.5, 0.9], vec![0.5, 0.6]).area(), (0.5 + 2.0) / 4.0);
        let same = Roc::new(vec![0.4, 0.5, 0.6], vec![0.6, 0.5, 0.4]);
        assert!((same.area() - 0.5).abs() < 1e-12);
    }

    #[test]
    fn errors_are_equal_where_the_distributions_cross() {
        let roc = Roc::new(vec![0.55, 0.7, 0.8, 0.9], vec![0.45, 0.5, 0.52, 0.6]);
        let equal = roc.equal_error(100);
        assert_eq!((equal.false_positives, equal.false_negatives), (0.25, 0.25));
        assert!((0.55..=0.6).contains(&equal.threshold));
        let apart = Roc::new(vec![0.9], vec![0.5]).equal_error(324);
        assert_eq!((apart.false_positives, apart.false_negatives), (0.0, 0.0));
        assert!((apart.threshold - 0.7).abs() < 0.01);
        assert_eq!(roc.at(0.0).false_positives, 1.0);
        assert_eq!(roc.at(1.1).false_negatives, 1.0);
    }
}
