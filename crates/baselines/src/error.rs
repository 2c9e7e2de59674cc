use job::JobError;
use sigmark::mark::MarkError;

/// Why an algorithm could not be run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BaselineError {
    /// A signature of another length than was prepared for.
    #[error("a signature of {given} bits was given, but the mesh was prepared for {wanted}; prepare it anew")]
    Bits {
        /// Length of the signature.
        given: usize,
        /// l.
        wanted: usize,
    },
    /// A strength that is none.
    #[error("the strength α is {alpha}, but must be a finite number, not below 0")]
    Alpha {
        /// The value that was given.
        alpha: f64,
    },
    /// Suspects and patch labels have one value a vertex of the original.
    #[error(
        "{given} values were given for {vertices} vertices; register the suspect to this very mesh, and cut patches of it"
    )]
    Vertices {
        /// How many values.
        given: usize,
        /// #V of the original.
        vertices: usize,
    },
    /// The basis has fewer functions than the signature needs.
    #[error("{functions} basis functions do not hold {bits} bits with chip rate {rate}; {least} would")]
    TooFewFunctions {
        /// m.
        functions: usize,
        /// l.
        bits: usize,
        /// c.
        rate: usize,
        /// m that would do.
        least: usize,
    },
    /// There are not as many vertices as centres.
    #[error(
        "{centres} centres were asked for, but there are {vertices} vertices only; use a finer mesh or fewer bits"
    )]
    Centres {
        /// How many centres.
        centres: usize,
        /// How many vertices.
        vertices: usize,
    },
    /// Radial functions that double precision can't tell from combinations of each other.
    #[error(
        "only {rank} of {centres} radial functions are independent; use another kernel, a narrower one, or a finer mesh"
    )]
    Dependent {
        /// How many are independent.
        rank: usize,
        /// How many centres there are.
        centres: usize,
    },
    /// Coordinates that are too large to square, or a decomposition that does not converge.
    #[error(
        "a decomposition of {size} radial functions failed: the coordinates are beyond what double precision can square"
    )]
    Dense {
        /// Rows of the matrix.
        size: usize,
    },
    /// The Laplacian basis functions of a patch could not be computed.
    #[error("patch {patch}: {source}")]
    Spectrum {
        /// Which patch, from 0.
        patch: usize,
        /// What went wrong.
        source: mhb_core::SpectrumError,
    },
    /// What manifold harmonics say.
    #[error(transparent)]
    Mark(MarkError),
    /// Threads could not be started, or the observer asked to stop.
    #[error(transparent)]
    Job(#[from] JobError),
}

impl From<MarkError> for BaselineError {
    /// A job that could not be done is always [`BaselineError::Job`].
    fn from(error: MarkError) -> Self {
        match error {
            MarkError::Job(error) => Self::Job(error),
            error => Self::Mark(error),
        }
    }
}
