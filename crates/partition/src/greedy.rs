//! Greedy k-way refinement: boundary vertices move to the part that they are tied to most, while that shortens the
//! border or, at the same length, evens out the weights (Karypis and Kumar 1998b).

use crate::kway::KWay;
use crate::rng::Rng;

/// At most `passes` sweeps over the boundary, in random order, with vertices that `may_leave` their part; `boundary` is
/// kept up to date.
pub(crate) fn refine(
    state: &mut KWay<'_>,
    boundary: &mut Vec<u32>,
    passes: usize,
    rng: &mut Rng,
    may_leave: &mut impl FnMut(&KWay<'_>, usize) -> bool,
) {
    for _ in 0..passes {
        rng.shuffle(boundary);
        let mut moved = Vec::new();
        for i in 0..boundary.len() {
            let v = boundary[i] as usize;
            if let Some(step) = state.best_move(v)
                && (step.gain > 0 || (step.gain == 0 && evens_out(state, v, step.to)))
                && may_leave(state, v)
            {
                state.apply(v, step.to);
                moved.push(v as u32);
            }
        }
        if moved.is_empty() {
            return;
        }
        for v in moved {
            boundary.extend(state.graph.neighbours(v as usize));
        }
        boundary.sort_unstable();
        boundary.dedup();
        boundary.retain(|&v| state.on_boundary(v as usize));
    }
}

/// Whether the target keeps more room after the move than the source had before it.
fn evens_out(state: &KWay<'_>, vertex: usize, to: u32) -> bool {
    let room = |part: u32| state.limits[part as usize] - state.weight[part as usize];
    room(to) - i64::from(state.graph.vertex_weights[vertex]) > room(state.part[vertex])
}
