//! A bar chart as SVG, readable on light and dark pages.

use std::fmt::Write;

const WIDTH: f64 = 720.0;
const LABELS: f64 = 150.0;
/// Room for the words behind the longest bar.
const WORDS: f64 = 170.0;
const ROW: f64 = 34.0;
const TOP: f64 = 52.0;

pub(crate) struct Chart {
    title: String,
    unit: String,
    bars: Vec<(String, f64, String)>,
}

impl Chart {
    pub(crate) fn new(title: &str, unit: &str) -> Self {
        Self {
            title: title.into(),
            unit: unit.into(),
            bars: Vec::new(),
        }
    }

    /// A bar of this length, with words behind it. The first bar is ours and stands out.
    pub(crate) fn bar(&mut self, label: &str, length: f64, words: &str) {
        self.bars.push((label.into(), length, words.into()));
    }

    pub(crate) fn svg(&self) -> String {
        let height = TOP + ROW * self.bars.len() as f64 + 12.0;
        let longest = self
            .bars
            .iter()
            .map(|bar| bar.1)
            .fold(f64::MIN_POSITIVE, f64::max);
        let scale = (WIDTH - LABELS - WORDS) / longest;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\" \
             font-family=\"system-ui, sans-serif\" font-size=\"14\">\n\
             <rect width=\"100%\" height=\"100%\" rx=\"6\" fill=\"#ffffff\"/>\n\
             <text x=\"16\" y=\"28\" font-size=\"16\" font-weight=\"600\" fill=\"#1f2933\">{}: {}</text>\n",
            escaped(&self.title),
            escaped(&self.unit)
        );
        for (i, (label, length, words)) in self.bars.iter().enumerate() {
            let y = TOP + ROW * i as f64;
            let (colour, weight) = if i == 0 {
                ("#d9480f", 600)
            } else {
                ("#9fb3c8", 400)
            };
            let text = y + 16.0;
            let bar = (scale * length).max(1.0);
            // Writing to a string can't fail.
            let _ = writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{text:.1}\" text-anchor=\"end\" font-weight=\"{weight}\" fill=\"#1f2933\">{}</text>\
                 <rect x=\"{LABELS:.1}\" y=\"{y:.1}\" width=\"{bar:.1}\" height=\"22\" rx=\"2\" fill=\"{colour}\"/>\
                 <text x=\"{:.1}\" y=\"{text:.1}\" fill=\"#52606d\">{}</text>",
                LABELS - 10.0,
                escaped(label),
                LABELS + bar + 8.0,
                escaped(words)
            );
        }
        svg + "</svg>\n"
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_bar_fills_its_room_and_the_others_are_in_proportion() {
        let mut chart = Chart::new("a < b", "s");
        chart.bar("ours", 1.0, "1 s");
        chart.bar("theirs", 4.0, "4 s");
        let svg = chart.svg();
        let room = WIDTH - LABELS - WORDS;
        for width in [room / 4.0, room] {
            assert!(
                svg.contains(&format!("width=\"{width:.1}\" height=\"22\"")),
                "{svg}"
            );
        }
        assert!(svg.contains("a &lt; b"));
    }
}
