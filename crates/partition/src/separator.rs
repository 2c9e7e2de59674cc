//! Vertex separators: a multilevel bisection whose border is kept as a set of vertices and refined as such.
//!
//! Moving a separator vertex to one side draws its neighbours on the other side into the separator; the gain is the
//! weight that the separator loses. Passes of such moves, with rollback to the best prefix, follow Ashcraft and Liu
//! (1998) and Hendrickson and Rothberg (1998).

use crate::Graph;
use crate::buckets::GainBuckets;
use crate::coarsen::{Level, coarsen, prolong};
use crate::fm2::Bisection;
use crate::initial::best_grown;
use crate::rng::Rng;
use crate::team::Team;

/// The mark of the separator among the sides 0 and 1.
pub(crate) const SEPARATOR: u8 = 2;

/// Share of the total weight that a side may have.
const MAX_SHARE: f64 = 0.6;
/// Size of the graph on which several separators are tried.
const MIDDLE: usize = 3000;
/// Size of the graph on which halves are grown, and how many times.
const COARSEST: usize = 100;
const GROWN: usize = 4;
const PASSES: usize = 6;

/// Two sides without edges between them, and what separates them.
#[derive(Clone, Debug)]
pub(crate) struct Separation {
    /// 0, 1 or [`SEPARATOR`] for each vertex.
    pub(crate) side: Vec<u8>,
    /// Weight of side 0, of side 1 and of the separator.
    pub(crate) weight: [i64; 3],
}

/// A light separator of a graph: the lightest of several found on a graph of middling size, refined up to the graph.
pub(crate) fn separate(graph: &Graph, tries: usize, team: &Team, rng: &mut Rng) -> Separation {
    let levels = coarsen(graph, MIDDLE, &[], team, rng);
    let middle = levels.last().map_or(graph, |level| &level.graph);
    let limit = (MAX_SHARE * graph.total_vertex_weight() as f64) as i64;
    let attempts: Vec<Separation> = (0..tries.max(1))
        .map(|_| cycle(middle, limit, team, rng))
        .collect();
    let lightest = attempts.into_iter().min_by_key(|s| s.standing(limit));
    let best = lightest.unwrap_or_else(|| Separation::beside(middle, &Bisection::one_sided(middle)));
    refine_up(graph, &levels, best, limit, rng)
}

/// One multilevel cycle from scratch.
fn cycle(graph: &Graph, limit: i64, team: &Team, rng: &mut Rng) -> Separation {
    let levels = coarsen(graph, COARSEST, &[], team, rng);
    let coarsest = levels.last().map_or(graph, |level| &level.graph);
    let total = graph.total_vertex_weight();
    let halves = best_grown(coarsest, total as f64 / 2.0, [total * 11 / 20; 2], GROWN, rng);
    let mut separation = Separation::beside(coarsest, &halves);
    refine(coarsest, &mut separation, limit, rng);
    refine_up(graph, &levels, separation, limit, rng)
}

/// Carries a separation of the coarsest graph up, refining it on every level.
fn refine_up(
    graph: &Graph,
    levels: &[Level],
    mut state: Separation,
    limit: i64,
    rng: &mut Rng,
) -> Separation {
    for depth in (0..levels.len()).rev() {
        let fine = if depth == 0 {
            graph
        } else {
            &levels[depth - 1].graph
        };
        state.side = prolong(&state.side, &levels[depth].coarse_of);
        refine(fine, &mut state, limit, rng);
    }
    state
}

/// What is compared: excess weight, separator weight, imbalance.
type Standing = (i64, i64, i64);

impl Separation {
    /// The border vertices of the side where they weigh less.
    fn beside(graph: &Graph, halves: &Bisection) -> Self {
        let on_border = |v: usize| {
            graph
                .neighbours(v)
                .iter()
                .any(|&u| halves.side[u as usize] != halves.side[v])
        };
        let border: Vec<usize> = (0..halves.side.len()).filter(|&v| on_border(v)).collect();
        let weight_of = |side: u8| -> i64 {
            border
                .iter()
                .filter(|&&v| halves.side[v] == side)
                .map(|&v| i64::from(graph.vertex_weights[v]))
                .sum()
        };
        let lighter = u8::from(weight_of(1) < weight_of(0));
        let mut separation = Self {
            side: halves.side.clone(),
            weight: [halves.weight[0], halves.weight[1], 0],
        };
        for v in border.into_iter().filter(|&v| halves.side[v] == lighter) {
            separation.put(graph, v, SEPARATOR);
        }
        separation
    }

    fn put(&mut self, graph: &Graph, vertex: usize, side: u8) {
        let weight = i64::from(graph.vertex_weights[vertex]);
        let from = std::mem::replace(&mut self.side[vertex], side);
        self.weight[usize::from(from)] -= weight;
        self.weight[usize::from(side)] += weight;
    }

    fn standing(&self, limit: i64) -> Standing {
        let excess = (self.weight[0] - limit).max(0) + (self.weight[1] - limit).max(0);
        (excess, self.weight[2], (self.weight[0] - self.weight[1]).abs())
    }
}

fn refine(graph: &Graph, separation: &mut Separation, limit: i64, rng: &mut Rng) {
    let count = graph.vertex_count();
    let span = (0..count)
        .map(|v| neighbourhood_weight(graph, v))
        .max()
        .unwrap_or(0);
    let new_queue = || GainBuckets::new(count, i32::try_from(span).unwrap_or(i32::MAX));
    let mut pass = Pass {
        graph,
        separation,
        limit,
        queues: [new_queue(), new_queue()],
        drawn_weight: [vec![0; count], vec![0; count]],
        moved: vec![false; count],
        journal: Vec::new(),
    };
    for _ in 0..PASSES {
        if !pass.run(rng) {
            return;
        }
    }
}

/// Weight of a vertex and its neighbours: the bound of its gains.
fn neighbourhood_weight(graph: &Graph, vertex: usize) -> i64 {
    let weight = |v: usize| i64::from(graph.vertex_weights[v]);
    weight(vertex)
        + graph
            .neighbours(vertex)
            .iter()
            .map(|&u| weight(u as usize))
            .sum::<i64>()
}

/// The state of one pass.
struct Pass<'a> {
    graph: &'a Graph,
    separation: &'a mut Separation,
    limit: i64,
    /// Separator vertices by their gain when moved to side 0 or 1.
    queues: [GainBuckets; 2],
    /// Weight that a separator vertex draws in when it moves to side 0 or 1. Valid for queued vertices.
    drawn_weight: [Vec<i32>; 2],
    moved: Vec<bool>,
    /// Moves of the pass.
    journal: Vec<Step>,
}

/// A vertex that left the separator and those that it drew in.
struct Step {
    vertex: usize,
    drawn: Vec<u32>,
}

impl Pass<'_> {
    /// Whether the separation got better.
    fn run(&mut self, rng: &mut Rng) -> bool {
        let count = self.graph.vertex_count() as u32;
        let mut members: Vec<u32> = (0..count)
            .filter(|&v| self.separation.side[v as usize] == SEPARATOR)
            .collect();
        rng.shuffle(&mut members);
        let patience = (members.len() / 2).clamp(20, 200);
        members.iter().for_each(|&v| self.enqueue(v as usize));
        let start = self.separation.standing(self.limit);
        let (mut best, mut best_len) = (start, 0);
        while let Some((vertex, side)) = self.next_move() {
            let step = self.apply(vertex, side);
            self.journal.push(step);
            let standing = self.separation.standing(self.limit);
            if standing < best {
                (best, best_len) = (standing, self.journal.len());
            } else if self.journal.len() - best_len > patience {
                break;
            }
        }
        self.queues.iter_mut().for_each(GainBuckets::clear);
        self.roll_back(best_len);
        (best.0, best.1) < (start.0, start.1)
    }

    fn roll_back(&mut self, keep: usize) {
        self.journal
            .iter()
            .for_each(|step| self.moved[step.vertex] = false);
        for step in self.journal.drain(keep..).rev() {
            let other = 1 - self.separation.side[step.vertex];
            self.separation.put(self.graph, step.vertex, SEPARATOR);
            for u in step.drawn {
                self.separation.put(self.graph, u as usize, other);
            }
        }
        self.journal.clear();
    }

    fn enqueue(&mut self, vertex: usize) {
        let mut drawn = [0, 0];
        for &u in self.graph.neighbours(vertex) {
            let side = self.separation.side[u as usize];
            if side != SEPARATOR {
                drawn[usize::from(1 - side)] += self.graph.vertex_weights[u as usize];
            }
        }
        for side in 0..2 {
            self.drawn_weight[side][vertex] = drawn[side];
            self.requeue(vertex, side);
        }
    }

    fn requeue(&mut self, vertex: usize, side: usize) {
        let gain = self.graph.vertex_weights[vertex] - self.drawn_weight[side][vertex];
        self.queues[side].set(vertex, gain);
    }

    /// The feasible move of greatest gain; of equals the one to the lighter side.
    fn next_move(&mut self) -> Option<(usize, u8)> {
        loop {
            let mut best: Option<(i32, i64, usize, usize)> = None;
            for side in 0..2 {
                if let Some(v) = self.queues[side].peek() {
                    let gain = self.graph.vertex_weights[v] - self.drawn_weight[side][v];
                    let room = self.limit - self.separation.weight[side];
                    if best.is_none_or(|(g, r, ..)| (gain, room) > (g, r)) {
                        best = Some((gain, room, v, side));
                    }
                }
            }
            let (_, room, vertex, side) = best?;
            self.queues[side].remove(vertex);
            if i64::from(self.graph.vertex_weights[vertex]) <= room {
                self.queues[1 - side].remove(vertex);
                return Some((vertex, side as u8));
            }
        }
    }

    fn apply(&mut self, vertex: usize, side: u8) -> Step {
        let graph = self.graph;
        self.separation.put(graph, vertex, side);
        self.moved[vertex] = true;
        let other = 1 - side;
        let mut drawn = Vec::new();
        for &u in graph.neighbours(vertex) {
            let u = u as usize;
            if self.separation.side[u] == other {
                self.separation.put(graph, u, SEPARATOR);
                drawn.push(u as u32);
                self.change_drawn(u, vertex, usize::from(side), -graph.vertex_weights[u]);
                if !self.moved[u] {
                    self.enqueue(u);
                }
            } else if self.separation.side[u] == SEPARATOR {
                self.change(u, usize::from(other), graph.vertex_weights[vertex]);
            }
        }
        Step { vertex, drawn }
    }

    /// Vertex `drawn` is no longer on the side opposite `side`: its separator neighbours draw in less.
    fn change_drawn(&mut self, drawn: usize, mover: usize, side: usize, weight: i32) {
        for &x in self.graph.neighbours(drawn) {
            if x as usize != mover && self.separation.side[x as usize] == SEPARATOR {
                self.change(x as usize, side, weight);
            }
        }
    }

    fn change(&mut self, vertex: usize, side: usize, weight: i32) {
        let queued = [self.queues[0].contains(vertex), self.queues[1].contains(vertex)];
        if queued == [false, false] {
            return;
        }
        self.drawn_weight[side][vertex] += weight;
        if queued[side] {
            self.requeue(vertex, side);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_edge_joins_the_sides_of_a_separated_grid_and_the_separator_is_a_short_line() {
        let at = |x: u32, y: u32| y * 50 + x;
        let right = (0..49).flat_map(|x| (0..30).map(move |y| (at(x, y), at(x + 1, y), 1)));
        let up = (0..50).flat_map(|x| (0..29).map(move |y| (at(x, y), at(x, y + 1), 1)));
        let graph = Graph::from_edges(1500, &right.chain(up).collect::<Vec<_>>()).unwrap();
        let result = separate(&graph, 4, &Team::new(1).unwrap(), &mut Rng::new(5));
        for v in 0..1500 {
            let sides = graph.neighbours(v).iter().map(|&u| result.side[u as usize]);
            assert!(
                sides
                    .into_iter()
                    .all(|side| side == SEPARATOR || result.side[v] == SEPARATOR || result.side[v] == side)
            );
        }
        let count = |side: u8| result.side.iter().filter(|&&s| s == side).count() as i64;
        assert_eq!(result.weight, [count(0), count(1), count(SEPARATOR)]);
        assert!(result.weight[2] <= 32 && result.weight[0].max(result.weight[1]) <= 900);
    }
}
