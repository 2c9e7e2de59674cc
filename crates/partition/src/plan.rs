//! What an effort means in figures.

use crate::bisection::BisectionSearch;
use crate::options::Effort;
use crate::refinement::{FlowSearch, LocalSearch};

/// What is done to a partition on every level on its way up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refinement {
    /// On all levels but the finest.
    coarse: LocalSearch,
    pub(crate) finest: LocalSearch,
    coarse_flow: FlowSearch,
    pub(crate) finest_flow: FlowSearch,
}

impl Refinement {
    fn without_flow(coarse: LocalSearch, finest: LocalSearch) -> Self {
        Self {
            coarse,
            finest,
            coarse_flow: FlowSearch::NONE,
            finest_flow: FlowSearch::NONE,
        }
    }

    /// Of the graph at a depth of the hierarchy, of which 0 is the finest.
    pub(crate) fn at(&self, depth: usize) -> (LocalSearch, FlowSearch) {
        match depth {
            0 => (self.finest, self.finest_flow),
            _ => (self.coarse, self.coarse_flow),
        }
    }
}

/// What an [`Effort`] means for a number of parts.
///
/// All figures without another source were chosen on the graphs and meshes of `results/partition.md`, by cut and CPU time
/// beside METIS. Where a constant of this crate says what another value does, it is the geometric mean of the cuts of that
/// page's 13 graphs at default effort.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plan {
    /// Vertices per part at which coarsening stops; 30 as in METIS (`kmetis.c`).
    pub(crate) coarsest_per_part: usize,
    /// Size of the graph on which candidates are made.
    pub(crate) middle: usize,
    pub(crate) candidates: usize,
    /// How many of the candidates are refined by flows before the best is chosen.
    pub(crate) finalists: usize,
    /// How many of the candidates are combined with the best.
    pub(crate) combinations: usize,
    pub(crate) bisection: BisectionSearch,
    /// Of candidates.
    pub(crate) small: Refinement,
    /// Of the partition that is chosen.
    pub(crate) whole: Refinement,
    /// Vertices along all borders above which flows are not sought: each of them costs about as much time as ten vertices
    /// of the graph do otherwise.
    pub(crate) longest_border: usize,
}

impl Plan {
    pub(crate) fn of(effort: Effort, parts: usize) -> Self {
        match effort {
            Effort::Fast => Self::fast(),
            Effort::Default => Self::default_effort(parts),
            Effort::High => Self::high(parts),
        }
    }

    fn fast() -> Self {
        let refinement = Refinement::without_flow(search(2, 6), search(1, 3));
        Self {
            coarsest_per_part: 30,
            middle: 1000,
            candidates: 1,
            finalists: 0,
            combinations: 0,
            bisection: bisection(1, 4),
            small: refinement,
            whole: refinement,
            longest_border: usize::MAX,
        }
    }

    fn default_effort(parts: usize) -> Self {
        let rounds = if parts > 8 { 2 } else { 3 };
        let small = Refinement::without_flow(search(rounds, 15), search(2, 12));
        let bisection = match parts {
            0..=8 => bisection(1, 8),
            9..=32 => bisection(2, 8),
            _ => bisection(3, 6),
        };
        Self {
            candidates: by_parts(parts, [8, 6, 4, 1]),
            finalists: 2,
            bisection,
            small,
            whole: Refinement {
                finest_flow: FlowSearch { rounds: 1, depth: 2 },
                ..small
            },
            longest_border: 2500,
            ..Self::fast()
        }
    }

    fn high(parts: usize) -> Self {
        let search = LocalSearch {
            seeds: 2,
            max_loss: 5.0,
            max_internal: 2.0,
            ..search(3, 10)
        };
        let flow = FlowSearch { rounds: 1, depth: 3 };
        let refinement = Refinement {
            coarse: search,
            finest: search,
            coarse_flow: flow,
            finest_flow: flow,
        };
        Self {
            middle: 20_000,
            candidates: by_parts(parts, [4, 4, 3, 2]),
            combinations: by_parts(parts, [3, 3, 2, 1]),
            bisection: bisection(2, 8),
            small: refinement,
            whole: refinement,
            ..Self::fast()
        }
    }
}

/// Few parts leave the local search little to exchange: there more candidates pay.
fn by_parts(parts: usize, [two, four, eight, more]: [usize; 4]) -> usize {
    match parts {
        0..=2 => two,
        3..=4 => four,
        5..=8 => eight,
        _ => more,
    }
}

fn search(rounds: usize, patience: usize) -> LocalSearch {
    LocalSearch {
        rounds,
        patience,
        seeds: 3,
        max_loss: 3.0,
        max_internal: 1.5,
    }
}

fn bisection(cycles: usize, tries: usize) -> BisectionSearch {
    BisectionSearch {
        cycles,
        tries,
        passes: 4,
    }
}
