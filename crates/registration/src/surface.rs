//! Nearest points and line hits on a triangle mesh, by a tree of boxes.
//!
//! The tree is binary, split by the surface area heuristic in bins (Wald 2007), with f64 boxes and the
//! leaves' corners side by side in memory. Line hits use the edge functions of Woop, Benthin and Wald (2013),
//! which give a shared edge the same sign from both of its triangles: a line through a closed surface never
//! slips between two triangles.

use crate::RegistrationError;
use crate::quads::Quads;
use crate::threads;
use crate::vector::{Vec3, add, cross, dot, norm, scaled, squared, sub};
use mesh::{BoundingBox, TriMesh};

/// A mesh prepared for queries. Building takes O(n log n) time, about 170 bytes a triangle.
pub struct Surface {
    quads: Quads,
    /// The tree of pairs that `quads` is made of.
    pub(crate) nodes: Vec<Node>,
    /// Corners of the triangles, in the order of the leaves.
    pub(crate) corners: Vec<[Vec3; 3]>,
    /// The triangle's index in the mesh, in the order of the leaves.
    triangles: Vec<u32>,
}

/// The point of a surface that is nearest to a query point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Where it is.
    pub point: [f64; 3],
    /// Its distance from the query point.
    pub distance: f64,
    /// The triangle that it lies on; of several equally near, any, but the same in every run.
    pub triangle: u32,
}

/// Where a line meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Position along the line: the point is origin + t · direction.
    pub t: f64,
    /// The triangle that is met.
    pub triangle: u32,
}

/// A box of triangles. Leaf: `count` triangles from `first`; inner node (`count` 0): the children `first` and
/// `first + 1`.
#[derive(Clone, Copy)]
pub(crate) struct Node {
    pub(crate) min: Vec3,
    pub(crate) max: Vec3,
    pub(crate) first: u32,
    pub(crate) count: u32,
}

impl Node {
    pub(crate) fn half_area(&self) -> f64 {
        let [x, y, z] = sub(self.max, self.min);
        x * y + y * z + z * x
    }
}

const LEAF: usize = 4;
const BINS: usize = 16;

/// Below this depth ranges are halved, so that the tree is never deeper than this and 32.
const HEURISTIC_DEPTH: usize = 48;
pub(crate) const DEEPEST: usize = HEURISTIC_DEPTH + 33;

impl Surface {
    /// Builds the tree over the triangles of a mesh.
    ///
    /// ```
    /// use registration::Surface;
    /// let ball = Surface::new(&mesh::shapes::icosphere(4));
    /// let nearest = ball.nearest([0.0, 0.0, 3.0]);
    /// assert!((nearest.distance - 2.0).abs() < 1e-2);
    /// let hit = ball.hit([0.0, 0.0, 0.9], [0.0, 0.0, 1.0], 0.5, |_| true).unwrap();
    /// assert!((hit.t - 0.1).abs() < 1e-2);
    /// ```
    pub fn new(mesh: &TriMesh) -> Self {
        let count = mesh.triangle_count();
        let boxes: Vec<BoundingBox> = (0..count).map(|t| BoundingBox::of(&mesh.corners(t))).collect();
        let mut builder = Builder {
            centres: boxes.iter().map(|b| scaled(add(b.min, b.max), 0.5)).collect(),
            boxes,
            order: (0..count as u32).collect(),
            nodes: Vec::with_capacity(count),
        };
        builder.build();
        let Builder { order, mut nodes, .. } = builder;
        pad(&mut nodes);
        nodes.shrink_to_fit();
        let corners = order
            .iter()
            .map(|&t| mesh.corners(t as usize).map(Into::into))
            .collect();
        Self {
            quads: Quads::of(&nodes),
            nodes,
            corners,
            triangles: order,
        }
    }

    /// The point of the surface nearest to `p`.
    pub fn nearest(&self, p: [f64; 3]) -> Nearest {
        self.search(p, f64::INFINITY).unwrap_or(Nearest {
            point: p,
            distance: f64::INFINITY,
            triangle: 0,
        })
    }

    /// [`nearest`](Self::nearest) of many points, on several threads.
    ///
    /// # Errors
    /// When the threads can't be started.
    pub fn nearest_of(&self, points: &[[f64; 3]], threads: usize) -> Result<Vec<Nearest>, RegistrationError> {
        threads::in_pool(threads, || {
            threads::map(points.len(), |i| self.nearest(points[i]))
        })
    }

    /// The point of the surface nearest to `p`, if it is nearer than `limit`.
    pub fn nearest_within(&self, p: [f64; 3], limit: f64) -> Option<Nearest> {
        self.search(p, limit * limit)
    }

    fn search(&self, p: Vec3, limit_squared: f64) -> Option<Nearest> {
        let mut best = limit_squared;
        let mut found = None;
        self.quads.near(p, &mut best, |first, count, best| {
            for leaf in first..first + count {
                let point = nearest_on_triangle(&self.corners[leaf], p);
                let distance = squared(sub(point, p));
                if distance < *best {
                    *best = distance;
                    found = Some((point, leaf));
                }
            }
        });
        found.map(|(point, leaf)| Nearest {
            point,
            distance: best.sqrt(),
            triangle: self.triangles[leaf],
        })
    }

    /// Where the line origin + t · direction, −`limit` ≤ t ≤ `limit`, meets an accepted triangle at the least
    /// |t|.
    ///
    /// Triangles are met from both sides; one that contains the line is not met. `accept` is asked by
    /// triangle index.
    pub fn hit(
        &self,
        origin: [f64; 3],
        direction: [f64; 3],
        limit: f64,
        accept: impl Fn(u32) -> bool,
    ) -> Option<Hit> {
        let line = Line::new(origin, direction)?;
        let mut best = limit;
        let mut found = None;
        self.quads
            .along(origin, direction, &mut best, |first, count, best| {
                for leaf in first..first + count {
                    if let Some(t) = line.meet(&self.corners[leaf])
                        && t.abs() <= *best
                        && accept(self.triangles[leaf])
                    {
                        *best = t.abs();
                        found = Some(Hit {
                            t,
                            triangle: self.triangles[leaf],
                        });
                    }
                }
            });
        found
    }
}

struct Builder {
    boxes: Vec<BoundingBox>,
    centres: Vec<Vec3>,
    order: Vec<u32>,
    nodes: Vec<Node>,
}

impl Builder {
    fn build(&mut self) {
        self.nodes.push(self.leaf(0, self.order.len()));
        let mut open = vec![(0, 0)];
        while let Some((index, depth)) = open.pop() {
            let Node { first, count, .. } = self.nodes[index];
            let (start, end) = (first as usize, (first + count) as usize);
            if count as usize <= LEAF {
                continue;
            }
            let middle = self.split(start, end, depth);
            let child = self.nodes.len();
            let halves = [self.leaf(start, middle), self.leaf(middle, end)];
            self.nodes.extend(halves);
            self.nodes[index].first = child as u32;
            self.nodes[index].count = 0;
            open.push((child, depth + 1));
            open.push((child + 1, depth + 1));
        }
    }

    fn leaf(&self, start: usize, end: usize) -> Node {
        let mut node = Node {
            min: [f64::INFINITY; 3],
            max: [f64::NEG_INFINITY; 3],
            first: start as u32,
            count: (end - start) as u32,
        };
        for &t in &self.order[start..end] {
            grow(&mut node.min, &mut node.max, &self.boxes[t as usize]);
        }
        node
    }

    /// Reorders a range of triangles and says where to cut it; both halves are not empty.
    fn split(&mut self, start: usize, end: usize, depth: usize) -> usize {
        let range = &mut self.order[start..end];
        let centres = &self.centres;
        let mut bounds = BoundingBox {
            min: [f64::INFINITY; 3],
            max: [f64::NEG_INFINITY; 3],
        };
        for &t in range.iter() {
            for axis in 0..3 {
                bounds.min[axis] = bounds.min[axis].min(centres[t as usize][axis]);
                bounds.max[axis] = bounds.max[axis].max(centres[t as usize][axis]);
            }
        }
        let size = bounds.size();
        let axis = (0..3).max_by(|&i, &j| size[i].total_cmp(&size[j])).unwrap_or(0);
        let per_bin = BINS as f64 / size[axis];
        if depth < HEURISTIC_DEPTH && per_bin.is_finite() {
            let bin =
                |t: u32| (((centres[t as usize][axis] - bounds.min[axis]) * per_bin) as usize).min(BINS - 1);
            if let Some(cut) = best_cut(range, &self.boxes, &bin) {
                let middle = partition(range, |t| bin(t) < cut);
                if middle > 0 && middle < range.len() {
                    return start + middle;
                }
            }
        }
        let middle = range.len() / 2;
        range.select_nth_unstable_by(middle, |&s, &t| {
            centres[s as usize][axis]
                .total_cmp(&centres[t as usize][axis])
                .then(s.cmp(&t))
        });
        start + middle
    }
}

/// The bin before which to cut so that Σ (area of half · triangles in half) is least.
fn best_cut(range: &[u32], boxes: &[BoundingBox], bin: &impl Fn(u32) -> usize) -> Option<usize> {
    let mut bins = [(
        BoundingBox {
            min: [f64::INFINITY; 3],
            max: [f64::NEG_INFINITY; 3],
        },
        0_usize,
    ); BINS];
    for &t in range {
        let (bounds, count) = &mut bins[bin(t)];
        grow(&mut bounds.min, &mut bounds.max, &boxes[t as usize]);
        *count += 1;
    }
    let mut costs = [0.0; BINS];
    for backwards in [false, true] {
        let (mut bounds, mut count) = (
            BoundingBox {
                min: [f64::INFINITY; 3],
                max: [f64::NEG_INFINITY; 3],
            },
            0,
        );
        for step in 0..BINS - 1 {
            let (taken, cut) = if backwards {
                (BINS - 1 - step, BINS - 1 - step)
            } else {
                (step, step + 1)
            };
            grow(&mut bounds.min, &mut bounds.max, &bins[taken].0);
            count += bins[taken].1;
            costs[cut] += if count == 0 {
                f64::INFINITY
            } else {
                half_area(&bounds) * count as f64
            };
        }
    }
    (1..BINS)
        .filter(|&cut| costs[cut].is_finite())
        .min_by(|&i, &j| costs[i].total_cmp(&costs[j]))
}

fn half_area(bounds: &BoundingBox) -> f64 {
    let [x, y, z] = bounds.size();
    x * y + y * z + z * x
}

fn grow(min: &mut Vec3, max: &mut Vec3, other: &BoundingBox) {
    for axis in 0..3 {
        min[axis] = min[axis].min(other.min[axis]);
        max[axis] = max[axis].max(other.max[axis]);
    }
}

/// Moves the items that satisfy `first` to the front; returns their number.
fn partition(range: &mut [u32], first: impl Fn(u32) -> bool) -> usize {
    let mut front = 0;
    for i in 0..range.len() {
        if first(range[i]) {
            range.swap(front, i);
            front += 1;
        }
    }
    front
}

/// Widens all boxes by more than the rounding of the box tests, so that these never reject wrongly.
fn pad(nodes: &mut [Node]) {
    let root = &nodes[0];
    let largest = (0..3).fold(0.0_f64, |m, axis| {
        m.max(root.min[axis].abs()).max(root.max[axis].abs())
    });
    let pad = 16.0 * f64::EPSILON * largest;
    for node in nodes {
        node.min = node.min.map(|x| x - pad);
        node.max = node.max.map(|x| x + pad);
    }
}

/// Nodes still to visit, each with its distance.
pub(crate) struct Stack {
    nodes: [(u32, f64); DEEPEST + 1],
    len: usize,
}

impl Stack {
    pub(crate) fn new() -> Self {
        Self {
            nodes: [(0, 0.0); DEEPEST + 1],
            len: 0,
        }
    }

    pub(crate) fn push(&mut self, node: u32, distance: f64) {
        self.nodes[self.len] = (node, distance);
        self.len += 1;
    }

    pub(crate) fn pop(&mut self) -> Option<(u32, f64)> {
        self.len = self.len.checked_sub(1)?;
        Some(self.nodes[self.len])
    }
}

/// The point of a triangle nearest to `p` (Ericson, *Real-Time Collision Detection*, 5.1.5), degenerate
/// triangles included.
pub(crate) fn nearest_on_triangle(&[a, b, c]: &[Vec3; 3], p: Vec3) -> Vec3 {
    let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(p, a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = sub(p, b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let cp = sub(p, c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return add(a, scaled(ab, ratio(d1, d1 - d3)));
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return add(a, scaled(ac, ratio(d2, d2 - d6)));
    }
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return add(b, scaled(sub(c, b), ratio(d4 - d3, (d4 - d3) + (d5 - d6))));
    }
    let sum = va + vb + vc;
    add(a, add(scaled(ab, ratio(vb, sum)), scaled(ac, ratio(vc, sum))))
}

/// x / y, and 0 for 0 / 0.
fn ratio(x: f64, y: f64) -> f64 {
    if y == 0.0 { 0.0 } else { x / y }
}

/// A line in the frame in which triangles are tested: its largest axis last, sheared onto that axis.
struct Line {
    origin: Vec3,
    axes: [usize; 3],
    shear: Vec3,
}

impl Line {
    /// None when the direction is zero or not finite.
    fn new(origin: Vec3, direction: Vec3) -> Option<Self> {
        let z = (0..3).max_by(|&i, &j| direction[i].abs().total_cmp(&direction[j].abs()))?;
        if direction[z] == 0.0 || !direction.iter().all(|x| x.is_finite()) {
            return None;
        }
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let shear = [
            direction[axes[0]] / direction[z],
            direction[axes[1]] / direction[z],
            1.0 / direction[z],
        ];
        Some(Self { origin, axes, shear })
    }

    /// Where the line meets a triangle.
    fn meet(&self, corners: &[Vec3; 3]) -> Option<f64> {
        let [x, y, z] = self.axes;
        let [a, b, c] = corners.map(|p| {
            let p = sub(p, self.origin);
            [
                p[x] - self.shear[0] * p[z],
                p[y] - self.shear[1] * p[z],
                self.shear[2] * p[z],
            ]
        });
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None;
        }
        Some((u * a[2] + v * b[2] + w * c[2]) / determinant)
    }
}

/// The unit normals of all triangles; zero for those without area.
pub(crate) fn triangle_normals(mesh: &TriMesh) -> Vec<Vec3> {
    let normal = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        let n = cross(sub(b, a), sub(c, a));
        let length = norm(n);
        if length > 0.0 {
            scaled(n, 1.0 / length)
        } else {
            [0.0; 3]
        }
    };
    (0..mesh.triangle_count()).map(normal).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;
    use proptest::prelude::*;

    fn soups() -> impl Strategy<Value = TriMesh> {
        (1..60_u32, any::<u64>(), 0..4_u8).prop_map(|(n, seed, kind)| match kind {
            0 => shapes::soup(n, seed),
            1 => shapes::book_of_slivers(n, 1e-7),
            2 => shapes::translated(&shapes::bumpy_sphere(1, seed), [1e5, 0.0, -1e5]),
            _ => shapes::disjoint_union(&vec![shapes::tetrahedron(); n as usize]),
        })
    }

    proptest! {
        #[test]
        fn the_nearest_point_is_the_nearest_of_all_triangles(mesh in soups(), p in prop::array::uniform3(-15.0..15.0_f64), near in any::<bool>()) {
            let p = if near { add(scaled(p, 0.01), mesh.positions()[0]) } else { p };
            let nearest = Surface::new(&mesh).nearest(p);
            let all = (0..mesh.triangle_count()).map(|t| norm(sub(nearest_on_triangle(&mesh.corners(t).map(Into::into), p), p)));
            prop_assert_eq!(nearest.distance, all.fold(f64::INFINITY, f64::min));
            let on_it = nearest_on_triangle(&mesh.corners(nearest.triangle as usize).map(Into::into), p);
            prop_assert_eq!(on_it, nearest.point);
            prop_assert!(Surface::new(&mesh).nearest_within(p, nearest.distance * 0.999).is_none());
        }

        #[test]
        fn the_nearest_point_of_a_triangle_beats_its_other_points(
            corners in prop::array::uniform3(prop::array::uniform3(-1.0..1.0_f64)), p in prop::array::uniform3(-2.0..2.0_f64),
            weights in prop::array::uniform3(0.01..1.0_f64), flat in 0..3_u8,
        ) {
            let [a, b, c] = corners;
            let corners = match flat { 0 => [a, b, a], 1 => [a, a, a], _ => [a, b, c] };
            let sum: f64 = weights.iter().sum();
            let other = (0..3).fold([0.0; 3], |q, i| add(q, scaled(corners[i], weights[i] / sum)));
            let nearest = nearest_on_triangle(&corners, p);
            prop_assert!(norm(sub(nearest, p)) <= norm(sub(other, p)) + 1e-14);
            prop_assert!(norm(sub(nearest_on_triangle(&corners, nearest), nearest)) < 1e-7);
        }

        #[test]
        fn the_hit_is_the_nearest_of_all_triangles(mesh in soups(), origin in prop::array::uniform3(-5.0..5.0_f64), towards in prop::array::uniform3(-5.0..5.0_f64)) {
            let direction = sub(towards, origin);
            let found = Surface::new(&mesh).hit(origin, direction, 3.0, |_| true);
            let line = Line::new(origin, direction).unwrap();
            let all = (0..mesh.triangle_count()).filter_map(|t| line.meet(&mesh.corners(t).map(Into::into))).map(f64::abs);
            let least = all.fold(f64::INFINITY, f64::min);
            prop_assert_eq!(found.map(|hit| hit.t.abs()), (least <= 3.0).then_some(least));
        }

        #[test]
        fn a_line_from_inside_always_leaves_a_closed_surface(
            seed in 0..4_u64, direction in prop::array::uniform3(-1.0..1.0_f64), v in 0..162_usize, e in 0..480_usize,
        ) {
            let ball = shapes::bumpy_sphere(2, seed);
            let edges = mesh::Edges::of(&ball);
            let [a, b] = edges.vertices()[e].map(|v| ball.positions()[v as usize]);
            let surface = Surface::new(&ball);
            // Through vertices and the middles of edges, where triangles meet, and anywhere.
            for direction in [direction, ball.positions()[v], scaled(add(a, b), 0.5)] {
                prop_assert!(surface.hit([0.0; 3], direction, 1e9, |_| true).is_some());
            }
        }
    }

    #[test]
    fn axis_parallel_lines_in_the_faces_of_boxes_hit() {
        let cube = Surface::new(&shapes::cube(1.0));
        for edge in [0.0, 0.5, 1.0] {
            let hit = cube
                .hit([edge, 0.25, -1.0], [0.0, 0.0, 1.0], 5.0, |_| true)
                .unwrap();
            assert_eq!(hit.t, 1.0);
        }
        assert!(
            cube.hit([1.0 + 1e-12, 0.25, -1.0], [0.0, 0.0, 1.0], 5.0, |_| true)
                .is_none()
        );
        assert!(cube.hit([0.5; 3], [0.0; 3], 5.0, |_| true).is_none());
    }

    #[test]
    fn a_filter_lets_the_line_go_on() {
        let cube = shapes::cube(1.0);
        let normals = triangle_normals(&cube);
        let top = |t: u32| normals[t as usize][2] > 0.5;
        let hit = Surface::new(&cube)
            .hit([0.3, 0.4, 0.1], [0.0, 0.0, 1.0], 5.0, top)
            .unwrap();
        assert!((hit.t - 0.9).abs() < 1e-15);
    }
}
