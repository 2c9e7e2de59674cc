//! Connected parts: stray pieces join a neighbouring part, and later moves never cut a part in two.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use job::{Job, JobError};

use super::{greedy, kway::KWay, rebalance};
use crate::result::first_connected;
use crate::rng::Rng;

/// Makes every part connected within each component of the graph, whatever becomes of the balance: stray pieces join a
/// neighbouring part.
pub(crate) fn join_stray_pieces(state: &mut KWay<'_>) {
    let pieces = Pieces::of(state);
    if pieces.weight.len() > pieces.main.len() {
        join_strays(state, pieces);
    }
}

/// Joins stray pieces, then restores balance and shortens the border by moves that keep parts connected.
pub(crate) fn make_contiguous(state: &mut KWay<'_>, rng: &mut Rng, job: &Job) -> Result<(), JobError> {
    join_stray_pieces(state);
    let mut guard = Guard::new(state.graph.vertex_count());
    for _ in 0..MAX_ROUNDS {
        let before = state.excess();
        if before == 0 {
            break;
        }
        rebalance::pass_on(state, &mut |state, v| guard.may_leave(state, v), job)?;
        if state.excess() >= before {
            break;
        }
    }
    let mut boundary = state.boundary();
    let mut may_leave = |state: &KWay<'_>, v| guard.may_leave(state, v);
    greedy::refine(state, &mut boundary, MAX_ROUNDS, rng, &mut may_leave, job)
}

/// Rounds after which balance or a shorter border is given up: each round costs one run over the boundary, and a round
/// that gains nothing is the last anyway. With 4 or 16 contiguous cuts differ by 0.03 % at most; with 2, 38 of 52 instead of 34
/// miss an imbalance of 0.1 %.
const MAX_ROUNDS: usize = 8;

/// The connected components of all parts.
struct Pieces {
    /// Piece of each vertex.
    of: Vec<u32>,
    /// (vertex weight, number of vertices) of each piece.
    weight: Vec<(i64, usize)>,
    /// Heaviest piece of each part in each component of the graph, ascending.
    main: Vec<u32>,
}

impl Pieces {
    fn of(state: &KWay<'_>) -> Self {
        let component = first_connected(state.graph, |_, _| true);
        let first = first_connected(state.graph, |u, v| state.part[u] == state.part[v]);
        let (mut of, mut weight, mut firsts) = (Vec::with_capacity(first.len()), Vec::new(), Vec::new());
        for (v, &first) in first.iter().enumerate() {
            let first = first as usize;
            if first == v {
                of.push(weight.len() as u32);
                weight.push((0, 0));
                firsts.push(v);
            } else {
                of.push(of[first]);
            }
            let (sum, size) = &mut weight[of[v] as usize];
            *sum += i64::from(state.graph.vertex_weights[v]);
            *size += 1;
        }
        let rank = |(piece, &v): (u32, &usize)| {
            let heaviest_first = Reverse(weight[piece as usize]);
            (component[v], state.part[v], heaviest_first, piece)
        };
        let mut ranks: Vec<_> = (0..).zip(&firsts).map(rank).collect();
        ranks.sort_unstable();
        ranks.dedup_by_key(|rank| (rank.0, rank.1));
        let mut main: Vec<u32> = ranks.into_iter().map(|rank| rank.3).collect();
        main.sort_unstable();
        Self { of, weight, main }
    }
}

/// Gives each piece that is not its part's main one to the main piece that its edges weigh most to, of those with room
/// if there are any.
/// Pieces enclosed by other strays follow in later rounds.
fn join_strays(state: &mut KWay<'_>, pieces: Pieces) {
    let mut members = vec![Vec::new(); pieces.weight.len()];
    let mut settled = vec![false; pieces.weight.len()];
    pieces
        .main
        .iter()
        .for_each(|&piece| settled[piece as usize] = true);
    for (v, &piece) in pieces.of.iter().enumerate() {
        if !settled[piece as usize] {
            members[piece as usize].push(v);
        }
    }
    let mut waiting: Vec<usize> = (0..settled.len()).filter(|&piece| !settled[piece]).collect();
    waiting.sort_by_key(|&piece| (pieces.weight[piece], piece));
    let mut connection = vec![0i64; state.limits.len()];
    loop {
        let before = waiting.len();
        waiting.retain(|&piece| {
            match strongest_neighbour(state, &pieces, &settled, &members[piece], &mut connection) {
                None => true,
                Some(to) => {
                    members[piece].iter().for_each(|&v| state.apply(v, to));
                    settled[piece] = true;
                    false
                }
            }
        });
        if waiting.len() == before {
            break;
        }
    }
}

fn strongest_neighbour(
    state: &KWay<'_>,
    pieces: &Pieces,
    settled: &[bool],
    members: &[usize],
    connection: &mut [i64],
) -> Option<u32> {
    let weight: i64 = members
        .iter()
        .map(|&v| i64::from(state.graph.vertex_weights[v]))
        .sum();
    let mut parts = Vec::new();
    for &v in members {
        for (u, w) in state.graph.edges(v) {
            if settled[pieces.of[u] as usize] {
                let part = state.part[u];
                if connection[part as usize] == 0 {
                    parts.push(part);
                }
                connection[part as usize] += i64::from(w);
            }
        }
    }
    let fits = |part: u32| state.weight[part as usize] + weight <= state.limits[part as usize];
    let best = parts
        .iter()
        .copied()
        .max_by_key(|&p| (fits(p), connection[p as usize], Reverse(p)));
    parts.iter().for_each(|&part| connection[part as usize] = 0);
    best
}

/// Knows which vertices can leave their part without cutting it in two.
struct Guard {
    seen: Vec<u32>,
    stamp: u32,
    reached: Vec<u32>,
}

/// Vertices that are looked at before a vertex counts as indispensable. On a mesh the neighbours of a vertex that may leave
/// are connected within a few steps; the bound is for vertices that may not, whose whole part would be searched. With 100 or
/// 400 contiguous cuts differ by 0.02 % at most, and time does not; with 20, 38 of 52 instead of 34 miss an imbalance of 0.1 %.
const SEARCH_LIMIT: usize = 200;

impl Guard {
    fn new(count: usize) -> Self {
        Self {
            seen: vec![0; count],
            stamp: 0,
            reached: Vec::new(),
        }
    }

    /// True only when the vertex' neighbours in its part are connected without it, as far as a short search can see.
    fn may_leave(&mut self, state: &KWay<'_>, vertex: usize) -> bool {
        let graph = state.graph;
        let own = |u: &&u32| state.part[**u as usize] == state.part[vertex];
        let Some(&first) = graph.neighbours(vertex).iter().find(own) else {
            return false;
        };
        let mut missing = graph.neighbours(vertex).iter().filter(own).count() - 1;
        if missing == 0 {
            return true;
        }
        self.stamp += 1;
        self.seen[vertex] = self.stamp;
        self.seen[first as usize] = self.stamp;
        self.reached.clear();
        self.reached.push(first);
        let mut next = 0;
        while next < self.reached.len() && self.reached.len() <= SEARCH_LIMIT {
            let v = self.reached[next] as usize;
            next += 1;
            for u in graph.neighbours(v).iter().filter(own) {
                if std::mem::replace(&mut self.seen[*u as usize], self.stamp) != self.stamp {
                    self.reached.push(*u);
                    missing -= usize::from(graph.neighbours(vertex).binary_search(u).is_ok());
                    if missing == 0 {
                        return true;
                    }
                }
            }
        }
        false
    }
}

/// Gives each empty part one vertex of a part that has several, in such an order that connected parts stay connected.
pub(crate) fn fill_empty_parts(state: &mut KWay<'_>) {
    let mut sizes = vec![0usize; state.limits.len()];
    state.part.iter().for_each(|&p| sizes[p as usize] += 1);
    if sizes.iter().all(|&size| size > 0) {
        return;
    }
    let mut members = breadth_first_members(state);
    let mut donors: BinaryHeap<(usize, u32)> = sizes
        .iter()
        .enumerate()
        .map(|(part, &size)| (size, part as u32))
        .collect();
    for empty in (0..sizes.len()).filter(|&part| sizes[part] == 0) {
        let Some((size, donor)) = donors.pop() else { return };
        if size < 2 {
            return;
        }
        if let Some(v) = members[donor as usize].pop() {
            state.apply(v as usize, empty as u32);
        }
        donors.push((size - 1, donor));
    }
}

/// The vertices of each part, every piece in breadth-first order: the last one can always leave.
fn breadth_first_members(state: &KWay<'_>) -> Vec<Vec<u32>> {
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); state.limits.len()];
    let mut seen = vec![false; state.part.len()];
    for root in 0..state.part.len() {
        if std::mem::replace(&mut seen[root], true) {
            continue;
        }
        let list = &mut members[state.part[root] as usize];
        let mut next = list.len();
        list.push(root as u32);
        while let Some(&v) = list.get(next) {
            next += 1;
            for &u in state.graph.neighbours(v as usize) {
                if state.part[u as usize] == state.part[root]
                    && !std::mem::replace(&mut seen[u as usize], true)
                {
                    list.push(u);
                }
            }
        }
    }
    members
}
