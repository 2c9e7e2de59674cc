/// What an alignment is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RegistrationStage {
    /// Looking for vertices that survived.
    Connectivity,
    /// Sampling surfaces and building search trees.
    Preparation,
    /// Refining pose hypotheses, of which progress is told. Comes once for every round of them.
    Hypotheses,
    /// Refining the best pose.
    Refinement,
}

impl job::Stage for RegistrationStage {
    fn name(&self) -> &'static str {
        match self {
            Self::Connectivity => "connectivity",
            Self::Preparation => "preparation",
            // Named before hypotheses were called so; programs read it.
            Self::Hypotheses => "guesses",
            Self::Refinement => "refinement",
        }
    }
}
