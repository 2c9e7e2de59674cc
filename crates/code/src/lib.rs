//! Polar.
mod candidates;
mod construction;
mod error;
mod kernels;
mod list;
mod plan;
mod polar;
mod precode;
mod transform;

pub use candidates::{Candidate, Candidates};
pub use construction::Reliability;
pub use error::CodeError;
pub use polar::PolarCode;
