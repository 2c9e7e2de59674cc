use super::Borders;

/// Why bits could not be written into a shape, or read from one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MarkError {
    /// The payload has no bits, or each bit no chip.
    #[error("a mark of {bits} bits with chip rate {rate} is empty; both must be at least 1")]
    EmptyLayout {
        /// l.
        bits: usize,
        /// c.
        rate: usize,
    },
    /// The patches' harmonics are too few for the chips.
    #[error(
        "there is room for {found} chips, but the mark takes {least}; use a finer mesh, since every two vertices have room for three at most, or fewer patches where a number was asked for"
    )]
    Room {
        /// Chips that the patches have room for; in the paper's plan, the patch with the fewest harmonics.
        found: usize,
        /// Chips that are needed there.
        least: usize,
    },
    /// The bases were computed for other harmonics.
    #[error(
        "the original's harmonics are {found:?} at borders between patches, but the mark's are {wanted:?}"
    )]
    Borders {
        /// What the original's harmonics do at borders.
        found: Borders,
        /// What the mark's do.
        wanted: Borders,
    },
    /// A strength of nothing.
    #[error("{what} is {value}, but must be a number above 0")]
    NotPositive {
        /// Which knob it is.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A mark that strong would be the ruin of the shape.
    #[error(
        "{what} is {value}, which would move the surface by more than a tenth of its diagonal; {most:.3e} is the most"
    )]
    TooStrong {
        /// Which knob it is.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The largest that is accepted for this mesh.
        most: f64,
    },
    /// No component has room for the signature.
    #[error(
        "the largest connected piece has {largest} vertices, but a mark with {functions} manifold harmonics needs {least}; \
         use a finer mesh, a lower chip rate where it is above 1, or a shorter signature (the paper profile)"
    )]
    TooFewVertices {
        /// Vertices of the largest component.
        largest: usize,
        /// Vertices that would do.
        least: usize,
        /// m.
        functions: usize,
    },
    /// More patches were asked for than the mesh has room for.
    #[error(
        "a patch would have {vertices} vertices only, but a mark with {functions} manifold harmonics needs {least} in each; \
         ask for fewer patches"
    )]
    PatchTooSmall {
        /// Vertices of the patch.
        vertices: usize,
        /// Vertices that would do.
        least: usize,
        /// m.
        functions: usize,
    },
    /// Fewer patches were asked for than would keep each of a size that can be worked with.
    #[error(
        "a patch would have {vertices} vertices, but {most} are the most; ask for {enough} patches or more"
    )]
    PatchTooLarge {
        /// Vertices of the patch.
        vertices: usize,
        /// The limit.
        most: usize,
        /// Patches that would do.
        enough: usize,
    },
    /// Patch labels are one a vertex.
    #[error("{given} patch labels were given for a mesh of {vertices} vertices")]
    Labels {
        /// How many labels.
        given: usize,
        /// #V.
        vertices: usize,
    },
    /// A patch without a triangle is no surface.
    #[error("patch {patch} has no triangle whose three vertices it holds")]
    EmptyPatch {
        /// Which patch, from 0.
        patch: usize,
    },
    /// The mesh's graph could not be cut.
    #[error("the mesh can't be cut into patches: {0}")]
    Partition(partition::PartitionError),
    /// The surface has no area, or no extent, to hide anything in.
    #[error(
        "patch {patch} has no area: all its triangles are degenerate; export the model again with more digits"
    )]
    NoArea {
        /// Which patch, from 0.
        patch: usize,
    },
    /// The manifold harmonics of a patch could not be computed.
    #[error("patch {patch}: {source}")]
    Spectrum {
        /// Which patch, from 0.
        patch: usize,
        /// What went wrong.
        source: mhb_core::SpectrumError,
    },
    /// The basis computed now is not the one that the mark was written in.
    #[error(
        "patch {patch} does not have the harmonics that the mark was written in (last eigenvalue {found} here, {expected} there); \
         verify with the version of Sigmark that wrote it"
    )]
    BasisMismatch {
        /// Which patch, from 0.
        patch: usize,
        /// The last eigenvalue that the mark was written with.
        expected: f64,
        /// The one that was computed.
        found: f64,
    },
    /// There is not one observation a vertex.
    #[error("{given} observations were given of {vertices} vertices; register the suspect to this very mesh")]
    Vertices {
        /// How many observations.
        given: usize,
        /// #V of the original.
        vertices: usize,
    },
    /// Bits of another number than the layout has.
    #[error("{given} bits were given for a mark of {wanted}")]
    Bits {
        /// How many bits.
        given: usize,
        /// l.
        wanted: usize,
    },
    /// There is not one value a patch.
    #[error("{given} values were given for {patches} patches; give one for each")]
    Patches {
        /// How many values.
        given: usize,
        /// How many patches.
        patches: usize,
    },
    /// Registration of a suspect.
    #[error(transparent)]
    Registration(registration::RegistrationError),
    /// Positions that make no mesh.
    #[error(transparent)]
    Mesh(#[from] mesh::MeshError),
    /// The normal equations of the alignment hold no finite numbers.
    #[error(
        "the suspect can't be aligned with the original: its coordinates are beyond what double precision can square"
    )]
    Alignment,
    /// Threads could not be started, or the observer asked to stop.
    #[error(transparent)]
    Job(#[from] job::JobError),
}

impl From<partition::PartitionError> for MarkError {
    /// A job that could not be done is always [`MarkError::Job`].
    fn from(error: partition::PartitionError) -> Self {
        match error {
            partition::PartitionError::Job(error) => Self::Job(error),
            error => Self::Partition(error),
        }
    }
}

impl From<registration::RegistrationError> for MarkError {
    /// A job that could not be done is always [`MarkError::Job`].
    fn from(error: registration::RegistrationError) -> Self {
        match error {
            registration::RegistrationError::Job(error) => Self::Job(error),
            error => Self::Registration(error),
        }
    }
}
