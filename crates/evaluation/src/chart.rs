//! A bar chart as SVG, readable on light and dark pages.

use std::fmt::Write;

use crate::markup::{INK, OURS, PALE_INK, escaped};

const WIDTH: f64 = 760.0;
const LABELS: f64 = 160.0;
/// Room for the words behind the longest bar.
const WORDS: f64 = 200.0;
const ROW: f64 = 32.0;
const BAR: f64 = 20.0;
const TOP: f64 = 74.0;
/// Room for the numbers below the axis.
const BOTTOM: f64 = 34.0;

const THEIRS: &str = "#9fb3c8";
const GRID: &str = "#e4e7eb";

pub struct Chart {
    title: String,
    unit: String,
    bars: Vec<Bar>,
}

struct Bar {
    label: String,
    length: f64,
    words: String,
    open: bool,
}

impl Chart {
    pub fn new(title: &str, unit: &str) -> Self {
        Self {
            title: title.into(),
            unit: unit.into(),
            bars: Vec::new(),
        }
    }

    /// A bar of this length, with words behind it. The first bar is ours and stands out.
    pub fn bar(&mut self, label: &str, length: f64, words: &str) {
        self.push(label, length, words, false);
    }

    /// A bar that is drawn as an outline: what it stands for did not reach its end.
    pub fn open_bar(&mut self, label: &str, length: f64, words: &str) {
        self.push(label, length, words, true);
    }

    fn push(&mut self, label: &str, length: f64, words: &str, open: bool) {
        self.bars.push(Bar {
            label: label.into(),
            length,
            words: words.into(),
            open,
        });
    }

    pub fn svg(&self) -> String {
        let foot = TOP + ROW * self.bars.len() as f64;
        let height = foot + BOTTOM;
        let lengths = self.bars.iter().map(|bar| bar.length);
        let longest = lengths.fold(f64::MIN_POSITIVE, f64::max);
        let scale = (WIDTH - LABELS - WORDS) / longest;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\" \
             font-family=\"system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif\" font-size=\"13\">\n\
             <rect width=\"100%\" height=\"100%\" rx=\"8\" fill=\"#ffffff\"/>\n\
             <text x=\"20\" y=\"30\" font-size=\"15\" font-weight=\"600\" fill=\"{INK}\">{}</text>\n\
             <text x=\"20\" y=\"51\" fill=\"{PALE_INK}\">{}</text>\n",
            escaped(&self.title),
            escaped(&self.unit)
        );
        // Writing to a string can't fail.
        for mark in marks(longest) {
            let x = LABELS + scale * mark;
            let _ = writeln!(
                svg,
                "<path d=\"M{x:.1} {:.1}V{foot:.1}\" stroke=\"{GRID}\"/>\
                 <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\" font-size=\"11\" fill=\"{PALE_INK}\">{mark}</text>",
                TOP - 8.0,
                foot + 16.0
            );
        }
        for (i, bar) in self.bars.iter().enumerate() {
            let y = TOP + ROW * i as f64;
            let text = y + 0.5 * BAR + 4.5;
            let (colour, weight) = if i == 0 { (OURS, 600) } else { (THEIRS, 400) };
            let length = (scale * bar.length).max(2.0);
            let paint = if bar.open {
                format!("fill=\"#ffffff\" stroke=\"{colour}\" stroke-dasharray=\"4 3\"")
            } else {
                format!("fill=\"{colour}\"")
            };
            let _ = writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{text:.1}\" text-anchor=\"end\" font-weight=\"{weight}\" fill=\"{INK}\">{}</text>\
                 <rect x=\"{LABELS:.1}\" y=\"{y:.1}\" width=\"{length:.1}\" height=\"{BAR:.1}\" rx=\"2\" {paint}/>\
                 <text x=\"{:.1}\" y=\"{text:.1}\" font-weight=\"{weight}\" fill=\"{}\">{}</text>",
                LABELS - 12.0,
                escaped(&bar.label),
                LABELS + length + 8.0,
                if i == 0 { INK } else { PALE_INK },
                escaped(&bar.words)
            );
        }
        svg + "</svg>\n"
    }
}

/// Round numbers from 0 up to `longest`, five to ten of them.
fn marks(longest: f64) -> impl Iterator<Item = f64> {
    let power = 10f64.powf((longest / 4.0).log10().floor());
    let steps = [5.0, 2.0, 1.0].map(|digit| digit * power);
    let step = steps.into_iter().find(|step| 4.0 * step <= longest);
    let step = step.unwrap_or(power);
    (0..=(longest / step) as usize).map(move |k| k as f64 * step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_bar_fills_its_room_and_the_others_are_in_proportion() {
        let mut chart = Chart::new("a < b", "s");
        chart.bar("ours", 1.0, "1 s");
        chart.open_bar("theirs", 4.0, "4 s");
        let svg = chart.svg();
        let room = WIDTH - LABELS - WORDS;
        for width in [room / 4.0, room] {
            assert!(
                svg.contains(&format!("width=\"{width:.1}\" height=\"{BAR:.1}\"")),
                "{svg}"
            );
        }
        assert!(svg.contains("a &lt; b"));
        assert_eq!(svg.matches("stroke-dasharray").count(), 1);
    }

    #[test]
    fn marks_are_round_and_neither_few_nor_many() {
        assert_eq!(
            marks(36.0).collect::<Vec<_>>(),
            [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0]
        );
        for longest in [0.003, 1.0, 7.9, 80.0, 99.0, 456.0] {
            let count = marks(longest).count();
            assert!((5..=11).contains(&count), "{longest}: {count}");
            assert!(marks(longest).all(|mark| mark <= longest));
        }
    }
}
