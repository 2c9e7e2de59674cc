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
//! | [`block`] | q + χ | 2 q | 2 − 2 h | 0 | h holes; area A = 18 h + 14, q = A n² cells, volume 5 h + 3 |
//! | [`rectangle`] | (nx + 1)(ny + 1) | 2 nx ny | 1 | 1 | z = 0, faces +z, area width·height |
//! | [`cylinder`] | nu (nz + 1) | 2 nu nz | 0 | 2 | no caps |
//! | [`moebius_strip`] | 2 n | 2 n | 0 | 1 | one side |
//! | [`book`] | 2 + 2 pages | 2 pages | 1 | `pages` open curves | one edge with `pages` triangles, of pages 1 × 1; curves are loops below three pages |
//! | [`book_of_slivers`] | 2 n + 2 | 2 n | 1 | 1 | flat strip, two angles of each triangle near right, one `angle` |
//! | [`soup`] | 3 n | n | n | n | no two triangles share a vertex |
//! | [`bumpy_sphere`] | 10·4ˡ + 2 | 20·4ˡ | 2 | 0 | irregular, no symmetry |
//! | [`bumpy_torus`] | nu nv | 2 nu nv | 0 | 0 | irregular, no symmetry |
//! | [`bumpy_block`] | q + χ | 2 q | 2 − 2 h | 0 | irregular, no symmetry |
//!
//! Changes to a mesh: [`moved`], [`scaled`], [`translated`], [`mirrored`], [`inside_out`], [`disjoint_union`], [`exploded`], [`shuffled`],
//! [`jittered`], [`flipped`], [`bumped`], [`divided`], [`dragged`].

mod dragged;
mod irregular;
mod plain;

pub use dragged::{dragged, turned};
pub use irregular::{bumped, bumpy_block, bumpy_sphere, bumpy_torus, flipped, jittered, shuffled, soup};
pub use plain::{
    block, book, book_of_slivers, cube, cylinder, disjoint_union, divided, exploded, icosphere, inside_out,
    mirrored, moebius_strip, moved, rectangle, scaled, tetrahedron, torus, translated,
};
