//! Manifold harmonics: the lower Laplace–Beltrami spectrum of a triangle mesh, and the transforms it spans.
//!
//! Computes the m lowest eigenpairs of
//!
//! > S h = λ D h,  λ_0 = 0 ≤ λ_1 ≤ …,  Hᵀ D H = I  (eq. 5)
//!
//! where S is the cotangent stiffness matrix and D the lumped mass of linear finite elements (eqs. 3, 4), or B, their full mass
//! (eq. 3), in place of D ([`Mass::Full`]). Proves that none is missing, and turns functions on the mesh into coefficients and back (eqs. 6–8).
//!
//! ```
//! use job::Job;
//! use mhb_core::{Spectrum, SpectrumOptions};
//!
//! let mesh = mesh::shapes::icosphere(4);
//! let options = SpectrumOptions { count: 9, ..Default::default() };
//! let spectrum = Spectrum::compute(&mesh, &options, &Job::default())?;
//! assert!((spectrum.eigenvalues()[1] - 2.0).abs() < 0.01); // l (l + 1) for l = 1, three times
//! assert!((spectrum.eigenvalues()[4] - 6.0).abs() < 0.05); // and for l = 2, five times
//!
//! // The coordinates of a sphere are its eigenfunctions of l = 1: nothing is left to the other pairs.
//! let difference = spectrum.reconstruction_difference(mesh.positions());
//! assert!(difference.iter().flatten().all(|d| d.abs() < 1e-3));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Conventions
//! - S is positive semidefinite: the negative of the paper's Q. Its rows sum to zero.
//! - Everything is in the mesh's own unit: scaling it by s scales λ by 1/s², D by s² and H by 1/s. Inside, the total mass is 1, so
//!   that nothing depends on the unit.
//! - Columns of H are canonical: the same, to the accuracy asked for, on any machine, for any number of threads and of pairs. Signs,
//!   and rotations inside clusters of close eigenvalues, are fixed by comparison with noise that depends on the vertex's index.
//! - Each connected component adds one eigenvalue 0. Function 0 is a positive constant; contrasts between components follow. Where vertices are
//!   held fixed ([`Spectrum::with_fixed`]), only components without one do so.
//! - Vertices that no triangle uses have no mass and are refused.
//!
//! # Cost
//! About 2.8 triangular solves a pair, in bands of some 90 pairs that need 2 KiB a vertex each: 325 pairs of 35 000 vertices take 2 to 3 s on
//! one core and 250 MiB. Memory grows with the result, twice its size at the end. What was tried, measured and rejected stands in
//! `EIGENSOLVER.md`.
//!
//! # Sources
//! Vallet and Lévy, Spectral geometry processing with manifold harmonics, 2008 (the transform, bands of the spectrum). Wang, Feng and Miao,
//! 2012 (equation numbers). Sharp and Crane, A Laplacian for nonmanifold triangle meshes, 2020 ([`LaplacianKind::Intrinsic`]).

mod canonical;
mod dense;
mod error;
mod inertia;
mod intrinsic;
mod kernel;
mod laplacian;
mod noise;
mod operator;
mod options;
mod solver;
mod spectrum;
mod stage;
mod transform;
mod triangle;

pub use error::SpectrumError;
pub use inertia::InertiaCount;
pub use laplacian::{Laplacian, LaplacianKind, Mass, lumped_mass};
pub use options::SpectrumOptions;
pub use spectrum::Spectrum;
pub use stage::SpectrumStage;

#[cfg(feature = "bench-internals")]
#[doc(hidden)]
pub use solver::bench;
