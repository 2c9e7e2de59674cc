//! The phases one by one, as default effort runs them, for benchmarks alone: behind the feature `bench-internals`, and
//! without any promise.

use crate::bisect::recursive_bisection;
use crate::coarsen::{Level, coarsen};
use crate::contiguity::make_contiguous;
use crate::flow;
use crate::kway::{KWay, cut};
use crate::local_search::Searches;
use crate::multilevel::Plan;
use crate::options::Balance;
use crate::rng::Rng;
use crate::separator::separate;
use crate::team::Team;
use crate::{Effort, Graph, Options, PartitionError};

/// A graph and what it was coarsened to.
pub struct Hierarchy(Vec<Level>);

impl Hierarchy {
    /// Coarsens to about `size` vertices.
    ///
    /// # Errors
    /// When the threads cannot be started.
    pub fn new(graph: &Graph, size: usize, threads: usize) -> Result<Self, PartitionError> {
        let team = Team::new(threads)?;
        Ok(Self(
            team.run(|| coarsen(graph, size, &[], &team, &mut Rng::new(0))),
        ))
    }

    /// The smallest graph, unless none is smaller.
    pub fn coarsest(&self) -> Option<&Graph> {
        self.0.last().map(|level| &level.graph)
    }
}

/// One division of a graph, and what its refinement needs.
pub struct Division<'a> {
    graph: &'a Graph,
    balance: Balance,
    plan: Plan,
    team: Team,
    part: Vec<u32>,
}

impl<'a> Division<'a> {
    /// By recursive bisection: what is done to the coarsest graph.
    ///
    /// # Errors
    /// See [`PartitionError`].
    pub fn initial(graph: &'a Graph, parts: usize, threads: usize) -> Result<Self, PartitionError> {
        let options = Options {
            parts,
            ..Options::default()
        };
        let (balance, team) = (Balance::new(graph, &options)?, Team::new(threads)?);
        let plan = Plan::of(Effort::Default, parts);
        let search = &plan.bisection;
        let part = team.run(|| recursive_bisection(graph, &balance, search, &team, &Rng::new(0)));
        Ok(Self {
            graph,
            balance,
            plan,
            team,
            part,
        })
    }

    /// The cut after one local search over all borders.
    pub fn search(&self) -> i64 {
        let (mut state, mut boundary) = self.begin();
        let search = self.plan.whole.finest;
        self.team.run(|| {
            Searches::new(self.part.len(), &self.team).refine(
                &mut state,
                &mut boundary,
                search,
                &mut Rng::new(0),
            );
        });
        cut(self.graph, &state.part)
    }

    /// The cut after flows between all pairs of parts.
    pub fn flows(&self) -> i64 {
        let (mut state, mut boundary) = self.begin();
        let search = self.plan.whole.finest_flow;
        self.team
            .run(|| flow::refine(&mut state, &mut boundary, search, &self.team));
        cut(self.graph, &state.part)
    }

    /// The cut after stray pieces were joined.
    pub fn connect(&self) -> i64 {
        let (mut state, _) = self.begin();
        make_contiguous(&mut state, &mut Rng::new(0));
        cut(self.graph, &state.part)
    }

    fn begin(&self) -> (KWay<'_>, Vec<u32>) {
        let state = KWay::new(self.graph, self.part.clone(), &self.balance.limits);
        let boundary = (0..self.part.len() as u32)
            .filter(|&v| state.on_boundary(v as usize))
            .collect();
        (state, boundary)
    }
}

/// Weight of side 0, of side 1 and of the separator between them.
///
/// # Errors
/// When the threads cannot be started.
pub fn separator(graph: &Graph, tries: usize) -> Result<[i64; 3], PartitionError> {
    Ok(separate(graph, tries, &Team::new(1)?, &mut Rng::new(0)).weight)
}
