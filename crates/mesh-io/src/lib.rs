//! Mesh files that are written back with new positions and nothing else changed.
//!
//! An [`Asset`] keeps all bytes of a file and knows where in them each coordinate lies. Its geometry is seen as a welded
//! [`TriMesh`](mesh::TriMesh); new positions are written into the kept bytes, so that no format has a writer that could forget
//! something. Where a mesh moves as a whole, [`Asset::moved_by`] turns its normals, too. [`write_mesh`] makes a file where there was none. GLB, glTF, OBJ, PLY, STL and OFF are read, each also gzipped; 3MF; and the one mesh
//! of a zip archive.
//!
//! ```
//! let tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0 # top\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
//! let asset = mesh_io::Asset::from_bytes(tetrahedron, mesh_io::Format::Obj)?;
//! let mut positions = asset.mesh().positions().to_vec();
//! positions[2][1] += 0.25;
//! let moved = asset.with_positions(&positions)?;
//! assert_eq!(*moved.to_bytes(), *tetrahedron.replace("0 1 0 # top", "0 1.25 0 # top").as_bytes());
//! # Ok::<(), mesh_io::AssetError>(())
//! ```
//!
//! **Costs.** Reading takes linear time (welding n log n) and memory of some six times the file's size, sixteen at worst; counts in a header
//! are checked against that size before anything is allocated. Files of more than [`LARGEST`] bytes, a GiB, are refused, and so
//! are gzipped ones that unpack to more.

mod archive;
mod asset;
mod buffer;
mod companion;
mod error;
mod export;
mod format;
mod formats;
mod gzip;
mod materials;
mod number;
mod packing;
mod picture;
mod save;
mod scalar;
mod slots;
mod source;
mod words;

pub use asset::{Asset, Moved};
pub use companion::{Companion, companions_of};
pub use error::{AssetError, AssetProblem, Place};
pub use export::{Precision, write_coloured_ply, write_mesh};
pub use format::Format;
pub use save::{write_file, write_private_file};
pub use slots::directions::Unturned;
pub use source::LARGEST;
