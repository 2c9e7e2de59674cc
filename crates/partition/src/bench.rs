//! The phases one by one, as default effort runs them, for benchmarks alone: behind the feature `bench-internals`, and
//! without any promise.

use job::{Job, JobError};

use crate::bisection::recursive_bisection;
use crate::coarsening::Hierarchy;
use crate::options::Balance;
use crate::plan::Plan;
use crate::refinement::{KWay, Searches, cut, make_contiguous, refine_by_flows};
use crate::rng::Rng;
use crate::{Effort, Graph, Options, PartitionError};

/// The graph after coarsening to about `size` vertices.
///
/// # Errors
/// When the threads cannot be started.
pub fn coarsened(graph: &Graph, size: usize, job: &Job) -> Result<Graph, PartitionError> {
    let hierarchy = Hierarchy::of(graph, size, &[], job, &mut Rng::new(0))?;
    Ok(hierarchy.coarsest().clone())
}

/// One division of a graph, and what its refinement needs.
pub struct Division<'a> {
    graph: &'a Graph,
    balance: Balance,
    plan: Plan,
    job: &'a Job,
    part: Vec<u32>,
}

impl<'a> Division<'a> {
    /// By recursive bisection: what is done to the coarsest graph.
    ///
    /// # Errors
    /// See [`PartitionError`].
    pub fn initial(graph: &'a Graph, parts: usize, job: &'a Job) -> Result<Self, PartitionError> {
        let options = Options {
            parts,
            ..Options::default()
        };
        let balance = Balance::new(graph, &options)?;
        let plan = Plan::of(Effort::Default, parts);
        let part = recursive_bisection(graph, &balance, &plan.bisection, job, &Rng::new(0))?;
        Ok(Self {
            graph,
            balance,
            plan,
            job,
            part,
        })
    }

    /// The cut after one local search over all borders.
    ///
    /// # Errors
    /// When the threads cannot be started.
    pub fn search(&self) -> Result<i64, JobError> {
        let (mut state, mut boundary) = self.begin();
        let mut searches = Searches::new(self.part.len(), self.job);
        let search = self.plan.whole.finest;
        searches.refine(&mut state, &mut boundary, search, &mut Rng::new(0))?;
        Ok(cut(self.graph, &state.part))
    }

    /// The cut after flows between all pairs of parts.
    ///
    /// # Errors
    /// When the threads cannot be started.
    pub fn flows(&self) -> Result<i64, JobError> {
        let (mut state, mut boundary) = self.begin();
        refine_by_flows(&mut state, &mut boundary, self.plan.whole.finest_flow, self.job)?;
        Ok(cut(self.graph, &state.part))
    }

    /// The cut after stray pieces were joined.
    ///
    /// # Errors
    /// When the threads cannot be started.
    pub fn connect(&self) -> Result<i64, JobError> {
        let (mut state, _) = self.begin();
        make_contiguous(&mut state, &mut Rng::new(0), self.job)?;
        Ok(cut(self.graph, &state.part))
    }

    fn begin(&self) -> (KWay<'_>, Vec<u32>) {
        let state = KWay::new(self.graph, self.part.clone(), &self.balance.limits);
        let boundary = state.boundary();
        (state, boundary)
    }
}
