use std::sync::{Arc, OnceLock};

use mesh::{Surface, TriMesh, Vec3};

use crate::{field::Field, matrix::Mat3};

/// How many points stand for a surface.
pub(crate) const SAMPLES: usize = 20_000;

/// A thread takes at least so many points at a time.
pub(crate) const GRAIN: usize = 256;

/// A mesh ready for alignment: its surface for queries, and points spread evenly over it.
pub(crate) struct Sampled {
    pub(crate) surface: Arc<Surface>,
    pub(crate) points: Vec<Vec3>,
    /// The triangle of each point.
    triangles: Vec<u32>,
    /// Unit normals of the triangles.
    normals: Arc<[[f64; 3]]>,
    /// As many of the mesh's vertices at most, evenly chosen.
    pub(crate) vertices: Vec<Vec3>,
    pub(crate) diagonal: f64,
    /// Area-weighted centroid.
    pub(crate) centroid: Vec3,
    /// Area-weighted covariance of position.
    pub(crate) covariance: Mat3,
    field: OnceLock<Field>,
}

impl Sampled {
    /// None when the mesh has no area. `surface` and `normals` are those of its triangles.
    pub(crate) fn of(
        mesh: &TriMesh,
        surface: &Arc<Surface>,
        normals: &Arc<[[f64; 3]]>,
        count: usize,
    ) -> Option<Self> {
        let (points, triangles) = sample(mesh, count)?;
        let each = 1.0 / count as f64;
        let centroid = points.iter().copied().sum::<Vec3>() * each;
        let mut covariance = Mat3::ZERO;
        for &p in &points {
            let p = p - centroid;
            covariance += Mat3::outer(p.map(|x| x / count as f64), p);
        }
        let corners = mesh.triangles().as_flattened();
        let vertices = corners.iter().step_by((corners.len() / count).max(1));
        Some(Self {
            surface: Arc::clone(surface),
            points,
            triangles,
            normals: Arc::clone(normals),
            vertices: vertices.map(|&v| mesh.point(v as usize)).collect(),
            diagonal: mesh.bounding_box().diagonal(),
            centroid,
            covariance,
            field: OnceLock::new(),
        })
    }

    /// The unit normal at one of the points.
    pub(crate) fn normal(&self, point: usize) -> Vec3 {
        self.triangle_normal(self.triangles[point])
    }

    /// The triangle of one of the points.
    pub(crate) fn triangle(&self, point: usize) -> usize {
        self.triangles[point] as usize
    }

    /// The unit normal of a triangle.
    pub(crate) fn triangle_normal(&self, triangle: u32) -> Vec3 {
        Vec3(self.normals[triangle as usize])
    }

    /// A sample about nearest to `p` and its distance, in constant time; none for points far outside.
    pub(crate) fn near(&self, p: Vec3) -> Option<(usize, f64)> {
        let field = self.field.get_or_init(|| Field::of(&self.points, self.diagonal));
        let sample = field.near(p)?;
        Some((sample, (self.points[sample] - p).norm()))
    }

    /// About `count` of the points, evenly spread.
    pub(crate) fn some(&self, count: usize) -> impl Iterator<Item = usize> + Clone + '_ {
        (0..self.points.len()).step_by((self.points.len() / count.max(1)).max(1))
    }
}

/// Points that stand for equal areas: one in the middle of each `count`-th of the area, in the order of the triangles, at
/// places within the triangles that follow a low-discrepancy sequence. None when there is no area.
fn sample(mesh: &TriMesh, count: usize) -> Option<(Vec<Vec3>, Vec<u32>)> {
    let size = mesh.bounding_box().diagonal();
    // Scaled so that areas neither overflow nor vanish.
    let area = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(|p| p * (1.0 / size));
        (b - a).cross(c - a).norm()
    };
    let total: f64 = (0..mesh.triangle_count()).map(area).sum();
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    let (mut points, mut triangles) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let mut before = 0.0;
    for t in 0..mesh.triangle_count() {
        before += area(t);
        while points.len() < count && (points.len() as f64 + 0.5) * total < before * count as f64 {
            points.push(at(mesh, t, points.len()));
            triangles.push(t as u32);
        }
    }
    while points.len() < count {
        let last = *triangles.last()?;
        points.push(at(mesh, last as usize, points.len()));
        triangles.push(last);
    }
    Some((points, triangles))
}

/// The i-th place of the R₂ sequence (Roberts 2018), folded into a triangle.
fn at(mesh: &TriMesh, triangle: usize, i: usize) -> Vec3 {
    const PLASTIC: f64 = 1.324_717_957_244_746;
    let mut u = (i as f64 / PLASTIC).fract();
    let mut v = (i as f64 / (PLASTIC * PLASTIC)).fract();
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    let [a, b, c] = mesh.corners(triangle);
    a + ((b - a) * u + (c - a) * v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    #[test]
    fn distances_to_the_grids_samples_are_near_the_true_ones() {
        let mesh = shapes::bumpy_torus(40, 24, 1);
        let surface = Arc::new(Surface::new(&mesh));
        let sampled = Sampled::of(&mesh, &surface, &mesh.triangle_normals().into(), SAMPLES);
        let sampled = sampled.expect("a torus has area");
        for i in 0..500 {
            // Points spread over the bounding box.
            let place = [0.618, 0.755, 0.570].map(|step| (f64::from(i) * step).fract());
            let bounds = mesh.bounding_box();
            let p = Vec3([0, 1, 2].map(|axis| bounds.min[axis] + place[axis] * bounds.size()[axis]));
            let (_, near) = sampled.near(p).expect("inside the box");
            let exact = surface.nearest(p.0).distance;
            assert!(
                near >= exact && near < exact + 0.03 * sampled.diagonal,
                "{near} {exact}"
            );
        }
        assert!(sampled.near(100.0 * Vec3::X).is_none());
    }
}
