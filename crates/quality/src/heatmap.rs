//! Numbers on a surface as colours, and pictures of them with a scale (Figs. 4 and 5).

use mesh::TriMesh;

use crate::picture::{Colour, Paint, Picture, View, linear};

/// sRGB, from the least (blue) to the greatest (red), as in the paper's figures.
const STOPS: [u32; 6] = [0x2b3a9f, 0x2f8fd0, 0x53c2a0, 0xb9dd5c, 0xf6b13c, 0xc9211e];

/// The views of a heat map: from the front (z), the back, the right (x) and the left, with y up.
const VIEWS: [View; 4] = [
    View {
        eye: [0.0, 0.0, 1.0],
        up: [0.0, 1.0, 0.0],
    },
    View {
        eye: [0.0, 0.0, -1.0],
        up: [0.0, 1.0, 0.0],
    },
    View {
        eye: [1.0, 0.0, 0.0],
        up: [0.0, 1.0, 0.0],
    },
    View {
        eye: [-1.0, 0.0, 0.0],
        up: [0.0, 1.0, 0.0],
    },
];

const WHITE: Colour = [1.0; 3];
const BLACK: Colour = [0.0; 3];

/// A scale of colours from 0 to a greatest number; what is greater has the last colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    greatest: f64,
    /// The colours at its fifths, in linear light.
    stops: [Colour; STOPS.len()],
}

impl Scale {
    /// From 0 to `greatest`; pictures that are to be compared need the same.
    pub fn up_to(greatest: f64) -> Self {
        Self {
            greatest,
            stops: STOPS.map(linear),
        }
    }

    /// Up to the greatest of these numbers.
    pub fn of(values: &[f64]) -> Self {
        Self::up_to(values.iter().copied().fold(0.0, f64::max))
    }

    /// What the last colour stands for.
    pub fn greatest(&self) -> f64 {
        self.greatest
    }

    /// The colour of a number, in linear light.
    pub fn colour(&self, value: f64) -> Colour {
        let place = if self.greatest > 0.0 {
            (value / self.greatest).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let place = place * (STOPS.len() - 1) as f64;
        let below = (place as usize).min(STOPS.len() - 2);
        let t = place - below as f64;
        let (x, y) = (self.stops[below], self.stops[below + 1]);
        std::array::from_fn(|i| x[i] + t * (y[i] - x[i]))
    }

    /// The colours of numbers as bytes of red, green and blue (sRGB).
    pub fn bytes(&self, values: &[f64]) -> Vec<[u8; 3]> {
        values
            .iter()
            .map(|&value| crate::picture::bytes(self.colour(value)))
            .collect()
    }
}

/// A picture of a mesh from four fixed sides, in the colours of a number for each vertex, with the scale beside it.
///
/// `size` is the side of each of the four views, in pixels; `unit` says in small letters what the numbers are. Numbers beside
/// the scale are multiplied by `factor`: 100 for per cent.
///
/// # Panics
/// If there is not one number a vertex.
pub fn heatmap(
    mesh: &TriMesh,
    values: &[f64],
    scale: Scale,
    size: usize,
    unit: &str,
    factor: f64,
) -> Picture {
    assert_eq!(values.len(), mesh.vertex_count(), "one number a vertex");
    let letter = (size / 200).max(1);
    let legend = 26 * 6 * letter;
    let mut paper = Picture::blank(2 * size + legend, 2 * size, WHITE);
    let colour = |value: f64| scale.colour(value);
    for (i, view) in VIEWS.into_iter().enumerate() {
        let picture = Picture::of(mesh, Paint::Values(values, &colour), view, size);
        let (x, y) = (i % 2 * size, i / 2 * size);
        let middle = |side: usize| size.saturating_sub(side) / 2;
        paper.lay(
            &picture,
            x + middle(picture.width()),
            y + middle(picture.height()),
        );
    }
    draw_legend(&mut paper, scale, 2 * size + 3 * letter, letter, unit, factor);
    paper
}

/// The scale as a bar from bottom to top, numbers at its fifths, and what they are.
fn draw_legend(paper: &mut Picture, scale: Scale, x: usize, letter: usize, unit: &str, factor: f64) {
    const TICKS: usize = 5;
    let (line, width) = (7 * letter, 16 * letter);
    let (top, height) = (6 * line, paper.height().saturating_sub(9 * line).max(1));
    paper.write(unit, x, 3 * line, letter, BLACK);
    for row in 0..height {
        let value = scale.greatest() * (1.0 - (row as f64 + 0.5) / height as f64);
        paper.fill(x, top + row, width, 1, scale.colour(value));
    }
    for tick in 0..=TICKS {
        let y = top + (height - 1) * (TICKS - tick) / TICKS;
        paper.fill(x + width, y, 3 * letter, letter, BLACK);
        let value = factor * scale.greatest() * tick as f64 / TICKS as f64;
        let text = number(value, factor * scale.greatest());
        paper.write(
            &text,
            x + width + 8 * letter,
            y.saturating_sub(line / 2),
            letter,
            BLACK,
        );
    }
}

/// A number with three digits of the greatest on the scale.
fn number(value: f64, greatest: f64) -> String {
    if greatest > 0.0 && !(1e-4..1e5).contains(&greatest) {
        return format!("{value:.2e}");
    }
    let digits = if greatest > 0.0 {
        (2.0 - greatest.log10().floor()).max(0.0)
    } else {
        1.0
    };
    format!("{value:.*}", digits as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    #[test]
    fn the_scale_runs_from_blue_to_red_and_stays_there() {
        let scale = Scale::up_to(2.0);
        let [least, greatest, beyond] = [0.0, 2.0, 9.0].map(|value| scale.bytes(&[value])[0]);
        assert_eq!((least, greatest), ([0x2b, 0x3a, 0x9f], [0xc9, 0x21, 0x1e]));
        assert_eq!(beyond, greatest);
        assert_eq!(Scale::of(&[0.5, 1.5]), Scale::up_to(1.5));
        // Where nothing differs, all is blue.
        assert_eq!(Scale::of(&[0.0, 0.0]).bytes(&[0.0]), [least]);
    }

    #[test]
    fn numbers_beside_the_scale_have_three_digits() {
        assert_eq!(number(0.0123, 0.0123), "0.0123");
        assert_eq!(number(0.00492, 0.0123), "0.0049");
        assert_eq!(number(12.0, 34.0), "12.0");
        assert_eq!(number(1e-7, 1e-7), "1.00e-7");
    }

    #[test]
    fn the_same_values_have_the_same_colours_in_pictures_that_share_a_scale() {
        let ball = shapes::icosphere(3);
        let picture = |value: f64, greatest| {
            heatmap(
                &ball,
                &vec![value; ball.vertex_count()],
                Scale::up_to(greatest),
                60,
                "distance",
                1.0,
            )
        };
        let (alone, shared, double) = (picture(1.0, 1.0), picture(1.0, 2.0), picture(2.0, 2.0));
        let middle = |p: &Picture| p.pixel(30, 30).unwrap();
        assert_ne!(middle(&alone), middle(&shared));
        assert_eq!(middle(&alone), middle(&double));
        assert_eq!((alone.width(), alone.height()), (2 * 60 + 156, 120));
    }
}
