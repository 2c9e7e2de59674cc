//! In work.

pub mod signature;
