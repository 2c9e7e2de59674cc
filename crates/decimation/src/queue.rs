//! The cheapest edge first.
//!
//! A collapse costs its quadric where it leads, divided by the worst shape 2 area / (longest side)² of the triangles that it moves, or by [`GOOD_SHAPE`] where all are
//! better. Planes weigh as their triangles' doubled areas; planes through the sides at borders, across the triangle, weigh ¼ however large it is.
//! After a collapse, the edges of the triangles around it are weighed anew; edges that lead on from there wait until a neighbour's collapse does.

use std::{cmp::Ordering, collections::BinaryHeap};

use job::{Job, JobError};
use mesh::{Edges, TriMesh, Vec3};

use crate::{Quadric, collapsing::Collapsing};

/// Shapes from here on are all good; a triangle with equal sides has √3 / 2.
const GOOD_SHAPE: f64 = 0.3;

/// Length of the normal of a plane across a border; its square is the weight.
const BORDER: f64 = 0.5;

/// Quadrics below say that a place is exact, in the sixth power of the model's unit for places and in units of the diagonal (times 10⁸) for costs.
const EXACT: f64 = 1e-15;

/// Costs are in sixth powers of the diagonal, divided by this.
const SCALE: f64 = 1e8;

/// Collapses between two questions to the job.
const CHUNK: usize = 4096;

pub(crate) fn decimate(mesh: &TriMesh, target: usize, job: &Job) -> Result<TriMesh, JobError> {
    let mut queue = Queue::of(mesh);
    let mut collapses = 0_usize;
    while queue.left.left() > target {
        if collapses.is_multiple_of(CHUNK) {
            job.go_on()?;
        }
        match queue.cheapest() {
            Some(next) => queue.collapse(&next),
            None => break,
        }
        collapses += 1;
    }
    Ok(queue.left.into_mesh(mesh))
}

struct Queue {
    left: Collapsing,
    quadrics: Vec<Quadric>,
    edges: BinaryHeap<Candidate>,
    /// When the surroundings of a vertex changed last.
    changed: Vec<u32>,
    now: u32,
    scale: f64,
}

/// An edge that may be collapsed.
#[derive(Clone, Copy)]
struct Candidate {
    cost: f64,
    ends: [u32; 2],
    /// When it was weighed.
    at: u32,
}

/// The least cost is the greatest, then the first ends.
impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then(other.ends.cmp(&self.ends))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Candidate {}

impl Queue {
    fn of(mesh: &TriMesh) -> Self {
        let left = Collapsing::of(mesh, &mesh.vertex_triangles());
        let edges = Edges::of(mesh);
        let mut queue = Self {
            quadrics: quadrics(mesh, &edges, &left),
            left,
            edges: BinaryHeap::new(),
            changed: vec![0; mesh.vertex_count()],
            now: 0,
            scale: SCALE / mesh.bounding_box().diagonal().powi(6),
        };
        let all = edges.vertices().iter();
        queue.edges = all.filter_map(|&ends| queue.candidate(ends)).collect();
        queue
    }

    /// The cheapest edge around which nothing changed since it was weighed.
    fn cheapest(&mut self) -> Option<Candidate> {
        loop {
            let next = self.edges.pop()?;
            let [v, w] = next.ends;
            let is_fresh = next.ends.iter().all(|&end| self.changed[end as usize] <= next.at);
            if is_fresh && self.left.leaves_some(v, w) {
                return Some(next);
            }
        }
    }

    fn collapse(&mut self, candidate: &Candidate) {
        let [w, v] = candidate.ends;
        let to = self.place([w, v]);
        self.left.collapse(v, w, to);
        let of_w = self.quadrics[w as usize];
        self.quadrics[v as usize] += of_w;
        self.now += 1;
        self.changed[v as usize] = self.now;
        self.changed[w as usize] = u32::MAX;
        let mut edges: Vec<[u32; 2]> = Vec::new();
        for (_, [_, next, last]) in self.left.star(v) {
            for end in [next, last] {
                self.changed[end as usize] = self.now;
                edges.push([end.min(v), end.max(v)]);
            }
            edges.push([next.min(last), next.max(last)]);
        }
        edges.sort_unstable();
        edges.dedup();
        for ends in edges {
            let candidate = self.candidate(ends);
            self.edges.extend(candidate);
        }
    }

    /// None if it has no finite cost.
    fn candidate(&self, ends: [u32; 2]) -> Option<Candidate> {
        let [v, w] = ends;
        let to = self.place(ends);
        let shape = |next: u32, last: u32| shape([to, self.left.point(next), self.left.point(last)]);
        let moved = self.left.staying(v, w).chain(self.left.staying(w, v));
        let worst = moved.fold(GOOD_SHAPE, |worst, (_, [_, next, last])| {
            worst.min(shape(next, last))
        });
        let quadric = self.quadrics[v as usize] + self.quadrics[w as usize];
        let mut cost = self.scale * quadric.at(to);
        if cost <= EXACT {
            cost = EXACT * (self.left.point(v) - self.left.point(w)).norm();
        }
        let cost = cost / worst;
        cost.is_finite().then_some(Candidate {
            cost,
            ends,
            at: self.now,
        })
    }

    /// Where an edge collapses to: its middle if that is exact, else where the quadric is least.
    fn place(&self, [v, w]: [u32; 2]) -> Vec3 {
        let middle = (self.left.point(v) + self.left.point(w)) / 2.0;
        let quadric = self.quadrics[v as usize] + self.quadrics[w as usize];
        if quadric.at(middle) <= 2.0 * EXACT {
            return middle;
        }
        quadric.minimum().unwrap_or(middle)
    }
}

/// That of each vertex: the planes of its triangles, and those across its borders.
fn quadrics(mesh: &TriMesh, edges: &Edges, points: &Collapsing) -> Vec<Quadric> {
    let mut quadrics = vec![Quadric::ZERO; mesh.vertex_count()];
    for (corners, sides) in mesh.triangles().iter().zip(edges.of_triangle()) {
        let [a, b, c] = corners.map(|v| points.point(v));
        let normal = (b - a).cross(c - a);
        let (area, normal) = (normal.norm(), normal.unit());
        let root = normal * area.sqrt();
        let quadric = Quadric::of_plane(root, root.dot(a));
        corners.iter().for_each(|&v| quadrics[v as usize] += quadric);
        for (i, &side) in sides.iter().enumerate() {
            if edges.triangles(side as usize).len().is_multiple_of(2) {
                continue;
            }
            let ends = [corners[i], corners[(i + 1) % 3]];
            let [p, q] = ends.map(|v| points.point(v));
            let across = normal.cross((q - p).unit()) * BORDER;
            let quadric = Quadric::of_plane(across, across.dot(p));
            ends.iter().for_each(|&v| quadrics[v as usize] += quadric);
        }
    }
    quadrics
}

/// 2 area / (longest side)²: 0 for a needle, √3 / 2 for equal sides.
fn shape([a, b, c]: [Vec3; 3]) -> f64 {
    let longest = [b - a, c - b, a - c].map(Vec3::squared);
    let longest = longest.into_iter().fold(0.0, f64::max);
    if longest > 0.0 {
        (b - a).cross(c - a).norm() / longest
    } else {
        0.0
    }
}
