use job::Stage;

/// What [`partition`](crate::partition) is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PartitionStage {
    /// Heavy edges are contracted until the graph is small.
    Coarsening,
    /// The small graph is divided, several times where that pays.
    Division,
    /// The division is carried up, its borders shortened on every level.
    Refinement,
    /// Stray pieces join a neighbouring part ([`Options::contiguous`](crate::Options::contiguous)).
    Connection,
}

impl Stage for PartitionStage {
    fn name(&self) -> &'static str {
        match self {
            Self::Coarsening => "coarsening",
            Self::Division => "division",
            Self::Refinement => "refinement",
            Self::Connection => "connection",
        }
    }
}
