//! The one way to draw charts as SVG, readable on light and dark pages: horizontal bars, and panels with axes for curves and histograms.

use std::fmt::Write;

use super::markup::{INK, OURS, PALE_INK, escaped};

/// Of what ours is held against.
pub const THEIRS: &str = "#829ab1";

/// Lines behind what is drawn.
const GRID: &str = "#e4e7eb";

/// A white page with what was drawn on it. Numbers are pixels.
pub fn page(width: f64, height: f64, drawn: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" rx=\"8\" fill=\"#ffffff\"/>\n{drawn}</svg>\n"
    )
}

/// Words at a place, with more attributes if there are any.
fn words((x, y): (f64, f64), colour: &str, more: &str, text: &str) -> String {
    format!(
        "<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"{colour}\" {more}>{}</text>\n",
        escaped(text)
    )
}

/// A rectangle, its upper left corner at a place.
fn rectangle((x, y): (f64, f64), (width, height): (f64, f64), paint: &str) -> String {
    format!("<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" {paint}/>\n")
}

/// A path that is not filled.
fn line(path: &str, colour: &str, width: f64) -> String {
    format!("<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"/>\n")
}

const MIDDLE: &str = "text-anchor=\"middle\"";
const END: &str = "text-anchor=\"end\"";

/// A panel with axes. Places in it run from 0 to 1, from left to right and upwards.
pub struct Panel {
    /// Left, top, width, height.
    room: [f64; 4],
    drawn: String,
}

impl Panel {
    /// Axes with their names; left, top, width and height of the room between them in pixels.
    pub fn new(room: [f64; 4], x: &str, y: &str) -> Self {
        let [left, top, width, height] = room;
        let (right, foot) = (left + width, top + height);
        let drawn = line(&format!("M{left} {top}V{foot}H{right}"), PALE_INK, 1.0)
            + &words((left + 0.5 * width, foot + 38.0), INK, MIDDLE, x)
            + &words((left - 44.0, top - 22.0), INK, "", y);
        Self { room, drawn }
    }

    fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let [left, top, width, height] = self.room;
        (left + x * width, top + (1.0 - y) * height)
    }

    /// A mark on the x axis, with its number.
    pub fn tick_x(&mut self, at: f64, text: &str) {
        let (x, y) = self.place((at, 0.0));
        self.drawn += &line(&format!("M{x:.1} {y:.1}v5"), PALE_INK, 1.0);
        self.drawn += &words((x, y + 19.0), PALE_INK, MIDDLE, text);
    }

    /// A mark on the y axis, with its number.
    pub fn tick_y(&mut self, at: f64, text: &str) {
        let (x, y) = self.place((0.0, at));
        self.drawn += &line(&format!("M{x:.1} {y:.1}h-5"), PALE_INK, 1.0);
        self.drawn += &words((x - 8.0, y + 4.0), PALE_INK, END, text);
    }

    /// Straight lines from place to place.
    pub fn curve(&mut self, places: impl IntoIterator<Item = (f64, f64)>, colour: &str) {
        let mut path = String::new();
        for place in places {
            let (x, y) = self.place(place);
            // Writing to a string can't fail.
            let _ = write!(path, "{}{x:.1} {y:.1}", if path.is_empty() { "M" } else { "L" });
        }
        self.drawn += &line(&path, colour, 2.0);
    }

    /// A column of a histogram, its foot on the x axis.
    pub fn column(&mut self, x: f64, width: f64, height: f64, colour: &str) {
        let size = (width * self.room[2] - 1.0, height * self.room[3]);
        let paint = format!("fill=\"{colour}\" fill-opacity=\"0.65\"");
        self.drawn += &rectangle(self.place((x, height)), size, &paint);
    }

    /// A dot of ours, with words at its upper left.
    pub fn dot(&mut self, place: (f64, f64), text: &str) {
        let (x, y) = self.place(place);
        let _ = writeln!(
            self.drawn,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{OURS}\"/>"
        );
        self.drawn += &words((x - 8.0, y - 6.0), INK, END, text);
    }

    /// A line of the legend, which begins at this share of the width.
    pub fn legend(&mut self, at: f64, row: usize, name: &str, colour: &str) {
        let (x, y) = self.place((at, 1.0));
        let y = y + 8.0 + 18.0 * row as f64;
        let paint = format!("rx=\"2\" fill=\"{colour}\"");
        self.drawn += &rectangle((x, y - 10.0), (12.0, 12.0), &paint);
        self.drawn += &words((x + 18.0, y), INK, "", name);
    }

    /// What was drawn, for a [`page`].
    pub fn drawn(&self) -> &str {
        &self.drawn
    }
}

/// Horizontal bars.
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

/// Pixels of a chart of bars.
const WIDTH: f64 = 760.0;
const LABELS: f64 = 160.0;
/// Room for the words behind the longest bar.
const WORDS: f64 = 200.0;
const ROW: f64 = 32.0;
const BAR: f64 = 20.0;
const TOP: f64 = 74.0;
/// Room for the numbers below the axis.
const BOTTOM: f64 = 34.0;

impl Chart {
    /// Without bars. The unit is that of their lengths.
    pub fn new(title: &str, unit: &str) -> Self {
        Self {
            title: title.into(),
            unit: unit.into(),
            bars: Vec::new(),
        }
    }

    /// A bar of this length, with words behind it. The first bar is ours and stands out. What an `open` one, drawn as an outline,
    /// stands for did not reach its end.
    pub fn bar(&mut self, label: &str, length: f64, words: &str, open: bool) {
        self.bars.push(Bar {
            label: label.into(),
            length,
            words: words.into(),
            open,
        });
    }

    /// The chart as a file.
    pub fn svg(&self) -> String {
        let foot = TOP + ROW * self.bars.len() as f64;
        let lengths = self.bars.iter().map(|bar| bar.length);
        let longest = lengths.fold(f64::MIN_POSITIVE, f64::max);
        let scale = (WIDTH - LABELS - WORDS) / longest;
        let heading = "font-size=\"15\" font-weight=\"600\"";
        let mut drawn =
            words((20.0, 30.0), INK, heading, &self.title) + &words((20.0, 51.0), PALE_INK, "", &self.unit);
        for tick in ticks(longest) {
            let x = LABELS + scale * tick;
            drawn += &line(&format!("M{x:.1} {:.1}V{foot:.1}", TOP - 8.0), GRID, 1.0);
            drawn += &words((x, foot + 16.0), PALE_INK, MIDDLE, &tick.to_string());
        }
        for (i, bar) in self.bars.iter().enumerate() {
            drawn += &bar.drawn(TOP + ROW * i as f64, scale, i == 0);
        }
        page(WIDTH, foot + BOTTOM, &drawn)
    }
}

impl Bar {
    fn drawn(&self, y: f64, scale: f64, ours: bool) -> String {
        let text = y + 0.5 * BAR + 4.5;
        let (colour, weight) = if ours { (OURS, 600) } else { (THEIRS, 400) };
        let weight = format!("font-weight=\"{weight}\"");
        let length = (scale * self.length).max(2.0);
        let paint = if self.open {
            format!("rx=\"2\" fill=\"#ffffff\" stroke=\"{colour}\" stroke-dasharray=\"4 3\"")
        } else {
            format!("rx=\"2\" fill=\"{colour}\"")
        };
        let behind = if ours { INK } else { PALE_INK };
        let label = format!("{END} {weight}");
        words((LABELS - 12.0, text), INK, &label, &self.label)
            + &rectangle((LABELS, y), (length, BAR), &paint)
            + &words((LABELS + length + 8.0, text), behind, &weight, &self.words)
    }
}

/// Round numbers from 0 up to `longest`, five to ten of them.
fn ticks(longest: f64) -> impl Iterator<Item = f64> {
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
        chart.bar("ours", 1.0, "1 s", false);
        chart.bar("theirs", 4.0, "4 s", true);
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
    fn places_in_a_panel_run_from_its_lower_left_corner_to_its_upper_right() {
        let mut panel = Panel::new([70.0, 50.0, 500.0, 270.0], "x < 1", "y");
        panel.curve([(0.0, 0.0), (1.0, 1.0)], OURS);
        assert!(panel.drawn().contains("d=\"M70.0 320.0L570.0 50.0\""));
        assert!(panel.drawn().contains("x &lt; 1"));
    }

    #[test]
    fn ticks_are_round_and_neither_few_nor_many() {
        assert_eq!(
            ticks(36.0).collect::<Vec<_>>(),
            [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0]
        );
        for longest in [0.003, 1.0, 7.9, 80.0, 99.0, 456.0] {
            let count = ticks(longest).count();
            assert!((5..=11).contains(&count), "{longest}: {count}");
            assert!(ticks(longest).all(|tick| tick <= longest));
        }
    }
}
