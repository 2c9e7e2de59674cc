//! Triangle meshes with checked topology, and mesh files that are written back with new positions and nothing else changed.

mod asset;
mod boundary;
mod components;
mod edges;
mod error;
mod normals;
pub mod shapes;
mod similarity;
mod topology;
mod trimesh;
mod union_find;
mod vector;
mod weld;

pub use asset::{Asset, AssetError, Format, Place, Precision, write_mesh};
pub use boundary::{BoundaryLoop, boundary_loops};
pub use components::{Components, components};
pub use edges::{Adjacency, Edges};
pub use error::MeshError;
pub use similarity::Similarity;
pub use topology::{DEGENERATE_AREA, Facing, TopologyReport};
pub use trimesh::{BoundingBox, TriMesh};
pub use weld::{WeldSummary, Welded};
