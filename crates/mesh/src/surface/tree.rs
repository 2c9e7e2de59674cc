//! A binary tree of boxes over triangles, split by the surface area heuristic in bins (Wald 2007).

use crate::{BoundingBox, Vec3};

/// The tree, and the order of the triangles in which each leaf holds consecutive ones.
pub(super) struct Tree {
    /// The root first.
    pub(super) nodes: Vec<Node>,
    /// Indices of the triangles in the mesh, leaf by leaf.
    pub(super) order: Vec<u32>,
}

/// A box of triangles. Leaf: `count` triangles from `first` in the tree's order; inner node (`count` 0): the children are the
/// nodes `first` and `first + 1`.
#[derive(Clone, Copy)]
pub(super) struct Node {
    pub(super) bounds: BoundingBox,
    pub(super) first: u32,
    pub(super) count: u32,
}

/// The most triangles of a leaf.
const LEAF: usize = 4;

/// Places along an axis between which a cut is chosen.
const BINS: usize = 16;

/// From this depth on ranges are halved, which takes at most 32 levels more.
const HEURISTIC_DEPTH: usize = 48;

/// More levels than any tree has.
pub(super) const DEEPEST: usize = HEURISTIC_DEPTH + 33;

impl Tree {
    /// Builds the tree over the boxes of triangles, at least one, in O(n log n) time.
    pub(super) fn over(boxes: Vec<BoundingBox>) -> Self {
        let count = boxes.len();
        let mut builder = Builder {
            centres: boxes.iter().map(|bounds| Vec3(bounds.centre())).collect(),
            boxes,
            order: (0..count as u32).collect(),
            nodes: Vec::with_capacity(count),
        };
        builder.build();
        let Builder { order, mut nodes, .. } = builder;
        pad(&mut nodes);
        nodes.shrink_to_fit();
        Self { nodes, order }
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
        let mut bounds = BoundingBox::EMPTY;
        for &t in &self.order[start..end] {
            bounds.include(&self.boxes[t as usize]);
        }
        Node {
            bounds,
            first: start as u32,
            count: (end - start) as u32,
        }
    }

    /// Reorders a range of triangles and says where to cut it; both parts hold some.
    fn split(&mut self, start: usize, end: usize, depth: usize) -> usize {
        let range = &mut self.order[start..end];
        let centres = &self.centres;
        let mut bounds = BoundingBox::EMPTY;
        for &t in range.iter() {
            bounds.include_point(centres[t as usize]);
        }
        let size = bounds.size();
        let axis = (0..3).max_by(|&i, &j| size[i].total_cmp(&size[j])).unwrap_or(0);
        let per_unit = BINS as f64 / size[axis];
        if depth < HEURISTIC_DEPTH && per_unit.is_finite() {
            let along = |t: u32| centres[t as usize][axis] - bounds.min[axis];
            let bin = |t: u32| ((along(t) * per_unit) as usize).min(BINS - 1);
            if let Some(cut) = best_cut(range, &self.boxes, &bin) {
                let middle = partition(range, |t| bin(t) < cut);
                if middle > 0 && middle < range.len() {
                    return start + middle;
                }
            }
        }
        let middle = range.len() / 2;
        range.select_nth_unstable_by(middle, |&s, &t| {
            let [along_s, along_t] = [s, t].map(|t| centres[t as usize][axis]);
            along_s.total_cmp(&along_t).then(s.cmp(&t))
        });
        start + middle
    }
}

/// Triangles whose centres lie in one of the places, or in several that follow each other.
#[derive(Clone, Copy)]
struct Bin {
    bounds: BoundingBox,
    count: usize,
}

impl Bin {
    const EMPTY: Self = Self {
        bounds: BoundingBox::EMPTY,
        count: 0,
    };

    fn add(&mut self, bounds: &BoundingBox, count: usize) {
        self.bounds.include(bounds);
        self.count += count;
    }

    /// What a query pays for it: the chance that it enters, times the triangles that it meets. A cut must not leave it empty.
    fn cost(&self) -> f64 {
        match self.count {
            0 => f64::INFINITY,
            count => half_area(&self.bounds) * count as f64,
        }
    }
}

/// The bin before which to cut so that the costs of both parts are least.
fn best_cut(range: &[u32], boxes: &[BoundingBox], bin: &impl Fn(u32) -> usize) -> Option<usize> {
    let mut bins = [Bin::EMPTY; BINS];
    for &t in range {
        bins[bin(t)].add(&boxes[t as usize], 1);
    }
    let mut costs = [0.0; BINS];
    let mut before = Bin::EMPTY;
    for cut in 1..BINS {
        before.add(&bins[cut - 1].bounds, bins[cut - 1].count);
        costs[cut] += before.cost();
    }
    let mut beyond = Bin::EMPTY;
    for cut in (1..BINS).rev() {
        beyond.add(&bins[cut].bounds, bins[cut].count);
        costs[cut] += beyond.cost();
    }
    (1..BINS)
        .filter(|&cut| costs[cut].is_finite())
        .min_by(|&i, &j| costs[i].total_cmp(&costs[j]))
}

/// Half the area of a box, by which the heuristic estimates the chance that a query enters it.
pub(super) fn half_area(bounds: &BoundingBox) -> f64 {
    let [x, y, z] = bounds.size();
    x * y + y * z + z * x
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

/// Widens all boxes by more than the rounding of the tests against them, so that these never reject wrongly.
fn pad(nodes: &mut [Node]) {
    let BoundingBox { min, max } = nodes[0].bounds;
    let largest = (0..3).fold(0.0_f64, |m, axis| m.max(min[axis].abs()).max(max[axis].abs()));
    let pad = 16.0 * f64::EPSILON * largest;
    for Node { bounds, .. } in nodes {
        bounds.min = bounds.min.map(|x| x - pad);
        bounds.max = bounds.max.map(|x| x + pad);
    }
}
