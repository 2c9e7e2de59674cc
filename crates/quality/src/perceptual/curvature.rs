//! Curvature by normal cycles (Cohen-Steiner and Morvan, *Restricted Delaunay triangulations and normal cycle*, SoCG 2003), as MSDM2
//! measures it.

use mesh::{Edges, TriMesh, VertexStars};

use super::walk::Walker;
use job::{Job, JobError};

/// A mesh with what curvature needs.
pub(crate) struct Bending<'a> {
    pub(crate) mesh: &'a TriMesh,
    pub(crate) edges: Edges,
    pub(crate) star: VertexStars,
    bends: Vec<Option<f64>>,
}

/// Vertices that one task works on.
const CHUNK: usize = 4096;

impl<'a> Bending<'a> {
    pub(crate) fn new(mesh: &'a TriMesh) -> Self {
        let edges = Edges::of(mesh);
        Self {
            star: edges.at_vertices(),
            bends: super::dihedral::bends(mesh, &edges),
            edges,
            mesh,
        }
    }

    /// (|k_1| + |k_2|)/2 at each vertex, #V, in the inverse of the mesh's unit, over balls of this radius.
    ///
    /// k_1 and k_2 are the two largest eigenvalues in size of Σ β(e) |e ∩ ball| ē ēᵀ / π r² over the edges that lead outward. β is
    /// the arc sine of the sine of the bend, so that an edge folded beyond a right angle counts as less. This is what Lavoué's program
    /// measures: smaller than the curvature for want of the other edges (a quarter on a sphere where the radius is three edges), and larger
    /// where edges are longer than the radius.
    pub(crate) fn amplitudes(&self, radius: f64, job: &Job) -> Result<Vec<f64>, JobError> {
        let chunks = job.map_chunks(self.mesh.vertex_count(), CHUNK, |vertices| {
            let mut walker = Walker::new(self.mesh, &self.edges, &self.star);
            vertices
                .map(|v| self.amplitude(v as u32, radius, &mut walker))
                .collect::<Vec<f64>>()
        })?;
        Ok(chunks.concat())
    }

    fn amplitude(&self, v: u32, radius: f64, walker: &mut Walker<'_>) -> f64 {
        let point = |v: u32| self.mesh.point(v as usize);
        let mut tensor = [[0.0; 3]; 3];
        walker.outward(v, radius, |step| {
            let Some(bend) = self.bends[step.edge as usize] else {
                return;
            };
            let along = point(step.to) - point(step.from);
            let direction = along.unit().0;
            let weight = bend.sin().asin() * step.inside * along.norm();
            for (row, x) in tensor.iter_mut().zip(direction) {
                for (entry, y) in row.iter_mut().zip(direction) {
                    *entry += weight * x * y;
                }
            }
        });
        let mut sizes = eigenvalues(&tensor).map(f64::abs);
        sizes.sort_by(f64::total_cmp);
        0.5 * (sizes[1] + sizes[2]) / (std::f64::consts::PI * radius * radius)
    }
}

/// The eigenvalues of a symmetric matrix, by their trigonometric formula (Smith, *Eigenvalues of a symmetric 3 × 3 matrix*, CACM 1961).
fn eigenvalues(a: &[[f64; 3]; 3]) -> [f64; 3] {
    let mean = (a[0][0] + a[1][1] + a[2][2]) / 3.0;
    let [x, y, z] = [a[0][0] - mean, a[1][1] - mean, a[2][2] - mean];
    let (p, q, r) = (a[0][1], a[0][2], a[1][2]);
    let spread = ((x * x + y * y + z * z + 2.0 * (p * p + q * q + r * r)) / 6.0).sqrt();
    if spread == 0.0 {
        return [mean; 3];
    }
    let determinant = x * (y * z - r * r) - p * (p * z - r * q) + q * (p * r - y * q);
    let angle = (0.5 * determinant / spread.powi(3)).clamp(-1.0, 1.0).acos() / 3.0;
    [0.0, 1.0, 2.0].map(|third| mean + 2.0 * spread * (angle + third * std::f64::consts::TAU / 3.0).cos())
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;
    use proptest::prelude::*;

    fn mean(mesh: &TriMesh, radius: f64, wanted: impl Fn(&[f64; 3]) -> bool) -> f64 {
        let amplitudes = Bending::new(mesh).amplitudes(radius, &Job::default()).unwrap();
        let chosen: Vec<f64> = mesh
            .positions()
            .iter()
            .zip(amplitudes)
            .filter(|(p, _)| wanted(p))
            .map(|(_, a)| a)
            .collect();
        chosen.iter().sum::<f64>() / chosen.len() as f64
    }

    #[test]
    fn a_plane_has_none_and_a_sphere_comes_near_the_inverse_of_its_radius_as_triangles_become_small() {
        assert_eq!(mean(&shapes::rectangle(20, 20, 4.0, 4.0), 0.4, |_| true), 0.0);
        let error = |steps| {
            let ball = shapes::scaled(&shapes::icosphere(steps), 2.0);
            0.5 - mean(&ball, 0.8, |p| p[0] > 1.8)
        };
        let errors = [3, 4, 5].map(error);
        assert!(errors[2] > 0.0 && errors.is_sorted_by(|a, b| a > b), "{errors:?}");
        assert!(errors[2] < 0.05, "{errors:?}");
    }

    #[test]
    fn bowls_and_domes_are_alike_and_size_divides() {
        let grid = shapes::rectangle(40, 40, 2.0, 2.0);
        let bowl = grid
            .positions()
            .iter()
            .map(|&[x, y, _]| [x, y, (x - 1.0).powi(2) - 0.3 * (y - 1.0).powi(2)]);
        let bowl = grid.with_positions(bowl.collect()).unwrap();
        let [own, dome, large] = [
            (bowl.clone(), 0.3),
            (shapes::inside_out(&bowl), 0.3),
            (shapes::scaled(&bowl, 4.0), 1.2),
        ]
        .map(|(mesh, radius)| mean(&mesh, radius, |_| true));
        assert!(own > 0.3 && (own - dome).abs() < 1e-9 && (own - 4.0 * large).abs() < 1e-9);
    }

    /// Where the ball ends inside the edges, each counts by the part that is in it: Σ β r ē ēᵀ / π r².
    #[test]
    fn a_ball_shorter_than_the_edges_sees_those_of_its_vertex() {
        let cube = shapes::cube(1.0);
        let inner = std::f64::consts::FRAC_PI_2 / (std::f64::consts::PI * 0.1);
        // Three edges at right angles, each bent by a right angle; the diagonals not at all.
        assert!((mean(&cube, 0.1, |_| true) - inner).abs() < 1e-7);
    }

    proptest! {
        #[test]
        fn eigenvalues_have_the_traces_of_the_first_three_powers(v in prop::array::uniform6(-2.0..2.0_f64)) {
            let a = [[v[0], v[1], v[2]], [v[1], v[3], v[4]], [v[2], v[4], v[5]]];
            let product = |a: [[f64; 3]; 3], b: [[f64; 3]; 3]| -> [[f64; 3]; 3] {
                std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
            };
            let mut power = a;
            for n in 1..=3 {
                let sum: f64 = eigenvalues(&a).iter().map(|k| k.powi(n)).sum();
                let trace: f64 = (0..3).map(|i| power[i][i]).sum();
                prop_assert!((sum - trace).abs() < 1e-11 * (1.0 + trace.abs()));
                power = product(power, a);
            }
        }
    }
}
