//! Multilevel k-way graph partitioning.

mod bisect;
mod buckets;
mod coarsen;
mod contiguity;
mod contract;
mod divide;
mod error;
mod fm2;
mod gain_cache;
mod graph;
mod greedy;
mod initial;
mod kway;
mod local_search;
mod matching;
mod metis_format;
mod min_degree;
mod multilevel;
mod options;
mod ordering;
mod rebalance;
mod result;
mod rng;
mod separator;
mod symbolic;
mod team;

pub use divide::partition;
pub use error::PartitionError;
pub use graph::Graph;
pub use metis_format::{read_metis, write_metis};
pub use options::{Effort, Method, Options};
pub use ordering::{Ordering, OrderingOptions, nested_dissection};
pub use result::Partition;
pub use symbolic::{column_counts, elimination_tree};
