//! Triangle meshes with checked topology, and mesh files that are written back with new positions and nothing else changed.

mod error;
mod trimesh;

pub use error::MeshError;
pub use trimesh::{BoundingBox, TriMesh};
