//! A point and a line against one triangle, in double precision.

use crate::Vec3;

/// The point of a triangle nearest to `p` (Ericson, *Real-Time Collision Detection*, 5.1.5), degenerate triangles included.
pub(super) fn nearest_on_triangle(&[a, b, c]: &[Vec3; 3], p: Vec3) -> Vec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ratio(d1, d1 - d3) * ab;
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ratio(d2, d2 - d6) * ac;
    }
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + ratio(d4 - d3, (d4 - d3) + (d5 - d6)) * (c - b);
    }
    let sum = va + vb + vc;
    a + (ratio(vb, sum) * ab + ratio(vc, sum) * ac)
}

/// x / y, and 0 for 0 / 0.
fn ratio(x: f64, y: f64) -> f64 {
    if y == 0.0 { 0.0 } else { x / y }
}

/// A line in the frame in which triangles are tested: its largest axis last, sheared onto that axis.
///
/// The edge functions of Woop, Benthin and Wald (*Watertight ray/triangle intersection*, 2013) give a shared edge the same sign
/// from both of its triangles: a line through a closed surface never slips between two of them.
pub(super) struct Line {
    origin: Vec3,
    axes: [usize; 3],
    shear: [f64; 3],
}

impl Line {
    /// The line origin + t · direction; `None` when the direction is zero or not finite.
    pub(super) fn new(origin: Vec3, direction: Vec3) -> Option<Self> {
        let z = (0..3).max_by(|&i, &j| direction[i].abs().total_cmp(&direction[j].abs()))?;
        if direction[z] == 0.0 || !direction.0.iter().all(|x| x.is_finite()) {
            return None;
        }
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let shear = [
            direction[axes[0]] / direction[z],
            direction[axes[1]] / direction[z],
            1.0 / direction[z],
        ];
        Some(Self { origin, axes, shear })
    }

    /// The t at which the line meets a triangle.
    pub(super) fn meet(&self, corners: &[Vec3; 3]) -> Option<f64> {
        let [x, y, z] = self.axes;
        let [a, b, c] = corners.map(|p| {
            let p = p - self.origin;
            [
                p[x] - self.shear[0] * p[z],
                p[y] - self.shear[1] * p[z],
                self.shear[2] * p[z],
            ]
        });
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None;
        }
        Some((u * a[2] + v * b[2] + w * c[2]) / determinant)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn points(size: f64) -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-size..size).prop_map(Vec3)
    }

    proptest! {
        #[test]
        fn the_nearest_point_of_a_triangle_beats_its_other_points(
            corners in prop::array::uniform3(points(1.0)), p in points(2.0),
            weights in prop::array::uniform3(0.01..1.0_f64), flat in 0..3_u8,
        ) {
            let [a, b, c] = corners;
            let corners = match flat { 0 => [a, b, a], 1 => [a, a, a], _ => [a, b, c] };
            let sum: f64 = weights.iter().sum();
            let other: Vec3 = (0..3).map(|i| corners[i] * (weights[i] / sum)).sum();
            let nearest = nearest_on_triangle(&corners, p);
            prop_assert!((nearest - p).norm() <= (other - p).norm() + 1e-14);
            prop_assert!((nearest_on_triangle(&corners, nearest) - nearest).norm() < 1e-7);
        }
    }
}
