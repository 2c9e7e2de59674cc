//! Polar.
mod candidates;
mod error;
mod kernels;
mod list;
mod plan;
mod polar;
mod precode;
mod reliability;
mod search;
mod transform;

pub use candidates::{Candidate, Candidates};
pub use error::CodeError;
pub use polar::{CheckNodes, PolarCode};
pub use search::{Found, LISTS};
