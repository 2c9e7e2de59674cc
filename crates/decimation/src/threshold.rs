//! All edges below a threshold, in the order of the triangles.
//!
//! A round collapses every edge that costs less than its threshold, but none of a triangle that changed in the round; thresholds rise as
//! 10⁻⁹ (r + 3)⁷ with the round r. An edge is not collapsed if only one end is at a border, nor if a triangle would turn by more than arccos 0.2 from
//! where it was at the start or would be a needle. Quadrics are sums of planes with weight 1.

use std::mem::take;

use job::{Job, JobError};
use mesh::{Edges, TriMesh, Vec3, VertexStars};

use crate::{Quadric, collapsing::Collapsing};

/// The threshold of round 0 is this times 3 to [`SHARPNESS`], in squares of the model's unit.
const LEAST: f64 = 1e-9;
const SHARPNESS: i32 = 7;

/// After so many rounds what is left is taken as a mesh of its own.
const ROUNDS: i32 = 100;

/// Triangles between two questions to the job: where a vertex has thousands of them, each takes long.
const CHUNK: usize = 1024;

/// Among so many edges at a vertex one is sought whose cost is known: a vertex may have thousands.
const SOUGHT: usize = 32;

/// Cosine of the largest turn of a triangle.
const TURN: f64 = 0.2;

/// Cosine of the least angle at the point of a collapse, and of its supplement.
const NEEDLE: f64 = 0.999;

pub(crate) fn decimate(mesh: &TriMesh, target: usize, job: &Job) -> Result<TriMesh, JobError> {
    let once = |mesh: &TriMesh| {
        let connectivity = Connectivity::of(mesh);
        let thresholds = Thresholds::of(mesh, &connectivity);
        Ok(thresholds.run(target, job)?.into_mesh(mesh))
    };
    let mut mesh = once(mesh)?;
    let mut before = usize::MAX;
    while mesh.triangle_count() > target && mesh.triangle_count() < before {
        before = mesh.triangle_count();
        mesh = once(&mesh)?;
    }
    Ok(mesh)
}

pub(crate) fn survivors(
    mesh: &TriMesh,
    connectivity: &Connectivity,
    target: usize,
    job: &Job,
) -> Result<Vec<u32>, JobError> {
    let left = Thresholds::of(mesh, connectivity).run(target, job)?;
    Ok((0..mesh.triangle_count() as u32)
        .filter(|&t| left.triangle(t as usize).is_some())
        .collect())
}

pub(crate) fn labels(
    mesh: &TriMesh,
    connectivity: &Connectivity,
    known: &[Option<u32>],
    job: &Job,
) -> Result<Vec<Option<u32>>, JobError> {
    let mut thresholds = Thresholds::of(mesh, connectivity);
    thresholds.left = thresholds.left.labelled(known);
    let told = thresholds.run(0, job)?.into_labels();
    Ok(told.into_iter().map(|(_, label)| label).collect())
}

/// What decimations of meshes with the same triangles share.
#[derive(Clone, Debug)]
pub struct Connectivity {
    edges: Edges,
    at_border: Vec<bool>,
    /// The triangles at each vertex.
    stars: VertexStars,
}

impl Connectivity {
    /// That of a mesh.
    pub fn of(mesh: &TriMesh) -> Self {
        let edges = Edges::of(mesh);
        Self {
            at_border: edges.at_border(),
            edges,
            stars: mesh.vertex_triangles(),
        }
    }
}

struct Thresholds<'a> {
    left: Collapsing,
    quadrics: Vec<Quadric>,
    at_border: &'a [bool],
    /// Unit normals of the triangles at the start.
    normals: Vec<Vec3>,
    /// What it costs to collapse each side of a triangle, from corner i to corner i + 1; infinite where the ends never may meet.
    costs: Vec<[f64; 3]>,
    /// The least of a triangle's costs.
    cheapest: Vec<f64>,
    /// The round in which a triangle changed last.
    changed: Vec<i32>,
    /// How many edges were collapsed.
    collapsed: u32,
    /// How many edges had been collapsed when each vertex or a triangle at it changed last.
    touched: Vec<u32>,
    /// One more than how many edges had been collapsed when a side of a triangle was refused; 0 of a side that never was.
    refused: Vec<[u32; 3]>,
    /// Room for the triangles at a vertex, and for what the edges to its neighbours cost.
    star: Vec<(u32, [u32; 3])>,
    priced: Vec<(u32, f64)>,
}

impl<'a> Thresholds<'a> {
    fn of(mesh: &TriMesh, connectivity: &'a Connectivity) -> Self {
        let Connectivity {
            edges,
            at_border,
            stars,
        } = connectivity;
        let counts = (mesh.vertex_count(), mesh.triangle_count());
        assert_eq!(
            (at_border.len(), edges.of_triangle().len()),
            counts,
            "its connectivity"
        );
        let left = Collapsing::of(mesh, stars);
        let mut quadrics = vec![Quadric::ZERO; mesh.vertex_count()];
        let mut normals = Vec::with_capacity(mesh.triangle_count());
        for corners in mesh.triangles() {
            let [a, b, c] = corners.map(|v| left.point(v));
            let normal = (b - a).cross(c - a).unit();
            let quadric = Quadric::of_plane(normal, normal.dot(a));
            corners.iter().for_each(|&v| quadrics[v as usize] += quadric);
            normals.push(normal);
        }
        let mut thresholds = Self {
            left,
            quadrics,
            at_border,
            normals,
            costs: Vec::new(),
            cheapest: Vec::new(),
            changed: vec![-1; mesh.triangle_count()],
            collapsed: 0,
            touched: vec![0; mesh.vertex_count()],
            refused: vec![[0; 3]; mesh.triangle_count()],
            star: Vec::new(),
            priced: Vec::new(),
        };
        let of_edges: Vec<f64> = edges
            .vertices()
            .iter()
            .map(|&edge| thresholds.place(edge).0)
            .collect();
        let sides = edges.of_triangle().iter();
        thresholds.costs = sides.map(|sides| sides.map(|e| of_edges[e as usize])).collect();
        thresholds.cheapest = thresholds.costs.iter().map(least).collect();
        thresholds
    }

    fn run(mut self, target: usize, job: &Job) -> Result<Collapsing, JobError> {
        let mut open: Vec<u32> = (0..self.costs.len() as u32).collect();
        for round in 0..ROUNDS {
            let threshold = threshold(round);
            open.retain(|&t| self.left.triangle(t as usize).is_some());
            for (i, &t) in open.iter().enumerate() {
                if i.is_multiple_of(CHUNK) {
                    job.go_on()?;
                }
                if self.left.left() <= target || self.left.all_have_labels() {
                    return Ok(self.left);
                }
                self.collapse_a_side(t as usize, threshold, round);
            }
        }
        Ok(self.left)
    }

    /// Collapses the first side of a triangle that is cheap enough and may be, unless the triangle went or changed in this round.
    fn collapse_a_side(&mut self, t: usize, threshold: f64, round: i32) {
        let is_cheap = self.cheapest[t] < threshold;
        if !is_cheap || self.changed[t] == round {
            return;
        }
        let Some(corners) = self.left.triangle(t) else {
            return;
        };
        let costs = self.costs[t];
        for i in (0..3).filter(|&i| costs[i] < threshold) {
            let [v, w] = [corners[i], corners[(i + 1) % 3]];
            if self.at_border[v as usize] != self.at_border[w as usize] || !self.left.may_meet(v, w) {
                // Nor may those ever meet of which they become part.
                self.costs[t][i] = f64::INFINITY;
                self.cheapest[t] = least(&self.costs[t]);
                continue;
            }
            // Refused again, if nothing changed at either end.
            let refused = self.refused[t][i];
            if self.touched[v as usize] < refused && self.touched[w as usize] < refused {
                continue;
            }
            if self.collapse([v, w], round) {
                return;
            }
            self.refused[t][i] = self.collapsed + 1;
        }
    }

    /// Collapses an edge unless triangles turn too far.
    fn collapse(&mut self, [v, w]: [u32; 2], round: i32) -> bool {
        let (_, to) = self.place([v, w]);
        let is_allowed = !self.turns(v, w, to) && !self.turns(w, v, to) && self.left.leaves_some(v, w);
        if !is_allowed {
            return false;
        }
        self.collapsed += 1;
        for end in [v, w] {
            for (_, corners) in self.left.star(end) {
                corners
                    .iter()
                    .for_each(|&u| self.touched[u as usize] = self.collapsed);
            }
        }
        self.left.collapse(v, w, to);
        let of_w = self.quadrics[w as usize];
        self.quadrics[v as usize] += of_w;
        self.price_star(v, round);
        true
    }

    /// Takes note that the triangles at a vertex changed in this round, and of what their sides at it cost now. Most of these are sides of two triangles, and cost the same from both.
    fn price_star(&mut self, v: u32, round: i32) {
        let (mut star, mut priced) = (take(&mut self.star), take(&mut self.priced));
        star.clear();
        star.extend(self.left.star(v));
        priced.clear();
        for &(t, [_, next, last]) in &star {
            let mut cost = |w: u32| {
                let before = priced.iter().take(SOUGHT).find(|(of, _)| *of == w);
                before.map(|(_, cost)| *cost).unwrap_or_else(|| {
                    let (cost, _) = self.place([v, w]);
                    priced.push((w, cost));
                    cost
                })
            };
            let [to_next, to_last] = [cost(next), cost(last)];
            let t = t as usize;
            for (i, corner) in self.left.triangle(t).into_iter().flatten().enumerate() {
                if corner == v {
                    self.costs[t][i] = to_next;
                    self.costs[t][(i + 2) % 3] = to_last;
                }
            }
            self.cheapest[t] = least(&self.costs[t]);
            self.changed[t] = round;
        }
        (self.star, self.priced) = (star, priced);
    }

    /// Whether a triangle at v, but not at w, turns too far or becomes a needle when v moves.
    fn turns(&self, v: u32, w: u32, to: Vec3) -> bool {
        self.left.staying(v, w).any(|(t, [_, next, last])| {
            let a = (self.left.point(next) - to).unit();
            let b = (self.left.point(last) - to).unit();
            a.dot(b).abs() > NEEDLE || a.cross(b).unit().dot(self.normals[t as usize]) < TURN
        })
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

/// Of a round, in squares of the model's unit.
fn threshold(round: i32) -> f64 {
    LEAST * f64::from(round + 3).powi(SHARPNESS)
}

fn least(costs: &[f64; 3]) -> f64 {
    costs.iter().copied().fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;
    use proptest::prelude::*;

    impl Thresholds<'_> {
        /// [`run`](Self::run) by who keeps nothing in mind: looks at all triangles, weighs each side anew, and tries what was refused again.
        fn run_forgetfully(mut self, target: usize) -> Collapsing {
            for round in 0..ROUNDS {
                for t in 0..self.costs.len() {
                    if self.left.left() <= target || self.left.all_have_labels() {
                        return self.left;
                    }
                    let Some([a, b, c]) = self.left.triangle(t) else {
                        continue;
                    };
                    self.costs[t] = [[a, b], [b, c], [c, a]].map(|edge| self.place(edge).0);
                    self.cheapest[t] = f64::NEG_INFINITY;
                    self.refused[t] = [0; 3];
                    self.collapse_a_side(t, threshold(round), round);
                }
            }
            self.left
        }
    }

    /// Triangles around a vertex, more than [`SOUGHT`].
    fn fan() -> TriMesh {
        let spoke = |i: u32| {
            let turn = 0.1 * f64::from(i);
            [turn.cos(), turn.sin(), 0.3]
        };
        let positions = [[0.0; 3]].into_iter().chain((0..60).map(spoke)).collect();
        TriMesh::new(positions, (1..60).map(|i| [0, i, i + 1]).collect()).unwrap()
    }

    fn meshes() -> impl Strategy<Value = TriMesh> {
        (any::<u64>(), 0..8_u8, -2..3_i32).prop_map(|(seed, kind, size)| {
            let mesh = match kind {
                0 => shapes::soup(40, seed),
                1 => shapes::bumpy_torus(12, 9, seed),
                2 => shapes::jittered(&shapes::rectangle(9, 8, 1.0, 1.0), 0.3, seed),
                3 => shapes::book(5),
                4 => shapes::book_of_slivers(30, 1e-6),
                5 => shapes::jittered(&fan(), 0.1, seed),
                6 => shapes::shuffled(&shapes::bumpy_block(2, 3, seed), seed),
                _ => shapes::bumpy_sphere(3, seed),
            };
            shapes::scaled(&mesh, 10_f64.powi(size))
        })
    }

    proptest! {
        #[test]
        fn who_remembers_what_was_refused_collapses_the_same_edges(mesh in meshes(), share in 0.0..1.0_f64, labels in prop::collection::vec(prop::option::of(0..9_u32), 0..700)) {
            let connectivity = Connectivity::of(&mesh);
            let target = (share * mesh.triangle_count() as f64) as usize;
            for (target, labels) in [(target, &[][..]), (0, &labels)] {
                let start = || {
                    let mut thresholds = Thresholds::of(&mesh, &connectivity);
                    thresholds.left = thresholds.left.labelled(labels);
                    thresholds
                };
                let left = start().run(target, &Job::default()).unwrap();
                let expected = start().run_forgetfully(target);
                prop_assert_eq!(left.into_labels(), expected.into_labels());
            }
        }
    }

    #[test]
    fn what_became_of_the_corners_of_what_is_left_tells_what_became_of_the_others() {
        let (original, job) = (shapes::bumpy_sphere(5, 3), Job::default());
        // Moved by as much as changes which edges are collapsed.
        let wave = |&[x, y, z]: &[f64; 3]| 1.0 + 1e-3 * (9.0 * x - 7.0 * y + 5.0 * z).sin();
        let moved = original.positions().iter().map(|p| p.map(|x| x * wave(p)));
        let moved = original.with_positions(moved.collect()).unwrap();
        let connectivity = Connectivity::of(&moved);
        let mut thresholds = Thresholds::of(&moved, &connectivity);
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
        let told = labels(&original, &connectivity, &known, &job).unwrap();
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
        let connectivity = Connectivity::of(&original);
        let left = survivors(&original, &connectivity, 300, &job).unwrap();
        assert!(left.is_sorted() && left.len() == decimated.triangle_count());
        // What is left is a triangle whose corners became part of three vertices.
        let mut thresholds = Thresholds::of(&original, &connectivity);
        thresholds.left = thresholds.left.labelled(&[]);
        let into = thresholds.run(300, &job).unwrap().into_labels();
        for &t in &left {
            let [a, b, c] = original.triangles()[t as usize].map(|v| into[v as usize].0);
            assert!(a != b && b != c && c != a);
        }
        assert_eq!(
            survivors(&original, &connectivity, usize::MAX, &job)
                .unwrap()
                .len(),
            original.triangle_count()
        );
    }

    #[test]
    fn who_knows_nothing_or_all_is_told_as_much() {
        let (mesh, job) = (shapes::bumpy_sphere(2, 1), Job::default());
        let connectivity = Connectivity::of(&mesh);
        assert_eq!(
            labels(&mesh, &connectivity, &[], &job).unwrap(),
            vec![None; mesh.vertex_count()]
        );
        let all: Vec<Option<u32>> = (0..mesh.vertex_count() as u32).map(Some).collect();
        assert_eq!(labels(&mesh, &connectivity, &all, &job).unwrap(), all);
    }
}
