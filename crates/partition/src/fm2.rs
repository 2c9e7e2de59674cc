//! Two-way refinement after Fiduccia and Mattheyses (1982): move the vertex of greatest gain, each at most once a pass,
//! go on through losses for a while, and roll back to the best prefix.

use crate::Graph;
use crate::buckets::GainBuckets;
use crate::rng::Rng;

/// The two sides of a graph.
#[derive(Clone, Debug)]
pub(crate) struct Bisection {
    /// 0 or 1 for each vertex.
    pub(crate) side: Vec<u8>,
    pub(crate) weight: [i64; 2],
    pub(crate) cut: i64,
}

impl Bisection {
    /// Everything on side 1.
    pub(crate) fn one_sided(graph: &Graph) -> Self {
        Self {
            side: vec![1; graph.vertex_count()],
            weight: [0, graph.total_vertex_weight()],
            cut: 0,
        }
    }

    /// Weight above the limits.
    pub(crate) fn excess(&self, limits: [i64; 2]) -> i64 {
        (self.weight[0] - limits[0]).max(0) + (self.weight[1] - limits[1]).max(0)
    }

    /// Moves a vertex whose gain is known.
    fn flip(&mut self, vertex: usize, vertex_weight: i32, gain: i32) {
        let from = usize::from(self.side[vertex]);
        self.side[vertex] ^= 1;
        self.weight[from] -= i64::from(vertex_weight);
        self.weight[1 - from] += i64::from(vertex_weight);
        self.cut -= i64::from(gain);
    }

    /// External less internal edge weight.
    pub(crate) fn gain(&self, graph: &Graph, vertex: usize) -> i32 {
        let own = self.side[vertex];
        graph
            .edges(vertex)
            .map(|(u, w)| if self.side[u] == own { -w } else { w })
            .sum()
    }

    fn on_boundary(&self, graph: &Graph, vertex: usize) -> bool {
        graph
            .neighbours(vertex)
            .iter()
            .any(|&u| self.side[u as usize] != self.side[vertex])
    }
}

/// What is compared when the best prefix is sought: excess weight, then cut, then distance from balance.
type Standing = (i64, i64, i64);

/// The state of one pass.
struct Pass<'a> {
    graph: &'a Graph,
    state: &'a mut Bisection,
    limits: [i64; 2],
    queues: [GainBuckets; 2],
    /// Valid for queued vertices.
    gain: Vec<i32>,
    moved: Vec<bool>,
}

/// Refines until a pass finds nothing or `passes` are done; a pass ends `patience` moves after its best state.
pub(crate) fn refine(
    graph: &Graph,
    state: &mut Bisection,
    limits: [i64; 2],
    passes: usize,
    patience: usize,
    rng: &mut Rng,
) {
    let count = graph.vertex_count();
    let max_gain = graph.max_weighted_degree();
    let mut boundary: Vec<u32> = (0..count as u32)
        .filter(|&v| state.on_boundary(graph, v as usize))
        .collect();
    let mut pass = Pass {
        graph,
        state,
        limits,
        queues: [
            GainBuckets::new(count, max_gain),
            GainBuckets::new(count, max_gain),
        ],
        gain: vec![0; count],
        moved: vec![false; count],
    };
    for _ in 0..passes {
        rng.shuffle(&mut boundary);
        let touched = pass.run(&boundary, patience);
        match touched {
            None => return,
            Some(touched) => {
                boundary.extend(touched);
                boundary.sort_unstable();
                boundary.dedup();
                boundary.retain(|&v| pass.state.on_boundary(graph, v as usize));
            }
        }
    }
}

impl Pass<'_> {
    /// The vertices that may be new on the boundary, or nothing when nothing got better.
    fn run(&mut self, boundary: &[u32], patience: usize) -> Option<Vec<u32>> {
        let start = self.standing();
        let mut best = start;
        let mut best_len = 0;
        let mut moves: Vec<u32> = Vec::new();
        if self.state.excess(self.limits) > 0 && boundary.is_empty() {
            self.enqueue_all();
        }
        for &v in boundary {
            self.enqueue(v as usize);
        }
        while let Some(v) = self.next_move() {
            let gain = self.gain[v];
            self.state.flip(v, self.graph.vertex_weights[v], gain);
            self.moved[v] = true;
            moves.push(v as u32);
            self.update_neighbours(v);
            let standing = self.standing();
            if standing < best {
                best = standing;
                best_len = moves.len();
            } else if moves.len() - best_len > patience {
                break;
            }
        }
        self.queues.iter_mut().for_each(GainBuckets::clear);
        for &v in &moves {
            self.moved[v as usize] = false;
        }
        for &v in moves[best_len..].iter().rev() {
            let gain = self.state.gain(self.graph, v as usize);
            self.state
                .flip(v as usize, self.graph.vertex_weights[v as usize], gain);
        }
        moves.truncate(best_len);
        let neighbours = moves.iter().flat_map(|&v| self.graph.neighbours(v as usize));
        let touched = neighbours.chain(&moves).copied().collect();
        ((best.0, best.1) < (start.0, start.1)).then_some(touched)
    }

    fn standing(&self) -> Standing {
        let lean = |side: usize| self.state.weight[side] - self.limits[side];
        (
            self.state.excess(self.limits),
            self.state.cut,
            (lean(0) - lean(1)).abs(),
        )
    }

    fn enqueue(&mut self, v: usize) {
        self.gain[v] = self.state.gain(self.graph, v);
        self.queues[usize::from(self.state.side[v])].set(v, self.gain[v]);
    }

    fn enqueue_all(&mut self) {
        for v in 0..self.graph.vertex_count() {
            self.enqueue(v);
        }
    }

    /// Takes the feasible vertex of greatest gain, or the best of the overweight side.
    fn next_move(&mut self) -> Option<usize> {
        loop {
            let heads = [self.queues[0].peek(), self.queues[1].peek()];
            let overweight = (0..2).find(|&s| self.state.weight[s] > self.limits[s]);
            let from = match (overweight, heads) {
                (Some(side), _) => side,
                (None, [Some(a), Some(b)]) if self.gain[a] == self.gain[b] => {
                    usize::from(self.room(1) < self.room(0))
                }
                (None, [Some(a), Some(b)]) => usize::from(self.gain[b] > self.gain[a]),
                (None, [Some(_), None]) => 0,
                (None, [None, _]) => 1,
            };
            let v = self.queues[from].pop()?;
            let fits = i64::from(self.graph.vertex_weights[v]) <= self.room(1 - from);
            if fits || overweight.is_some() {
                return Some(v);
            }
        }
    }

    fn room(&self, side: usize) -> i64 {
        self.limits[side] - self.state.weight[side]
    }

    fn update_neighbours(&mut self, v: usize) {
        let side = self.state.side[v];
        for (u, weight) in self.graph.edges(v) {
            if self.moved[u] {
                continue;
            }
            let queue = &mut self.queues[usize::from(self.state.side[u])];
            if queue.contains(u) {
                let change = if self.state.side[u] == side {
                    -weight
                } else {
                    weight
                };
                // In two steps: twice a weight may not fit, gains always do.
                self.gain[u] += change;
                self.gain[u] += change;
                queue.set(u, self.gain[u]);
            } else if self.state.side[u] != side {
                self.enqueue(u);
            }
        }
    }
}
