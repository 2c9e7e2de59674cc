//! Direct k-way partitioning: coarsen, divide the coarsest graph by recursive bisection, refine all parts at once on
//! the way back up (Karypis and Kumar 1998b); then again inside the parts found (iterated multilevel, Walshaw 2004).

use crate::Graph;
use crate::bisect::{BisectionSearch, recursive_bisection};
use crate::coarsen::{Level, coarsen, prolong, restrict};
use crate::kway::{KWay, cut};
use crate::local_search::{self, LocalSearch};
use crate::options::Balance;
use crate::rebalance::rebalance;
use crate::rng::Rng;
use crate::{greedy, options::Effort};

/// What an [`Effort`] means.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// Vertices per part at which coarsening stops.
    pub(crate) coarsest_per_part: usize,
    pub(crate) bisection: BisectionSearch,
    pub(crate) search: LocalSearch,
    pub(crate) fine_search: LocalSearch,
    pub(crate) cycles: usize,
}

fn env(name: &str, default: usize) -> usize {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

impl Plan {
    pub(crate) fn of(effort: Effort) -> Self {
        let _ = effort;
        Self {
            coarsest_per_part: env("CPP", 60),
            bisection: BisectionSearch { tries: env("TRIES", 8), cycles: env("BCYC", 3), passes: env("BPASS", 4) },
            search: LocalSearch { rounds: env("ROUNDS", 3), patience: env("PAT", 25) },
            fine_search: LocalSearch { rounds: env("FROUNDS", 3), patience: env("FPAT", 10) },
            cycles: env("CYC", 0),
        }
    }
}

pub(crate) fn partition(graph: &Graph, balance: &Balance, plan: &Plan, rng: &Rng) -> Vec<u32> {
    if env("RB", 0) == 1 {
        let part = recursive_bisection(graph, balance, &plan.bisection, &rng.fork(7));
        if balance.parts() == 2 { return part; }
        return uncoarsen(graph, &[], part, balance, plan, &mut rng.fork(3));
    }
    let mut best = cycle(graph, balance, plan, None, &mut rng.fork(0));
    for i in 0..plan.cycles {
        let next = cycle(graph, balance, plan, Some(&best), &mut rng.fork(1 + i as u64));
        if cut(graph, &next) <= cut(graph, &best) {
            best = next;
        }
    }
    best
}

/// One multilevel cycle: from scratch, or improving on `previous`, whose cut edges then are never contracted.
fn cycle(graph: &Graph, balance: &Balance, plan: &Plan, previous: Option<&[u32]>, rng: &mut Rng) -> Vec<u32> {
    let parts = balance.parts();
    let size = (plan.coarsest_per_part * parts).max(100);
    let levels = coarsen(graph, size, previous, rng);
    let coarsest = levels.last().map_or(graph, |level| &level.graph);
    let part = match previous {
        None => recursive_bisection(coarsest, balance, &plan.bisection, &rng.fork(7)),
        Some(part) => levels.iter().fold(part.to_vec(), |fine, level| {
            restrict(&fine, &level.coarse_of, level.graph.vertex_count())
        }),
    };
    uncoarsen(graph, &levels, part, balance, plan, rng)
}

/// Carries the partition of the coarsest graph up, refining it on every level.
fn uncoarsen(
    graph: &Graph,
    levels: &[Level],
    mut part: Vec<u32>,
    balance: &Balance,
    plan: &Plan,
    rng: &mut Rng,
) -> Vec<u32> {
    let coarsest = levels.last().map_or(graph, |level| &level.graph);
    let mut boundary: Vec<u32> = (0..coarsest.vertex_count() as u32).collect();
    for depth in (0..=levels.len()).rev() {
        let level_graph = if depth == 0 { graph } else { &levels[depth - 1].graph };
        if depth < levels.len() {
            let coarse_of = &levels[depth].coarse_of;
            let mut near = vec![false; levels[depth].graph.vertex_count()];
            boundary.iter().for_each(|&c| near[c as usize] = true);
            part = prolong(&part, coarse_of);
            boundary = (0..coarse_of.len() as u32).filter(|&v| near[coarse_of[v as usize] as usize]).collect();
        }
        let mut state = KWay::new(level_graph, part, &balance.limits);
        if state.excess() > 0 {
            rebalance(&mut state);
            boundary = (0..level_graph.vertex_count() as u32).collect();
        }
        boundary.retain(|&v| state.on_boundary(v as usize));
        let search = if depth == 0 { plan.fine_search } else { plan.search };
        if depth < env("GREEDYLV", 0) {
            greedy::refine(&mut state, &mut boundary, 4, rng);
        } else {
            local_search::refine(&mut state, &mut boundary, search, rng);
        }
        part = state.part;
    }
    part
}
