//! Where a run takes place: the machine, other programs, Python, the sources.

pub mod machine;
pub mod process;
pub mod python;
pub mod sources;
