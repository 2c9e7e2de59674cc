/// The stages of embedding and verification, in the order in which they happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MarkStage {
    /// The mesh is cut into patches.
    Patches,
    /// The manifold harmonics of the patches are computed: nearly all of the time.
    Harmonics,
    /// The signature is made and written into the shape.
    Embedding,
    /// The suspect is brought onto the original.
    Registration,
    /// The suspect's surface is sampled at the original's vertices.
    Resampling,
    /// The bits are read back, and the signature they form is checked.
    Detection,
}

impl job::Stage for MarkStage {
    fn name(&self) -> &'static str {
        match self {
            Self::Patches => "patches",
            Self::Harmonics => "harmonics",
            Self::Embedding => "embedding",
            Self::Registration => "registration",
            Self::Resampling => "resampling",
            Self::Detection => "detection",
        }
    }
}
