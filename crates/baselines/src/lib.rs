//! The watermarks that Wang, Feng and Miao (2012) hold manifold harmonics against, and those, behind one interface.
//!
//! An [`Algorithm`] prepares an original once; what it prepared writes any signature at any strength, and reads bits back from a
//! registered suspect. Whoever compares algorithms gives each the same mesh, patches, bits and suspects.
//!
//! | algorithm | basis of each patch | chips | mark | base |
//! |---|---|---|---|---|
//! | [`Mhb`] (section 4) | S h = λ D h, m = ⌈lc/3⌉ + 1 | one axis each, c = 3 | x̃ + α s φ | the original |
//! | [`Lbf`] (Ohbuchi et al. 2001, 2002) | K e = λ e, m in the thousands | one a function, on all axes, c = 1 | x̃ + α s φ | m functions' reconstruction |
//! | [`Rbf`] (Wu and Kobbelt 2005) | orthonormal radial functions, ⌈l/3⌉ | one axis each, c = 1 | x̃ (1 + α s) | the original |
//! | [`Adapted`] (the paper's conclusion) | either rival's | those of MHBs | x̃ + α s φ | the original |
//!
//! All are linear: a mark is base + α Σₜ sₜ Fₜ, with a vector field Fₜ for bit t.
//!
//! ```
//! use job::Job;
//! use baselines::{Algorithm, Prepared, Rbf, Subject};
//! use sigmark::mark::{PatchCount, Patches, Registered};
//!
//! let job = Job::default();
//! let mesh = mesh::shapes::translated(&mesh::shapes::bumpy_sphere(4, 1), [3.0, 2.0, 1.0]);
//! let patches = Patches::cut(&mesh, 40, PatchCount::Paper, &job)?;
//! let subject = Subject { mesh: &mesh, patches: &patches, bits: 24 };
//! let signature: Vec<bool> = (0..24).map(|t| t % 3 == 0).collect();
//!
//! let prepared = Rbf::default().prepare(&subject, &job)?;
//! let marked = prepared.embed(&signature, Rbf::PAPER_ALPHA, &job)?;
//!
//! let suspect = Registered::by_vertices(marked.into_iter().map(Some).collect());
//! assert_eq!(prepared.extract(&suspect, Rbf::PAPER_ALPHA, &job)?.hard(), signature);
//! # Ok::<(), baselines::BaselineError>(())
//! ```
//!
//! # Conventions
//! Those of [`sigmark`]: bits are `bool`, axes 0, 1, 2 are x, y, z, suspects stand in the original's frame. α is the algorithm's own
//! and has the meaning that the paper gives it; displacements are in the mesh's unit. Results do not depend on the number of threads.
//!
//! # Costs
//! What is prepared keeps 8 bytes for each vertex and modulated function. While an [`Lbf`] is prepared, a patch needs some 16 m bytes a
//! vertex; 5 000 functions of 35 000 vertices take minutes. Radial functions take #V k² operations.
//!
//! # Sources
//! - Ohbuchi, Takahashi, Miyazawa, Mukaiyama, *Watermarking 3D polygonal meshes in the mesh spectral domain*, Graphics Interface 2001
//! - Ohbuchi, Mukaiyama, Takahashi, *A frequency-domain approach to watermarking 3D shapes*, CGF 2002
//! - Wu, Kobbelt, *Efficient spectral watermarking of large meshes with orthogonal basis functions*, The Visual Computer 2005
//! - Wang, Feng, Miao, *A robust confirmable watermarking algorithm for 3D mesh based on manifold harmonics analysis*, 2012, section 5

mod adapted;
mod algorithm;
mod carrier;
mod error;
mod id;
mod kirchhoff;
mod lbf;
mod mhb;
mod radial;
mod rbf;

pub use adapted::{Adapted, Basis};
pub use algorithm::{Algorithm, Prepared, Reference, Subject, entries};
pub use error::BaselineError;
pub use id::{AlgorithmId, DetectorId};
pub use kirchhoff::kirchhoff;
pub use lbf::Lbf;
pub use mhb::{MakeMethod, Mhb};
pub use radial::{Kernel, farthest_points, radial_basis};
pub use rbf::Rbf;
