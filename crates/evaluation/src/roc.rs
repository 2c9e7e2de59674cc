//! Fig. 11: the distributions of extraction rates with and without a mark, and the ROC curve between them.

use std::fmt::Write;

use crate::markup::{INK, OURS, PALE_INK};

/// Rates from 0 to 1.
pub(crate) struct Roc {
    marked: Vec<f64>,
    unmarked: Vec<f64>,
}

/// A threshold, and how often it errs: rates of at least it count as marked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Point {
    pub(crate) threshold: f64,
    pub(crate) false_positives: f64,
    pub(crate) false_negatives: f64,
}

impl Roc {
    pub(crate) fn new(mut marked: Vec<f64>, mut unmarked: Vec<f64>) -> Self {
        marked.sort_by(f64::total_cmp);
        unmarked.sort_by(f64::total_cmp);
        Self { marked, unmarked }
    }

    pub(crate) fn counts(&self) -> (usize, usize) {
        (self.marked.len(), self.unmarked.len())
    }

    pub(crate) fn at(&self, threshold: f64) -> Point {
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
    pub(crate) fn equal_error(&self, bits: usize) -> Point {
        let points: Vec<Point> = (0..=bits).map(|k| self.at(k as f64 / bits as f64)).collect();
        let gap = |point: &Point| (point.false_positives - point.false_negatives).abs();
        let least = points.iter().map(gap).fold(f64::INFINITY, f64::min);
        let equal: Vec<&Point> = points.iter().filter(|point| gap(point) <= least).collect();
        *equal[equal.len() / 2]
    }

    /// The probability that a marked mesh has a higher rate than an unmarked one, ties counting half: the area under the curve
    /// (Mann and Whitney).
    pub(crate) fn area(&self) -> f64 {
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
    pub(crate) fn svg(&self, bits: usize) -> String {
        const SIZE: (f64, f64) = (860.0, 360.0);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" \
             font-family=\"system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif\" font-size=\"12\">\n\
             <rect width=\"100%\" height=\"100%\" rx=\"8\" fill=\"#ffffff\"/>\n",
            SIZE.0, SIZE.1
        );
        svg += &self.histogram(Frame::new(60.0, 50.0, 340.0, 250.0));
        svg += &self.curve(Frame::new(490.0, 50.0, 340.0, 250.0), bits);
        svg + "</svg>\n"
    }

    /// Shares of the meshes in bins of 2.5 points.
    fn histogram(&self, frame: Frame) -> String {
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
        let mut svg = frame.axes("extraction rate (%)", "share of the meshes (%)");
        for tick in 0..=6 {
            let rate = LEFT + 0.1 * f64::from(tick);
            svg += &frame.mark_x((rate - LEFT) / (1.0 - LEFT), &format!("{:.0}", 100.0 * rate));
        }
        for tick in 0..=4 {
            let share = highest * f64::from(tick) / 4.0;
            svg += &frame.mark_y(share / highest, &format!("{:.0}", 100.0 * share));
        }
        for (i, (counts, colour, name)) in all.iter().enumerate() {
            for (bin, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0.0) {
                let (x, width) = (bin as f64 / BINS as f64, 1.0 / BINS as f64);
                svg += &frame.bar(x, width, count / highest, colour);
            }
            svg += &frame.key(i, name, colour);
        }
        svg
    }

    /// False negatives over false positives, which are on a logarithmic axis from the least that so many meshes can show.
    fn curve(&self, frame: Frame, bits: usize) -> String {
        let least = 0.5 / self.unmarked.len().max(1) as f64;
        let place = |rate: f64| (rate.max(least) / least).log10() / (1.0 / least).log10();
        let mut svg = frame.axes("false positives (%), logarithmic", "false negatives (%)");
        for rate in [0.001, 0.01, 0.1, 1.0].into_iter().filter(|rate| *rate > least) {
            svg += &frame.mark_x(place(rate), &format!("{}", 100.0 * rate));
        }
        svg += &frame.mark_x(0.0, "0");
        let points: Vec<Point> = (0..=bits)
            .rev()
            .map(|k| self.at(k as f64 / bits as f64))
            .collect();
        let spotless = points.iter().filter(|point| point.false_positives <= 0.0);
        let highest = spotless.map(|point| point.false_negatives).fold(1.0, f64::min);
        let highest = (1.2 * highest).clamp(0.05, 1.0);
        for tick in 0..=4 {
            let rate = highest * f64::from(tick) / 4.0;
            svg += &frame.mark_y(rate / highest, &format!("{:.1}", 100.0 * rate));
        }
        let mut path = String::new();
        for point in points.iter().filter(|point| point.false_negatives <= highest) {
            let (x, y) = frame.place(place(point.false_positives), point.false_negatives / highest);
            let _ = write!(path, "{}{x:.1} {y:.1}", if path.is_empty() { "M" } else { "L" });
        }
        let _ = writeln!(
            svg,
            "<path d=\"{path}\" fill=\"none\" stroke=\"{OURS}\" stroke-width=\"2\"/>"
        );
        let equal = self.equal_error(bits);
        let (x, y) = frame.place(place(equal.false_positives), equal.false_negatives / highest);
        let _ = writeln!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{OURS}\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"{INK}\">{:.1} %</text>",
            x - 8.0,
            y - 6.0,
            100.0 * equal.threshold
        );
        svg
    }
}

const THEIRS: &str = "#829ab1";

/// Where a plot lies on the page; places in it run from 0 to 1.
#[derive(Clone, Copy)]
pub(crate) struct Frame {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
}

impl Frame {
    pub(crate) fn new(left: f64, top: f64, width: f64, height: f64) -> Self {
        Self {
            left,
            top,
            width,
            height,
        }
    }

    pub(crate) fn place(&self, x: f64, y: f64) -> (f64, f64) {
        (self.left + x * self.width, self.top + (1.0 - y) * self.height)
    }

    pub(crate) fn axes(&self, x: &str, y: &str) -> String {
        let (right, foot) = (self.left + self.width, self.top + self.height);
        format!(
            "<path d=\"M{} {}V{foot}H{right}\" fill=\"none\" stroke=\"{PALE_INK}\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"{INK}\">{x}</text>\
             <text x=\"{:.1}\" y=\"{:.1}\" fill=\"{INK}\">{y}</text>\n",
            self.left,
            self.top,
            self.left + 0.5 * self.width,
            foot + 38.0,
            self.left - 44.0,
            self.top - 22.0
        )
    }

    pub(crate) fn mark_x(&self, x: f64, text: &str) -> String {
        let (x, y) = self.place(x, 0.0);
        format!(
            "<path d=\"M{x:.1} {y:.1}v5\" stroke=\"{PALE_INK}\"/><text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"{PALE_INK}\">{text}</text>\n",
            y + 19.0
        )
    }

    pub(crate) fn mark_y(&self, y: f64, text: &str) -> String {
        let (x, y) = self.place(0.0, y);
        format!(
            "<path d=\"M{x:.1} {y:.1}h-5\" stroke=\"{PALE_INK}\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"{PALE_INK}\">{text}</text>\n",
            x - 8.0,
            y + 4.0
        )
    }

    fn bar(&self, x: f64, width: f64, height: f64, colour: &str) -> String {
        let (left, top) = self.place(x, height);
        format!(
            "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{colour}\" fill-opacity=\"0.65\"/>\n",
            width * self.width - 1.0,
            height * self.height
        )
    }

    /// A line of the key, at the upper left.
    pub(crate) fn key(&self, row: usize, name: &str, colour: &str) -> String {
        let (x, y) = (self.left + 0.3 * self.width, self.top + 8.0 + 18.0 * row as f64);
        format!(
            "<rect x=\"{x:.1}\" y=\"{:.1}\" width=\"12\" height=\"12\" rx=\"2\" fill=\"{colour}\"/><text x=\"{:.1}\" y=\"{y:.1}\" fill=\"{INK}\">{name}</text>\n",
            y - 10.0,
            x + 18.0
        )
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
