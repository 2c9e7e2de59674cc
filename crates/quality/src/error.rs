use job::JobError;
use mhb_core::SpectrumError;

/// One of the two meshes that are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// What is measured by.
    Reference,
    /// What differs from it.
    Other,
}

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Reference => "the reference",
            Self::Other => "the other mesh",
        })
    }
}

/// Why two meshes can't be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum QualityError {
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
    /// The sampling interval is so small that the samples can't be counted, or would take days.
    #[error(
        "sampling every {interval} of the diagonal would take {samples:.1e} samples; take an interval of at least {least:.1e}"
    )]
    TooManySamples {
        /// The interval, as a fraction of the diagonal.
        interval: f64,
        /// About how many samples that means.
        samples: f64,
        /// The smallest interval that is accepted for this surface.
        least: f64,
    },
    /// A surface without area has no samples, no spectrum and no diagonal to measure by.
    #[error("the area of the surface is {area}: nothing can be measured on it")]
    NoSurface {
        /// The sum of the triangles' areas.
        area: f64,
    },
    /// One of the two meshes is the reason.
    #[error("{side}: {source}")]
    Mesh {
        /// Which.
        side: Side,
        /// What is wrong with it.
        source: Box<QualityError>,
    },
    /// The metric compares vertex with vertex, but the two meshes do not have the same triangles.
    #[error(
        "the meshes differ in connectivity ({difference}): this metric needs the same triangles over the same vertices"
    )]
    Connectivity {
        /// The first difference, in words.
        difference: String,
    },
    /// Each connected component has one eigenvalue 0; of the others there are too few.
    #[error(
        "{count} non-zero eigenvalues were asked for; {vertices} vertices in {components} component(s) have {available}"
    )]
    TooFewEigenvalues {
        /// How many were asked for.
        count: usize,
        /// #V.
        vertices: usize,
        /// Connected components.
        components: usize,
        /// How many there are.
        available: usize,
    },
    /// So many eigenvalues of so large a mesh need more memory than there is on most machines.
    #[error(
        "{count} non-zero eigenvalues of a mesh of {vertices} vertices in {components} component(s) need too much memory: ask for at most {most}, simplify the mesh, or leave small components out"
    )]
    TooManyEigenvalues {
        /// How many were asked for.
        count: usize,
        /// #V.
        vertices: usize,
        /// Connected components, whose eigenvalues 0 take as much memory each.
        components: usize,
        /// How many can be had.
        most: usize,
    },
    /// Each connected component has one eigenvalue 0; to tell so many from the others would take hours.
    #[error(
        "the mesh of {vertices} vertices falls into {components} components, each with an eigenvalue 0, and at most {most} are computed: weld it, or leave small components out"
    )]
    TooManyComponents {
        /// #V.
        vertices: usize,
        /// Connected components.
        components: usize,
        /// How many a mesh of so many vertices may have.
        most: usize,
    },
    /// Two Shape-DNAs of different lengths have no distance.
    #[error("a Shape-DNA of {left} eigenvalues can't be compared with one of {right}")]
    Lengths {
        /// Eigenvalues of the one.
        left: usize,
        /// Eigenvalues of the other.
        right: usize,
    },
    /// Eigenvalues could not be computed.
    #[error(transparent)]
    Spectrum(SpectrumError),
    /// A picture could not be encoded.
    #[cfg(feature = "png")]
    #[error("the picture can't be encoded ({reason})")]
    Picture {
        /// What the encoder said.
        reason: String,
    },
    /// The job was cancelled, or got no threads.
    #[error(transparent)]
    Job(#[from] JobError),
}

impl From<SpectrumError> for QualityError {
    /// A job that could not be done is always [`QualityError::Job`].
    fn from(error: SpectrumError) -> Self {
        match error {
            SpectrumError::Job(error) => Self::Job(error),
            error => Self::Spectrum(error),
        }
    }
}

impl QualityError {
    /// The same error of one mesh, if it is about a mesh.
    pub(crate) fn of(self, side: Side) -> Self {
        match self {
            Self::NoSurface { .. }
            | Self::TooFewEigenvalues { .. }
            | Self::TooManyEigenvalues { .. }
            | Self::TooManyComponents { .. }
            | Self::Spectrum(_) => Self::Mesh {
                side,
                source: Box::new(self),
            },
            other => other,
        }
    }
}
