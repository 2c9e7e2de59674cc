//! Maximum flows in small undirected networks, by blocking flows (Dinitz 1970). Vertices may become sources and sinks
//! while flow is there: it then only grows.

/// What a vertex is to the flow.
pub(super) const INNER: u8 = 0;
pub(super) const SOURCE: u8 = 1;
pub(super) const SINK: u8 = 2;

const ENDS: [u8; 2] = [SOURCE, SINK];
const UNREACHED: u32 = u32::MAX;

/// A network under construction and its flow. Two vertices after those of the caller stand for all that lies outside.
#[derive(Default)]
pub(super) struct Network {
    count: usize,
    /// (end, end, capacity both ways) until built.
    edges: Vec<(u32, u32, u32)>,
    /// Arcs of vertex v: `arcs[first[v]..first[v + 1]]`.
    first: Vec<u32>,
    arcs: Vec<Arc>,
    kind: Vec<u8>,
    flow: i64,
    /// From which end flow is sought next, 0 or 1 as in `ENDS`, and the vertices that are new there.
    side: usize,
    roots: Vec<u32>,
    /// What the sources reach through capacity that is left, and what reaches the sinks.
    reached: [Vec<bool>; 2],
    level: Vec<u32>,
    next: Vec<u32>,
    queue: Vec<u32>,
    path: Vec<u32>,
}

#[derive(Clone, Copy, Default)]
struct Arc {
    head: u32,
    /// Position of the opposite arc.
    twin: u32,
    /// Up to twice a weight, when all flow goes the other way.
    residual: u32,
}

impl Network {
    /// Begins anew with `count` vertices and no edges.
    pub(super) fn clear(&mut self, count: usize) {
        self.count = count;
        self.edges.clear();
        self.kind.clear();
        self.kind.resize(count, INNER);
        self.kind.extend(ENDS);
        self.flow = 0;
        self.side = 0;
        self.roots.clear();
        self.roots.push(count as u32);
    }

    pub(super) fn add_edge(&mut self, a: usize, b: usize, capacity: i32) {
        self.edges.push((a as u32, b as u32, capacity.unsigned_abs()));
    }

    /// Joins a vertex to the source or the sink outside.
    pub(super) fn add_terminal(&mut self, vertex: usize, end: u8, capacity: i32) {
        let outside = self.count + usize::from(end == SINK);
        self.edges
            .push((vertex as u32, outside as u32, capacity.unsigned_abs()));
    }

    /// Makes the arcs of all edges added.
    pub(super) fn build(&mut self) {
        let count = self.count + 2;
        self.first.clear();
        self.first.resize(count + 1, 0);
        for &(a, b, _) in &self.edges {
            self.first[a as usize + 1] += 1;
            self.first[b as usize + 1] += 1;
        }
        for v in 0..count {
            self.first[v + 1] += self.first[v];
        }
        self.next.clear();
        self.next.extend_from_slice(&self.first[..count]);
        self.level.resize(count, UNREACHED);
        self.arcs.clear();
        self.arcs.resize(2 * self.edges.len(), Arc::default());
        for &(a, b, residual) in &self.edges {
            let (there, back) = (self.next[a as usize], self.next[b as usize]);
            self.next[a as usize] += 1;
            self.next[b as usize] += 1;
            self.arcs[there as usize] = Arc {
                head: b,
                twin: back,
                residual,
            };
            self.arcs[back as usize] = Arc {
                head: a,
                twin: there,
                residual,
            };
        }
    }

    /// Lets all flow pass that can, or more than `enough`; answers with the flow. Unless that is more than enough, what
    /// the ends reach is known then.
    ///
    /// Paths are sought from what is new at one end: what was there before has sent all that it could.
    pub(super) fn augment(&mut self, enough: i64) -> i64 {
        while self.flow <= enough {
            if !self.find_levels() {
                self.find_reached();
                break;
            }
            self.next.copy_from_slice(&self.first[..self.count + 2]);
            for i in 0..self.roots.len() {
                self.block(self.roots[i]);
            }
        }
        self.flow
    }

    /// After the levels were found that do not lead to the other end.
    fn find_reached(&mut self) {
        let (side, other) = (self.side, 1 - self.side);
        let ends = self.kind.iter().zip(&self.level);
        self.reached[side].clear();
        self.reached[side].extend(ends.map(|(&kind, &level)| kind == ENDS[side] || level != UNREACHED));
        self.queue.clear();
        self.queue
            .extend((0..self.kind.len() as u32).filter(|&v| self.kind[v as usize] == ENDS[other]));
        self.reached[other].clear();
        self.reached[other].extend(self.kind.iter().map(|&kind| kind == ENDS[other]));
        self.reach(other);
    }

    /// What can still pass along an arc, or against it on the way from the sinks.
    fn residual(&self, arc: Arc) -> u32 {
        if self.side == 0 {
            arc.residual
        } else {
            self.arcs[arc.twin as usize].residual
        }
    }

    /// Breadth-first distances from the roots through what capacity is left; false when the other end is not reached.
    fn find_levels(&mut self) -> bool {
        let [own, other] = [ENDS[self.side], ENDS[1 - self.side]];
        self.level.fill(UNREACHED);
        self.queue.clear();
        for &v in &self.roots {
            self.level[v as usize] = 0;
            self.queue.push(v);
        }
        let mut next = 0;
        let mut last = UNREACHED;
        while let Some(&v) = self.queue.get(next) {
            next += 1;
            let level = self.level[v as usize] + 1;
            if level > last {
                break;
            }
            for arc in self.row(v) {
                let arc = self.arcs[arc];
                let (head, kind) = (arc.head as usize, self.kind[arc.head as usize]);
                if self.level[head] == UNREACHED && kind != own && self.residual(arc) > 0 {
                    self.level[head] = level;
                    if kind == other {
                        last = level;
                    }
                    self.queue.push(arc.head);
                }
            }
        }
        last != UNREACHED
    }

    /// Sends flow along shortest paths from one root until each is blocked.
    fn block(&mut self, root: u32) {
        let other = ENDS[1 - self.side];
        self.path.clear();
        let mut v = root;
        loop {
            if self.kind[v as usize] == other {
                let residuals = self
                    .path
                    .iter()
                    .map(|&arc| self.residual(self.arcs[arc as usize]));
                let bottleneck = residuals.min().unwrap_or(0);
                self.flow += i64::from(bottleneck);
                let mut keep = self.path.len();
                for (i, &arc) in self.path.iter().enumerate().rev() {
                    let twin = self.arcs[arc as usize].twin;
                    let (with, against) = if self.side == 0 { (arc, twin) } else { (twin, arc) };
                    self.arcs[with as usize].residual -= bottleneck;
                    self.arcs[against as usize].residual += bottleneck;
                    if self.arcs[with as usize].residual == 0 {
                        keep = i;
                    }
                }
                v = self.tail(self.path[keep]);
                self.path.truncate(keep);
            } else if let Some(arc) = self.advance(v) {
                self.path.push(arc);
                v = self.arcs[arc as usize].head;
            } else {
                let Some(arc) = self.path.pop() else { return };
                v = self.tail(arc);
                self.next[v as usize] += 1;
            }
        }
    }

    /// The next arc to the following level that has capacity left.
    fn advance(&mut self, v: u32) -> Option<u32> {
        let end = self.first[v as usize + 1];
        let following = self.level[v as usize] + 1;
        while self.next[v as usize] < end {
            let at = self.next[v as usize];
            let arc = self.arcs[at as usize];
            if self.level[arc.head as usize] == following && self.residual(arc) > 0 {
                return Some(at);
            }
            self.next[v as usize] += 1;
        }
        None
    }

    fn tail(&self, arc: u32) -> u32 {
        self.arcs[self.arcs[arc as usize].twin as usize].head
    }

    fn row(&self, v: u32) -> std::ops::Range<usize> {
        self.first[v as usize] as usize..self.first[v as usize + 1] as usize
    }

    /// Extends what the end of a side reaches from the vertices in the queue, which it does.
    fn reach(&mut self, side: usize) {
        while let Some(v) = self.queue.pop() {
            for arc in self.row(v) {
                let arc = self.arcs[arc];
                let through = if side == 0 {
                    arc
                } else {
                    self.arcs[arc.twin as usize]
                };
                if through.residual > 0
                    && !std::mem::replace(&mut self.reached[side][arc.head as usize], true)
                {
                    self.queue.push(arc.head);
                }
            }
        }
    }

    /// For each of the caller's vertices whether the source (side 0) reaches it, or it the sink.
    pub(super) fn reached(&self, side: usize) -> &[bool] {
        &self.reached[side][..self.count]
    }

    /// The vertices next to what the end of a side reaches that are not at the other end.
    pub(super) fn beside(&self, side: usize) -> impl Iterator<Item = usize> + '_ {
        let (reached, other) = (&self.reached[side], ENDS[1 - side]);
        (0..self.count).filter(move |&v| {
            !reached[v]
                && self.kind[v] != other
                && self
                    .row(v as u32)
                    .any(|arc| reached[self.arcs[arc].head as usize])
        })
    }

    /// Makes an end of all that it reaches and of more vertices. Whether more flow can pass then.
    pub(super) fn widen(&mut self, side: usize, vertices: impl Iterator<Item = usize>) -> bool {
        for v in 0..self.count {
            if self.reached[side][v] {
                self.kind[v] = ENDS[side];
            }
        }
        self.side = side;
        self.roots.clear();
        let mut passes = false;
        for v in vertices {
            self.kind[v] = ENDS[side];
            passes |= self.reached[1 - side][v];
            self.reached[side][v] = true;
            self.roots.push(v as u32);
        }
        self.queue.clone_from(&self.roots);
        self.reach(side);
        passes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    /// The least capacity of a set of edges that parts the ends, over all divisions of the inner vertices.
    fn least_cut(count: usize, edges: &[(usize, usize, i32)]) -> i64 {
        (0..1u32 << count)
            .map(|mask| {
                // The source outside is on side 1, the sink on side 0.
                let side = |v: usize| {
                    if v < count {
                        mask >> v & 1
                    } else {
                        u32::from(v == count)
                    }
                };
                let cut = edges.iter().filter(|(a, b, _)| side(*a) != side(*b));
                cut.map(|edge| i64::from(edge.2)).sum()
            })
            .min()
            .unwrap_or(0)
    }

    #[test]
    fn the_greatest_flow_is_the_least_cut_and_both_ends_reach_up_to_one() {
        let mut rng = Rng::new(11);
        for _ in 0..200 {
            let count = 2 + rng.below(7);
            let mut network = Network::default();
            network.clear(count);
            let mut edges = Vec::new();
            for _ in 0..3 * count {
                let (a, b, capacity) = (rng.below(count), rng.below(count), 1 + rng.below(4) as i32);
                if a != b {
                    network.add_edge(a, b, capacity);
                    edges.push((a, b, capacity));
                }
            }
            for (end, outside) in [(SOURCE, count), (SINK, count + 1)] {
                let v = rng.below(count);
                network.add_terminal(v, end, 5);
                edges.push((v, outside, 5));
            }
            network.build();
            let flow = network.augment(i64::MAX - 1);
            assert_eq!(flow, least_cut(count, &edges));
            for end in 0..2 {
                let on_first = |v: usize| network.reached(end)[v] == (end == 0);
                let side = |v: usize| if v < count { on_first(v) } else { v == count };
                let cut = edges.iter().filter(|(a, b, _)| side(*a) != side(*b));
                assert_eq!(cut.map(|edge| i64::from(edge.2)).sum::<i64>(), flow);
            }
        }
    }

    #[test]
    fn flow_grows_when_vertices_become_terminals() {
        // A path of widening capacity: 1, 2, 3.
        let mut network = Network::default();
        network.clear(2);
        network.add_terminal(0, SOURCE, 1);
        network.add_edge(0, 1, 2);
        network.add_terminal(1, SINK, 3);
        network.build();
        assert_eq!(network.augment(100), 1);
        assert_eq!(network.beside(0).collect::<Vec<_>>(), [0]);
        assert!(network.widen(0, [0].into_iter()));
        assert_eq!(network.augment(100), 2);
        assert!(network.widen(0, [1].into_iter()));
        assert_eq!(network.augment(100), 3);
    }

    #[test]
    fn an_edge_of_the_greatest_weight_carries_it_all_both_ways() {
        let mut network = Network::default();
        network.clear(2);
        network.add_terminal(0, SOURCE, i32::MAX);
        network.add_edge(1, 0, i32::MAX);
        network.add_terminal(1, SINK, i32::MAX);
        network.build();
        assert_eq!(network.augment(i64::MAX - 1), i64::from(i32::MAX));
    }
}
