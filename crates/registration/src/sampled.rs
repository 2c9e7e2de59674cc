use crate::PreparedMesh;
use crate::field::Field;
use crate::vector::{Mat3, Vec3, add, cross, norm, scaled, sub};
use mesh::{Surface, TriMesh};
use std::sync::{Arc, OnceLock};

/// How many points stand for a surface.
pub(crate) const SAMPLES: usize = 20_000;

/// A thread takes at least so many points at a time.
pub(crate) const GRAIN: usize = 256;

/// A mesh prepared for alignment: its surface for queries, and points spread evenly over it.
pub(crate) struct Sampled {
    pub(crate) surface: Arc<Surface>,
    /// Unit normals of the triangles.
    pub(crate) normals: Arc<[Vec3]>,
    pub(crate) points: Vec<Vec3>,
    /// The triangle of each point.
    pub(crate) triangles: Vec<u32>,
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
    /// None when the mesh has no area.
    pub(crate) fn of(prepared: &PreparedMesh, count: usize) -> Option<Self> {
        let mesh = prepared.mesh();
        let (points, triangles) = sample(mesh, count)?;
        let centroid = scaled(
            points.iter().fold([0.0; 3], |sum, &p| add(sum, p)),
            1.0 / count as f64,
        );
        let mut covariance = [[0.0; 3]; 3];
        for &p in &points {
            let p = sub(p, centroid);
            for row in 0..3 {
                covariance[row] = add(covariance[row], scaled(p, p[row] / count as f64));
            }
        }
        let corners = mesh.triangles().as_flattened();
        let vertices = corners.iter().step_by((corners.len() / count).max(1));
        let vertices = vertices.map(|&v| mesh.positions()[v as usize]).collect();
        let diagonal = mesh.bounding_box().diagonal();
        Some(Self {
            surface: Arc::clone(prepared.surface()),
            normals: Arc::clone(prepared.triangle_normals()),
            points,
            triangles,
            vertices,
            diagonal,
            centroid,
            covariance,
            field: OnceLock::new(),
        })
    }

    /// A sample about nearest to `p` and its distance, in constant time; none for points far outside.
    pub(crate) fn near(&self, p: Vec3) -> Option<(usize, f64)> {
        let field = self.field.get_or_init(|| Field::of(&self.points, self.diagonal));
        let sample = field.near(p)?;
        Some((sample, norm(sub(self.points[sample], p))))
    }

    /// About `count` of the points, evenly spread.
    pub(crate) fn some(&self, count: usize) -> impl Iterator<Item = usize> + Clone + '_ {
        (0..self.points.len()).step_by((self.points.len() / count.max(1)).max(1))
    }
}

/// Points that stand for equal areas: one in the middle of each `count`-th of the area, in the order of the
/// triangles, at places within the triangles that follow a low-discrepancy sequence. None when there is no
/// area.
fn sample(mesh: &TriMesh, count: usize) -> Option<(Vec<Vec3>, Vec<u32>)> {
    let size = mesh.bounding_box().diagonal();
    // Scaled so that areas neither overflow nor vanish.
    let area = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(|p| scaled(p, 1.0 / size));
        norm(cross(sub(b, a), sub(c, a)))
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
    add(a, add(scaled(sub(b, a), u), scaled(sub(c, a), v)))
}
