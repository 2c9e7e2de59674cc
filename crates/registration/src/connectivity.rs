//! Which vertex of a suspect is which vertex of the original, when the suspect kept the original's connectivity.

mod colours;
mod correspondence;
mod graph;
mod matching;
mod placement;
mod propagation;
mod surroundings;

pub use correspondence::Correspondence;
pub(crate) use graph::Connectivity;
pub use matching::{Difference, match_candidates, match_connectivity, match_cut, match_surroundings};
pub(crate) use matching::{Remainder, Survivors, survivors};
