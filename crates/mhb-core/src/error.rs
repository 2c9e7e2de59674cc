use job::JobError;

/// Why no spectrum could be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpectrumError {
    /// A mesh of n vertices has n eigenpairs, and at least one must be asked for.
    #[error("{count} eigenpairs were asked for; a mesh of {vertices} vertices has 1 to {vertices}")]
    Count {
        /// How many were asked for.
        count: usize,
        /// How many there are.
        vertices: usize,
    },
    /// The tolerance on relative residuals must be a number between 0 and 1.
    #[error("the tolerance {tolerance} is not between 0 and 1; 1e-6 to 1e-10 are sensible")]
    Tolerance {
        /// The value that was given.
        tolerance: f64,
    },
    /// A vertex carries no area, because no triangle uses it: the mass matrix is singular.
    #[error(
        "vertex {vertex} has mass {mass}: no triangle uses it, so set unused vertices aside (mesh::Welded does)"
    )]
    Mass {
        /// Index of the first such vertex.
        vertex: usize,
        /// Its mass.
        mass: f64,
    },
    /// All vertices lie in one place, or the surface is too small or too large for double precision.
    #[error(
        "the surface has area {area}: its size must be positive, and within what double precision can square"
    )]
    Area {
        /// The sum of the triangles' areas.
        area: f64,
    },
    /// The stiffness matrix must be square, with one mass a row.
    #[error("a stiffness matrix of {rows} by {columns} does not go with {masses} masses")]
    Shape {
        /// Rows of the stiffness matrix.
        rows: usize,
        /// Its columns.
        columns: usize,
        /// Entries of the lumped mass.
        masses: usize,
    },
    /// An entry of the stiffness matrix is NaN or infinite, or differs from its mirror image.
    #[error(
        "entry ({row}, {column}) of the stiffness matrix is not finite, or not equal to entry ({column}, {row})"
    )]
    Entry {
        /// Row of the entry.
        row: usize,
        /// Its column.
        column: usize,
    },
    /// Rows of a Laplacian sum to zero, so that constants have eigenvalue zero.
    #[error("row {row} of the stiffness matrix sums to {sum}, not to zero: this is no Laplacian")]
    RowSum {
        /// The row.
        row: usize,
        /// What it sums to.
        sum: f64,
    },
    /// A sparse or dense factorisation failed its check, at every shift that was tried.
    #[error(
        "the factorisation at shift {shift} is inaccurate (backward error {backward_error:e}): the mesh has extreme triangles, mend them or re-mesh"
    )]
    Factorisation {
        /// The shift, in units of 1 / total mass.
        shift: f64,
        /// Largest componentwise backward error of the probe.
        backward_error: f64,
    },
    /// The factors do not fit in memory.
    #[error("there is not enough memory to factorise a matrix of {size} rows: split the mesh into patches")]
    Memory {
        /// Number of rows.
        size: usize,
    },
    /// The eigenfunctions that were asked for do not fit in memory.
    #[error(
        "{count} eigenfunctions of {vertices} vertices do not fit in memory: ask for fewer, or split the mesh into patches"
    )]
    Eigenfunctions {
        /// How many were asked for.
        count: usize,
        /// How many values each has.
        vertices: usize,
    },
    /// As many pairs were found below a shift as inertia does not prove there: some are missing, or counted twice.
    #[error(
        "found {found} eigenpairs below {shift}, where inertia proves {proven}: loosen the tolerance, or mend extreme triangles"
    )]
    Incomplete {
        /// The shift, in units of 1 / total mass.
        shift: f64,
        /// How many pairs exist below it, by Sylvester's law of inertia.
        proven: usize,
        /// How many were found.
        found: usize,
    },
    /// A dense eigenproblem did not converge, which finite input does not cause.
    #[error("a dense eigenproblem of size {size} did not converge")]
    Dense {
        /// Its number of rows.
        size: usize,
    },
    /// The job was cancelled, or got no threads.
    #[error(transparent)]
    Job(#[from] JobError),
}
