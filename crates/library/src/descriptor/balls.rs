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
    /// From the centre to the points that it sees, and how far.
    near: Vec<(Vec3, f64)>,
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
        let mut normal = Vec3::ZERO;
        self.grid.near(p, |point, i| {
            let d = point - p;
            let distance = d.norm();
            let weight = 1.0 - distance / (INNER * self.radius);
            if weight > 0.0 {
                normal += self.cloud.normals[i * self.step] * weight;
            }
            near.push((d, distance));
        });
        let normal = normal.unit();
        let unit = 1.0 / self.radius;
        let [a, b] = super::across(normal);
        let mut sums = [[0.0; 8]; 3];
        let mut third = [0.0; 2];
        for &(d, distance) in &self.near {
            let d = d * unit;
            let (x, y, z) = (d.dot(a), d.dot(b), d.dot(normal));
            let (xx, xy) = (x * x - y * y, 2.0 * x * y);
            let terms = [1.0, z, z * z, x, y, z * xx, z * xy, 0.0];
            let shares = shares(distance * unit);
            for (sums, share) in sums.iter_mut().zip(shares) {
                for (sum, term) in sums.iter_mut().zip(terms) {
                    *sum += share * term;
                }
            }
            third[0] += shares[2] * z * (xx * x - xy * y);
            third[1] += shares[2] * z * (xx * y + xy * x);
        }
        let mut numbers = [0.0; NUMBERS];
        for (s, sums) in sums.iter().enumerate() {
            let [m, z, zz, x, y, u, v, _] = *sums;
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

/// The shares that the shells have in a point so far away.
fn shares(radius: f64) -> [f64; 3] {
    let above = |s: usize| ((radius - SHELLS[s]) / (SHELLS[s + 1] - SHELLS[s])).clamp(0.0, 1.0);
    let (second, third) = (above(0), above(1));
    [1.0 - second, second - third, third]
}

/// The shares of a disc that the shells have.
fn planar() -> &'static [f64; 3] {
    static PLANAR: OnceLock<[f64; 3]> = OnceLock::new();
    PLANAR.get_or_init(|| {
        let mut sums = [0.0; 3];
        let steps = 4000;
        for k in 0..steps {
            let r = (f64::from(k) + 0.5) / f64::from(steps);
            for (sum, share) in sums.iter_mut().zip(shares(r)) {
                *sum += share * 2.0 * r / f64::from(steps);
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
}
