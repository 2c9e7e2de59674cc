//! Greedy k-way refinement: boundary vertices move to the part that their edges weigh most to, while that shortens the
//! border or, at the same length, evens out the weights (Karypis and Kumar 1998b).

use job::{Job, JobError};

use super::kway::KWay;
use crate::rng::Rng;

/// At most `passes` sweeps over the boundary, in random order, with vertices that `may_leave` their part; `boundary` is
/// kept up to date.
pub(super) fn refine(
    state: &mut KWay<'_>,
    boundary: &mut Vec<u32>,
    passes: usize,
    rng: &mut Rng,
    may_leave: &mut impl FnMut(&KWay<'_>, usize) -> bool,
    job: &Job,
) -> Result<(), JobError> {
    for _ in 0..passes {
        job.go_on()?;
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
            break;
        }
        state.update_boundary(boundary, &moved);
    }
    Ok(())
}

/// Whether the target keeps more room after the move than the source had before it.
fn evens_out(state: &KWay<'_>, vertex: usize, to: u32) -> bool {
    let room = |part: u32| state.limits[part as usize] - state.weight[part as usize];
    room(to) - i64::from(state.graph.vertex_weights[vertex]) > room(state.part[vertex])
}
