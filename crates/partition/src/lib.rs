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
mod multilevel;
mod options;
mod rebalance;
mod result;
mod rng;
mod team;

pub use divide::partition;
pub use error::PartitionError;
pub use graph::Graph;
pub use metis_format::{read_metis, write_metis};
pub use options::{Effort, Method, Options};
pub use result::Partition;
