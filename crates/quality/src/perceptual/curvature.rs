//! Curvature by normal cycles (Cohen-Steiner and Morvan, *Restricted Delaunay triangulations and normal cycle*, SoCG 2003).

use mesh::{Edges, TriMesh};

use super::balls::{Balls, Star, other_end};
use crate::QualityError;
use crate::work::{Observer, by_chunks};
use mesh::vector::{Vec3, cross, dot, norm, scaled, sub, unit};

/// A mesh with what curvature needs.
pub(crate) struct Bending<'a> {
    pub(crate) mesh: &'a TriMesh,
    pub(crate) edges: Edges,
    pub(crate) star: Star,
    bends: Vec<Option<f64>>,
    normals: Vec<Vec3>,
}

/// Vertices that one task works on.
const CHUNK: usize = 4096;

impl<'a> Bending<'a> {
    pub(crate) fn new(mesh: &'a TriMesh) -> Self {
        let edges = Edges::of(mesh);
        Self {
            star: Star::new(mesh, &edges),
            bends: super::dihedral::bends(mesh, &edges),
            normals: mesh.vertex_normals(),
            edges,
            mesh,
        }
    }

    /// (|k_1| + |k_2|)/2 at each vertex, #V, in the inverse of the mesh's unit, over balls of this radius.
    ///
    /// Where edges are longer than the radius, the ball is as large as they are on average: below that a mesh has no curvature.
    pub(crate) fn amplitudes(&self, radius: f64, observer: Observer<'_>) -> Result<Vec<f64>, QualityError> {
        let chunks = by_chunks(self.mesh.vertex_count(), CHUNK, observer, |vertices| {
            let mut balls = Balls::new(self.mesh, &self.edges, &self.star);
            vertices
                .map(|v| self.amplitude(v as u32, radius, &mut balls))
                .collect::<Vec<f64>>()
        })?;
        Ok(chunks.concat())
    }

    fn amplitude(&self, v: u32, radius: f64, balls: &mut Balls<'_>) -> f64 {
        let around = self.star.of(v);
        if around.is_empty() {
            return 0.0;
        }
        let length: f64 = around.iter().map(|&e| norm(self.direction(e))).sum();
        let radius = radius.max(length / around.len() as f64);
        if radius == 0.0 {
            return 0.0;
        }
        let inside = balls.around(v, radius).to_vec();
        let centre = self.mesh.positions()[v as usize];
        // The tensor Σ β(e) |e ∩ ball| ē ēᵀ / π r² in the tangent plane: [xx, xy, yy].
        let [x, y] = tangents(self.normals[v as usize]);
        let mut tensor = [0.0; 3];
        for &u in &inside {
            for &e in self.star.of(u) {
                let w = other_end(&self.edges, e, u);
                if w < u && balls.holds(w) {
                    continue; // as an edge of w
                }
                let Some(bend) = self.bends[e as usize] else {
                    continue;
                };
                let direction = unit(self.direction(e));
                let start = sub(self.mesh.positions()[u as usize], centre);
                let along = sub(
                    self.mesh.positions()[w as usize],
                    self.mesh.positions()[u as usize],
                );
                let weight = bend * inside_ball(start, along, radius);
                let (p, q) = (dot(direction, x), dot(direction, y));
                tensor[0] += weight * p * p;
                tensor[1] += weight * p * q;
                tensor[2] += weight * q * q;
            }
        }
        let [xx, xy, yy] = tensor.map(|t| t / (std::f64::consts::PI * radius * radius));
        let (mean, spread) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
        0.5 * ((mean + spread).abs() + (mean - spread).abs())
    }

    fn direction(&self, edge: u32) -> Vec3 {
        let [a, b] = self.edges.vertices()[edge as usize];
        sub(
            self.mesh.positions()[b as usize],
            self.mesh.positions()[a as usize],
        )
    }
}

/// The length of the part of a segment that lies in the ball around 0; its start does.
fn inside_ball(start: Vec3, along: Vec3, radius: f64) -> f64 {
    let length = norm(along);
    if length == 0.0 {
        return 0.0;
    }
    let direction = scaled(along, 1.0 / length);
    let (b, c) = (dot(start, direction), dot(start, start) - radius * radius);
    let leaves = -b + (b * b - c).max(0.0).sqrt();
    leaves.clamp(0.0, length)
}

/// Two unit vectors at right angles to each other and to the normal.
fn tangents(normal: Vec3) -> [Vec3; 2] {
    let axis = (0..3)
        .min_by(|&i, &j| normal[i].abs().total_cmp(&normal[j].abs()))
        .unwrap_or(0);
    let mut away = [0.0; 3];
    away[axis] = 1.0;
    let x = unit(cross(normal, away));
    let x = if norm(x) > 0.0 { x } else { [1.0, 0.0, 0.0] };
    let y = unit(cross(normal, x));
    [x, if norm(y) > 0.0 { y } else { [0.0, 1.0, 0.0] }]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::work::unobserved;
    use mesh::shapes;

    fn mean(mesh: &TriMesh, radius: f64, wanted: impl Fn(&Vec3) -> bool) -> f64 {
        let amplitudes = Bending::new(mesh).amplitudes(radius, &unobserved).unwrap();
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
    fn a_sphere_has_the_inverse_of_its_radius_a_cylinder_half_and_a_plane_none() {
        for radius in [0.2, 0.4] {
            let ball = shapes::scaled(&shapes::icosphere(4), 2.0);
            assert!((mean(&ball, radius, |_| true) - 0.5).abs() < 0.05);
            let tube = shapes::cylinder(64, 40, 2.0, 8.0);
            let middle = |p: &Vec3| (p[2] - 4.0).abs() < 2.0;
            assert!((mean(&tube, radius, middle) - 0.25).abs() < 0.03);
            assert_eq!(mean(&shapes::rectangle(20, 20, 4.0, 4.0), radius, |_| true), 0.0);
        }
    }

    #[test]
    fn a_saddle_is_as_curved_as_a_bowl() {
        let curved = |sign: f64| {
            let grid = shapes::rectangle(40, 40, 2.0, 2.0);
            let positions = grid.positions().iter().map(|&[x, y, _]| {
                [
                    x - 1.0,
                    y - 1.0,
                    0.25 * ((x - 1.0).powi(2) + sign * (y - 1.0).powi(2)),
                ]
            });
            grid.with_positions(positions.collect()).unwrap()
        };
        let middle = |p: &Vec3| p[0].hypot(p[1]) < 0.1;
        let [bowl, saddle] = [1.0, -1.0].map(|sign| mean(&curved(sign), 0.3, middle));
        assert!(
            (bowl - 0.5).abs() < 0.04 && (saddle - 0.5).abs() < 0.04,
            "{bowl} {saddle}"
        );
    }
}
