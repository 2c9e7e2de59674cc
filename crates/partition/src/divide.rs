use job::Job;

use crate::multilevel;
use crate::options::{Balance, Options};
use crate::{Graph, Partition, PartitionError};

/// Divides the vertices into parts of near equal (or given) weight with few edges between them.
///
/// Every part gets at least one vertex. The balance of [`Options::imbalance`] holds whenever the search finds it, and
/// always with unit weights unless [`Options::contiguous`] forbids it (a star has one connected part of any size); look
/// at [`Partition::balanced`] when weights are uneven. The result does not depend on the job; its stages are those of
/// [`PartitionStage`](crate::PartitionStage).
///
/// # Errors
/// When the number of parts is 0 or above #V, an option is no sensible number, or the job ends
/// ([`PartitionError::Job`]).
pub fn partition(graph: &Graph, options: &Options, job: &Job) -> Result<Partition, PartitionError> {
    let balance = Balance::new(graph, options)?;
    let part_of = match (options.parts, job.threads()) {
        (1, _) => vec![0; graph.vertex_count()],
        (_, 1) => multilevel::partition(graph, &balance, options, job)?,
        // On one of the job's threads: what is handed to the others then starts sooner.
        _ => job.install(|| multilevel::partition(graph, &balance, options, job))??,
    };
    Ok(Partition::of(graph, part_of, &balance, job)?)
}
