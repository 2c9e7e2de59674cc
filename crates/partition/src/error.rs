/// Why a graph could not be built or divided.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PartitionError {
    /// An array of the graph has the wrong length.
    #[error("{what} has {given} entries but {expected} are needed; give one per item")]
    Length {
        /// Which array.
        what: &'static str,
        /// Its length.
        given: usize,
        /// The length that the rest of the input asks for.
        expected: usize,
    },
    /// The offsets do not start at 0 or go down somewhere.
    #[error(
        "offset {index} is {value}; offsets start at 0, never go down and end at the number of neighbours"
    )]
    Offsets {
        /// Position in the array of offsets.
        index: usize,
        /// The offending offset.
        value: usize,
    },
    /// More vertices or adjacency entries than 32-bit indices can hold.
    #[error("{count} {what} are too many for 32-bit indices; divide the graph beforehand")]
    TooLarge {
        /// Vertices or adjacency entries.
        what: &'static str,
        /// Their number.
        count: usize,
    },
    /// A neighbour that is no vertex.
    #[error("vertex {vertex} names neighbour {neighbour}, but there are only {count} vertices (from 0)")]
    NeighbourOutOfRange {
        /// The vertex.
        vertex: usize,
        /// The neighbour it names.
        neighbour: usize,
        /// Number of vertices.
        count: usize,
    },
    /// An edge from a vertex to itself.
    #[error("vertex {vertex} is its own neighbour; drop the loop or build with Graph::from_edges")]
    SelfLoop {
        /// The vertex.
        vertex: usize,
    },
    /// The same neighbour twice.
    #[error(
        "vertex {vertex} names neighbour {neighbour} twice; add the weights up or build with Graph::from_edges"
    )]
    DuplicateEdge {
        /// The vertex.
        vertex: usize,
        /// The repeated neighbour.
        neighbour: usize,
    },
    /// An edge that stands on one side only, or with two different weights.
    #[error(
        "edge {vertex}-{neighbour} is not listed with the same weight from both ends; build with Graph::from_edges"
    )]
    Asymmetric {
        /// The vertex that lists the edge.
        vertex: usize,
        /// The vertex that does not, or not with this weight.
        neighbour: usize,
    },
    /// An edge weight of zero or less.
    #[error("edge {vertex}-{neighbour} has weight {weight}; weights of edges are at least 1")]
    EdgeWeight {
        /// One end.
        vertex: usize,
        /// The other end.
        neighbour: usize,
        /// Its weight.
        weight: i64,
    },
    /// A vertex weight below zero.
    #[error("vertex {vertex} has weight {weight}; weights of vertices are at least 0")]
    VertexWeight {
        /// The vertex.
        vertex: usize,
        /// Its weight.
        weight: i64,
    },
    /// Weights whose sum does not fit.
    #[error("the weights of all {what} sum to {total}, above 2147483647; divide them by a common factor")]
    WeightSum {
        /// Vertices or edges.
        what: &'static str,
        /// The sum.
        total: i64,
    },
    /// No parts, or more parts than vertices.
    #[error("{parts} parts of {vertices} vertices: ask for 1 to {vertices}, so that no part is empty")]
    Parts {
        /// Parts asked for.
        parts: usize,
        /// Vertices of the graph.
        vertices: usize,
    },
    /// An imbalance that is negative or not a number.
    #[error("imbalance {imbalance} must be a finite number of at least 0, such as 0.03")]
    Imbalance {
        /// The value given.
        imbalance: f64,
    },
    /// A target weight that is not positive and finite.
    #[error("target weight {weight} of part {part} must be positive and finite")]
    TargetWeight {
        /// The part.
        part: usize,
        /// Its target.
        weight: f64,
    },
    /// A part number that is too large.
    #[error("vertex {vertex} is in part {part}, but there are only {parts} parts (from 0)")]
    PartOutOfRange {
        /// The vertex.
        vertex: usize,
        /// Its part.
        part: usize,
        /// Number of parts.
        parts: usize,
    },
    /// A text that is no graph in METIS' format.
    #[error("line {line}: {problem}")]
    Format {
        /// Line number, from 1.
        line: usize,
        /// What is wrong with it and what was expected.
        problem: String,
    },
    /// The job was cancelled or could not start its threads.
    #[error(transparent)]
    Job(#[from] job::JobError),
}
