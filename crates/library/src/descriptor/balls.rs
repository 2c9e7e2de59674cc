//! What balls around points of a surface see.
//!
//! Around a point with normal n (a mean over the inner ball) every other point d of a ball of radius r, in units of r, has a height z = n·d and a place (x, y) in the plane across n, whose axes are anybody's. Of the
//! points of each of three shells about the centre (hat functions of |d|)
//! - the mass, 1 for a plane,
//! - the mean and the spread of z,
//! - |mean of (x + i y)|, and |mean of z (x + i y)²|: to which side the surface lies, and how differently it bends along and across,
//!
//! and of the outermost |mean of z (x + i y)³|. Turning (x, y) changes none.

use std::{f64::consts::PI, sync::OnceLock};

use mesh::Vec3;

use super::{across, cloud::Cloud, grid::Grid};

/// Radii at which a shell counts fully; within the first and beyond the last it goes on so.
const SHELLS: [f32; 3] = [0.3, 0.6, 0.9];
/// The normal's ball.
const INNER: f64 = 0.4;

/// Numbers of a place.
pub(super) const NUMBERS: usize = 16;

/// What is seen from samples of a cloud in roots of its area.
pub(super) struct Balls<'a> {
    cloud: &'a Cloud,
    /// Every `step`th sample.
    grid: Grid,
    step: usize,
    radius: f64,
    /// One over the samples that the ball has on a plane.
    unit: f64,
    /// From the centre to the points that it sees, in units of the radius.
    near: Vec<[f32; 3]>,
}

/// Points that are summed at a time, in single precision.
const LANES: usize = 8;
type Lanes = [f32; LANES];

/// The sums over a ball's points for each shell, of its share times 1, z, z², x, y, z (x² − y²) and 2 x y z; and of the outermost of the real and the imaginary part of z (x + i y)³.
#[derive(Default)]
struct Sums {
    shells: [[Lanes; 7]; 3],
    third: [Lanes; 2],
}

impl<'a> Balls<'a> {
    /// Balls of a radius, in which every `step`th sample is seen.
    pub(super) fn new(cloud: &'a Cloud, radius: f64, step: usize) -> Self {
        let points: Vec<Vec3> = cloud.points.iter().step_by(step).copied().collect();
        Self {
            cloud,
            unit: 1.0 / (PI * radius * radius * points.len() as f64),
            grid: Grid::new(&points, radius),
            step,
            radius,
            near: Vec::new(),
        }
    }

    /// What the ball around a sample sees, and the normal there.
    pub(super) fn see(&mut self, centre: usize) -> ([f64; NUMBERS], Vec3) {
        let p = self.cloud.points[centre];
        self.near.clear();
        let near = &mut self.near;
        let (unit, inner) = (1.0 / self.radius, INNER * self.radius);
        let mut normal = Vec3::ZERO;
        self.grid.near(p, |point, i| {
            let d = point - p;
            let square = d.squared();
            if square < inner * inner {
                normal += self.cloud.normals[i * self.step] * (1.0 - square.sqrt() / inner);
            }
            near.push((d * unit).0.map(|x| x as f32));
        });
        let normal = normal.unit();
        let [a, b] = across(normal);
        let axes = [a, b, normal].map(|axis| axis.0.map(|x| x as f32));
        let mut sums = Sums::default();
        for points in self.near.chunks(LANES) {
            sums.add(points, &axes);
        }
        let sum = |lanes: &Lanes| f64::from(lanes.iter().sum::<f32>());
        let mut numbers = [0.0; NUMBERS];
        for (s, sums) in sums.shells.iter().enumerate() {
            let [m, z, zz, x, y, u, v] = sums.each_ref().map(sum);
            let whole = f64::max(m, 1e-9);
            let mean = z / whole;
            numbers[5 * s] = (m * self.unit / planar()[s]).sqrt();
            numbers[5 * s + 1] = mean;
            numbers[5 * s + 2] = (zz / whole - mean * mean).max(0.0).sqrt();
            numbers[5 * s + 3] = x.hypot(y) / whole;
            numbers[5 * s + 4] = u.hypot(v) / whole;
        }
        let [real, imaginary] = sums.third.each_ref().map(sum);
        numbers[15] = real.hypot(imaginary) / f64::max(sum(&sums.shells[2][0]), 1e-9);
        (numbers, normal)
    }
}

/// A number for each of some points.
#[inline]
fn lanes(of_one: impl Fn(usize) -> f32) -> Lanes {
    let mut lanes = [0.0; LANES];
    for (k, lane) in lanes.iter_mut().enumerate() {
        *lane = of_one(k);
    }
    lanes
}

impl Sums {
    /// Adds up to [`LANES`] points, given from the centre in units of the radius; the axes are two across the normal, and that.
    #[inline]
    fn add(&mut self, points: &[[f32; 3]], axes: &[[f32; 3]; 3]) {
        let mut d = [[0.0; LANES]; 3];
        for (k, point) in points.iter().enumerate() {
            (0..3).for_each(|axis| d[axis][k] = point[axis]);
        }
        let times = |a: &Lanes, b: &Lanes| lanes(|k| a[k] * b[k]);
        let along = |axis: &[f32; 3]| lanes(|k| axis[0] * d[0][k] + axis[1] * d[1][k] + axis[2] * d[2][k]);
        let [x, y, z] = axes.each_ref().map(along);
        let xx = lanes(|k| x[k] * x[k] - y[k] * y[k]);
        let xy = lanes(|k| 2.0 * x[k] * y[k]);
        let terms = [
            [1.0; LANES],
            z,
            times(&z, &z),
            x,
            y,
            times(&z, &xx),
            times(&z, &xy),
        ];
        let distance = lanes(|k| (d[0][k] * d[0][k] + d[1][k] * d[1][k] + d[2][k] * d[2][k]).sqrt());
        let shares = shares(&distance, points.len());
        for (sums, share) in self.shells.iter_mut().zip(&shares) {
            for (sum, term) in sums.iter_mut().zip(&terms) {
                for k in 0..LANES {
                    sum[k] += share[k] * term[k];
                }
            }
        }
        let [.., u, v] = &terms;
        for k in 0..LANES {
            self.third[0][k] += shares[2][k] * (u[k] * x[k] - v[k] * y[k]);
            self.third[1][k] += shares[2][k] * (u[k] * y[k] + v[k] * x[k]);
        }
    }
}

/// The shares that the shells have in points so far away, of which there are so many.
#[inline]
fn shares(distance: &Lanes, count: usize) -> [Lanes; 3] {
    const SLOPES: [f32; 2] = [1.0 / (SHELLS[1] - SHELLS[0]), 1.0 / (SHELLS[2] - SHELLS[1])];
    let above = |s: usize| lanes(|k| ((distance[k] - SHELLS[s]) * SLOPES[s]).clamp(0.0, 1.0));
    let (second, third) = (above(0), above(1));
    [
        lanes(|k| if k < count { 1.0 - second[k] } else { 0.0 }),
        lanes(|k| second[k] - third[k]),
        third,
    ]
}

/// The shares of a disc that the shells have.
fn planar() -> &'static [f64; 3] {
    static PLANAR: OnceLock<[f64; 3]> = OnceLock::new();
    PLANAR.get_or_init(|| {
        let mut sums = [0.0; 3];
        let steps = 4000;
        for k in 0..steps {
            let r = (f64::from(k) + 0.5) / f64::from(steps);
            for (sum, [share, ..]) in sums.iter_mut().zip(shares(&[r as f32; LANES], 1)) {
                *sum += f64::from(share) * 2.0 * r / f64::from(steps);
            }
        }
        sums
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::descriptor::cloud::FINE;
    use mesh::shapes;

    #[test]
    fn shells_share_a_disc() {
        assert!((planar().iter().sum::<f64>() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_plane_has_the_mass_of_a_plane_and_no_height() {
        let cloud = Cloud::fine(&shapes::rectangle(8, 8, 1.0, 1.0))
            .unwrap()
            .in_roots();
        let centre = (0..FINE)
            .min_by(|&a, &b| cloud.points[a].norm().total_cmp(&cloud.points[b].norm()))
            .unwrap();
        let (numbers, normal) = Balls::new(&cloud, 0.1, 2).see(centre);
        assert!((normal.0[2].abs() - 1.0).abs() < 1e-9);
        for shell in 0..3 {
            assert!((numbers[5 * shell] - 1.0).abs() < 0.1, "{numbers:?}");
            assert!(numbers[5 * shell + 1].abs() < 1e-9 && numbers[5 * shell + 2] < 1e-6);
        }
    }

    /// At a chord's length ρ from a point of a sphere of radius R its height is −ρ²/(2 R), and rings of equal width have areas in proportion to ρ.
    #[test]
    fn a_sphere_falls_off_with_the_square_of_the_distance() {
        let cloud = Cloud::fine(&shapes::icosphere(5)).unwrap().in_roots();
        let (radius, of_sphere) = (0.1, (4.0 * PI).powf(-0.5));
        let mut balls = Balls::new(&cloud, radius, 2);
        let rings = (0..1000).map(|k| (f64::from(k) + 0.5) / 1000.0);
        let moments = rings.fold([[0.0; 2]; 3], |mut moments, r| {
            for (moments, [share, ..]) in moments.iter_mut().zip(shares(&[r as f32; LANES], 1)) {
                moments[0] += f64::from(share) * r;
                moments[1] += f64::from(share) * r.powi(3);
            }
            moments
        });
        for centre in (0..FINE).step_by(FINE / 16) {
            let (numbers, normal) = balls.see(centre);
            assert!(normal.dot(cloud.points[centre].unit()) > 0.999);
            for (shell, [mass, square]) in moments.into_iter().enumerate() {
                let height = -radius / (2.0 * of_sphere) * square / mass;
                assert!(
                    (numbers[5 * shell + 1] - height).abs() < 0.01,
                    "{numbers:?} {height}"
                );
            }
        }
    }
}
