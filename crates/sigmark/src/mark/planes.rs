//! The planes of triangles that went into the vertices of a decimated suspect, and what a displacement of their corners does to them there.

use mesh::Vec3;

use super::settling::barycentric;

/// Where a corner of a triangle weighs more, the triangle is a needle: its plane says little, and what a displacement does to it says nothing.
const MOST_WEIGHT: f64 = 50.0;

/// A plane of a region.
#[derive(Debug)]
pub(super) struct Plane {
    pub(super) region: usize,
    /// The corners of its triangle, among the vertices of a patch, and what each weighs at the region's point; those of a plane that several corners bring are as many times as large.
    corners: [u32; 3],
    weights: [f64; 3],
    pub(super) normal: Vec3,
}

impl Plane {
    /// That of a triangle, by its numbers and places, at a region's point; none of a needle.
    pub(super) fn of(
        corners: [u32; 3],
        places @ [a, b, c]: [Vec3; 3],
        (region, point): (usize, Vec3),
        times: f64,
    ) -> Option<Self> {
        let normal = (b - a).cross(c - a);
        let weights = barycentric(places, point);
        let says = normal.squared() > 0.0 && weights.iter().all(|weight| weight.abs() <= MOST_WEIGHT);
        says.then(|| Self {
            region,
            corners,
            weights: weights.map(|weight| times * weight),
            normal: normal.unit(),
        })
    }

    /// What it moves by along its normal where its corners are displaced by vector fields, for each of them.
    pub(super) fn moved_by<const N: usize>(&self, fields: &[[Vec3; N]]) -> [f64; N] {
        let corners = self.corners.map(|v| &fields[v as usize]);
        std::array::from_fn(|k| {
            let parts = (0..3).map(|i| self.weights[i] * self.normal.dot(corners[i][k]));
            parts.sum()
        })
    }
}

/// Σ n nᵀ f(x) of each of so many regions, by rows: the pull of its planes when the vertices of the patch are displaced by a function along each of the three axes.
pub(super) fn pulls(planes: &[Plane], function: &[f64], regions: usize) -> Vec<[Vec3; 3]> {
    let mut sums = vec![[Vec3::ZERO; 3]; regions];
    for plane in planes {
        let values = plane.corners.iter().zip(plane.weights);
        let value: f64 = values.map(|(&v, weight)| weight * function[v as usize]).sum();
        for (row, n) in sums[plane.region].iter_mut().zip(plane.normal.0) {
            *row += plane.normal * (n * value);
        }
    }
    sums
}
