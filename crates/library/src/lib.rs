//! Which of very many originals a mesh was made of.
//!
//! A [`Library`] is one file, an SQLite database: of each original its digest, its [`Descriptor`], its [geometry](pack_geometry) without loss, where its files lie, and the
//! certificates that name it. An [`Index`] holds all descriptors in memory and tells, by an exact scan, which originals a suspect resembles most:
//!
//! ```
//! use job::Job;
//! use library::{Entry, Index, Library, Query};
//! use mesh::shapes;
//!
//! let folder = tempfile::tempdir()?;
//! let mut library = Library::create(&folder.path().join("lib.sigmark"))?;
//! for seed in 0..4 {
//!     let mesh = shapes::bumpy_sphere(4, seed);
//!     library.add(&Entry::of(&format!("ball {seed}"), &mesh, true)?)?;
//! }
//! let index = Index::load(&library, &Job::default())?;
//! let suspect = shapes::jittered(&shapes::bumpy_sphere(4, 2), 0.1, 7);
//! let found = index.search(&library, &Query::of(&suspect, &Job::default())?, 10, &Job::default())?;
//! assert_eq!(library.original(found[0].original)?.name, "ball 2");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Descriptors
//! Everything is computed from samples of the surface, so that neither vertices nor triangles matter, and in units of the samples themselves, so that place, size and position
//! don't. Four things are known of each original, and each finds what the others lose:
//! - *whole*: how mass lies about the centre, by spherical harmonics of six shells. It outlasts noise, smoothing, decimation, subdivision, re-meshing.
//! - *surface*: what balls around 1024 and 512 places see, of two radii, as words and as codes, and 2048 samples. It finds what was cropped: originals with the suspect's words come first, and on the likeliest of them the suspect is laid.
//! - *local*: which small shapes a surface has, wherever they lie. It finds what was posed.
//! - *tessellation*: some vertices of its file, by how triangles hang together around them. It finds crops and poses that left the triangles alone.
//!
//! # What is not here
//! Alignment, reading of marks, and verdicts: a candidate says where to look, and is no claim. Nothing secret is kept: no signing key is ever asked for.
//!
//! # Conventions
//! Distances of descriptors are mean absolute differences of bytes. Nothing is random, results do not depend on the number of threads. Certificates are texts here: who adds one has
//! checked it. A database is a stranger's file: its tables are compared with what they have to be, lengths are checked before anything is allocated, geometry by its digest; nothing panics.
//!
//! # Costs
//! Some 6 KiB an original in memory, and 30 KiB in the file beside the geometry. `results/library.md` has the seconds, and how often the right original is found.
//!
//! # Sources
//! Kazhdan, Funkhouser, Rusinkiewicz, *Rotation invariant spherical harmonic representation of 3D shape descriptors*, SGP 2003 (energies by shell and degree). Pottmann, Wallner, Huang, Yang,
//! *Integral invariants for robust geometry processing*, CAGD 2009 (what a ball sees of a surface). Sivic, Zisserman, *Video Google*, ICCV 2003 (words of places, and lists of who has them). Osada, Funkhouser, Chazelle, Dobkin, *Shape distributions*, TOG 2002 (samples in place of
//! triangles).

mod descriptor;
mod error;
mod geometry;
mod index;
mod store;

pub use descriptor::{Descriptor, Query};
pub use error::LibraryError;
pub use geometry::{MOST_GEOMETRY, pack_geometry, unpack_geometry};
pub use index::{By, Candidate, Index};
pub use store::{
    AddedAs, CertificateRecord, Entry, FileRecord, Library, OriginalId, OriginalRecord, SCHEMA_VERSION,
};
