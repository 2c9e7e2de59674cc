//! Graph partitioning and nested dissection.
//!
//! Given a graph with vertex weights c and edge weights w, [`partition`] looks for a division of the vertices into k
//! parts that makes the *cut*, the sum of w over the edges between parts, small, while every part p stays within its
//! limit: its weight c(p) ≤ max(⌊(1 + ε) t_p⌋, ⌈t_p⌉), where t_p is its share of the total weight. [`nested_dissection`]
//! looks for an order in which a Cholesky factorisation of a matrix with this graph fills in little.
//!
//! ```
//! use partition::{Graph, Options, partition};
//!
//! // A ladder of 100 rungs.
//! let rails = (0..99).flat_map(|i| [(i, i + 1, 1), (100 + i, 101 + i, 1)]);
//! let rungs = (0..100).map(|i| (i, 100 + i, 1));
//! let ladder = Graph::from_edges(200, &rails.chain(rungs).collect::<Vec<_>>())?;
//!
//! let result = partition(&ladder, &Options { parts: 4, contiguous: true, ..Default::default() })?;
//! assert_eq!(result.cut, 6);
//! assert!(result.balanced && result.components == [1, 1, 1, 1]);
//! # Ok::<(), partition::PartitionError>(())
//! ```
//!
//! **Conventions.** Vertices and parts count from 0. Each edge is stored from both ends and counted once. Weights have 32
//! bits, sums of them must fit; sums are given in 64 bits. Equal input and seed give equal results on every platform
//! and any number of threads.
//!
//! **Method.** Multilevel (Karypis and Kumar, *A fast and high quality multilevel scheme for partitioning irregular
//! graphs*, 1998; *Multilevel k-way partitioning*, 1998b): heavy edges are contracted until the graph is small, the small
//! graph is divided by recursive bisection, and the division is refined on the way back up by localised k-way
//! Fiduccia–Mattheyses search and by minimum cuts in corridors along the borders (Sanders and Schulz, 2011). Several
//! candidates are made on a graph of middling size; at high effort the best is combined with the others (Sanders and
//! Schulz, 2012).
//!
//! **Cost.** O(#E) time a level and about twice that in all, plus O(#E) memory of about 40 bytes a stored edge. At
//! default effort about 1.4 times the CPU time of METIS and, by the clock on two threads, as long as METIS on its one,
//! with shorter borders; at high effort less than ten times.

#[cfg(feature = "bench-internals")]
#[doc(hidden)]
pub mod bench;
mod bisect;
mod buckets;
mod coarsen;
mod contiguity;
mod contract;
mod divide;
mod error;
mod flow;
mod fm2;
mod gain_cache;
mod graph;
mod greedy;
mod initial;
mod kway;
mod local_search;
mod matching;
mod max_flow;
mod metis_format;
mod min_fill;
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
