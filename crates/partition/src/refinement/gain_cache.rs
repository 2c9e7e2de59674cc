//! The gain entry of each boundary vertex (where its edges lead), kept up to date while vertices move and restored exactly
//! when moves are taken back, so that a local search seldom has to look at neighbours of neighbours.

use super::kway::KWay;

/// No part.
pub(super) const NONE: u32 = u32::MAX;

/// Edge weights from a vertex to its own part, and to the one other part that they are greatest to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct GainEntry {
    pub(super) internal: i32,
    pub(super) external: i32,
    /// The part of `external`, or [`NONE`] inside a part.
    pub(super) to: u32,
    state: State,
    /// The age of the cache in which the entry was made.
    age: u16,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    /// Never asked for; no neighbour has moved in the present search.
    #[default]
    Unknown,
    /// A move has made another part the best, and which is not known.
    Stale,
    /// At most one other part has an edge to the vertex.
    Single,
    /// Several other parts may have.
    Several,
}

impl GainEntry {
    const STALE: Self = Self {
        internal: 0,
        external: 0,
        to: NONE,
        state: State::Stale,
        age: 0,
    };

    /// Reads the edges of a vertex. Most vertices touch one other part at most, which needs no sums by part.
    pub(super) fn of(state: &mut KWay<'_>, vertex: usize) -> Self {
        let own = state.part[vertex];
        let (mut internal, mut external, mut to) = (0, 0, NONE);
        for (u, weight) in state.graph.edges(vertex) {
            let part = state.part[u];
            if part == own {
                internal += weight;
            } else if state.movable.contains(&part) {
                if part != to && to != NONE {
                    return Self::among_several(state, vertex);
                }
                to = part;
                external += weight;
            }
        }
        Self {
            internal,
            external,
            to,
            state: State::Single,
            age: 0,
        }
    }

    fn among_several(state: &mut KWay<'_>, vertex: usize) -> Self {
        let connections = state.connections(vertex, |_, _| true);
        let (external, to) = connections.best.unwrap_or((0, NONE));
        let several = connections.other_parts > 1;
        Self {
            internal: connections.internal,
            external,
            to,
            state: if several { State::Several } else { State::Single },
            age: 0,
        }
    }

    pub(super) fn gain(&self) -> i32 {
        self.external - self.internal
    }

    /// The entry of a vertex of part `own` after a neighbour at weight `w` went from part `a` to part `b`; stale where
    /// another part may be the best now.
    fn after(mut self, own: u32, a: u32, b: u32, w: i32) -> Self {
        let several = self.state == State::Several;
        if own == a {
            self.internal -= w;
        } else if own == b {
            self.internal += w;
        }
        if self.to == NONE {
            // The neighbour left the common part.
            self.to = b;
            self.external = w;
        } else if self.to == b {
            self.external += w;
        } else if own == b && self.to == a && !several {
            self.external -= w;
            if self.external == 0 {
                self.to = NONE;
            }
        } else if own != b || self.to == a {
            return Self::STALE;
        }
        self
    }
}

/// The entries of all vertices that were asked for, with a journal of changes.
pub(super) struct GainCache {
    entries: Vec<GainEntry>,
    /// Entries of another age count as unknown.
    age: u16,
    journal: Vec<(u32, GainEntry)>,
}

impl GainCache {
    pub(super) fn new(count: usize) -> Self {
        Self {
            entries: vec![GainEntry::default(); count],
            age: 0,
            journal: Vec::new(),
        }
    }

    /// Forgets all entries, as the division has changed without the cache.
    pub(super) fn forget(&mut self) {
        self.age = self.age.checked_add(1).unwrap_or_else(|| {
            self.entries.fill(GainEntry::default());
            0
        });
    }

    /// A point to which [`GainCache::restore`] can go back.
    pub(super) fn now(&self) -> usize {
        self.journal.len()
    }

    /// Forgets how to go back.
    pub(super) fn commit(&mut self) {
        self.journal.clear();
    }

    /// Takes back all changes since `time`; the caller has taken back the moves.
    pub(super) fn restore(&mut self, time: usize) {
        for (vertex, entry) in self.journal.drain(time..).rev() {
            self.entries[vertex as usize] = entry;
        }
    }

    pub(super) fn entry(&mut self, state: &mut KWay<'_>, vertex: usize) -> GainEntry {
        match self.known(vertex) {
            State::Unknown => self.find_out(state, vertex),
            State::Stale => {
                let entry = GainEntry::of(state, vertex);
                self.set(vertex, entry);
            }
            State::Single | State::Several => {}
        }
        self.entries[vertex]
    }

    fn known(&self, vertex: usize) -> State {
        let entry = &self.entries[vertex];
        if entry.age == self.age {
            entry.state
        } else {
            State::Unknown
        }
    }

    fn find_out(&mut self, state: &mut KWay<'_>, vertex: usize) {
        self.entries[vertex] = GainEntry {
            age: self.age,
            ..GainEntry::of(state, vertex)
        };
    }

    /// Moves a vertex and updates the entries of its neighbours. Unknown entries are found out before the move: they
    /// then outlive the taking back of the move.
    pub(super) fn apply(&mut self, state: &mut KWay<'_>, vertex: usize, to: u32) {
        let (graph, from) = (state.graph, state.part[vertex]);
        for (u, weight) in graph.edges(vertex) {
            if !state.may_move(u) {
                continue;
            }
            if self.known(u) == State::Unknown {
                self.find_out(state, u);
            }
            if self.entries[u].state != State::Stale {
                let entry = self.entries[u].after(state.part[u], from, to, weight);
                self.set(u, entry);
            }
        }
        state.apply(vertex, to);
        self.set(vertex, GainEntry::STALE);
    }

    fn set(&mut self, vertex: usize, entry: GainEntry) {
        let entry = GainEntry {
            age: self.age,
            ..entry
        };
        let before = std::mem::replace(&mut self.entries[vertex], entry);
        self.journal.push((vertex as u32, before));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Graph;
    use crate::rng::Rng;

    fn random_graph(rng: &mut Rng) -> Graph {
        let edges: Vec<_> = (0..90)
            .map(|_| {
                (
                    rng.below(30) as u32,
                    rng.below(30) as u32,
                    1 + rng.below(5) as i32,
                )
            })
            .collect();
        Graph::from_edges(30, &edges).unwrap()
    }

    #[test]
    fn entries_kept_up_to_date_equal_entries_found_afresh_also_after_moves_are_taken_back() {
        let mut rng = Rng::new(3);
        for _ in 0..200 {
            let graph = random_graph(&mut rng);
            let limits = [1000; 4];
            let part = (0..30).map(|_| rng.below(4) as u32).collect();
            let mut state = KWay::new(&graph, part, &limits);
            let mut cache = GainCache::new(30);
            let check = |cache: &mut GainCache, state: &mut KWay<'_>| {
                for v in 0..30 {
                    let (kept, fresh) = (cache.entry(state, v), GainEntry::of(state, v));
                    assert_eq!((kept.internal, kept.external), (fresh.internal, fresh.external));
                    assert_eq!(kept.to == NONE, fresh.to == NONE);
                }
            };
            for _ in 0..15 {
                cache.entry(&mut state, rng.below(30));
            }
            let (time, before) = (cache.now(), state.part.clone());
            let mut journal = Vec::new();
            for _ in 0..10 {
                let (v, to) = (rng.below(30), rng.below(4) as u32);
                if state.part[v] != to && !journal.iter().any(|&(u, _)| u == v) {
                    journal.push((v, state.part[v]));
                    cache.apply(&mut state, v, to);
                }
            }
            check(&mut cache, &mut state);
            cache.restore(time);
            journal
                .into_iter()
                .rev()
                .for_each(|(v, from)| state.apply(v, from));
            assert_eq!(state.part, before);
            check(&mut cache, &mut state);
        }
    }
}
