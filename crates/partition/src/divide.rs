use crate::multilevel;
use crate::options::{Balance, Options};
use crate::team::Team;
use crate::{Graph, Partition, PartitionError};

/// Divides the vertices into parts of near equal (or given) weight with few edges between them.
///
/// Every part gets at least one vertex. The balance of [`Options::imbalance`] holds whenever the search finds it, and
/// always with unit weights unless [`Options::contiguous`] forbids it (a star has one connected part of any size); look
/// at [`Partition::balanced`] when weights are uneven.
///
/// # Errors
/// When the number of parts is 0 or above #V, or an option is no sensible number.
pub fn partition(graph: &Graph, options: &Options) -> Result<Partition, PartitionError> {
    let balance = Balance::new(graph, options)?;
    let team = Team::new(options.threads)?;
    let part_of = if options.parts == 1 {
        vec![0; graph.vertex_count()]
    } else {
        team.run(|| multilevel::partition(graph, &balance, options, &team))
    };
    Ok(Partition::of(graph, part_of, &balance, &team))
}
