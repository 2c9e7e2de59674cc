//! Manifold harmonics: the lower Laplace–Beltrami spectrum of a triangle mesh, and the transforms it spans.
//!
//! Eigenpairs of S h = λ D h, where S is the cotangent stiffness matrix and D the lumped mass (linear finite elements).
//!
//! ```
//! use mesh::TriMesh;
//! use mhb_core::{Spectrum, SpectrumOptions};
//!
//! let tetrahedron = TriMesh::new(
//!     vec![[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]],
//!     vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
//! )?;
//! let spectrum = Spectrum::compute(&tetrahedron, &SpectrumOptions { count: 4, ..Default::default() })?;
//! assert_eq!(spectrum.eigenvalues()[0], 0.0);
//!
//! let coefficients = spectrum.transform_positions(tetrahedron.positions());
//! let positions = spectrum.inverse_transform_positions(&coefficients);
//! assert!((positions[2][1] - 1.0).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod canonical;
mod dense;
mod error;
mod intrinsic;
mod kernel;
mod laplacian;
mod observer;
mod operator;
mod solver;
mod spectrum;
mod transform;
mod triangle;

pub use error::SpectrumError;
pub use laplacian::{Laplacian, LaplacianKind, full_mass, lumped_mass, stiffness};
pub use observer::{Observer, Phase, Unobserved};
pub use spectrum::{Certificate, Spectrum, SpectrumOptions};
