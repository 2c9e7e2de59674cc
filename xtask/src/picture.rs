//! A small software rasteriser: orthographic view, depth buffer, smooth shading, antialiasing by supersampling.

use std::{fs::File, io::BufWriter, path::Path};

use anyhow::{Context, Result};
use mesh::TriMesh;

/// Samples a pixel along each axis.
const SAMPLES: usize = 3;
/// Fraction of the picture that stays free around the model.
const MARGIN: f64 = 0.03;

/// Linear red, green and blue, from 0 to 1.
pub(crate) type Colour = [f64; 3];

/// Where the eye is, seen from the model, and which way is up; of any length, not parallel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    pub(crate) eye: [f64; 3],
    pub(crate) up: [f64; 3],
}

/// A picture with a transparent background.
pub(crate) struct Picture {
    width: usize,
    height: usize,
    /// sRGB and alpha, row by row from the top.
    pixels: Vec<u8>,
}

impl Picture {
    /// Draws a mesh, its triangles in these colours, as large as fits; the longer side has `size` pixels.
    pub(crate) fn of(mesh: &TriMesh, colours: &[Colour], view: View, size: usize) -> Self {
        let camera = Camera::new(mesh, view, size * SAMPLES);
        let mut canvas = Canvas::new(camera.width, camera.height);
        let points: Vec<[f64; 3]> = mesh.positions().iter().map(|&p| camera.project(p)).collect();
        let normals: Vec<[f64; 3]> = mesh
            .vertex_normals()
            .iter()
            .map(|&n| camera.axes.map(|axis| dot(axis, n)))
            .collect();
        for (triangle, &colour) in mesh.triangles().iter().zip(colours) {
            let corners = triangle.map(|v| points[v as usize]);
            canvas.draw(corners, triangle.map(|v| normals[v as usize]), colour);
        }
        canvas.reduced()
    }

    /// Two pictures beside each other, their middles at one height.
    pub(crate) fn beside(left: &Self, right: &Self) -> Self {
        let (width, height) = (left.width + right.width, left.height.max(right.height));
        let mut pixels = vec![0; 4 * width * height];
        for (part, x) in [(left, 0), (right, left.width)] {
            let top = (height - part.height) / 2;
            for (y, row) in part.pixels.chunks(4 * part.width).enumerate() {
                let start = 4 * ((top + y) * width + x);
                pixels[start..start + row.len()].copy_from_slice(row);
            }
        }
        Self {
            width,
            height,
            pixels,
        }
    }

    /// Writes the picture as PNG.
    pub(crate) fn save(&self, path: &Path) -> Result<()> {
        let shown = || path.display().to_string();
        let file = BufWriter::new(File::create(path).with_context(shown)?);
        let mut encoder = png::Encoder::new(file, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        let mut writer = encoder.write_header().with_context(shown)?;
        writer.write_image_data(&self.pixels).with_context(shown)?;
        writer.finish().with_context(shown)
    }
}

/// An orthographic projection to sample coordinates: x to the right, y down, z towards the eye.
struct Camera {
    axes: [[f64; 3]; 3],
    scale: f64,
    origin: [f64; 2],
    width: usize,
    height: usize,
}

impl Camera {
    fn new(mesh: &TriMesh, view: View, longer_side: usize) -> Self {
        let forward = unit(view.eye);
        let right = unit(cross(view.up, forward));
        let axes = [right, cross(forward, right), forward];
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for &p in mesh.positions() {
            for axis in 0..2 {
                let x = dot(axes[axis], p);
                low[axis] = low[axis].min(x);
                high[axis] = high[axis].max(x);
            }
        }
        let extent = [high[0] - low[0], high[1] - low[1]];
        let scale = longer_side as f64 * (1.0 - 2.0 * MARGIN) / extent[0].max(extent[1]);
        let margin = MARGIN * longer_side as f64;
        let side =
            |length: f64| (((length * scale + 2.0 * margin) / SAMPLES as f64).ceil() as usize) * SAMPLES;
        Self {
            axes,
            scale,
            origin: [margin - scale * low[0], margin + scale * high[1]],
            width: side(extent[0]),
            height: side(extent[1]),
        }
    }

    fn project(&self, p: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.axes.map(|axis| self.scale * dot(axis, p));
        [self.origin[0] + x, self.origin[1] - y, z]
    }
}

/// Samples with their depths.
struct Canvas {
    width: usize,
    height: usize,
    depth: Vec<f64>,
    colour: Vec<Colour>,
}

impl Canvas {
    fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            depth: vec![f64::NEG_INFINITY; width * height],
            colour: vec![[0.0; 3]; width * height],
        }
    }

    /// Draws the samples inside a triangle that nothing drawn so far hides.
    fn draw(&mut self, corners: [[f64; 3]; 3], normals: [[f64; 3]; 3], colour: Colour) {
        let [a, b, c] = corners;
        let area = edge(a, b, c);
        if area == 0.0 {
            return;
        }
        // The centre of sample i lies at i + ½.
        let range = |axis: usize, end: usize| {
            let low = a[axis].min(b[axis]).min(c[axis]);
            let high = a[axis].max(b[axis]).max(c[axis]);
            ((low - 0.5).ceil().max(0.0) as usize)..((high + 0.5).floor().max(0.0) as usize).min(end)
        };
        for y in range(1, self.height) {
            for x in range(0, self.width) {
                let point = [x as f64 + 0.5, y as f64 + 0.5, 0.0];
                let weights = [edge(b, c, point), edge(c, a, point), edge(a, b, point)].map(|w| w / area);
                let depth = combined(weights, [a[2], b[2], c[2]]);
                let sample = y * self.width + x;
                if weights.iter().all(|&w| w >= 0.0) && depth > self.depth[sample] {
                    self.depth[sample] = depth;
                    let normal = unit(std::array::from_fn(|axis| {
                        combined(weights, normals.map(|n| n[axis]))
                    }));
                    self.colour[sample] = shaded(colour, normal);
                }
            }
        }
    }

    /// Means over the samples of each pixel.
    fn reduced(&self) -> Picture {
        let (width, height) = (self.width / SAMPLES, self.height / SAMPLES);
        let mut pixels = Vec::with_capacity(4 * width * height);
        for y in 0..height {
            for x in 0..width {
                let samples = (0..SAMPLES * SAMPLES)
                    .map(|i| (y * SAMPLES + i / SAMPLES) * self.width + x * SAMPLES + i % SAMPLES);
                let covered: Vec<usize> = samples.filter(|&s| self.depth[s].is_finite()).collect();
                let count = covered.len().max(1) as f64;
                for channel in 0..3 {
                    let sum: f64 = covered.iter().map(|&s| self.colour[s][channel]).sum();
                    pixels.push((255.0 * srgb(sum / count)).round() as u8);
                }
                let coverage = covered.len() as f64 / (SAMPLES * SAMPLES) as f64;
                pixels.push((255.0 * coverage).round() as u8);
            }
        }
        Picture {
            width,
            height,
            pixels,
        }
    }
}

/// Lambert's law for a light over the eye's left shoulder, with light from the sky and from the eye in the shadows. Surfaces
/// that turn their backs to the eye are lit as if they faced it.
fn shaded(colour: Colour, normal: [f64; 3]) -> Colour {
    let facing = if normal[2] < 0.0 {
        normal.map(|x| -x)
    } else {
        normal
    };
    let key = dot(facing, unit([-0.5, 0.6, 0.75])).max(0.0);
    let sky = 0.5 + 0.5 * facing[1];
    let light = 0.62 * key + 0.14 * sky + 0.22 * facing[2] + 0.05;
    // Where the light is mirrored to the eye, between it and the view.
    let gloss = 0.10 * dot(facing, unit([-0.27, 0.32, 0.91])).max(0.0).powi(40);
    colour.map(|c| (c * light + gloss).min(1.0))
}

/// From linear light to sRGB.
fn srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// Twice the signed area of a triangle of the picture's plane.
fn edge(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

fn combined(weights: [f64; 3], values: [f64; 3]) -> f64 {
    dot(weights, values)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = dot(a, a).sqrt();
    if length > 0.0 { a.map(|x| x / length) } else { a }
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
        let picture = Picture::of(&sphere, &colours, FRONT, 100);
        assert_eq!((picture.width, picture.height), (100, 100));
        let covered: f64 = picture
            .pixels
            .chunks(4)
            .map(|pixel| f64::from(pixel[3]) / 255.0)
            .sum();
        let disc = std::f64::consts::PI * (50.0 * (1.0 - 2.0 * MARGIN)).powi(2);
        assert!((covered / disc - 1.0).abs() < 0.01, "{covered} {disc}");
    }

    #[test]
    fn pictures_beside_each_other_keep_their_pixels() {
        let sphere = shapes::icosphere(2);
        let colours = vec![[0.5; 3]; sphere.triangle_count()];
        let [small, large] = [20, 30].map(|size| Picture::of(&sphere, &colours, FRONT, size));
        let both = Picture::beside(&small, &large);
        assert_eq!((both.width, both.height), (50, 30));
        let opaque = |picture: &Picture| picture.pixels.chunks(4).filter(|pixel| pixel[3] > 0).count();
        assert_eq!(opaque(&both), opaque(&small) + opaque(&large));
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
            let picture = Picture::of(&both, &colours, FRONT, 20);
            let middle = &picture.pixels[4 * (10 * picture.width + 10)..][..4];
            assert!(
                middle[0] > 100 && middle[2] < middle[0] / 2 && middle[3] == 255,
                "{middle:?}"
            );
        }
    }
}
