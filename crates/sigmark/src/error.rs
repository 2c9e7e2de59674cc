use crate::signature::SignatureError;

/// Why a mesh could not be signed, or a suspect not be judged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SigmarkError {
    /// The payload has no bits, or each bit no chip.
    #[error("a mark of {bits} bits with chip rate {rate} is empty; both must be at least 1")]
    EmptyLayout {
        /// l.
        bits: usize,
        /// c.
        rate: usize,
    },
    /// The patches were cut for another mark.
    #[error(
        "the original was cut for {} bits with chip rate {}, but the mark has {} bits with chip rate {}; cut it anew",
        prepared.bits(), prepared.rate(), wanted.bits(), wanted.rate()
    )]
    Layout {
        /// What the patches have room for.
        prepared: crate::ChipLayout,
        /// What the mark needs.
        wanted: crate::ChipLayout,
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
         use a lower chip rate, a shorter signature (the paper profile), or a finer mesh"
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
    Partition(#[from] partition::PartitionError),
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
        "patch {patch} does not have the harmonics that the certificate records (last eigenvalue {found} here, {recorded} there); \
         verify with the version of Sigmark that made the certificate"
    )]
    BasisMismatch {
        /// Which patch, from 0.
        patch: usize,
        /// The last eigenvalue that the certificate records.
        recorded: f64,
        /// The one that was computed.
        found: f64,
    },
    /// The certificate describes other patches or another Laplacian.
    #[error(
        "the certificate describes other patches, or another Laplacian, than the original was prepared with; prepare it as the certificate says"
    )]
    AnotherCut,
    /// The certificate is for another mesh.
    #[error(
        "this is not the original that the certificate was made for (digest {found} here, {expected} in the certificate); \
         use the very file that was signed, not a converted or edited copy"
    )]
    AnotherOriginal {
        /// The certificate's digest.
        expected: String,
        /// This mesh's digest.
        found: String,
    },
    /// The certificate was issued by another key.
    #[error(
        "the certificate was issued by the key {certificate}, not by the given public key {given}; use the public key of the signer"
    )]
    AnotherKey {
        /// Fingerprint of the certificate's key.
        certificate: String,
        /// Fingerprint of the key that was given.
        given: String,
    },
    /// A certificate can't be read.
    #[error(transparent)]
    Certificate(#[from] crate::CertificateError),
    /// Keys and signatures.
    #[error(transparent)]
    Signature(#[from] SignatureError),
    /// Registration of a suspect.
    #[error(transparent)]
    Registration(#[from] registration::RegistrationError),
    /// Positions that make no mesh.
    #[error(transparent)]
    Mesh(#[from] mesh::MeshError),
    /// The normal equations of the alignment hold no finite numbers.
    #[error(
        "the suspect can't be aligned with the original: its coordinates are beyond what double precision can square"
    )]
    Alignment,
    /// The observer asked to stop.
    #[error("stopped on request")]
    Cancelled,
}
