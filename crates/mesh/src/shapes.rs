//! Meshes with known facts, for tests and examples. All are deterministic; those with a seed depend on nothing else.
//!
//! Closed surfaces face outward. A panic means that a count is too small to make the shape.
//!
//! | shape | #V | #F | χ | boundary loops | exact facts |
//! |---|---|---|---|---|---|
//! | [`tetrahedron`] | 4 | 4 | 2 | 0 | regular, edges √8, centre 0 |
//! | [`cube`] | 8 | 12 | 2 | 0 | from 0 to `side`: area 6 side², volume side³ |
//! | [`icosphere`] | 10·4ˡ + 2 | 20·4ˡ | 2 | 0 | vertices on the unit sphere; area → 4π as 4⁻ˡ |
//! | [`torus`] | nu nv | 2 nu nv | 0 | 0 | vertices on the torus; area → 4π² R r |
//! | [`block`] | – | – | 2 − 2 holes | 0 | (2 holes + 1) × 3 × 1 with square holes: area 22 + 18·… see there |
//! | [`rectangle`] | (nx + 1)(ny + 1) | 2 nx ny | 1 | 1 | z = 0, faces +z, area width·height |
//! | [`cylinder`] | nu (nz + 1) | 2 nu nz | 0 | 2 | no caps |
//! | [`moebius_strip`] | 2 n | 2 n | 0 | 1 | one side |
//! | [`book`] | 2 + 2 pages | 2 pages | 1 | – | one edge with `pages` triangles, of pages 1 × 1 |
//! | [`book_of_slivers`] | 2 n + 2 | 2 n | 1 | 1 | flat strip, two angles of each triangle near right, one `angle` |
//! | [`soup`] | 3 n | n | n | n | no two triangles share a vertex |
//! | [`bumpy_sphere`] | 10·4ˡ + 2 | 20·4ˡ | 2 | 0 | irregular, no symmetry |
//! | [`bumpy_torus`] | nu nv | 2 nu nv | 0 | 0 | irregular, no symmetry |
//! | [`bumpy_block`] | – | – | 2 − 2 holes | 0 | irregular, no symmetry |
//!
//! Changes to a mesh: [`moved`], [`mirrored`], [`union`], [`shuffled`], [`exploded`], [`jittered`], [`flipped`], [`bumped`].

mod irregular;
mod plain;

pub use irregular::*;
pub use plain::*;
