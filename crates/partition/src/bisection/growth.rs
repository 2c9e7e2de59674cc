//! First bisections of small graphs: a side grown from a random vertex, by gain or by breadth, then refined; the best of
//! several is kept.

use std::collections::VecDeque;

use crate::Graph;
use crate::buckets::GainBuckets;
use crate::rng::Rng;

use super::two_way::{Bisection, TwoWay};

/// Bounds of the moves without success after which a pass of refinement ends (METIS, `fm.c`).
const LEAST_PATIENCE: usize = 15;
const MOST_PATIENCE: usize = 100;
/// Every so many attempts one side grows by breadth.
const BREADTH_EVERY: usize = 4;
/// Passes over a grown bisection; with one alone cuts are 0.1 % longer.
const PASSES: usize = 4;

/// The best of `tries` grown and refined bisections: least excess weight, then least cut.
pub(crate) fn best_grown(
    graph: &Graph,
    target: f64,
    limits: [i64; 2],
    tries: usize,
    rng: &mut Rng,
) -> Bisection {
    let patience = graph.vertex_count().clamp(LEAST_PATIENCE, MOST_PATIENCE);
    let mut two_way = TwoWay::new(graph);
    let mut growth = Growth::new(graph);
    let mut best: Option<Bisection> = None;
    for attempt in 0..tries.max(1) {
        let mut state = Bisection::one_sided(graph);
        let seed = rng.below(graph.vertex_count());
        if attempt % BREADTH_EVERY == BREADTH_EVERY - 1 {
            grow_by_breadth(graph, &mut state, target, seed);
        } else {
            growth.by_gain(&mut state, target, seed);
        }
        two_way.refine(&mut state, limits, PASSES, patience, rng);
        let key = |b: &Bisection| (b.excess(limits), b.cut);
        if best.as_ref().is_none_or(|best| key(&state) < key(best)) {
            best = Some(state);
        }
    }
    best.unwrap_or_else(|| Bisection::one_sided(graph))
}

/// Workspace for growing sides of one graph.
struct Growth<'a> {
    graph: &'a Graph,
    queue: GainBuckets,
    /// Valid for queued vertices.
    gain: Vec<i32>,
}

impl<'a> Growth<'a> {
    fn new(graph: &'a Graph) -> Self {
        let count = graph.vertex_count();
        Self {
            graph,
            queue: GainBuckets::new(count, graph.max_weighted_degree()),
            gain: vec![0; count],
        }
    }

    /// Greedy graph growing (Karypis and Kumar 1998): side 0 takes the vertex that lengthens the border least until it
    /// weighs `target`.
    fn by_gain(&mut self, state: &mut Bisection, target: f64, seed: usize) {
        let count = self.graph.vertex_count();
        let mut seeds = (seed..count).chain(0..seed);
        while (state.weight[0] as f64) < target {
            let next = self.queue.pop().or_else(|| seeds.find(|&v| state.side[v] == 1));
            let Some(v) = next else { break };
            if !take(self.graph, state, v, target) {
                continue;
            }
            for (u, weight) in self.graph.edges(v).filter(|&(u, _)| state.side[u] == 1) {
                if self.queue.contains(u) {
                    // In two steps: twice a weight may not fit, gains always do.
                    self.gain[u] += weight;
                    self.gain[u] += weight;
                } else {
                    self.gain[u] = state.gain(self.graph, u);
                }
                self.queue.set(u, self.gain[u]);
            }
        }
        self.queue.clear();
    }
}

/// Side 0 takes vertices in breadth-first order until it weighs `target`.
fn grow_by_breadth(graph: &Graph, state: &mut Bisection, target: f64, seed: usize) {
    let mut queue = VecDeque::new();
    let mut seen = vec![false; graph.vertex_count()];
    for root in (seed..graph.vertex_count()).chain(0..seed) {
        if !seen[root] {
            seen[root] = true;
            queue.push_back(root);
        }
        while let Some(v) = queue.pop_front() {
            if state.weight[0] as f64 >= target {
                return;
            }
            take(graph, state, v, target);
            for &u in graph.neighbours(v) {
                if !std::mem::replace(&mut seen[u as usize], true) {
                    queue.push_back(u as usize);
                }
            }
        }
    }
}

/// Moves the vertex to side 0 unless that overshoots the target by more than half of its weight.
fn take(graph: &Graph, state: &mut Bisection, vertex: usize, target: f64) -> bool {
    let weight = graph.vertex_weights[vertex];
    if state.weight[0] as f64 + f64::from(weight) / 2.0 > target {
        return false;
    }
    let gain = state.gain(graph, vertex);
    state.cut -= i64::from(gain);
    state.side[vertex] = 0;
    state.weight[0] += i64::from(weight);
    state.weight[1] -= i64::from(weight);
    true
}
