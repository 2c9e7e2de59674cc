//! Surfaces dragged by handles, as rigid as possible (Sorkine and Alexa 2007).

use crate::{Edges, TriMesh, Vec3};

/// Turns and places are sought in turn so many times, which makes most of the way.
const ROUNDS: usize = 60;

/// How much a vertex is drawn to where it was, beside the weights of its edges: parts of which nothing is held go nowhere.
const DRAWN: f64 = 1e-8;

/// Weights of obtuse triangles are raised to so much, of needles lowered.
const WEIGHTS: [f64; 2] = [1e-3, 1e3];

/// Steps by which a turn comes nearer to the rotation of the polar decomposition in each round.
const TURNING_STEPS: usize = 4;

/// Conjugate gradients end where so much of the right side is left, or after so many steps.
const LEFT: f64 = 1e-10;
const MOST_STEPS: usize = 10_000;

/// The mesh with some vertices held at given places. Around each vertex i it is turned by some rotation Rᵢ, and the others go where Σ wᵢⱼ |p′ᵢ − p′ⱼ − Rᵢ (pᵢ − pⱼ)|² is least, over both ends of all edges with their cotangent weights: in turn the Rᵢ for given places, and the places for given Rᵢ, sixty times.
///
/// # Panics
/// When there isn't one entry a vertex, or a place is no place of a mesh.
pub fn dragged(mesh: &TriMesh, held: &[Option<Vec3>]) -> TriMesh {
    assert_eq!(held.len(), mesh.vertex_count(), "one entry a vertex");
    let surface = Surface::of(mesh, held);
    let mut turns = vec![[Vec3::X, Vec3::Y, Vec3::Z]; held.len()];
    let here = (0..held.len()).map(|v| mesh.point(v));
    let mut places: Vec<Vec3> = here.zip(held).map(|(here, held)| held.unwrap_or(here)).collect();
    for _ in 0..ROUNDS {
        surface.place(&mut places, &turns);
        surface.turn(&mut turns, &places);
    }
    let places = places.into_iter().map(Into::into).collect();
    mesh.with_positions(places)
        .unwrap_or_else(|error| panic!("these places make no mesh: {error}"))
}

/// A surface, and what is held of it.
struct Surface<'a> {
    mesh: &'a TriMesh,
    held: &'a [Option<Vec3>],
    /// Both ends, and the weight.
    edges: Vec<(usize, usize, f64)>,
    /// What each place is drawn with.
    diagonal: Vec<f64>,
}

impl<'a> Surface<'a> {
    fn of(mesh: &'a TriMesh, held: &'a [Option<Vec3>]) -> Self {
        let edges = Edges::of(mesh);
        let weights = mesh.cotangent_weights(&edges);
        let weighted = edges.vertices().iter().zip(weights);
        let edges: Vec<_> = weighted
            .map(|(&[v, w], weight)| (v as usize, w as usize, weight.clamp(WEIGHTS[0], WEIGHTS[1])))
            .collect();
        let mut diagonal = vec![DRAWN; held.len()];
        for &(v, w, weight) in &edges {
            diagonal[v] += weight;
            diagonal[w] += weight;
        }
        Self {
            mesh,
            held,
            edges,
            diagonal,
        }
    }

    /// The places of all that is free, for given turns.
    fn place(&self, places: &mut [Vec3], turns: &[[Vec3; 3]]) {
        let mut right: Vec<Vec3> = (0..places.len()).map(|v| self.mesh.point(v) * DRAWN).collect();
        for &(v, w, weight) in &self.edges {
            let step = self.mesh.point(v) - self.mesh.point(w);
            let step = (rotated(&turns[v], step) + rotated(&turns[w], step)) * (0.5 * weight);
            right[v] += step + self.held[w].map_or(Vec3::ZERO, |place| place * weight);
            right[w] += self.held[v].map_or(Vec3::ZERO, |place| place * weight) - step;
        }
        for axis in 0..3 {
            let right: Vec<f64> = right.iter().map(|right| right[axis]).collect();
            let mut along: Vec<f64> = places.iter().map(|place| place[axis]).collect();
            self.solve(&right, &mut along);
            for ((place, along), held) in places.iter_mut().zip(along).zip(self.held) {
                if held.is_none() {
                    place[axis] = along;
                }
            }
        }
    }

    /// Conjugate gradients from a given start, with the diagonal as preconditioner, among what is free.
    fn solve(&self, right: &[f64], x: &mut [f64]) {
        let freed = |values: &mut [f64]| {
            let held = values.iter_mut().zip(self.held);
            held.filter(|(_, held)| held.is_some())
                .for_each(|(value, _)| *value = 0.0);
        };
        let times = |x: &[f64]| {
            let mut y: Vec<f64> = x.iter().zip(&self.diagonal).map(|(x, d)| x * d).collect();
            for &(v, w, weight) in &self.edges {
                y[v] -= weight * x[w];
                y[w] -= weight * x[v];
            }
            freed(&mut y);
            y
        };
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let eased = |r: &[f64]| -> Vec<f64> { r.iter().zip(&self.diagonal).map(|(r, d)| r / d).collect() };
        let mut right = right.to_vec();
        freed(&mut right);
        freed(x);
        let enough = LEFT * LEFT * dot(&right, &eased(&right));
        let mut left: Vec<f64> = right.iter().zip(times(x)).map(|(b, y)| b - y).collect();
        let mut direction = eased(&left);
        let mut size = dot(&left, &direction);
        for _ in 0..MOST_STEPS {
            if size <= enough || size.is_nan() {
                break;
            }
            let along = times(&direction);
            let step = size / dot(&direction, &along);
            for (i, &along) in along.iter().enumerate() {
                x[i] += step * direction[i];
                left[i] -= step * along;
            }
            let next = eased(&left);
            let before = std::mem::replace(&mut size, dot(&left, &next));
            for (direction, next) in direction.iter_mut().zip(next) {
                *direction = next + *direction * (size / before);
            }
        }
    }

    /// Turns each vertex's surroundings on to where its edges went, by steps that end at the rotation of the polar decomposition (Müller and others 2016).
    fn turn(&self, turns: &mut [[Vec3; 3]], places: &[Vec3]) {
        let mut covariances = vec![[Vec3::ZERO; 3]; turns.len()];
        for &(v, w, weight) in &self.edges {
            let before = self.mesh.point(v) - self.mesh.point(w);
            let after = (places[v] - places[w]) * weight;
            for end in [v, w] {
                for (axis, column) in covariances[end].iter_mut().enumerate() {
                    *column += after * before[axis];
                }
            }
        }
        for (columns, covariance) in turns.iter_mut().zip(&covariances) {
            for _ in 0..TURNING_STEPS {
                let pairs = || columns.iter().zip(covariance);
                let along: f64 = pairs().map(|(r, a)| r.dot(*a)).sum();
                let step = pairs().map(|(r, a)| r.cross(*a)).sum::<Vec3>();
                let step = step * (1.0 / (along.abs() + f64::MIN_POSITIVE));
                if step.norm() < 1e-9 {
                    break;
                }
                *columns = columns.map(|column| turned(column, step));
            }
        }
    }
}

fn rotated(columns: &[Vec3; 3], x: Vec3) -> Vec3 {
    columns[0] * x[0] + columns[1] * x[1] + columns[2] * x[2]
}

/// A point, turned about an axis through 0 by as many radians as that is long (Rodrigues).
pub fn turned(point: Vec3, about: Vec3) -> Vec3 {
    let angle = about.norm();
    let axis = about * (1.0 / angle.max(f64::MIN_POSITIVE));
    let (sin, cos) = angle.sin_cos();
    point * cos + axis.cross(point) * sin + axis * (axis.dot(point) * (1.0 - cos))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn what_is_held_as_it_would_lie_if_all_was_turned_turns_all() {
        let mesh = shapes::bumpy_torus(24, 16, 1);
        let turn = Vec3([0.3, -0.4, 0.2]);
        let held: Vec<Option<Vec3>> = (0..mesh.vertex_count())
            .map(|v| (v % 9 == 0).then(|| turned(mesh.point(v), turn)))
            .collect();
        let places = dragged(&mesh, &held);
        let off = |v: usize| (places.point(v) - turned(mesh.point(v), turn)).norm();
        let most = (0..mesh.vertex_count()).map(off).fold(0.0, f64::max);
        assert!(most < 1e-3 * mesh.bounding_box().diagonal(), "{most}");
    }

    #[test]
    fn forces_balance_where_nothing_is_held_and_edges_keep_their_lengths_nearly() {
        let mesh = shapes::bumpy_torus(24, 16, 1);
        let held: Vec<Option<Vec3>> = (0..mesh.vertex_count())
            .map(|v| {
                let p = mesh.point(v);
                (p[0].abs() > 0.9).then(|| {
                    if p[0] > 0.0 {
                        turned(p, Vec3([0.8, 0.3, 0.0]))
                    } else {
                        p
                    }
                })
            })
            .collect();
        assert!(held.iter().flatten().count() > 20);
        let posed = dragged(&mesh, &held);
        for (v, held) in held.iter().enumerate() {
            assert!(held.is_none_or(|held| held == posed.point(v)), "{v}");
        }
        let surface = Surface::of(&mesh, &held);
        let places: Vec<Vec3> = (0..mesh.vertex_count()).map(|v| posed.point(v)).collect();
        let mut turns = vec![[Vec3::X, Vec3::Y, Vec3::Z]; places.len()];
        (0..20).for_each(|_| surface.turn(&mut turns, &places));
        let mut forces = vec![Vec3::ZERO; places.len()];
        let (mut strain, mut pull) = (0.0, 0.0);
        for &(v, w, weight) in &surface.edges {
            let here = mesh.point(v) - mesh.point(w);
            let there = places[v] - places[w];
            let force = there - (rotated(&turns[v], here) + rotated(&turns[w], here)) * 0.5;
            forces[v] += force * weight;
            forces[w] -= force * weight;
            pull += force.norm() * weight;
            strain += (there.norm() / here.norm() - 1.0).abs();
        }
        assert!(strain / (surface.edges.len() as f64) < 0.1, "{strain}");
        let left: f64 = forces
            .iter()
            .zip(&held)
            .filter(|(_, held)| held.is_none())
            .map(|(force, _)| force.norm())
            .sum();
        assert!(left < 0.02 * pull, "{left} of {pull}");
    }
}
