//! Pictures of meshes: a small software rasteriser with an orthographic view, a depth buffer, smooth shading, and antialiasing by
//! supersampling.

mod font;
#[cfg(feature = "png")]
mod png_file;
mod raster;

use mesh::TriMesh;

pub(crate) use raster::visible_samples;
use raster::{Camera, Canvas, srgb};

/// Linear red, green and blue, from 0 to 1.
pub type Colour = [f64; 3];

/// Where the eye is, seen from the model, and which way is up; of any length, not parallel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Direction to the eye.
    pub eye: [f64; 3],
    /// Direction that is up in the picture.
    pub up: [f64; 3],
}

/// The colours of a mesh.
#[derive(Clone, Copy)]
pub enum Paint<'a> {
    /// One for each triangle, #F.
    Triangles(&'a [Colour]),
    /// A number for each vertex, #V, interpolated in between and only then turned into a colour.
    Values(&'a [f64], &'a (dyn Fn(f64) -> Colour + Sync)),
}

/// Pixels of red, green, blue (sRGB) and alpha.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    width: usize,
    height: usize,
    /// Row by row from the top, four bytes a pixel.
    pixels: Vec<u8>,
}

impl Picture {
    /// Draws a mesh on a transparent background, as large as fits; the longer side has `size` pixels.
    ///
    /// # Panics
    /// If there are fewer colours than triangles, or fewer numbers than vertices.
    pub fn of(mesh: &TriMesh, paint: Paint<'_>, view: View, size: usize) -> Self {
        let camera = Camera::new(mesh, view, size, raster::SAMPLES);
        let mut canvas = Canvas::new(&camera);
        canvas.draw(mesh, &camera);
        let normals: Vec<[f64; 3]> = mesh.vertex_normals().iter().map(|&n| camera.turn(n)).collect();
        let (width, height, pixels) = canvas.shaded(mesh, &normals, paint);
        Self {
            width,
            height,
            pixels,
        }
    }

    /// A picture of one colour, opaque.
    pub fn blank(width: usize, height: usize, colour: Colour) -> Self {
        let [r, g, b] = colour.map(to_byte);
        Self {
            width,
            height,
            pixels: [r, g, b, 255].repeat(width * height),
        }
    }

    /// Pixels from left to right.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Pixels from top to bottom.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Red, green, blue and alpha of a pixel; `None` outside.
    pub fn pixel(&self, x: usize, y: usize) -> Option<[u8; 4]> {
        let at = 4 * (y * self.width + x);
        if x >= self.width {
            return None;
        }
        self.pixels.get(at..at + 4)?.try_into().ok()
    }

    /// Two pictures beside each other, their middles at one height, on nothing.
    pub fn beside(left: &Self, right: &Self) -> Self {
        let (width, height) = (left.width + right.width, left.height.max(right.height));
        let mut both = Self {
            width,
            height,
            pixels: vec![0; 4 * width * height],
        };
        both.lay(left, 0, (height - left.height) / 2);
        both.lay(right, left.width, (height - right.height) / 2);
        both
    }

    /// Lays another picture over this one, its upper left corner at (x, y); what would be outside is left out.
    pub fn lay(&mut self, other: &Self, x: usize, y: usize) {
        for row in 0..other.height.min(self.height.saturating_sub(y)) {
            for column in 0..other.width.min(self.width.saturating_sub(x)) {
                let source = &other.pixels[4 * (row * other.width + column)..][..4];
                let target = &mut self.pixels[4 * ((y + row) * self.width + x + column)..][..4];
                let alpha = f64::from(source[3]) / 255.0;
                for channel in 0..3 {
                    let (below, above) = (f64::from(target[channel]), f64::from(source[channel]));
                    target[channel] = (below + alpha * (above - below)).round() as u8;
                }
                let under = f64::from(target[3]) / 255.0;
                target[3] = (255.0 * (alpha + (1.0 - alpha) * under)).round() as u8;
            }
        }
    }

    /// Fills a rectangle with one colour, opaque.
    pub fn fill(&mut self, x: usize, y: usize, width: usize, height: usize, colour: Colour) {
        self.lay(&Self::blank(width, height, colour), x, y);
    }

    /// Writes letters of `size` times 5 by 7 pixels; (x, y) is the upper left corner of the first.
    pub fn write(&mut self, text: &str, x: usize, y: usize, size: usize, colour: Colour) {
        for (i, letter) in text.chars().enumerate() {
            for (column, row) in font::dots(letter) {
                self.fill(
                    x + size * (font::ADVANCE * i + column),
                    y + size * row,
                    size,
                    size,
                    colour,
                );
            }
        }
    }
}

fn to_byte(linear: f64) -> u8 {
    (255.0 * srgb(linear)).round() as u8
}

/// Red, green and blue of a colour as bytes (sRGB).
pub(crate) fn bytes(colour: Colour) -> [u8; 3] {
    colour.map(to_byte)
}

/// A colour as it is written in style sheets, 0xrrggbb, in linear light.
pub fn linear(srgb: u32) -> Colour {
    [16, 8, 0].map(|shift| {
        let value = f64::from(srgb >> shift & 0xff) / 255.0;
        if value <= 0.040_45 {
            value / 12.92
        } else {
            ((value + 0.055) / 1.055).powf(2.4)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    const FRONT: View = View {
        eye: [0.0, 0.0, 1.0],
        up: [0.0, 1.0, 0.0],
    };

    #[test]
    fn a_sphere_covers_the_disc_that_it_should() {
        let sphere = shapes::icosphere(4);
        let colours = vec![[0.5; 3]; sphere.triangle_count()];
        let picture = Picture::of(&sphere, Paint::Triangles(&colours), FRONT, 100);
        assert_eq!((picture.width, picture.height), (100, 100));
        let covered: f64 = picture
            .pixels
            .chunks(4)
            .map(|pixel| f64::from(pixel[3]) / 255.0)
            .sum();
        let disc = std::f64::consts::PI * (50.0 * (1.0 - 2.0 * raster::MARGIN)).powi(2);
        assert!((covered / disc - 1.0).abs() < 0.01, "{covered} {disc}");
    }

    #[test]
    fn what_is_nearer_hides_what_is_behind_whichever_is_drawn_first() {
        let near = shapes::translated(&shapes::rectangle(1, 1, 1.0, 1.0), [0.0, 0.0, 1.0]);
        let far = shapes::rectangle(1, 1, 1.0, 1.0);
        let (red, blue) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
        for (both, colours) in [
            (
                shapes::disjoint_union(&[near.clone(), far.clone()]),
                [red, red, blue, blue],
            ),
            (shapes::disjoint_union(&[far, near]), [blue, blue, red, red]),
        ] {
            let picture = Picture::of(&both, Paint::Triangles(&colours), FRONT, 20);
            let middle = picture.pixel(10, 10).unwrap();
            assert!(
                middle[0] > 100 && middle[2] < middle[0] / 2 && middle[3] == 255,
                "{middle:?}"
            );
        }
    }

    #[test]
    fn values_are_interpolated_before_they_become_colours() {
        // A step in the middle of the scale is a sharp border in the picture, though the values go over in 2 steps only.
        let strip = shapes::rectangle(2, 1, 2.0, 1.0);
        let values: Vec<f64> = strip.positions().iter().map(|p| p[0]).collect();
        let step = |x: f64| if x < 1.2 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
        let picture = Picture::of(&strip, Paint::Values(&values, &step), FRONT, 200);
        let at = |x: f64| picture.pixel((x * 100.0) as usize, picture.height() / 2).unwrap();
        let (blue, red) = (at(1.13), at(1.25));
        assert!(
            blue[2] > 100 && blue[0] < 60 && red[0] > 100 && red[2] < 60,
            "{blue:?} {red:?}"
        );
    }

    #[test]
    fn pictures_are_laid_over_each_other() {
        let mut paper = Picture::blank(40, 20, [1.0; 3]);
        paper.write("0.5 %", 2, 2, 1, [0.0; 3]);
        assert!(paper.pixels.chunks(4).any(|p| p == [0, 0, 0, 255]));
        paper.fill(35, 15, 100, 100, linear(0xff0000));
        assert_eq!(paper.pixel(39, 19), Some([255, 0, 0, 255]));
        assert_eq!(paper.pixel(34, 19), Some([255; 4]));
        assert_eq!(paper.pixel(40, 0), None);
    }
}
