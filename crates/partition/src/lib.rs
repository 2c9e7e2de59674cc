//! Multilevel k-way graph partitioning.
//!
//! Given a graph with vertex weights c and edge weights w, [`partition`] looks for a division of the vertices into k
//! parts that makes the *cut*, the sum of w over the edges between parts, small, while every part p stays within its
//! limit: its weight c(p) ≤ max(⌊(1 + ε) t_p⌋, ⌈t_p⌉), where t_p is its share of the total weight.
//!
//! ```
//! use job::Job;
//! use partition::{Graph, Options, partition};
//!
//! // A ladder of 100 rungs.
//! let rails = (0..99).flat_map(|i| [(i, i + 1, 1), (100 + i, 101 + i, 1)]);
//! let rungs = (0..100).map(|i| (i, 100 + i, 1));
//! let ladder = Graph::from_edges(200, &rails.chain(rungs).collect::<Vec<_>>())?;
//!
//! let options = Options { parts: 4, contiguous: true, ..Default::default() };
//! let result = partition(&ladder, &options, &Job::new(2))?;
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

mod bisection;
mod buckets;
mod coarsening;
mod divide;
mod error;
mod graph;
mod metis_format;
mod multilevel;
mod options;
mod plan;
mod refinement;
mod result;
mod rng;
mod stage;

#[cfg(feature = "bench-internals")]
#[doc(hidden)]
pub mod bench;

pub use divide::partition;
pub use error::PartitionError;
pub use graph::Graph;
pub use metis_format::{read_metis, write_metis};
pub use options::{Effort, Method, Options};
pub use result::Partition;
pub use stage::PartitionStage;
