/// The stages of embedding and verification, in the order in which they happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
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

impl Stage {
    /// One lower-case word, as the JSON reports name it.
    pub fn name(self) -> &'static str {
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

/// Watches a long computation, possibly from several threads at once. Every method has a default that does nothing.
pub trait Observer: Sync {
    /// A stage begins; the one before it is over.
    fn stage(&self, _stage: Stage) {}

    /// How much of the present stage is done, from 0 to 1.
    fn fraction(&self, _done: f64) {}

    /// Answer `true` to make the computation end soon with [`SigmarkError::Cancelled`](crate::SigmarkError::Cancelled).
    fn cancelled(&self) -> bool {
        false
    }
}

/// Watches nothing.
impl Observer for () {}
