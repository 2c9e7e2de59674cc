//! Localised k-way Fiduccia–Mattheyses search (Sanders and Schulz, "Engineering multilevel graph partitioning
//! algorithms", 2011).
//!
//! From each boundary vertex, in random order, a small search of its own starts: it moves the best vertex near by, also
//! at a loss, and is rolled back to its best prefix. Local searches climb out of hills from which one search over the
//! whole boundary would run away to easier places. A vertex moves at most once a round, which bounds the time.

use crate::buckets::GainBuckets;
use crate::kway::KWay;
use crate::rng::Rng;

/// Vertices with more neighbours are left to [`greedy`](crate::greedy): here they would be looked at once per move of
/// a neighbour.
const MAX_DEGREE: usize = 200;

/// Bounds of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalSearch {
    /// Rounds over the boundary; a round that gains nothing is the last.
    pub(crate) rounds: usize,
    /// Moves without success after which one search gives up.
    pub(crate) patience: usize,
}

/// Lowers the cut; no part gets above its limit that was below it. `boundary` must hold all boundary vertices.
pub(crate) fn refine(state: &mut KWay<'_>, boundary: &mut Vec<u32>, search: LocalSearch, rng: &mut Rng) {
    let count = state.graph.vertex_count();
    let mut round = Round {
        queue: GainBuckets::new(count, state.graph.max_weighted_degree()),
        stamp: vec![0; count],
        round: 0,
        moves: Vec::new(),
    };
    for _ in 0..search.rounds {
        round.round += 1;
        rng.shuffle(boundary);
        let mut gained = 0;
        for i in 0..boundary.len() {
            gained += round.search(state, boundary[i] as usize, search.patience, boundary);
        }
        boundary.sort_unstable();
        boundary.dedup();
        boundary.retain(|&v| state.on_boundary(v as usize));
        if gained == 0 {
            return;
        }
    }
}

struct Round {
    queue: GainBuckets,
    /// Round in which a vertex was moved last.
    stamp: Vec<u32>,
    round: u32,
    /// Moves of the current search: vertex and part it came from.
    moves: Vec<(u32, u32)>,
}

impl Round {
    /// One local search; returns what it took off the cut, and adds to `boundary` what its moves brought there.
    fn search(&mut self, state: &mut KWay<'_>, seed: usize, patience: usize, boundary: &mut Vec<u32>) -> i64 {
        self.enqueue(state, seed);
        let (mut gained, mut best, mut best_len) = (0i64, 0i64, 0usize);
        while let Some(v) = self.queue.pop() {
            let Some(step) = state.best_move(v) else { continue };
            self.moves.push((v as u32, state.part[v]));
            state.apply(v, step.to);
            self.stamp[v] = self.round;
            gained += i64::from(step.gain);
            if gained > best {
                best = gained;
                best_len = self.moves.len();
            } else if self.moves.len() - best_len > patience {
                break;
            }
            let graph = state.graph;
            for &u in graph.neighbours(v) {
                self.enqueue(state, u as usize);
            }
        }
        self.queue.clear();
        for (v, from) in self.moves.drain(best_len..).rev() {
            state.apply(v as usize, from);
        }
        for (v, _) in self.moves.drain(..) {
            boundary.push(v);
            boundary.extend(state.graph.neighbours(v as usize));
        }
        best
    }

    /// Queues a vertex at its present gain unless it may not move.
    fn enqueue(&mut self, state: &mut KWay<'_>, vertex: usize) {
        if self.stamp[vertex] == self.round || state.graph.degree(vertex) > MAX_DEGREE {
            return;
        }
        match state.best_move(vertex) {
            Some(step) => self.queue.set(vertex, step.gain),
            None => self.queue.remove(vertex),
        }
    }
}
