//! Vertex separators: a multilevel bisection whose border is kept as a set of vertices and refined as such.
//!
//! Moving a separator vertex to one side draws its neighbours on the other side into the separator; the gain is the
//! weight that the separator loses (Ashcraft and Liu 1998, Hendrickson and Rothberg 1998). A sweep moves vertices to one side
//! only, those that it draws in too, and rolls back to its best prefix; the next goes the other way. So the whole
//! separator travels across the graph, through places where it is heavier, as in METIS' one-sided refinement. Moves to
//! both sides in one pass undo each other: with them factors filled in by 7 % more.

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
const GROWN: usize = 2;
const SWEEPS: usize = 12;

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

/// Whether the separator is so much heavier than the best that going on is worth less.
fn far_from(best: Standing, now: Standing) -> bool {
    now.1 > best.1 + best.1 / 7
}

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

/// Sweeps the separator to and fro until neither direction makes it lighter.
fn refine(graph: &Graph, separation: &mut Separation, limit: i64, rng: &mut Rng) {
    let count = graph.vertex_count();
    let span = (0..count)
        .map(|v| neighbourhood_weight(graph, v))
        .max()
        .unwrap_or(0);
    let mut members: Vec<u32> = (0..count as u32)
        .filter(|&v| separation.side[v as usize] == SEPARATOR)
        .collect();
    let mut sweep = Sweep {
        graph,
        limit,
        to: u8::from(separation.weight[1] < separation.weight[0]),
        separation,
        queue: GainBuckets::new(count, i32::try_from(span).unwrap_or(i32::MAX)),
        gain: vec![0; count],
        movers: Vec::new(),
        drawn: Vec::new(),
    };
    let mut failures = 0;
    for _ in 0..SWEEPS {
        rng.shuffle(&mut members);
        failures = if sweep.run(&mut members) { 0 } else { failures + 1 };
        if failures == 2 {
            return;
        }
        sweep.to = 1 - sweep.to;
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

/// Moves of separator vertices to one side.
struct Sweep<'a> {
    graph: &'a Graph,
    separation: &'a mut Separation,
    limit: i64,
    /// The side that separator vertices move to; they draw in their neighbours on the other.
    to: u8,
    /// Separator vertices by gain.
    queue: GainBuckets,
    /// The weight that the separator loses when a vertex moves. Valid for queued vertices.
    gain: Vec<i32>,
    /// The vertices that moved, each with the number of vertices that were drawn in before it.
    movers: Vec<(u32, usize)>,
    drawn: Vec<u32>,
}

impl Sweep<'_> {
    /// Whether the separation got better. `members` are the separator's vertices, before and after.
    fn run(&mut self, members: &mut Vec<u32>) -> bool {
        members.iter().for_each(|&v| self.enqueue(v as usize));
        let patience = (3 * members.len()).clamp(20, 300);
        let start = self.separation.standing(self.limit);
        let (mut best, mut best_len) = (start, 0);
        while let Some(vertex) = self.queue.pop() {
            let weight = i64::from(self.graph.vertex_weights[vertex]);
            if self.separation.weight[usize::from(self.to)] + weight > self.limit {
                continue;
            }
            self.apply(vertex);
            let standing = self.separation.standing(self.limit);
            let since_best = self.movers.len() - best_len;
            if standing < best {
                (best, best_len) = (standing, self.movers.len());
            } else if since_best > patience && far_from(best, standing) || since_best > 3 * patience {
                break;
            }
        }
        self.queue.clear();
        self.roll_back(best_len);
        members.append(&mut self.drawn);
        members.retain(|&v| self.separation.side[v as usize] == SEPARATOR);
        (best.0, best.1) < (start.0, start.1)
    }

    fn roll_back(&mut self, keep: usize) {
        for (vertex, before) in self.movers.drain(keep..).rev() {
            self.separation.put(self.graph, vertex as usize, SEPARATOR);
            for u in self.drawn.drain(before..) {
                self.separation.put(self.graph, u as usize, 1 - self.to);
            }
        }
        self.movers.clear();
    }

    fn enqueue(&mut self, vertex: usize) {
        let other = 1 - self.to;
        let beyond = self.graph.neighbours(vertex).iter().map(|&u| u as usize);
        let drawn: i32 = beyond
            .filter(|&u| self.separation.side[u] == other)
            .map(|u| self.graph.vertex_weights[u])
            .sum();
        self.gain[vertex] = self.graph.vertex_weights[vertex] - drawn;
        self.queue.insert(vertex, self.gain[vertex]);
    }

    fn apply(&mut self, vertex: usize) {
        let graph = self.graph;
        self.movers.push((vertex as u32, self.drawn.len()));
        self.separation.put(graph, vertex, self.to);
        let first = self.drawn.len();
        for &u in graph.neighbours(vertex) {
            if self.separation.side[u as usize] == 1 - self.to {
                self.separation.put(graph, u as usize, SEPARATOR);
                self.drawn.push(u);
                for &x in graph.neighbours(u as usize) {
                    let x = x as usize;
                    if self.queue.contains(x) {
                        self.gain[x] += graph.vertex_weights[u as usize];
                        self.queue.set(x, self.gain[x]);
                    }
                }
            }
        }
        for i in first..self.drawn.len() {
            self.enqueue(self.drawn[i] as usize);
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
