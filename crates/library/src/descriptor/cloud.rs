//! Samples of a surface, evenly over it however it is cut into triangles.

use mesh::{TriMesh, Vec3};

use super::grid::Grid;
use crate::LibraryError;

/// How many samples a surface has, and of how many of them the whole is described.
pub(super) const FINE: usize = 16_384;
const SAMPLES: usize = 4096;

/// The ball in which samples are counted, in units of the cloud's radius. Smaller ones see the noise.
const DENSITY_RADIUS: f64 = 0.12;

/// Points of a surface about its centre, in units of its radius, with normals and weights.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cloud {
    /// From the weighted mean, divided by the root of the weighted mean square.
    pub(super) points: Vec<Vec3>,
    /// Of the triangles that they lie on.
    pub(super) normals: Vec<Vec3>,
    /// Their sum is 1.
    pub(super) weights: Vec<f64>,
    /// The area of the surface, in the square of the radius; once it is [evened](Self::evened), as balls see it.
    pub(super) area: f64,
    frame: Frame,
}

/// Where a mesh's points are in a cloud: at (p / unit − centre) · scale.
#[derive(Clone, Copy, Debug)]
struct Frame {
    unit: f64,
    centre: Vec3,
    scale: f64,
}

impl Default for Frame {
    fn default() -> Self {
        Self {
            unit: 1.0,
            centre: Vec3::ZERO,
            scale: 1.0,
        }
    }
}

impl Cloud {
    /// Samples of a mesh, all of one weight.
    pub(super) fn fine(mesh: &TriMesh) -> Result<Self, LibraryError> {
        let mut cloud = sampled(mesh, FINE)?;
        cloud.area /= cloud.normalise().powi(2);
        Ok(cloud)
    }

    /// The same in roots of its area; a needle has more of it.
    pub(super) fn in_roots(mut self) -> Self {
        let scale = 1.0 / self.area.max(1e-6).sqrt();
        self.points.iter_mut().for_each(|p| *p = *p * scale);
        self.frame.scale *= scale;
        self.area = 1.0;
        self
    }

    /// Where a point of the mesh lies.
    pub(super) fn place(&self, p: Vec3) -> Vec3 {
        (p * (1.0 / self.frame.unit) - self.frame.centre) * self.frame.scale
    }

    /// Every fourth sample, with weights that even out how dense they lie.
    ///
    /// A sample's weight is one over the number of samples in a ball around it. On a smooth surface that changes nothing; where noise has roughened small triangles, which have more area
    /// then, or where a wall has two sides close together, mass stays what it is seen to be from a distance.
    pub(super) fn evened(&self) -> Self {
        let step = FINE / SAMPLES;
        let mut cloud = Self {
            points: self.points.iter().skip(step / 2).step_by(step).copied().collect(),
            normals: self
                .normals
                .iter()
                .skip(step / 2)
                .step_by(step)
                .copied()
                .collect(),
            weights: vec![1.0; SAMPLES],
            ..Self::default()
        };
        cloud.normalise();
        let counts: Vec<f64> = {
            let grid = Grid::new(&cloud.points, DENSITY_RADIUS);
            let count = |p: &Vec3| {
                let mut count = 0.0;
                grid.near(*p, |_, _| count += 1.0);
                count
            };
            cloud.points.iter().map(count).collect()
        };
        let ball = std::f64::consts::PI * DENSITY_RADIUS * DENSITY_RADIUS;
        cloud.area = counts.iter().map(|count| ball / count).sum();
        cloud.weights = counts.iter().map(|count| 1.0 / count).collect();
        cloud.area /= cloud.normalise().powi(2);
        cloud
    }

    /// Brings the weights' sum to 1, the centre to the origin and the radius to 1; the answer is what the radius was.
    pub(super) fn normalise(&mut self) -> f64 {
        let total: f64 = self.weights.iter().sum();
        let pairs = || self.points.iter().zip(&self.weights);
        let centre = pairs().map(|(&p, &w)| p * w).sum::<Vec3>() / total;
        let square = pairs().map(|(&p, &w)| (p - centre).squared() * w).sum::<f64>() / total;
        let radius = square.sqrt();
        let scale = match radius > 0.0 {
            true => 1.0 / radius,
            false => 1.0,
        };
        self.points.iter_mut().for_each(|p| *p = (*p - centre) * scale);
        self.frame.centre += centre * (1.0 / self.frame.scale);
        self.frame.scale *= scale;
        self.weights.iter_mut().for_each(|w| *w /= total);
        radius
    }
}

/// Samples at equal steps of area in the order of the triangles; within them by the two-dimensional golden ratio.
fn sampled(mesh: &TriMesh, count: usize) -> Result<Cloud, LibraryError> {
    // Any finite coordinates are legal, and squares of large ones are not finite.
    let largest = mesh
        .positions()
        .as_flattened()
        .iter()
        .fold(0.0_f64, |most, x| most.max(x.abs()));
    let unit = match largest > 0.0 {
        true => largest,
        false => return Err(LibraryError::NoArea),
    };
    let bounds = mesh.bounding_box();
    let centre = Vec3(bounds.min.map(|x| 0.5 * (x / unit))) + Vec3(bounds.max.map(|x| 0.5 * (x / unit)));
    let extent = (0..3).fold(0.0_f64, |most, axis| {
        most.max(bounds.max[axis] / unit - bounds.min[axis] / unit)
    });
    if extent <= 0.0 {
        return Err(LibraryError::NoArea);
    }
    let corners = |t: usize| {
        mesh.corners(t)
            .map(|p| (Vec3(p.0.map(|x| x / unit)) - centre) / extent)
    };
    let twice = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a);
    let areas: Vec<f64> = (0..mesh.triangle_count())
        .map(|t| twice(corners(t)).norm())
        .collect();
    let total: f64 = areas.iter().sum();
    if !(total.is_finite() && total > 0.0) {
        return Err(LibraryError::NoArea);
    }
    let mut cloud = Cloud {
        weights: vec![1.0; count],
        // Of triangles it is twice as much.
        area: 0.5 * total,
        frame: Frame {
            unit,
            centre,
            scale: 1.0 / extent,
        },
        ..Cloud::default()
    };
    let step = total / count as f64;
    let (mut before, mut k) = (0.0, 0);
    for (t, area) in areas.iter().enumerate() {
        let end = before + area;
        while k < count && (k as f64 + 0.5) * step <= end {
            let corners = corners(t);
            cloud.points.push(within(corners, k));
            cloud.normals.push(twice(corners).unit());
            k += 1;
        }
        before = end;
    }
    // Rounding may leave the last one.
    while k < count {
        let last = areas.iter().rposition(|&area| area > 0.0).unwrap_or(0);
        cloud.points.push(within(corners(last), k));
        cloud.normals.push(twice(corners(last)).unit());
        k += 1;
    }
    Ok(cloud)
}

/// The `k`th point of a triangle: Roberts' R2 sequence, folded into the triangle.
fn within([a, b, c]: [Vec3; 3], k: usize) -> Vec3 {
    const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    let [mut u, mut v] = STEPS.map(|step| ((k as f64 + 0.5) * step).fract());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    a + (b - a) * u + (c - a) * v
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::{LARGEST_COORDINATE, shapes};

    #[test]
    fn samples_of_a_sphere_lie_on_the_unit_sphere_and_weigh_alike() {
        let cloud = Cloud::fine(&shapes::icosphere(4)).unwrap().evened();
        assert_eq!(cloud.points.len(), SAMPLES);
        assert!(cloud.points.iter().all(|p| (p.norm() - 1.0).abs() < 0.03));
        assert!((cloud.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let area = 4.0 * std::f64::consts::PI;
        assert!((cloud.area / area - 1.0).abs() < 0.1, "{}", cloud.area);
    }

    #[test]
    fn a_surface_without_area_or_with_the_largest_numbers_is_no_panic() {
        let line = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], vec![[0, 1, 2]]).unwrap();
        assert!(matches!(Cloud::fine(&line), Err(LibraryError::NoArea)));
        let point = TriMesh::new(vec![[1.0; 3]; 3], vec![[0, 1, 2]]).unwrap();
        assert!(matches!(Cloud::fine(&point), Err(LibraryError::NoArea)));
        let cube = shapes::cube(1.0);
        let far = |x: f64| {
            if x > 0.5 {
                LARGEST_COORDINATE
            } else {
                -LARGEST_COORDINATE
            }
        };
        let huge = cube.positions().iter().map(|p| p.map(far)).collect();
        let huge = cube.with_positions(huge).unwrap();
        assert!(Cloud::fine(&huge).is_ok());
    }
}
