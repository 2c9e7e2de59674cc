/// Why positions and triangles do not make a mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A surface is needed; a point cloud or an empty list of faces has none.
    #[error(
        "the mesh has no triangles: a surface is needed, not a point cloud; export the model with its faces"
    )]
    NoTriangles,
    /// A coordinate is NaN or infinite, usually from a division by zero in the program that wrote it.
    #[error("vertex {vertex} has a coordinate that is not a finite number: {position:?}")]
    NotFinite {
        /// Index of the vertex, from 0.
        vertex: usize,
        /// Its coordinates as they were given.
        position: [f64; 3],
    },
    /// A coordinate is beyond [`LARGEST_COORDINATE`](crate::LARGEST_COORDINATE).
    #[error(
        "vertex {vertex} has a coordinate beyond single precision's 3.4e38, which can't be computed with: {position:?}; scale the model down"
    )]
    TooFar {
        /// Index of the vertex, from 0.
        vertex: usize,
        /// Its coordinates as they were given.
        position: [f64; 3],
    },
    /// All vertices lie together within [`SMALLEST_EXTENT`](crate::SMALLEST_EXTENT), but not at one point.
    #[error("the model is {extent:e} units large, and less than 1.2e-38 can't be computed with: scale it up")]
    TooSmall {
        /// The longest edge of its bounding box.
        extent: f64,
    },
    /// A triangle names a vertex that does not exist.
    #[error(
        "triangle {triangle} refers to vertex {vertex}, but there are only {count} vertices (indices start at 0)"
    )]
    IndexOutOfRange {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// The index that it holds.
        vertex: u64,
        /// How many vertices there are.
        count: usize,
    },
    /// Every triangle has two corners at one point: the file may hold curves, or lost its precision when it was written.
    #[error(
        "no triangle is left of {count}, since each has two corners at the same point: check the precision the file was written with"
    )]
    OnlyRepeatedVertices {
        /// How many triangles there are.
        count: usize,
    },
    /// A triangle uses one vertex twice; [`Welded`](crate::Welded) sets such triangles aside.
    #[error("triangle {triangle} uses vertex {vertex} more than once")]
    RepeatedVertex {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// The vertex that it repeats.
        vertex: u32,
    },
    /// Vertices and triangles are counted in 32 bits.
    #[error("{count} {what} are more than this library counts ({limit}): split the model into parts")]
    TooLarge {
        /// "vertices" or "triangles".
        what: &'static str,
        /// How many were given.
        count: usize,
        /// The most that can be counted.
        limit: usize,
    },
    /// New positions must come one a vertex.
    #[error("{given} positions were given for a mesh of {expected} vertices")]
    PositionCount {
        /// How many were given.
        given: usize,
        /// How many vertices the mesh has.
        expected: usize,
    },
}
