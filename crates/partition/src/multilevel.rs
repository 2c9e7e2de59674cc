//! Direct k-way partitioning: coarsen, divide the coarsest graph by recursive bisection, refine all parts at once on
//! the way back up (Karypis and Kumar 1998b), by local search and by minimum cuts between pairs of parts. On a graph of
//! middling size this is done several times, and the best candidate is combined with the others (Sanders and Schulz 2012).

use crate::Graph;
use crate::bisect::{BisectionSearch, recursive_bisection};
use crate::coarsen::{Level, coarsen, prolong, restrict};
use crate::contiguity::{fill_empty_parts, join_stray_pieces, make_contiguous};
use crate::flow::{self, FlowSearch};
use crate::kway::{KWay, cut};
use crate::local_search::{LocalSearch, Searches};
use crate::options::{Balance, Effort, Method, Options};
use crate::rebalance::rebalance;
use crate::rng::Rng;
use crate::team::Team;

/// What is done to a partition on every level on its way up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refinement {
    /// On all levels but the finest.
    coarse: LocalSearch,
    pub(crate) finest: LocalSearch,
    coarse_flow: FlowSearch,
    pub(crate) finest_flow: FlowSearch,
}

/// What an [`Effort`] means for a number of parts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plan {
    /// Vertices per part at which coarsening stops.
    coarsest_per_part: usize,
    /// Size of the graph on which candidates are made.
    middle: usize,
    candidates: u64,
    /// How many of the candidates are refined by flows before the best is chosen.
    finalists: usize,
    /// How many of the candidates are combined with the best.
    combinations: u64,
    /// Cycles over the whole graph that start from the result.
    cycles: u64,
    pub(crate) bisection: BisectionSearch,
    /// Of candidates.
    small: Refinement,
    /// Of the partition that is chosen.
    pub(crate) whole: Refinement,
    /// Vertices along all borders above which flows are not sought: each of them costs about as much time as ten vertices
    /// of the graph do otherwise.
    longest_border: usize,
}

impl Plan {
    /// The figures were tuned on the graphs of Walshaw's archive and on surface meshes. Few parts leave the local search
    /// little to exchange: there more candidates pay.
    pub(crate) fn of(effort: Effort, parts: usize) -> Self {
        let few = |for_two, for_four, for_eight, for_more| match parts {
            0..=2 => for_two,
            3..=4 => for_four,
            5..=8 => for_eight,
            _ => for_more,
        };
        let search = |rounds, patience, max_loss, max_hold| LocalSearch {
            rounds,
            patience,
            seeds: 3,
            max_loss,
            max_hold,
        };
        let flow = |rounds, depth| FlowSearch { rounds, depth };
        let bisection = |cycles, tries| BisectionSearch {
            cycles,
            tries,
            passes: 4,
        };
        let without_flow = |coarse, finest| Refinement {
            coarse,
            finest,
            coarse_flow: flow(0, 0),
            finest_flow: flow(0, 0),
        };
        let quick = without_flow(search(2, 6, 3.0, 1.5), search(1, 3, 3.0, 1.5));
        let fast = Self {
            coarsest_per_part: 30,
            middle: 1000,
            candidates: 1,
            finalists: 0,
            combinations: 0,
            cycles: 0,
            bisection: bisection(1, 4),
            small: quick,
            whole: quick,
            longest_border: usize::MAX,
        };
        match effort {
            Effort::Fast => fast,
            Effort::Default => {
                let rounds = if parts > 8 { 2 } else { 3 };
                let small = without_flow(search(rounds, 15, 3.0, 1.5), search(2, 12, 3.0, 1.5));
                Self {
                    candidates: few(8, 6, 4, 1),
                    finalists: 2,
                    bisection: bisection(
                        if parts > 32 { 3 } else { few(1, 1, 1, 2) },
                        if parts > 32 { 6 } else { 8 },
                    ),
                    small,
                    whole: Refinement {
                        finest_flow: flow(1, 2),
                        ..small
                    },
                    longest_border: 2500,
                    ..fast
                }
            }
            Effort::High => {
                let searched = LocalSearch {
                    seeds: 2,
                    ..search(3, 10, 5.0, 2.0)
                };
                let thorough = Refinement {
                    coarse: searched,
                    finest: searched,
                    coarse_flow: flow(1, 3),
                    finest_flow: flow(1, 3),
                };
                Self {
                    middle: 20_000,
                    candidates: few(4, 4, 3, 2),
                    combinations: few(3, 3, 2, 1),
                    bisection: bisection(2, 8),
                    small: thorough,
                    whole: thorough,
                    ..fast
                }
            }
        }
    }
}

/// One problem, with all that stays the same while it is solved.
struct Solver<'a> {
    balance: &'a Balance,
    plan: Plan,
    contiguous: bool,
    team: &'a Team,
}

/// The part of each vertex.
pub(crate) fn partition(graph: &Graph, balance: &Balance, options: &Options, team: &Team) -> Vec<u32> {
    let plan = Plan::of(options.effort, options.parts);
    let solver = Solver {
        balance,
        plan,
        contiguous: options.contiguous,
        team,
    };
    let rng = Rng::new(options.seed);
    let part = match options.method {
        Method::Direct => solver.direct(graph, &rng),
        Method::RecursiveBisection => {
            let part = recursive_bisection(graph, balance, &plan.bisection, team, &rng.fork(0));
            solver.refine_up(graph, &[], part, &plan.whole, &mut rng.fork(1))
        }
    };
    let part = if options.contiguous {
        solver.connect(graph, part, &rng.fork(2))
    } else {
        part
    };
    let mut state = KWay::new(graph, part, &balance.limits);
    fill_empty_parts(&mut state);
    if options.contiguous {
        make_contiguous(&mut state, &mut rng.fork(3));
    }
    state.part
}

/// Cycles spent on restoring the balance that joining stray pieces has upset.
const REPAIRS: u64 = 3;
/// An excess below this fraction of all weight is left to single moves.
const FRINGE: i64 = 1000;

impl Solver<'_> {
    fn direct(&self, graph: &Graph, rng: &Rng) -> Vec<u32> {
        let middle = self.plan.middle.max(self.coarsest_size());
        let levels = coarsen(graph, middle, &[], self.team, &mut rng.fork(3));
        let middle = levels.last().map_or(graph, |level| &level.graph);
        let mut best = self.best_candidate(middle, &rng.fork(4));
        if self.contiguous && !levels.is_empty() {
            let mut state = KWay::new(middle, best, &self.balance.limits);
            make_contiguous(&mut state, &mut rng.fork(5));
            best = state.part;
        }
        best = self.refine_up(graph, &levels, best, &self.plan.whole, &mut rng.fork(6));
        for i in 0..self.plan.cycles {
            let next = self.cycle(graph, &[&best], &self.plan.whole, &mut rng.fork(100 + i));
            best = self.better(graph, best, next);
        }
        best
    }

    fn coarsest_size(&self) -> usize {
        (self.plan.coarsest_per_part * self.balance.parts()).max(100)
    }

    /// Joins stray pieces. Where that upsets the balance much, moving single vertices would fray the borders: another
    /// multilevel cycle restores it on coarse graphs.
    fn connect(&self, graph: &Graph, mut part: Vec<u32>, rng: &Rng) -> Vec<u32> {
        for i in 0..REPAIRS {
            let mut state = KWay::new(graph, part, &self.balance.limits);
            join_stray_pieces(&mut state);
            part = state.part.clone();
            if FRINGE * state.excess() <= graph.total_vertex_weight() {
                break;
            }
            part = self.cycle(graph, &[&part], &self.plan.whole, &mut rng.fork(i));
        }
        part
    }

    /// Several partitions of a small graph, the best combined with the others.
    fn best_candidate(&self, graph: &Graph, rng: &Rng) -> Vec<u32> {
        let Plan { small, finalists, .. } = &self.plan;
        let sorted = |mut candidates: Vec<Vec<u32>>| {
            candidates.sort_by_cached_key(|part| self.rank(graph, part));
            candidates
        };
        let mut candidates = sorted(self.team.map(self.plan.candidates, |i| {
            self.cycle(graph, &[], small, &mut rng.fork(i))
        }));
        if *finalists > 0 {
            candidates.truncate(*finalists);
            candidates = sorted(self.team.map(candidates.len() as u64, |i| {
                self.shorten_borders(graph, candidates[i as usize].clone())
            }));
        }
        let mut candidates = candidates.into_iter();
        let mut best = candidates.next().unwrap_or_default();
        for (i, other) in candidates.take(self.plan.combinations as usize).enumerate() {
            let child = self.cycle(graph, &[&best, &other], small, &mut rng.fork(1000 + i as u64));
            best = self.better(graph, best, child);
        }
        best
    }

    /// Flows alone.
    fn shorten_borders(&self, graph: &Graph, part: Vec<u32>) -> Vec<u32> {
        let mut state = KWay::new(graph, part, &self.balance.limits);
        let mut boundary: Vec<u32> = (0..graph.vertex_count() as u32)
            .filter(|&v| state.on_boundary(v as usize))
            .collect();
        flow::refine(&mut state, &mut boundary, self.plan.whole.finest_flow, self.team);
        state.part
    }

    /// One multilevel cycle: from scratch, or starting at the first of the partitions `kept`, none of whose cut edges
    /// is contracted. With two of them the search can exchange whole regions.
    fn cycle(&self, graph: &Graph, kept: &[&[u32]], refinement: &Refinement, rng: &mut Rng) -> Vec<u32> {
        let levels = coarsen(graph, self.coarsest_size(), kept, self.team, rng);
        let coarsest = levels.last().map_or(graph, |level| &level.graph);
        let part = match kept.first() {
            None => recursive_bisection(
                coarsest,
                self.balance,
                &self.plan.bisection,
                self.team,
                &rng.fork(0),
            ),
            Some(part) => levels.iter().fold(part.to_vec(), |fine, level| {
                restrict(&fine, &level.coarse_of, level.graph.vertex_count())
            }),
        };
        self.refine_up(graph, &levels, part, refinement, rng)
    }

    /// Carries a partition of the coarsest graph up, refining it on every level.
    fn refine_up(
        &self,
        graph: &Graph,
        levels: &[Level],
        mut part: Vec<u32>,
        refinement: &Refinement,
        rng: &mut Rng,
    ) -> Vec<u32> {
        let coarsest = levels.last().map_or(graph, |level| &level.graph);
        let mut boundary: Vec<u32> = (0..coarsest.vertex_count() as u32).collect();
        let mut searches = Searches::new(graph.vertex_count(), self.team);
        for depth in (0..=levels.len()).rev() {
            let fine = if depth == 0 {
                graph
            } else {
                &levels[depth - 1].graph
            };
            if let Some(level) = levels.get(depth) {
                part = prolong(&part, &level.coarse_of);
                boundary = children(&boundary, level);
            }
            let mut state = KWay::new(fine, part, &self.balance.limits);
            if state.excess() > 0 {
                rebalance(&mut state);
                boundary = (0..fine.vertex_count() as u32).collect();
            }
            boundary.retain(|&v| state.on_boundary(v as usize));
            let (search, flow) = if depth == 0 {
                (refinement.finest, refinement.finest_flow)
            } else {
                (refinement.coarse, refinement.coarse_flow)
            };
            searches.refine(&mut state, &mut boundary, search, rng);
            if boundary.len() <= self.plan.longest_border {
                flow::refine(&mut state, &mut boundary, flow, self.team);
            }
            part = state.part;
        }
        part
    }

    fn better(&self, graph: &Graph, old: Vec<u32>, new: Vec<u32>) -> Vec<u32> {
        if self.rank(graph, &new) <= self.rank(graph, &old) {
            new
        } else {
            old
        }
    }

    /// Partitions of lower rank are better: excess weight, then cut.
    fn rank(&self, graph: &Graph, part: &[u32]) -> (i64, i64) {
        (
            KWay::new(graph, part.to_vec(), &self.balance.limits).excess(),
            cut(graph, part),
        )
    }
}

/// The vertices that were merged into one of the given coarse vertices.
fn children(coarse: &[u32], level: &Level) -> Vec<u32> {
    let mut wanted = vec![false; level.graph.vertex_count()];
    coarse.iter().for_each(|&c| wanted[c as usize] = true);
    (0..level.coarse_of.len() as u32)
        .filter(|&v| wanted[level.coarse_of[v as usize] as usize])
        .collect()
}
