//! Bringing overweight parts back under their limits at the least cost in cut.

use job::{Job, JobError};

use super::kway::{KWay, Move};
use crate::buckets::GainBuckets;

/// Moves vertices out of overweight parts, best gain first: to neighbouring parts with room, then through neighbours
/// that are less overloaded, and last to any part with room.
pub(crate) fn rebalance(state: &mut KWay<'_>, job: &Job) -> Result<(), JobError> {
    if state.excess() > 0 {
        pass_on(state, &mut |_, _| true, job)?;
    }
    if state.excess() > 0 {
        send_anywhere(state);
    }
    Ok(())
}

/// Times that a vertex moves at most, and times per part that a full part is opened to pass weight on. Both bound a
/// cascade that might go round in a circle; from 1 to 50, and from 0 to 50, they change no cut.
const MAX_MOVES: u8 = 3;
const MAX_OPENED: usize = 4;

/// The first two of these steps, for vertices that `may_leave` their part.
pub(super) fn pass_on(
    state: &mut KWay<'_>,
    may_leave: &mut impl FnMut(&KWay<'_>, usize) -> bool,
    job: &Job,
) -> Result<(), JobError> {
    let graph = state.graph;
    let count = graph.vertex_count();
    let mut queue = GainBuckets::new(count, graph.max_weighted_degree());
    let mut moves = vec![0u8; count];
    let mut to_open = MAX_OPENED * state.limits.len();
    for v in 0..count {
        if state.is_overweight(state.part[v]) {
            enqueue(state, &mut queue, v);
        }
    }
    while let Some(v) = queue.pop() {
        job.go_on()?;
        if !state.is_overweight(state.part[v]) || moves[v] == MAX_MOVES || !may_leave(state, v) {
            continue;
        }
        let Some(step) = relief(state, v) else { continue };
        state.apply(v, step.to);
        moves[v] += 1;
        if state.is_overweight(step.to) && to_open > 0 {
            to_open -= 1;
            let members: Vec<usize> = (0..count).filter(|&u| state.part[u] == step.to).collect();
            members.into_iter().for_each(|u| enqueue(state, &mut queue, u));
        }
        for &u in graph.neighbours(v) {
            if state.is_overweight(state.part[u as usize]) {
                enqueue(state, &mut queue, u as usize);
            }
        }
    }
    Ok(())
}

fn enqueue(state: &mut KWay<'_>, queue: &mut GainBuckets, vertex: usize) {
    match relief(state, vertex) {
        Some(step) => queue.set(vertex, step.gain),
        None => queue.remove(vertex),
    }
}

/// The best move that lowers the load of the heavier of the two parts.
fn relief(state: &mut KWay<'_>, vertex: usize) -> Option<Move> {
    let weight = i64::from(state.graph.vertex_weights[vertex]);
    if weight == 0 {
        return None;
    }
    let from = state.part[vertex] as usize;
    state.best_move(vertex).or_else(|| {
        state.best_move_where(vertex, |s, to| {
            let over = |part: usize, change: i64| s.weight[part] + change - s.limits[part];
            over(to as usize, weight) < over(from, 0)
        })
    })
}

/// First fit by falling weight, so that small vertices fill what large ones leave.
fn send_anywhere(state: &mut KWay<'_>) {
    let mut heavy: Vec<u32> = (0..state.graph.vertex_count() as u32)
        .filter(|&v| {
            state.is_overweight(state.part[v as usize]) && state.graph.vertex_weights[v as usize] > 0
        })
        .collect();
    heavy.sort_by_key(|&v| (std::cmp::Reverse(state.graph.vertex_weights[v as usize]), v));
    for v in heavy {
        let v = v as usize;
        let (from, weight) = (state.part[v] as usize, i64::from(state.graph.vertex_weights[v]));
        let room = |part: &usize| state.limits[*part] - state.weight[*part];
        let roomiest = (0..state.weight.len()).max_by_key(|part| (room(part), std::cmp::Reverse(*part)));
        if let Some(to) = roomiest
            && state.is_overweight(from as u32)
            && to != from
            && -room(&from) > weight - room(&to)
        {
            state.apply(v, to as u32);
        }
    }
}
