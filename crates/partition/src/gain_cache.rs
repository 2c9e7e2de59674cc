//! What each boundary vertex is tied to, kept up to date while vertices move and restored exactly when moves are taken
//! back, so that a local search seldom has to look at neighbours of neighbours.

use crate::kway::KWay;

/// No part.
pub(crate) const NONE: u32 = u32::MAX;

/// Edge weights from a vertex to its own part and to the part, of the others, that it is tied to most.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Ties {
    pub(crate) internal: i32,
    pub(crate) external: i32,
    /// The part of `external`, or [`NONE`] inside a part.
    pub(crate) to: u32,
    state: State,
    /// Counts how often all was forgotten before.
    age: u16,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    /// Never asked for; no neighbour has moved in the present search.
    #[default]
    Unknown,
    /// Lost by a move.
    Stale,
    /// Tied to at most one other part.
    Single,
    /// Perhaps tied to several other parts.
    Several,
}

impl Ties {
    pub(crate) fn new(internal: i32, external: i32, to: u32, parts: usize) -> Self {
        Self {
            internal,
            external,
            to,
            state: if parts > 1 { State::Several } else { State::Single },
            age: 0,
        }
    }

    pub(crate) fn gain(&self) -> i32 {
        self.external - self.internal
    }

    /// The ties of a vertex of part `own` after a neighbour at weight `w` went from part `a` to part `b`.
    /// They are lost where another part may have become the strongest.
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

    const STALE: Self = Self {
        internal: 0,
        external: 0,
        to: NONE,
        state: State::Stale,
        age: 0,
    };
}

/// The ties of all vertices that were asked for, with a journal of changes.
pub(crate) struct GainCache {
    ties: Vec<Ties>,
    age: u16,
    journal: Vec<(u32, Ties)>,
}

impl GainCache {
    pub(crate) fn new(count: usize) -> Self {
        Self {
            ties: vec![Ties::default(); count],
            age: 0,
            journal: Vec::new(),
        }
    }

    /// Forgets all ties, as the division has changed without the cache.
    pub(crate) fn forget(&mut self) {
        self.age = self.age.checked_add(1).unwrap_or_else(|| {
            self.ties.fill(Ties::default());
            0
        });
    }

    /// A point to which [`GainCache::restore`] can go back.
    pub(crate) fn now(&self) -> usize {
        self.journal.len()
    }

    /// Forgets how to go back.
    pub(crate) fn commit(&mut self) {
        self.journal.clear();
    }

    /// Takes back all changes since `time`; the caller has taken back the moves.
    pub(crate) fn restore(&mut self, time: usize) {
        for (vertex, ties) in self.journal.drain(time..).rev() {
            self.ties[vertex as usize] = ties;
        }
    }

    pub(crate) fn of(&mut self, state: &mut KWay<'_>, vertex: usize) -> Ties {
        match self.known(vertex) {
            State::Unknown => self.find_out(state, vertex),
            State::Stale => {
                let ties = state.ties(vertex);
                self.set(vertex, ties);
            }
            State::Single | State::Several => {}
        }
        self.ties[vertex]
    }

    fn known(&self, vertex: usize) -> State {
        let ties = &self.ties[vertex];
        if ties.age == self.age {
            ties.state
        } else {
            State::Unknown
        }
    }

    fn find_out(&mut self, state: &mut KWay<'_>, vertex: usize) {
        self.ties[vertex] = Ties {
            age: self.age,
            ..state.ties(vertex)
        };
    }

    /// Moves a vertex and updates what its neighbours are tied to. What was unknown is found out before the move: it
    /// then outlives the taking back of the move.
    pub(crate) fn apply(&mut self, state: &mut KWay<'_>, vertex: usize, to: u32) {
        let (graph, from) = (state.graph, state.part[vertex]);
        for (u, weight) in graph.edges(vertex) {
            if !state.may_move(u) {
                continue;
            }
            if self.known(u) == State::Unknown {
                self.find_out(state, u);
            }
            if self.ties[u].state != State::Stale {
                let ties = self.ties[u].after(state.part[u], from, to, weight);
                self.set(u, ties);
            }
        }
        state.apply(vertex, to);
        self.set(vertex, Ties::STALE);
    }

    fn set(&mut self, vertex: usize, ties: Ties) {
        let ties = Ties {
            age: self.age,
            ..ties
        };
        self.journal
            .push((vertex as u32, std::mem::replace(&mut self.ties[vertex], ties)));
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
    fn ties_kept_up_to_date_equal_ties_found_afresh_also_after_moves_are_taken_back() {
        let mut rng = Rng::new(3);
        for _ in 0..200 {
            let graph = random_graph(&mut rng);
            let limits = [1000; 4];
            let part = (0..30).map(|_| rng.below(4) as u32).collect();
            let mut state = KWay::new(&graph, part, &limits);
            let mut cache = GainCache::new(30);
            let check = |cache: &mut GainCache, state: &mut KWay<'_>| {
                for v in 0..30 {
                    let (kept, fresh) = (cache.of(state, v), state.ties(v));
                    assert_eq!((kept.internal, kept.external), (fresh.internal, fresh.external));
                    assert_eq!(kept.to == NONE, fresh.to == NONE);
                }
            };
            for _ in 0..15 {
                cache.of(&mut state, rng.below(30));
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
