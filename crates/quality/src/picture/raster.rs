//! From triangles to samples, and from samples to pixels.

use mesh::{TriMesh, Vec3};

use super::{Colour, Paint, View};

/// Samples a pixel along each axis.
pub(super) const SAMPLES: usize = 3;
/// Fraction of the picture that stays free around the model.
pub(super) const MARGIN: f64 = 0.03;

/// An orthographic projection to sample coordinates: x to the right, y down, z towards the eye.
pub(super) struct Camera {
    axes: [Vec3; 3],
    scale: f64,
    origin: [f64; 2],
    width: usize,
    height: usize,
}

impl Camera {
    /// For a picture whose longer side has `size` pixels of `samples` by `samples`.
    pub(super) fn new(mesh: &TriMesh, view: View, size: usize, samples: usize) -> Self {
        let forward = Vec3(view.eye).unit();
        let right = Vec3(view.up).cross(forward).unit();
        let axes = [right, forward.cross(right), forward];
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for &p in mesh.positions() {
            for axis in 0..2 {
                let x = axes[axis].dot(Vec3(p));
                low[axis] = low[axis].min(x);
                high[axis] = high[axis].max(x);
            }
        }
        let extent = [high[0] - low[0], high[1] - low[1]];
        let longer_side = (size * samples) as f64;
        let longest = extent[0].max(extent[1]);
        // A model seen as a single point is as good at any scale.
        let scale = longer_side * (1.0 - 2.0 * MARGIN) / if longest > 0.0 { longest } else { 1.0 };
        let margin = MARGIN * longer_side;
        let side =
            |length: f64| (((length * scale + 2.0 * margin) / samples as f64).ceil() as usize) * samples;
        Self {
            axes,
            scale,
            origin: [margin - scale * low[0], margin + scale * high[1]],
            width: side(extent[0]),
            height: side(extent[1]),
        }
    }

    fn project(&self, p: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.turn(p).map(|x| self.scale * x);
        [self.origin[0] + x, self.origin[1] - y, z]
    }

    /// A direction as the eye sees it.
    pub(super) fn turn(&self, v: [f64; 3]) -> [f64; 3] {
        self.axes.map(|axis| axis.dot(Vec3(v)))
    }
}

/// What of a mesh is seen at a sample.
#[derive(Clone, Copy)]
struct Sample {
    triangle: u32,
    /// The weights of the first two corners; those of all three sum to 1.
    weights: [f32; 2],
}

const NOTHING: u32 = u32::MAX;

/// The nearest triangle at each sample.
pub(super) struct Canvas {
    width: usize,
    height: usize,
    depth: Vec<f64>,
    seen: Vec<Sample>,
}

impl Canvas {
    pub(super) fn new(camera: &Camera) -> Self {
        let size = camera.width * camera.height;
        let nothing = Sample {
            triangle: NOTHING,
            weights: [0.0; 2],
        };
        Self {
            width: camera.width,
            height: camera.height,
            depth: vec![f64::NEG_INFINITY; size],
            seen: vec![nothing; size],
        }
    }

    pub(super) fn draw(&mut self, mesh: &TriMesh, camera: &Camera) {
        let points: Vec<[f64; 3]> = mesh.positions().iter().map(|&p| camera.project(p)).collect();
        for (t, triangle) in mesh.triangles().iter().enumerate() {
            self.draw_triangle(triangle.map(|v| points[v as usize]), t as u32);
        }
    }

    /// Takes the samples inside a triangle that nothing drawn so far hides.
    fn draw_triangle(&mut self, [a, b, c]: [[f64; 3]; 3], triangle: u32) {
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
                let depth = Vec3(weights).dot(Vec3([a[2], b[2], c[2]]));
                let sample = y * self.width + x;
                if weights.iter().all(|&w| w >= 0.0) && depth > self.depth[sample] {
                    self.depth[sample] = depth;
                    self.seen[sample] = Sample {
                        triangle,
                        weights: [weights[0] as f32, weights[1] as f32],
                    };
                }
            }
        }
    }

    /// Width, height and pixels: means over the samples of each.
    pub(super) fn shaded(
        &self,
        mesh: &TriMesh,
        normals: &[[f64; 3]],
        paint: Paint<'_>,
    ) -> (usize, usize, Vec<u8>) {
        let (width, height) = (self.width / SAMPLES, self.height / SAMPLES);
        let mut pixels = Vec::with_capacity(4 * width * height);
        for y in 0..height {
            for x in 0..width {
                let samples = (0..SAMPLES * SAMPLES)
                    .map(|i| (y * SAMPLES + i / SAMPLES) * self.width + x * SAMPLES + i % SAMPLES);
                let colours: Vec<Colour> = samples
                    .map(|s| self.seen[s])
                    .filter(|s| s.triangle != NOTHING)
                    .map(|s| colour(mesh, normals, paint, s))
                    .collect();
                let count = colours.len().max(1) as f64;
                for channel in 0..3 {
                    let sum: f64 = colours.iter().map(|c| c[channel]).sum();
                    pixels.push(super::to_byte(sum / count));
                }
                let coverage = colours.len() as f64 / (SAMPLES * SAMPLES) as f64;
                pixels.push((255.0 * coverage).round() as u8);
            }
        }
        (width, height, pixels)
    }
}

fn colour(mesh: &TriMesh, normals: &[[f64; 3]], paint: Paint<'_>, sample: Sample) -> Colour {
    let corners = mesh.triangles()[sample.triangle as usize].map(|v| v as usize);
    let [u, v] = sample.weights.map(f64::from);
    let weights = Vec3([u, v, 1.0 - u - v]);
    let normal = Vec3([0, 1, 2].map(|axis| weights.dot(Vec3(corners.map(|v| normals[v][axis]))))).unit();
    let own = match paint {
        Paint::Triangles(colours) => colours[sample.triangle as usize],
        Paint::Values(values, scale) => scale(weights.dot(Vec3(corners.map(|v| values[v])))),
    };
    lit(own, normal)
}

/// The triangle at each sample of a view where there is one; the longer side has `size` samples.
pub(crate) fn visible_samples(mesh: &TriMesh, eye: [f64; 3], size: usize) -> impl Iterator<Item = u32> {
    // Any direction that is not the eye's serves as up.
    let up = match eye
        .iter()
        .map(|x| x.abs())
        .enumerate()
        .min_by(|a, b| a.1.total_cmp(&b.1))
    {
        Some((1, _)) => [0.0, 1.0, 0.0],
        Some((2, _)) => [0.0, 0.0, 1.0],
        _ => [1.0, 0.0, 0.0],
    };
    let camera = Camera::new(mesh, View { eye, up }, size, 1);
    let mut canvas = Canvas::new(&camera);
    canvas.draw(mesh, &camera);
    canvas
        .seen
        .into_iter()
        .map(|s| s.triangle)
        .filter(|&t| t != NOTHING)
}

/// Lambert's law for a light over the eye's left shoulder, with light from the sky and from the eye in the shadows. Surfaces
/// that turn their backs to the eye are lit as if they faced it.
fn lit(colour: Colour, normal: Vec3) -> Colour {
    let facing = if normal[2] < 0.0 { -normal } else { normal };
    let key = facing.dot(Vec3([-0.5, 0.6, 0.75]).unit()).max(0.0);
    let sky = 0.5 + 0.5 * facing[1];
    let light = 0.62 * key + 0.14 * sky + 0.22 * facing[2] + 0.05;
    // Where the light is mirrored to the eye, between it and the view.
    let gloss = 0.10 * facing.dot(Vec3([-0.27, 0.32, 0.91]).unit()).max(0.0).powi(40);
    colour.map(|c| (c * light + gloss).min(1.0))
}

/// From linear light to sRGB.
pub(super) fn srgb(linear: f64) -> f64 {
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
