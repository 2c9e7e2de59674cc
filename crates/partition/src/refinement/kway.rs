//! The state that all k-way refinement shares: parts, their weights, and the best move of a vertex.

use std::ops::Range;

use crate::Graph;

/// A division of a graph into k parts under refinement.
pub(crate) struct KWay<'a> {
    pub(crate) graph: &'a Graph,
    pub(crate) part: Vec<u32>,
    pub(crate) weight: Vec<i64>,
    pub(crate) limits: &'a [i64],
    /// The parts among which vertices move; the others stand still.
    pub(crate) movable: Range<u32>,
    /// Weight of the edges from the vertex under inspection to each part; zero outside of a call.
    connection: Vec<i32>,
    /// Parts with a connection.
    touched: Vec<u32>,
}

/// A vertex' best move: external less internal edge weight, and where to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Move {
    pub(crate) gain: i32,
    pub(crate) to: u32,
}

/// Edge weights from a vertex to parts.
pub(super) struct Connections {
    /// To its own part.
    pub(super) internal: i32,
    /// The greatest to another part that was admissible, and this part.
    pub(super) best: Option<(i32, u32)>,
    pub(super) other_parts: usize,
}

impl<'a> KWay<'a> {
    pub(crate) fn new(graph: &'a Graph, part: Vec<u32>, limits: &'a [i64]) -> Self {
        let parts = limits.len();
        let mut weight = vec![0; parts];
        for (v, &p) in part.iter().enumerate() {
            weight[p as usize] += i64::from(graph.vertex_weights[v]);
        }
        Self {
            graph,
            part,
            weight,
            limits,
            movable: 0..parts as u32,
            connection: vec![0; parts],
            touched: Vec::new(),
        }
    }

    /// The same division, in which only vertices of the given parts move, and among these parts only.
    pub(crate) fn among(&self, movable: Range<u32>) -> Self {
        Self {
            graph: self.graph,
            part: self.part.clone(),
            weight: self.weight.clone(),
            limits: self.limits,
            movable,
            connection: vec![0; self.limits.len()],
            touched: Vec::new(),
        }
    }

    /// Whether the vertex may move at all.
    pub(crate) fn may_move(&self, vertex: usize) -> bool {
        self.movable.contains(&self.part[vertex])
    }

    /// Weight above the limits.
    pub(crate) fn excess(&self) -> i64 {
        self.weight
            .iter()
            .zip(self.limits)
            .map(|(w, limit)| (w - limit).max(0))
            .sum()
    }

    pub(crate) fn is_overweight(&self, part: u32) -> bool {
        self.weight[part as usize] > self.limits[part as usize]
    }

    pub(crate) fn on_boundary(&self, vertex: usize) -> bool {
        let own = self.part[vertex];
        self.graph
            .neighbours(vertex)
            .iter()
            .any(|&u| self.part[u as usize] != own)
    }

    /// All vertices with a neighbour in another part, ascending.
    pub(crate) fn boundary(&self) -> Vec<u32> {
        let vertices = 0..self.graph.vertex_count() as u32;
        vertices.filter(|&v| self.on_boundary(v as usize)).collect()
    }

    /// Brings the list of all boundary vertices up to date after some have moved.
    pub(crate) fn update_boundary(&self, boundary: &mut Vec<u32>, moved: &[u32]) {
        for &v in moved {
            boundary.push(v);
            boundary.extend(self.graph.neighbours(v as usize));
        }
        boundary.sort_unstable();
        boundary.dedup();
        boundary.retain(|&v| self.on_boundary(v as usize));
    }

    /// The neighbouring part of greatest gain that has room; of equals the one with most room.
    pub(crate) fn best_move(&mut self, vertex: usize) -> Option<Move> {
        self.best_move_where(vertex, |state, to| state.has_room(to, vertex))
    }

    /// Whether the vertex fits into a part within the part's limit.
    pub(crate) fn has_room(&self, part: u32, vertex: usize) -> bool {
        let weight = i64::from(self.graph.vertex_weights[vertex]);
        self.weight[part as usize] + weight <= self.limits[part as usize]
    }

    /// The neighbouring part of greatest gain among those that `admissible` lets pass.
    pub(crate) fn best_move_where(
        &mut self,
        vertex: usize,
        admissible: impl Fn(&Self, u32) -> bool,
    ) -> Option<Move> {
        let Connections { internal, best, .. } = self.connections(vertex, admissible);
        best.map(|(external, to)| Move {
            gain: external - internal,
            to,
        })
    }

    /// The edges from a vertex to the movable parts; of equal parts the one with most room is the best.
    pub(super) fn connections(
        &mut self,
        vertex: usize,
        admissible: impl Fn(&Self, u32) -> bool,
    ) -> Connections {
        let own = self.part[vertex];
        let mut internal = 0;
        for (u, weight) in self.graph.edges(vertex) {
            let part = self.part[u];
            if part == own {
                internal += weight;
            } else if self.movable.contains(&part) {
                let connection = &mut self.connection[part as usize];
                if *connection == 0 {
                    self.touched.push(part);
                }
                *connection += weight;
            }
        }
        let mut best: Option<(i32, i64, u32)> = None;
        for i in 0..self.touched.len() {
            let to = self.touched[i];
            let connection = std::mem::take(&mut self.connection[to as usize]);
            let room = self.limits[to as usize] - self.weight[to as usize];
            if best.is_none_or(|(c, r, _)| (connection, room) > (c, r)) && admissible(self, to) {
                best = Some((connection, room, to));
            }
        }
        let other_parts = self.touched.len();
        self.touched.clear();
        Connections {
            internal,
            best: best.map(|(connection, _, to)| (connection, to)),
            other_parts,
        }
    }

    pub(crate) fn apply(&mut self, vertex: usize, to: u32) {
        let from = std::mem::replace(&mut self.part[vertex], to);
        let weight = i64::from(self.graph.vertex_weights[vertex]);
        self.weight[from as usize] -= weight;
        self.weight[to as usize] += weight;
    }
}

/// Total weight of the edges between parts.
pub(crate) fn cut(graph: &Graph, part: &[u32]) -> i64 {
    let mut twice = 0;
    for v in 0..graph.vertex_count() {
        let own = part[v];
        for (u, weight) in graph.edges(v) {
            if part[u] != own {
                twice += i64::from(weight);
            }
        }
    }
    twice / 2
}
