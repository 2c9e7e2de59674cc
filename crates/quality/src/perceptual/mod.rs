//! What people notice of a difference.

mod balls;
mod curvature;
mod dame;
mod dihedral;
mod msdm2;

pub use dame::{Dame, Visibility, same_connectivity};
pub use msdm2::Msdm2;
