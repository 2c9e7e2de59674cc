//! The distances of many points that lie close together, found together.
//!
//! A swarm of up to [`SWARM`] points goes through the tree of boxes as one: a box is passed over if it is farther from the
//! swarm's box than the farthest point is, so far, from the surface. A triangle that is reached is measured from all points in
//! one loop without branches, which the compiler turns into vector instructions, as wide as the processor has them. No
//! instruction fuses a product with a sum, so that results are the same on all of them. Benchmark: `cargo xtask bench quality`.

use crate::surface::{Node, Stack, Surface};
use crate::vector::{Vec3, add, cross, dot, scaled, squared, sub};
use mesh::BoundingBox;
use pulp::Arch;

/// Points that are measured in one loop.
const SWARM: usize = 64;

/// A triangle is a sliver when its height is below this fraction of its longest edge: its normal is lost in rounding, and its
/// edges are all that is measured.
const SLIVER: f64 = 1e-10;

impl Surface {
    /// The distance of each point from the surface. Quickest if points that follow each other lie close together.
    ///
    /// ```
    /// use registration::Surface;
    /// let cube = Surface::new(&mesh::shapes::cube(1.0));
    /// let mut distances = [0.0; 2];
    /// cube.distances(&[[0.5, 0.5, 1.25], [2.0, 0.5, 0.5]], &mut distances);
    /// assert_eq!(distances, [0.25, 1.0]);
    /// ```
    ///
    /// # Panics
    /// If there is not one place in `distances` for each point.
    pub fn distances(&self, points: &[[f64; 3]], distances: &mut [f64]) {
        assert_eq!(points.len(), distances.len(), "one distance a point");
        let arch = Arch::new();
        for (points, distances) in points.chunks(SWARM).zip(distances.chunks_mut(SWARM)) {
            let mut swarm = Swarm::new(points);
            arch.dispatch(|| self.measure(&mut swarm));
            for (distance, square) in distances.iter_mut().zip(swarm.squares) {
                *distance = square.sqrt();
            }
        }
    }

    #[inline(always)]
    fn measure(&self, swarm: &mut Swarm) {
        // Some triangle near the middle bounds all distances before the search begins.
        swarm.reach(&self.corners[self.a_near_leaf(swarm.bounds.centre())]);
        let mut stack = Stack::new();
        stack.push(0, 0.0);
        while let Some((node, gap)) = stack.pop() {
            if gap >= swarm.farthest {
                continue;
            }
            let node = &self.nodes[node as usize];
            if node.count == 0 {
                let [near, far] = [node.first, node.first + 1]
                    .map(|child| (child, gap_to_node(&swarm.bounds, &self.nodes[child as usize])));
                let (near, far) = if far.1 < near.1 { (far, near) } else { (near, far) };
                stack.push(far.0, far.1);
                stack.push(near.0, near.1);
                continue;
            }
            for corners in &self.corners[node.first as usize..(node.first + node.count) as usize] {
                if gap_to_triangle(&swarm.bounds, corners) < swarm.farthest {
                    swarm.reach(corners);
                }
            }
        }
    }

    /// A triangle near a point, by its place among the leaves: found by going down the nearer child each time.
    fn a_near_leaf(&self, p: Vec3) -> usize {
        let point = BoundingBox { min: p, max: p };
        let mut node = &self.nodes[0];
        while node.count == 0 {
            let [left, right] = [0, 1].map(|side| &self.nodes[node.first as usize + side]);
            let (l, r) = (gap_to_node(&point, left), gap_to_node(&point, right));
            // Inside both, the nearer centre decides.
            let nearer_left = if l == r {
                to_centre(left, p) <= to_centre(right, p)
            } else {
                l < r
            };
            node = if nearer_left { left } else { right };
        }
        node.first as usize
    }
}

/// Points side by side, and the squared distance of each from the triangles reached so far.
struct Swarm {
    x: [f64; SWARM],
    y: [f64; SWARM],
    z: [f64; SWARM],
    squares: [f64; SWARM],
    /// The greatest of them.
    farthest: f64,
    bounds: BoundingBox,
}

impl Swarm {
    /// Of 1 to [`SWARM`] points; places beyond repeat the last.
    fn new(points: &[Vec3]) -> Self {
        let point = |i: usize| points[i.min(points.len() - 1)];
        Self {
            x: std::array::from_fn(|i| point(i)[0]),
            y: std::array::from_fn(|i| point(i)[1]),
            z: std::array::from_fn(|i| point(i)[2]),
            squares: [f64::INFINITY; SWARM],
            farthest: f64::INFINITY,
            bounds: BoundingBox::of(points),
        }
    }

    /// Takes one more triangle into account.
    #[inline(always)]
    fn reach(&mut self, corners: &[Vec3; 3]) {
        let triangle = Triangle::new(corners);
        let mut farthest = 0.0;
        for i in 0..SWARM {
            let square = triangle.squared_distance([self.x[i], self.y[i], self.z[i]]);
            self.squares[i] = lesser(self.squares[i], square);
            farthest = greater(farthest, self.squares[i]);
        }
        self.farthest = farthest;
    }
}

/// What the distance from a triangle needs that does not depend on the point.
struct Triangle {
    corners: [Vec3; 3],
    /// Edge i runs from corner i to corner i + 1.
    edges: [Vec3; 3],
    /// 1 / length², and 0 for an edge without length.
    inverse: [f64; 3],
    unit_normal: Vec3,
    /// At right angles to edge i and the normal, towards the inside.
    inward: [Vec3; 3],
    /// A point is over the triangle if its place along each `inward` is at least this.
    inside: f64,
}

impl Triangle {
    #[inline(always)]
    fn new(corners: &[Vec3; 3]) -> Self {
        let edges = [0, 1, 2].map(|i| sub(corners[(i + 1) % 3], corners[i]));
        let lengths = edges.map(squared);
        let normal = cross(edges[0], edges[1]);
        let (area, longest) = (squared(normal).sqrt(), lengths.into_iter().fold(0.0, f64::max));
        let flat = area <= SLIVER * longest;
        let unit_normal = if flat {
            [0.0; 3]
        } else {
            scaled(normal, 1.0 / area)
        };
        Self {
            corners: *corners,
            edges,
            inverse: lengths.map(|l| if l > 0.0 { 1.0 / l } else { 0.0 }),
            unit_normal,
            inward: edges.map(|edge| cross(unit_normal, edge)),
            inside: if flat { f64::INFINITY } else { 0.0 },
        }
    }

    /// Over the triangle the distance is that from its plane, elsewhere that from its nearest edge.
    #[inline(always)]
    fn squared_distance(&self, p: Vec3) -> f64 {
        let (mut to_edges, mut over) = (f64::INFINITY, true);
        for i in 0..3 {
            let from_corner = sub(p, self.corners[i]);
            let along = dot(from_corner, self.edges[i]) * self.inverse[i];
            let along = lesser(greater(along, 0.0), 1.0);
            let apart = sub(from_corner, scaled(self.edges[i], along));
            to_edges = lesser(to_edges, squared(apart));
            over &= dot(from_corner, self.inward[i]) >= self.inside;
        }
        let height = dot(sub(p, self.corners[0]), self.unit_normal);
        lesser(to_edges, if over { height * height } else { f64::INFINITY })
    }
}

// As the vector instructions compare: without the care of `f64::min` for numbers that are none.
#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The squared distance between two boxes.
fn gap(a: &BoundingBox, min: Vec3, max: Vec3) -> f64 {
    let mut sum = 0.0;
    for axis in 0..3 {
        let apart = (min[axis] - a.max[axis]).max(a.min[axis] - max[axis]).max(0.0);
        sum += apart * apart;
    }
    sum
}

fn gap_to_node(bounds: &BoundingBox, node: &Node) -> f64 {
    gap(bounds, node.min, node.max)
}

fn gap_to_triangle(bounds: &BoundingBox, &[a, b, c]: &[Vec3; 3]) -> f64 {
    let min = [0, 1, 2].map(|axis| lesser(a[axis], lesser(b[axis], c[axis])));
    let max = [0, 1, 2].map(|axis| greater(a[axis], greater(b[axis], c[axis])));
    gap(bounds, min, max)
}

fn to_centre(node: &Node, p: Vec3) -> f64 {
    squared(sub(scaled(add(node.min, node.max), 0.5), p))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::{TriMesh, shapes};
    use proptest::prelude::*;

    fn surfaces() -> impl Strategy<Value = TriMesh> {
        (1..60_u32, any::<u64>(), 0..5_u8).prop_map(|(n, seed, kind)| match kind {
            0 => shapes::soup(n, seed),
            1 => shapes::book_of_slivers(n, 1e-7),
            2 => shapes::book_of_slivers(n, 1e-13),
            3 => shapes::translated(&shapes::bumpy_sphere(2, seed), [1e3, 0.0, -1e3]),
            _ => shapes::disjoint_union(&vec![shapes::tetrahedron(); n as usize]),
        })
    }

    proptest! {
        #[test]
        fn points_measured_together_are_as_far_as_each_alone(
            mesh in surfaces(), centre in prop::array::uniform3(-3.0..3.0_f64), spread in 0..4_i32,
            offsets in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 1..150),
        ) {
            let surface = Surface::new(&mesh);
            let middle = add(mesh.bounding_box().centre(), centre);
            let points: Vec<Vec3> = offsets.iter().map(|&o| add(middle, scaled(o, 10_f64.powi(-spread)))).collect();
            let mut together = vec![0.0; points.len()];
            surface.distances(&points, &mut together);
            let size = middle.iter().fold(1.0, |m, x| x.abs().max(m));
            for (&p, d) in points.iter().zip(together) {
                let alone = surface.nearest(p).distance;
                prop_assert!((d - alone).abs() <= 1e-13 * size + 1e-9 * alone, "{d} {alone}");
            }
        }

        #[test]
        fn points_of_the_surface_are_on_it(seed in 0..4_u64, weights in prop::collection::vec((0.0..1.0_f64, 0.0..1.0_f64), 1..80)) {
            let mesh = shapes::bumpy_torus(9, 7, seed);
            let points: Vec<Vec3> = weights.iter().enumerate().map(|(t, &(u, v))| {
                let [a, b, c] = mesh.corners(t % mesh.triangle_count());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                add(a, add(scaled(sub(b, a), u), scaled(sub(c, a), v)))
            }).collect();
            let mut distances = vec![1.0; points.len()];
            Surface::new(&mesh).distances(&points, &mut distances);
            prop_assert!(distances.iter().all(|&d| d < 1e-15));
        }
    }
}
