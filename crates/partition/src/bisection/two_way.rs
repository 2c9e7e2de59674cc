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

/// Workspace for the refinement of one graph's bisections, one after the other.
pub(crate) struct TwoWay<'a> {
    graph: &'a Graph,
    queues: [GainBuckets; 2],
    /// Valid for queued vertices.
    gain: Vec<i32>,
    moved: Vec<bool>,
    moves: Vec<u32>,
}

impl<'a> TwoWay<'a> {
    pub(crate) fn new(graph: &'a Graph) -> Self {
        let (count, max_gain) = (graph.vertex_count(), graph.max_weighted_degree());
        Self {
            graph,
            queues: [(); 2].map(|()| GainBuckets::new(count, max_gain)),
            gain: vec![0; count],
            moved: vec![false; count],
            moves: Vec::new(),
        }
    }

    /// Refines until a pass finds nothing or `passes` are done; a pass ends `patience` moves after its best state.
    pub(crate) fn refine(
        &mut self,
        state: &mut Bisection,
        limits: [i64; 2],
        passes: usize,
        patience: usize,
        rng: &mut Rng,
    ) {
        let graph = self.graph;
        let mut boundary: Vec<u32> = (0..graph.vertex_count() as u32)
            .filter(|&v| state.on_boundary(graph, v as usize))
            .collect();
        for pass in 1..=passes {
            rng.shuffle(&mut boundary);
            let workspace = &mut *self;
            let better = Pass {
                workspace,
                state,
                limits,
            }
            .run(&boundary, patience);
            if !better || pass == passes {
                return;
            }
            for &v in &self.moves {
                boundary.push(v);
                boundary.extend_from_slice(graph.neighbours(v as usize));
            }
            boundary.sort_unstable();
            boundary.dedup();
            boundary.retain(|&v| state.on_boundary(graph, v as usize));
        }
    }
}

/// The state of one pass.
struct Pass<'r, 'a> {
    workspace: &'r mut TwoWay<'a>,
    state: &'r mut Bisection,
    limits: [i64; 2],
}

impl Pass<'_, '_> {
    /// Whether anything got better; the moves that were kept stay in `workspace.moves`.
    fn run(&mut self, boundary: &[u32], patience: usize) -> bool {
        let graph = self.workspace.graph;
        let start = self.standing();
        let mut best = start;
        let mut best_len = 0;
        self.workspace.moves.clear();
        if self.state.excess(self.limits) > 0 && boundary.is_empty() {
            self.enqueue_all();
        }
        for &v in boundary {
            self.enqueue(v as usize);
        }
        while let Some(v) = self.next_move() {
            let gain = self.workspace.gain[v];
            self.state.flip(v, graph.vertex_weights[v], gain);
            self.workspace.moved[v] = true;
            self.workspace.moves.push(v as u32);
            self.update_neighbours(v);
            let (standing, made) = (self.standing(), self.workspace.moves.len());
            if standing < best {
                best = standing;
                best_len = made;
            } else if made - best_len > patience {
                break;
            }
        }
        self.workspace.queues.iter_mut().for_each(GainBuckets::clear);
        for &v in &self.workspace.moves {
            self.workspace.moved[v as usize] = false;
        }
        for v in self.workspace.moves.drain(best_len..).rev() {
            let v = v as usize;
            let gain = self.state.gain(graph, v);
            self.state.flip(v, graph.vertex_weights[v], gain);
        }
        (best.0, best.1) < (start.0, start.1)
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
        let gain = self.state.gain(self.workspace.graph, v);
        self.workspace.gain[v] = gain;
        self.workspace.queues[usize::from(self.state.side[v])].set(v, gain);
    }

    fn enqueue_all(&mut self) {
        for v in 0..self.workspace.graph.vertex_count() {
            self.enqueue(v);
        }
    }

    /// Takes the feasible vertex of greatest gain, or the best of the overweight side.
    fn next_move(&mut self) -> Option<usize> {
        loop {
            let heads = [self.workspace.queues[0].peek(), self.workspace.queues[1].peek()];
            let overweight = (0..2).find(|&s| self.state.weight[s] > self.limits[s]);
            let from = match (overweight, heads) {
                (Some(side), _) => side,
                (None, [Some(a), Some(b)]) if self.workspace.gain[a] == self.workspace.gain[b] => {
                    usize::from(self.slack(1) < self.slack(0))
                }
                (None, [Some(a), Some(b)]) => usize::from(self.workspace.gain[b] > self.workspace.gain[a]),
                (None, [Some(_), None]) => 0,
                (None, [None, _]) => 1,
            };
            let v = self.workspace.queues[from].pop()?;
            let fits = i64::from(self.workspace.graph.vertex_weights[v]) <= self.slack(1 - from);
            if fits || overweight.is_some() {
                return Some(v);
            }
        }
    }

    fn slack(&self, side: usize) -> i64 {
        self.limits[side] - self.state.weight[side]
    }

    fn update_neighbours(&mut self, v: usize) {
        let side = self.state.side[v];
        let graph = self.workspace.graph;
        for (u, weight) in graph.edges(v) {
            if self.workspace.moved[u] {
                continue;
            }
            let queue = &mut self.workspace.queues[usize::from(self.state.side[u])];
            if queue.contains(u) {
                let change = if self.state.side[u] == side {
                    -weight
                } else {
                    weight
                };
                // In two steps: twice a weight may not fit, gains always do.
                self.workspace.gain[u] += change;
                self.workspace.gain[u] += change;
                queue.set(u, self.workspace.gain[u]);
            } else if self.state.side[u] != side {
                self.enqueue(u);
            }
        }
    }
}
