//! Point packets: the distances of many points that lie close together, found together.
//!
//! A packet of up to [`PACKET`] points goes through the tree of boxes as one: a box is passed over if it is farther from the
//! packet's box than the farthest point is, so far, from the surface. A triangle that is reached is measured from all points in
//! one loop without branches, which the compiler turns into vector instructions, as wide as the processor has them. No
//! instruction fuses a product with a sum, so that results are the same on all of them. Benchmark: `cargo xtask bench quality`.

use pulp::Arch;

use super::stack::Stack;
use super::tree::{DEEPEST, Node, Tree};
use super::{greater, lesser};
use crate::{BoundingBox, Vec3};

/// Points that go through the tree together.
const PACKET: usize = LANES * BLOCKS;

/// Points that are measured in one loop: no more are measured than a packet's points fill of such blocks.
const LANES: usize = 8;
const BLOCKS: usize = 8;

/// A triangle is a sliver when its height is below this fraction of its longest edge: its normal is lost in rounding, and its
/// edges are all that is measured.
const SLIVER: f64 = 1e-10;

/// The distance of each point from the triangles, whose `corners` stand in the order of the tree.
pub(super) fn measure(tree: &Tree, corners: &[[Vec3; 3]], points: &[[f64; 3]], distances: &mut [f64]) {
    let arch = Arch::new();
    for (points, distances) in points.chunks(PACKET).zip(distances.chunks_mut(PACKET)) {
        let mut packet = Packet::new(points);
        arch.dispatch(|| packet.go_through(&tree.nodes, corners));
        for (distance, block) in distances.chunks_mut(LANES).zip(&packet.blocks) {
            for (distance, square) in distance.iter_mut().zip(block.squares) {
                *distance = square.sqrt();
            }
        }
    }
}

/// Points side by side, and the squared distance of each from the triangles reached so far.
#[derive(Clone, Copy)]
struct Block {
    x: [f64; LANES],
    y: [f64; LANES],
    z: [f64; LANES],
    squares: [f64; LANES],
}

impl Block {
    /// Of 1 to [`LANES`] points; places beyond repeat the last.
    fn new(points: &[[f64; 3]]) -> Self {
        let point = |i: usize| points[i.min(points.len() - 1)];
        Self {
            x: std::array::from_fn(|i| point(i)[0]),
            y: std::array::from_fn(|i| point(i)[1]),
            z: std::array::from_fn(|i| point(i)[2]),
            squares: [f64::INFINITY; LANES],
        }
    }
}

/// Points that lie close together.
struct Packet {
    blocks: [Block; BLOCKS],
    /// How many of them have points.
    filled: usize,
    /// The greatest squared distance.
    farthest: f64,
    bounds: BoundingBox,
}

impl Packet {
    /// Of 1 to [`PACKET`] points.
    fn new(points: &[[f64; 3]]) -> Self {
        let mut blocks = [Block::new(&points[..1]); BLOCKS];
        let filled = points.chunks(LANES).zip(&mut blocks);
        filled.for_each(|(points, block)| *block = Block::new(points));
        Self {
            blocks,
            filled: points.len().div_ceil(LANES),
            farthest: f64::INFINITY,
            bounds: BoundingBox::of(points),
        }
    }

    #[inline(always)]
    fn go_through(&mut self, nodes: &[Node], corners: &[[Vec3; 3]]) {
        // Some triangle near the middle bounds all distances before the search begins.
        self.reach(&corners[near_leaf(nodes, self.bounds.centre())]);
        // Nodes, each with its squared distance.
        let mut stack = Stack::<(u32, f64), { DEEPEST + 1 }>::new((0, 0.0));
        stack.push((0, 0.0));
        while let Some((node, distance)) = stack.pop() {
            if distance >= self.farthest {
                continue;
            }
            let node = &nodes[node as usize];
            if node.count == 0 {
                let [near, far] = [node.first, node.first + 1]
                    .map(|child| (child, gap(&self.bounds, &nodes[child as usize].bounds)));
                let (near, far) = if far.1 < near.1 { (far, near) } else { (near, far) };
                stack.push(far);
                stack.push(near);
                continue;
            }
            for corners in &corners[node.first as usize..(node.first + node.count) as usize] {
                if gap(&self.bounds, &box_of(corners)) < self.farthest {
                    self.reach(corners);
                }
            }
        }
    }

    /// Takes one more triangle into account.
    #[inline(always)]
    fn reach(&mut self, corners: &[Vec3; 3]) {
        let triangle = Triangle::new(corners);
        let mut farthest = [0.0; LANES];
        for block in &mut self.blocks[..self.filled] {
            for i in 0..LANES {
                let square = triangle.squared_distance(Vec3([block.x[i], block.y[i], block.z[i]]));
                block.squares[i] = lesser(block.squares[i], square);
                farthest[i] = greater(farthest[i], block.squares[i]);
            }
        }
        self.farthest = farthest.into_iter().fold(0.0, greater);
    }
}

/// A triangle near a point, by its place among the leaves: found by going down the nearer child each time.
fn near_leaf(nodes: &[Node], p: [f64; 3]) -> usize {
    let point = BoundingBox { min: p, max: p };
    let to_centre = |node: &Node| (Vec3(node.bounds.centre()) - Vec3(p)).squared();
    let mut node = &nodes[0];
    while node.count == 0 {
        let [left, right] = [0, 1].map(|side| &nodes[node.first as usize + side]);
        let (l, r) = (gap(&point, &left.bounds), gap(&point, &right.bounds));
        // Inside both, the nearer centre decides.
        let nearer_left = if l == r {
            to_centre(left) <= to_centre(right)
        } else {
            l < r
        };
        node = if nearer_left { left } else { right };
    }
    node.first as usize
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
        let edges = [0, 1, 2].map(|i| corners[(i + 1) % 3] - corners[i]);
        let lengths = edges.map(Vec3::squared);
        let normal = edges[0].cross(edges[1]);
        let (area, longest) = (normal.norm(), lengths.into_iter().fold(0.0, f64::max));
        let flat = area <= SLIVER * longest;
        let unit_normal = if flat { Vec3::ZERO } else { normal * (1.0 / area) };
        Self {
            corners: *corners,
            edges,
            inverse: lengths.map(|l| if l > 0.0 { 1.0 / l } else { 0.0 }),
            unit_normal,
            inward: edges.map(|edge| unit_normal.cross(edge)),
            inside: if flat { f64::INFINITY } else { 0.0 },
        }
    }

    /// Over the triangle the distance is that from its plane, elsewhere that from its nearest edge.
    #[inline(always)]
    fn squared_distance(&self, p: Vec3) -> f64 {
        let (mut to_edges, mut over) = (f64::INFINITY, true);
        for i in 0..3 {
            let from_corner = p - self.corners[i];
            let along = from_corner.dot(self.edges[i]) * self.inverse[i];
            let along = lesser(greater(along, 0.0), 1.0);
            let apart = from_corner - along * self.edges[i];
            to_edges = lesser(to_edges, apart.squared());
            over &= from_corner.dot(self.inward[i]) >= self.inside;
        }
        let height = (p - self.corners[0]).dot(self.unit_normal);
        lesser(to_edges, if over { height * height } else { f64::INFINITY })
    }
}

/// The squared distance between two boxes.
fn gap(a: &BoundingBox, b: &BoundingBox) -> f64 {
    let mut sum = 0.0;
    for axis in 0..3 {
        let apart = (b.min[axis] - a.max[axis])
            .max(a.min[axis] - b.max[axis])
            .max(0.0);
        sum += apart * apart;
    }
    sum
}

fn box_of([a, b, c]: &[Vec3; 3]) -> BoundingBox {
    BoundingBox {
        min: [0, 1, 2].map(|axis| lesser(a[axis], lesser(b[axis], c[axis]))),
        max: [0, 1, 2].map(|axis| greater(a[axis], greater(b[axis], c[axis]))),
    }
}

#[cfg(test)]
mod tests {
    use crate::{Surface, TriMesh, Vec3, shapes};
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
            let middle = Vec3(mesh.bounding_box().centre()) + Vec3(centre);
            let points: Vec<[f64; 3]> = offsets.iter().map(|&o| (middle + Vec3(o) * 10_f64.powi(-spread)).into()).collect();
            let mut together = vec![0.0; points.len()];
            surface.distances(&points, &mut together);
            let size = middle.0.iter().fold(1.0, |m, x| x.abs().max(m));
            for (&p, d) in points.iter().zip(together) {
                let alone = surface.nearest(p).distance;
                prop_assert!((d - alone).abs() <= 1e-13 * size + 1e-9 * alone, "{d} {alone}");
            }
        }

        #[test]
        fn points_of_the_surface_are_on_it(seed in 0..4_u64, weights in prop::collection::vec((0.0..1.0_f64, 0.0..1.0_f64), 1..80)) {
            let mesh = shapes::bumpy_torus(9, 7, seed);
            let points: Vec<[f64; 3]> = weights.iter().enumerate().map(|(t, &(u, v))| {
                let [a, b, c] = mesh.corners(t % mesh.triangle_count());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                (a + (u * (b - a) + v * (c - a))).into()
            }).collect();
            let mut distances = vec![1.0; points.len()];
            Surface::new(&mesh).distances(&points, &mut distances);
            prop_assert!(distances.iter().all(|&d| d < 1e-15));
        }
    }
}
