use job::Stage;

/// The stages of a spectrum's computation, in the order in which they begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SpectrumStage {
    /// Stiffness and mass.
    Assembly,
    /// Fill-reducing ordering and structure of the factors.
    Ordering,
    /// Counting eigenvalues to cut the spectrum into bands.
    Slicing,
    /// Eigenpairs of the bands: nearly all of the time.
    Solving,
    /// Joint orthonormalisation, canonical choice and residuals.
    Finishing,
}

impl Stage for SpectrumStage {
    fn name(&self) -> &'static str {
        match self {
            Self::Assembly => "assembly",
            Self::Ordering => "ordering",
            Self::Slicing => "slicing",
            Self::Solving => "solving",
            Self::Finishing => "finishing",
        }
    }
}
