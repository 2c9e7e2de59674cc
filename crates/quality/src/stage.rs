use job::Stage;

/// Which metric is being measured. Each is one stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum MetricStage {
    /// Distances between surfaces, one way or both.
    Distance,
    /// A Shape-DNA.
    ShapeDna,
    /// MSDM2.
    Msdm2,
    /// DAME.
    Dame,
}

impl Stage for MetricStage {
    fn name(&self) -> &'static str {
        match self {
            Self::Distance => "distance",
            Self::ShapeDna => "shape_dna",
            Self::Msdm2 => "msdm2",
            Self::Dame => "dame",
        }
    }
}
