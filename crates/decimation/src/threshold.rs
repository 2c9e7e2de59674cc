//! All edges below a threshold, in the order of the triangles.
//!
//! A round collapses every edge that costs less than its threshold, but none of a triangle that changed in the round; thresholds rise as
//! 10⁻⁹ (r + 3)⁷ with the round r. An edge is not collapsed if only one end is at a border, nor if a triangle would turn by more than arccos 0.2 from
//! where it was at the start or would be a needle. Quadrics are sums of planes with weight 1.

use job::{Job, JobError};
use mesh::{Edges, TriMesh, Vec3};

use crate::{Quadric, collapsing::Collapsing};

/// The threshold of round 0 is this times 3 to [`SHARPNESS`], in squares of the model's unit.
const LEAST: f64 = 1e-9;
const SHARPNESS: i32 = 7;

/// After so many rounds what is left is taken as a mesh of its own.
const ROUNDS: i32 = 100;

/// Triangles between two questions to the job: where a vertex has thousands of them, each takes long.
const CHUNK: usize = 1024;

/// Cosine of the largest turn of a triangle.
const TURN: f64 = 0.2;

/// Cosine of the least angle at the point of a collapse, and of its supplement.
const NEEDLE: f64 = 0.999;

pub(crate) fn decimate(mesh: &TriMesh, target: usize, job: &Job) -> Result<TriMesh, JobError> {
    let mut mesh = Thresholds::of(mesh).run(target, job)?.into_mesh(mesh);
    let mut before = usize::MAX;
    while mesh.triangle_count() > target && mesh.triangle_count() < before {
        before = mesh.triangle_count();
        mesh = Thresholds::of(&mesh).run(target, job)?.into_mesh(&mesh);
    }
    Ok(mesh)
}

pub(crate) fn survivors(mesh: &TriMesh, target: usize, job: &Job) -> Result<Vec<u32>, JobError> {
    let left = Thresholds::of(mesh).run(target, job)?;
    Ok((0..mesh.triangle_count() as u32)
        .filter(|&t| left.triangle(t as usize).is_some())
        .collect())
}

pub(crate) fn labels(mesh: &TriMesh, known: &[Option<u32>], job: &Job) -> Result<Vec<Option<u32>>, JobError> {
    let mut thresholds = Thresholds::of(mesh);
    thresholds.left = thresholds.left.labelled(known);
    let told = thresholds.run(0, job)?.into_labels();
    Ok(told.into_iter().map(|(_, label)| label).collect())
}

struct Thresholds {
    left: Collapsing,
    quadrics: Vec<Quadric>,
    at_border: Vec<bool>,
    /// Unit normals of the triangles at the start.
    normals: Vec<Vec3>,
    /// What it costs to collapse each side of a triangle, from corner i to corner i + 1.
    costs: Vec<[f64; 3]>,
    /// The round in which a triangle changed last.
    changed: Vec<i32>,
}

impl Thresholds {
    fn of(mesh: &TriMesh) -> Self {
        let left = Collapsing::of(mesh);
        let mut quadrics = vec![Quadric::ZERO; mesh.vertex_count()];
        let mut normals = Vec::with_capacity(mesh.triangle_count());
        for corners in mesh.triangles() {
            let [a, b, c] = corners.map(|v| left.point(v));
            let normal = (b - a).cross(c - a).unit();
            let quadric = Quadric::of_plane(normal, normal.dot(a));
            corners.iter().for_each(|&v| quadrics[v as usize] += quadric);
            normals.push(normal);
        }
        let mut at_border = vec![false; mesh.vertex_count()];
        let edges = Edges::of(mesh);
        for (e, ends) in edges.vertices().iter().enumerate() {
            if edges.triangles(e).len() == 1 {
                ends.iter().for_each(|&v| at_border[v as usize] = true);
            }
        }
        let mut thresholds = Self {
            left,
            quadrics,
            at_border,
            normals,
            costs: Vec::new(),
            changed: vec![-1; mesh.triangle_count()],
        };
        thresholds.costs = mesh.triangles().iter().map(|&t| thresholds.of_sides(t)).collect();
        thresholds
    }

    fn run(mut self, target: usize, job: &Job) -> Result<Collapsing, JobError> {
        for round in 0..ROUNDS {
            let threshold = LEAST * f64::from(round + 3).powi(SHARPNESS);
            for t in 0..self.costs.len() {
                if t.is_multiple_of(CHUNK) {
                    job.go_on()?;
                }
                if self.left.left() <= target || self.left.all_have_labels() {
                    return Ok(self.left);
                }
                let Some(corners) = self.left.triangle(t) else {
                    continue;
                };
                if self.changed[t] == round {
                    continue;
                }
                let costs = self.costs[t];
                (0..3)
                    .filter(|&i| costs[i] < threshold)
                    .any(|i| self.collapse([corners[i], corners[(i + 1) % 3]], round));
            }
        }
        Ok(self.left)
    }

    /// Collapses an edge if that is allowed.
    fn collapse(&mut self, [v, w]: [u32; 2], round: i32) -> bool {
        if self.at_border[v as usize] != self.at_border[w as usize] || !self.left.may_meet(v, w) {
            return false;
        }
        let (_, to) = self.place([v, w]);
        let is_allowed = !self.turns(v, w, to) && !self.turns(w, v, to) && self.left.leaves_some(v, w);
        if !is_allowed {
            return false;
        }
        self.left.collapse(v, w, to);
        let of_w = self.quadrics[w as usize];
        self.quadrics[v as usize] += of_w;
        let star: Vec<u32> = self.left.star(v).map(|(t, _)| t).collect();
        for t in star {
            let t = t as usize;
            self.changed[t] = round;
            if let Some(corners) = self.left.triangle(t) {
                self.costs[t] = self.of_sides(corners);
            }
        }
        true
    }

    /// Whether a triangle at v, but not at w, turns too far or becomes a needle when v moves.
    fn turns(&self, v: u32, w: u32, to: Vec3) -> bool {
        self.left.staying(v, w).any(|(t, [_, next, last])| {
            let a = (self.left.point(next) - to).unit();
            let b = (self.left.point(last) - to).unit();
            a.dot(b).abs() > NEEDLE || a.cross(b).unit().dot(self.normals[t as usize]) < TURN
        })
    }

    fn of_sides(&self, [a, b, c]: [u32; 3]) -> [f64; 3] {
        [[a, b], [b, c], [c, a]].map(|edge| self.place(edge).0)
    }

    /// What a collapse costs, and where it leads: to where the quadric is least, but along a border, or where that is no one point, to the best of both
    /// ends and their middle.
    fn place(&self, [v, w]: [u32; 2]) -> (f64, Vec3) {
        let quadric = self.quadrics[v as usize] + self.quadrics[w as usize];
        let is_border = self.at_border[v as usize] && self.at_border[w as usize];
        if let Some(least) = quadric.minimum().filter(|_| !is_border) {
            return (quadric.at(least), least);
        }
        let (p, q) = (self.left.point(v), self.left.point(w));
        let middle = (p + q) / 2.0;
        let costs = [middle, q, p].map(|point| (quadric.at(point), point));
        costs
            .into_iter()
            .fold(costs[0], |best, cost| if cost.0 < best.0 { cost } else { best })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    #[test]
    fn what_became_of_the_corners_of_what_is_left_tells_what_became_of_the_others() {
        let (original, job) = (shapes::bumpy_sphere(5, 3), Job::default());
        // Moved by as much as changes which edges are collapsed.
        let wave = |&[x, y, z]: &[f64; 3]| 1.0 + 1e-3 * (9.0 * x - 7.0 * y + 5.0 * z).sin();
        let moved = original.positions().iter().map(|p| p.map(|x| x * wave(p)));
        let moved = original.with_positions(moved.collect()).unwrap();
        let mut thresholds = Thresholds::of(&moved);
        thresholds.left = thresholds.left.labelled(&[]);
        let left = thresholds.run(original.triangle_count() / 10, &job).unwrap();
        let truth: Vec<u32> = left.into_labels().into_iter().map(|(end, _)| end).collect();

        let mut known = vec![None; truth.len()];
        for corners in original.triangles() {
            let [a, b, c] = corners.map(|v| truth[v as usize]);
            if a != b && b != c && c != a {
                corners
                    .iter()
                    .for_each(|&v| known[v as usize] = Some(truth[v as usize]));
            }
        }
        let told = labels(&original, &known, &job).unwrap();
        let unknown = || (0..truth.len()).filter(|&v| known[v].is_none());
        let right = unknown().filter(|&v| told[v] == Some(truth[v])).count();
        assert!(unknown().count() > truth.len() / 4);
        assert!(
            10 * right > 9 * unknown().count(),
            "{right} of {}",
            unknown().count()
        );
        assert!((0..truth.len()).all(|v| known[v].is_none() || known[v] == told[v]));
    }

    #[test]
    fn survivors_are_what_is_left_of_the_decimated_mesh() {
        let (original, job) = (shapes::bumpy_sphere(4, 3), Job::default());
        let decimated = decimate(&original, 300, &job).unwrap();
        let left = survivors(&original, 300, &job).unwrap();
        assert!(left.is_sorted() && left.len() == decimated.triangle_count());
        // What is left is a triangle whose corners became part of three vertices.
        let mut thresholds = Thresholds::of(&original);
        thresholds.left = thresholds.left.labelled(&[]);
        let into = thresholds.run(300, &job).unwrap().into_labels();
        for &t in &left {
            let [a, b, c] = original.triangles()[t as usize].map(|v| into[v as usize].0);
            assert!(a != b && b != c && c != a);
        }
        assert_eq!(
            survivors(&original, usize::MAX, &job).unwrap().len(),
            original.triangle_count()
        );
    }

    #[test]
    fn who_knows_nothing_or_all_is_told_as_much() {
        let (mesh, job) = (shapes::bumpy_sphere(2, 1), Job::default());
        assert_eq!(labels(&mesh, &[], &job).unwrap(), vec![None; mesh.vertex_count()]);
        let all: Vec<Option<u32>> = (0..mesh.vertex_count() as u32).map(Some).collect();
        assert_eq!(labels(&mesh, &all, &job).unwrap(), all);
    }
}
