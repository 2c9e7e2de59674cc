use job::JobError;

/// Why no alignment can be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RegistrationError {
    /// Correspondences come in pairs.
    #[error("{source_count} source points were given for {target_count} target points: they must be pairs")]
    PointCount {
        /// How many source points were given.
        source_count: usize,
        /// How many target points were given.
        target_count: usize,
    },
    /// Weights come one a pair.
    #[error("{given} weights were given for {expected} pairs of points")]
    WeightCount {
        /// How many weights were given.
        given: usize,
        /// How many pairs there are.
        expected: usize,
    },
    /// A weight is negative or not a finite number.
    #[error("the weight of pair {index} is {weight}; weights must be finite and not negative")]
    BadWeight {
        /// Index of the pair, from 0.
        index: usize,
        /// Its weight.
        weight: f64,
    },
    /// A coordinate is NaN or infinite.
    #[error("pair {index} has a coordinate that is not a finite number")]
    NotFinite {
        /// Index of the pair, from 0.
        index: usize,
    },
    /// A similarity has seven unknowns: three pairs of points determine it, two do not.
    #[error("{given} pairs of points with a positive weight are too few: a similarity needs three")]
    TooFewPoints {
        /// How many pairs have a positive weight.
        given: usize,
    },
    /// Points on one line, or in one place, leave a rotation undetermined.
    #[error(
        "the {cloud} points lie on one line or in one place, so the rotation is undetermined; add points off the line"
    )]
    Collinear {
        /// "source" or "target".
        cloud: &'static str,
    },
    /// The pairs have nothing in common that a similarity could carry over.
    #[error(
        "the pairs of points are uncorrelated: no similarity of positive scale fits them better than a single point"
    )]
    Uncorrelated,
    /// An option lies outside its range.
    #[error("the option {name} is {value}; it must be {range}")]
    Option {
        /// The field's name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// A mesh whose triangles have no area, or whose vertices lie in one place, has no surface to align.
    #[error("the {mesh} has no surface: the area of its triangles is zero")]
    NoSurface {
        /// "original" or "suspect".
        mesh: &'static str,
    },
    /// The work was cancelled, or its threads could not be started.
    #[error(transparent)]
    Job(#[from] JobError),
}

/// Refuses an option outside its range.
pub(crate) fn check_option(
    name: &'static str,
    value: f64,
    fits: bool,
    range: &'static str,
) -> Result<(), RegistrationError> {
    match fits {
        true => Ok(()),
        false => Err(RegistrationError::Option { name, value, range }),
    }
}
