//! What people notice of a difference.

mod curvature;
mod dame;
mod dihedral;
mod msdm2;
mod walk;

pub use dame::{Dame, DameMetric, Visibility, same_connectivity};
pub use msdm2::{Msdm2, Msdm2Metric};
