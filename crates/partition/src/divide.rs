use crate::multilevel::{self, Plan};
use crate::options::{Balance, Options};
use crate::rng::Rng;
use crate::{Graph, Partition, PartitionError};

/// Divides the vertices into parts of near equal (or given) weight with few edges between them.
///
/// # Errors
/// When the number of parts is 0 or above #V, or an option is no sensible number.
pub fn partition(graph: &Graph, options: &Options) -> Result<Partition, PartitionError> {
    let balance = Balance::new(graph, options)?;
    let rng = Rng::new(options.seed);
    let part_of = multilevel::partition(graph, &balance, &Plan::of(options.effort), &rng);
    Ok(Partition::of(graph, part_of, &balance))
}
