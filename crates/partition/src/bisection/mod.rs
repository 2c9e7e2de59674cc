//! Multilevel bisection and, by halving halves, recursive bisection.

mod growth;
mod two_way;

use job::{Job, JobError};

use crate::Graph;
use crate::coarsening::Hierarchy;
use crate::options::Balance;
use crate::rng::Rng;
use growth::best_grown;
use two_way::{Bisection, TwoWay};

/// Size of the graph on which first bisections are grown, as in METIS (`ometis.c` bisects from 100 at most).
const COARSEST: usize = 100;

/// How hard bisections are searched.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BisectionSearch {
    /// Grown bisections on the coarsest graph.
    pub(crate) tries: usize,
    /// Whole multilevel cycles, the best kept.
    pub(crate) cycles: usize,
    /// Passes of two-way refinement on every level.
    pub(crate) passes: usize,
}

/// Two sides of weights near `targets` and within `limits` if that can be had: the best of several cycles.
fn bisect(
    graph: &Graph,
    targets: [f64; 2],
    limits: [i64; 2],
    search: &BisectionSearch,
    job: &Job,
    rng: &Rng,
) -> Result<Bisection, JobError> {
    let cycle = |i: usize| {
        let rng = &mut rng.fork(1000 + i as u64);
        bisect_once(graph, targets, limits, search, job, rng)
    };
    let cycles = job.map(search.cycles.max(1), 1, cycle)?;
    let cycles: Vec<Bisection> = cycles.into_iter().collect::<Result<_, _>>()?;
    let best = cycles
        .into_iter()
        .min_by_key(|state| (state.excess(limits), state.cut));
    Ok(best.unwrap_or_else(|| Bisection::one_sided(graph)))
}

fn bisect_once(
    graph: &Graph,
    targets: [f64; 2],
    limits: [i64; 2],
    search: &BisectionSearch,
    job: &Job,
    rng: &mut Rng,
) -> Result<Bisection, JobError> {
    let hierarchy = Hierarchy::of(graph, COARSEST, &[], job, rng)?;
    let mut state = best_grown(hierarchy.coarsest(), targets[0], limits, search.tries, rng);
    for depth in (0..hierarchy.depth()).rev() {
        job.go_on()?;
        let fine = hierarchy.graph(depth);
        state.side = hierarchy.prolong(&state.side, depth);
        TwoWay::new(fine).refine(&mut state, limits, search.passes, patience(fine), rng);
    }
    Ok(state)
}

/// Moves without success after which a pass of two-way refinement ends (METIS, `fm.c`, where vertices have several weights).
fn patience(graph: &Graph) -> usize {
    (graph.vertex_count() / 100).clamp(25, 150)
}

/// Parts of the graph by halving halves; `balance` holds for all parts together.
pub(crate) fn recursive_bisection(
    graph: &Graph,
    balance: &Balance,
    search: &BisectionSearch,
    job: &Job,
    rng: &Rng,
) -> Result<Vec<u32>, JobError> {
    let parts = balance.parts();
    if parts == 1 {
        return Ok(vec![0; graph.vertex_count()]);
    }
    let half = parts / 2;
    let (targets, limits) = halves(graph, balance, half);
    let state = bisect(graph, targets, limits, search, job, rng)?;
    let side = |s: u8, parts: std::ops::Range<usize>| {
        let part = Balance {
            targets: balance.targets[parts.clone()].to_vec(),
            limits: balance.limits[parts].to_vec(),
        };
        let (subgraph, vertices) = induced(graph, &state.side, s);
        let rng = rng.fork(1 + u64::from(s));
        recursive_bisection(&subgraph, &part, search, job, &rng).map(|parts| (parts, vertices))
    };
    let (left, right) = job.join(|| side(0, 0..half), || side(1, half..parts))?;
    let mut part_of = vec![0; graph.vertex_count()];
    for ((parts, vertices), first) in [(left?, 0), (right?, half as u32)] {
        for (part, v) in parts.into_iter().zip(vertices) {
            part_of[v as usize] = first + part;
        }
    }
    Ok(part_of)
}

/// Targets and limits of a bisection after which the slack that is left still suffices for the bisections below:
/// each of the ⌈log2 k⌉ levels may use an equal share of it (after Schlag et al. 2016).
fn halves(graph: &Graph, balance: &Balance, half: usize) -> ([f64; 2], [i64; 2]) {
    let total = graph.total_vertex_weight() as f64;
    let sum = |values: &[f64]| values.iter().sum::<f64>();
    let wanted = sum(&balance.targets).max(f64::MIN_POSITIVE);
    let depth = f64::from(balance.parts().next_power_of_two().trailing_zeros());
    let allowed = balance.limits.iter().sum::<i64>() as f64;
    let slack = 1.0 + (allowed / total.max(1.0) - 1.0).max(0.0) / depth;
    let targets = [&balance.targets[..half], &balance.targets[half..]].map(|t| sum(t) / wanted * total);
    let limits = [0, 1].map(|s| ((slack * targets[s]).floor() as i64).max(targets[s].ceil() as i64));
    (targets, limits)
}

/// The subgraph of one side and the vertices it was made of.
fn induced(graph: &Graph, side: &[u8], wanted: u8) -> (Graph, Vec<u32>) {
    let vertices: Vec<u32> = (0..side.len() as u32)
        .filter(|&v| side[v as usize] == wanted)
        .collect();
    let mut number = vec![0u32; side.len()];
    for (i, &v) in vertices.iter().enumerate() {
        number[v as usize] = i as u32;
    }
    let mut offsets = Vec::with_capacity(vertices.len() + 1);
    let (mut neighbours, mut edge_weights) = (Vec::new(), Vec::new());
    offsets.push(0);
    for &v in &vertices {
        for (u, weight) in graph.edges(v as usize).filter(|&(u, _)| side[u] == wanted) {
            neighbours.push(number[u]);
            edge_weights.push(weight);
        }
        offsets.push(neighbours.len());
    }
    let vertex_weights = vertices
        .iter()
        .map(|&v| graph.vertex_weights[v as usize])
        .collect();
    (
        Graph {
            offsets,
            neighbours,
            vertex_weights,
            edge_weights,
        },
        vertices,
    )
}
