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

use super::{cloud::Cloud, grid::Grid};

/// Radii at which a shell counts fully; within the first and beyond the last it goes on so.
const SHELLS: [f64; 3] = [0.3, 0.6, 0.9];
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
    near: Vec<usize>,
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
        let (near, step) = (&mut self.near, self.step);
        self.grid.near(p, |i| near.push(i * step));
        let mut normal = Vec3::ZERO;
        for &i in &self.near {
            let weight = 1.0 - (self.cloud.points[i] - p).norm() / (INNER * self.radius);
            if weight > 0.0 {
                normal += self.cloud.normals[i] * weight;
            }
        }
        let normal = normal.unit();
        let [a, b] = super::across(normal);
        let mut sums = [[0.0; 9]; 3];
        let mut third = [0.0; 2];
        for &i in &self.near {
            let d = (self.cloud.points[i] - p) * (1.0 / self.radius);
            let (x, y, z) = (d.dot(a), d.dot(b), d.dot(normal));
            let (shell, upper) = shell(d.norm());
            let (xx, xy) = (x * x - y * y, 2.0 * x * y);
            let terms = [1.0, z, z * z, x, y, z * xx, z * xy];
            for (sum, term) in sums[shell].iter_mut().zip(terms) {
                *sum += (1.0 - upper) * term;
            }
            if upper > 0.0 {
                for (sum, term) in sums[shell + 1].iter_mut().zip(terms) {
                    *sum += upper * term;
                }
            }
            let outer = if shell == 2 {
                1.0
            } else if shell == 1 {
                upper
            } else {
                0.0
            };
            third[0] += outer * z * (xx * x - xy * y);
            third[1] += outer * z * (xx * y + xy * x);
        }
        let mut numbers = [0.0; NUMBERS];
        for (s, sums) in sums.iter().enumerate() {
            let [m, z, zz, x, y, u, v, ..] = *sums;
            let whole = f64::max(m, 1e-9);
            let mean = z / whole;
            numbers[5 * s] = (m * self.unit / planar()[s]).sqrt();
            numbers[5 * s + 1] = mean;
            numbers[5 * s + 2] = (zz / whole - mean * mean).max(0.0).sqrt();
            numbers[5 * s + 3] = x.hypot(y) / whole;
            numbers[5 * s + 4] = u.hypot(v) / whole;
        }
        numbers[15] = third[0].hypot(third[1]) / f64::max(sums[2][0], 1e-9);
        (numbers, normal)
    }
}

/// The shell below a radius, and the share of the one above.
fn shell(radius: f64) -> (usize, f64) {
    match SHELLS.iter().position(|&node| radius < node) {
        Some(0) => (0, 0.0),
        Some(i) => (i - 1, (radius - SHELLS[i - 1]) / (SHELLS[i] - SHELLS[i - 1])),
        None => (2, 0.0),
    }
}

/// The shares of a disc that the shells have.
fn planar() -> &'static [f64; 3] {
    static SHARES: OnceLock<[f64; 3]> = OnceLock::new();
    SHARES.get_or_init(|| {
        let mut shares = [0.0; 3];
        let steps = 4000;
        for k in 0..steps {
            let r = (f64::from(k) + 0.5) / f64::from(steps);
            let (s, upper) = shell(r);
            shares[s] += (1.0 - upper) * 2.0 * r / f64::from(steps);
            if upper > 0.0 {
                shares[s + 1] += upper * 2.0 * r / f64::from(steps);
            }
        }
        shares
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
}
