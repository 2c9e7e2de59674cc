//! The tree of boxes, four boxes to a node, for queries of single points and lines (Wald, Benthin and Boulos 2008).
//!
//! Boxes are in single precision, rounded outward, in a frame in which the mesh lies within ±1; the four of a node are tested in
//! one loop without branches, which the compiler turns into vector instructions. Tests are one-sided: what they reject is farther
//! off than the bound, rounding included, so that the triangles, in double precision, alone decide. Benchmark: `cargo xtask bench
//! registration`.

use super::stack::Stack;
use super::tree::{DEEPEST, Node, half_area};
use super::{greater, lesser};
use crate::Vec3;

/// Boxes of a node.
const WIDE: usize = 4;

/// Relative error of a test's arithmetic, and of a coordinate, generously.
const ROUNDING: f32 = 1e-6;

pub(super) struct Bvh4 {
    nodes: Vec<Node4>,
    centre: Vec3,
    /// 1 / half the longest side.
    unit: f64,
    /// Levels of nodes.
    depth: usize,
}

/// Up to four boxes side by side, by axis. Leaf: `count` triangles from `first`; inner node (`count` 0): the node `first`.
#[derive(Clone, Copy)]
struct Node4 {
    min: [[f32; WIDE]; 3],
    max: [[f32; WIDE]; 3],
    first: [u32; WIDE],
    count: [u16; WIDE],
    used: u8,
}

/// A box still to visit.
#[derive(Clone, Copy)]
struct Visit {
    first: u32,
    count: u16,
    bound: f32,
}

impl Bvh4 {
    /// From a binary tree, whose first node is the root.
    pub(super) fn of(binary: &[Node]) -> Self {
        let root = &binary[0].bounds;
        let half = (0..3).fold(0.0_f64, |m, axis| {
            m.max(0.5 * root.max[axis] - 0.5 * root.min[axis])
        });
        let unit = if (1.0 / half).is_normal() { 1.0 / half } else { 1.0 };
        let mut bvh = Self {
            nodes: vec![Node4::EMPTY],
            centre: Vec3(root.centre()),
            unit,
            depth: 0,
        };
        bvh.nodes.reserve(binary.len() / 4);
        let mut open = vec![(0_usize, 0_u32, 1)];
        while let Some((place, covered, depth)) = open.pop() {
            bvh.depth = bvh.depth.max(depth);
            for (lane, child) in four(binary, covered).into_iter().flatten().enumerate() {
                let node = &binary[child as usize];
                let first = if node.count > 0 {
                    node.first
                } else {
                    open.push((bvh.nodes.len(), child, depth + 1));
                    bvh.nodes.push(Node4::EMPTY);
                    bvh.nodes.len() as u32 - 1
                };
                let [min, max] = [node.bounds.min, node.bounds.max].map(|p| bvh.local(Vec3(p)));
                let node4 = &mut bvh.nodes[place];
                for axis in 0..3 {
                    node4.min[axis][lane] = rounded_down(min[axis]);
                    node4.max[axis][lane] = -rounded_down(-max[axis]);
                }
                node4.first[lane] = first;
                node4.count[lane] = node.count as u16;
                node4.used = lane as u8 + 1;
            }
        }
        bvh
    }

    /// A point in the frame of the boxes.
    fn local(&self, p: Vec3) -> Vec3 {
        (p - self.centre) * self.unit
    }

    /// Visits the leaves that may hold a point nearer to `p` than the root of `best`, about the nearest first; `leaf` is given the
    /// first triangle and how many there are, and the square of the distance to beat.
    #[inline]
    pub(super) fn near(&self, p: Vec3, best: &mut f64, mut leaf: impl FnMut(usize, usize, &mut f64)) {
        let [low, high] = widened(self.local(p));
        let scale = self.unit * self.unit;
        self.visit(
            |node| node.squared_distances(low, high),
            |best| (scale * best) as f32 * (1.0 + ROUNDING) + f32::MIN_POSITIVE,
            best,
            &mut leaf,
        );
    }

    /// Visits the leaves that a line may meet at a smaller |t| than `best`.
    #[inline]
    pub(super) fn along(
        &self,
        origin: Vec3,
        direction: Vec3,
        best: &mut f64,
        mut leaf: impl FnMut(usize, usize, &mut f64),
    ) {
        let [low, high] = widened(self.local(origin));
        let inverse = direction.0.map(|d| {
            let d = self.unit * d;
            // A tiny component in place of zero keeps 0 · ∞ out of the box test.
            (1.0 / if d.abs() < 1e-30 { 1e-30 } else { d }) as f32
        });
        self.visit(
            |node| node.reaches(low, high, inverse),
            // Finite, so that boxes which are never met lie beyond.
            |best| lesser(best as f32 * (1.0 + ROUNDING) + f32::MIN_POSITIVE, f32::MAX),
            best,
            &mut leaf,
        );
    }

    /// A stack costs the time to clear it, and few trees need a deep one.
    #[inline(always)]
    fn visit(
        &self,
        bounds_of: impl Fn(&Node4) -> [f32; WIDE],
        limit_of: impl Fn(f64) -> f32,
        best: &mut f64,
        leaf: &mut impl FnMut(usize, usize, &mut f64),
    ) {
        const SHALLOW: usize = 64;
        if left_behind(self.depth) <= SHALLOW {
            self.visit_within::<SHALLOW>(bounds_of, limit_of, best, leaf);
        } else {
            self.visit_within::<{ left_behind(DEEPEST) }>(bounds_of, limit_of, best, leaf);
        }
    }

    #[inline(always)]
    fn visit_within<const STACK: usize>(
        &self,
        bounds_of: impl Fn(&Node4) -> [f32; WIDE],
        limit_of: impl Fn(f64) -> f32,
        best: &mut f64,
        leaf: &mut impl FnMut(usize, usize, &mut f64),
    ) {
        let root = Visit {
            first: 0,
            count: 0,
            bound: 0.0,
        };
        let mut stack = Stack::<Visit, STACK>::new(root);
        let mut limit = limit_of(*best);
        stack.push(root);
        while let Some(visit) = stack.pop() {
            if visit.bound > limit {
                continue;
            }
            if visit.count > 0 {
                leaf(visit.first as usize, usize::from(visit.count), best);
                limit = limit_of(*best);
                continue;
            }
            let node = &self.nodes[visit.first as usize];
            let bounds = bounds_of(node);
            let floor = stack.len;
            for lane in 0..usize::from(node.used) {
                if bounds[lane] <= limit {
                    let child = Visit {
                        first: node.first[lane],
                        count: node.count[lane],
                        bound: bounds[lane],
                    };
                    stack.insert(floor, child);
                }
            }
        }
    }
}

impl Node4 {
    const EMPTY: Self = Self {
        min: [[0.0; WIDE]; 3],
        max: [[0.0; WIDE]; 3],
        first: [0; WIDE],
        count: [0; WIDE],
        used: 0,
    };

    /// Lower bounds of the squared distances of a point, which lies between `low` and `high`, from the boxes.
    #[inline(always)]
    fn squared_distances(&self, low: [f32; 3], high: [f32; 3]) -> [f32; WIDE] {
        let mut sums = [0.0; WIDE];
        for axis in 0..3 {
            for lane in 0..WIDE {
                let before = self.min[axis][lane] - high[axis];
                let beyond = low[axis] - self.max[axis][lane];
                let outside = greater(greater(before, beyond), 0.0);
                sums[lane] += outside * outside;
            }
        }
        sums
    }

    /// Lower bounds of the |t| at which a line, its origin between `low` and `high`, is inside the boxes; infinite where it never is.
    #[inline(always)]
    fn reaches(&self, low: [f32; 3], high: [f32; 3], inverse: [f32; 3]) -> [f32; WIDE] {
        let mut enter = [f32::NEG_INFINITY; WIDE];
        let mut leave = [f32::INFINITY; WIDE];
        for axis in 0..3 {
            for lane in 0..WIDE {
                let s = (self.min[axis][lane] - high[axis]) * inverse[axis];
                let t = (self.max[axis][lane] - low[axis]) * inverse[axis];
                enter[lane] = greater(enter[lane], lesser(s, t));
                leave[lane] = lesser(leave[lane], greater(s, t));
            }
        }
        std::array::from_fn(|lane| {
            let (enter, leave) = (enter[lane], leave[lane]);
            if enter - ROUNDING * enter.abs() > leave + ROUNDING * leave.abs() {
                f32::INFINITY
            } else {
                greater(greater(enter, -leave), 0.0)
            }
        })
    }
}

/// A point in single precision, from below and from above.
fn widened(p: Vec3) -> [[f32; 3]; 2] {
    let slack = |x: f32| 0.5 * ROUNDING * x.abs();
    let p = p.0.map(|x| x as f32);
    [p.map(|x| x - slack(x)), p.map(|x| x + slack(x))]
}

fn rounded_down(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) > x {
        rounded.next_down()
    } else {
        rounded
    }
}

/// Up to four nodes that cover a node of the binary tree: its children, the largest of them divided again.
fn four(binary: &[Node], node: u32) -> [Option<u32>; WIDE] {
    let mut chosen = [None; WIDE];
    let root = &binary[node as usize];
    if root.count > 0 {
        chosen[0] = Some(node);
        return chosen;
    }
    chosen[0] = Some(root.first);
    chosen[1] = Some(root.first + 1);
    for free in 2..WIDE {
        let inner = (0..free).filter(|&i| chosen[i].is_some_and(|child| binary[child as usize].count == 0));
        let area = |i: usize| chosen[i].map_or(0.0, |child| half_area(&binary[child as usize].bounds));
        let Some(largest) = inner.max_by(|&i, &j| area(i).total_cmp(&area(j))) else {
            break;
        };
        let first = chosen[largest].map_or(0, |child| binary[child as usize].first);
        chosen[largest] = Some(first);
        chosen[free] = Some(first + 1);
    }
    chosen
}

/// The most boxes that are left to visit: every level leaves all but one of its node's, and the last all of them.
const fn left_behind(depth: usize) -> usize {
    (WIDE - 1) * depth + 1
}

impl<const SIZE: usize> Stack<Visit, SIZE> {
    /// Puts a box in its place among those from `floor` on: the nearest last.
    #[inline(always)]
    fn insert(&mut self, floor: usize, visit: Visit) {
        let mut place = self.len;
        while place > floor && self.items[place - 1].bound < visit.bound {
            self.items[place] = self.items[place - 1];
            place -= 1;
        }
        self.items[place] = visit;
        self.len += 1;
    }
}
