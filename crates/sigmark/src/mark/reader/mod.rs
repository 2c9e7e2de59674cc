mod sampler;
mod vertices;

pub use sampler::Sampler;
pub(crate) use vertices::{Aligned, align};
