//! How far two meshes differ: by distance, by shape, to the eye; and pictures of where.
//!
//! | metric | types | needs | source |
//! |---|---|---|---|
//! | d_rmse (eq. 21), mean, forward and symmetric Hausdorff distance, MRMS | [`DistanceMetric`]: [`SurfaceDistance`], [`SymmetricDistance`] | surfaces in the same place | Aspert et al. 2002, Cignoni et al. 1998, Wang et al. 2010 |
//! | Shape-DNA d_{p,m} (eqs. 22–24) | [`ShapeDnaMetric`]: [`ShapeDna`] | nothing: it does not depend on place, pose or size | Reuter et al. 2006 |
//! | MSDM2 | [`Msdm2Metric`]: [`Msdm2`] | surfaces in the same place | Lavoué 2011 |
//! | DAME | [`DameMetric`]: [`Dame`] | the same connectivity | Váša and Rus 2012 |
//!
//! All are [`Metric`]s, for programs that offer a choice; each has functions and results of its own besides.
//!
//! ```
//! use job::Job;
//! use quality::{DistanceOptions, Normalisation, ShapeDna, ShapeDnaOptions, SymmetricDistance};
//!
//! let original = mesh::shapes::bumpy_sphere(4, 1);
//! let marked = mesh::shapes::jittered(&original, 0.05, 2);
//!
//! let job = Job::new(2);
//! let distance = SymmetricDistance::between(&marked, &original, &DistanceOptions::default(), &job)?;
//! let d_rmse = distance.forward.rmse / distance.diagonal;
//! assert!(0.0 < d_rmse && d_rmse < distance.hausdorff() / distance.diagonal);
//!
//! let [a, b] = [&marked, &original].map(|mesh| ShapeDna::of(mesh, &ShapeDnaOptions::default(), &job).unwrap());
//! let d_2_50 = a.distance(&b, 2.0, Normalisation::FirstEigenvalue)?;
//! assert!(d_2_50 < 1.0);
//! # Ok::<(), quality::QualityError>(())
//! ```
//!
//! # Conventions
//! Distances are in the meshes' unit; whoever shows them divides by the diagonal of the reference's bounding box. Forward is from
//! the distorted mesh to the reference, backward the other way. Vertices and triangles count from 0. Nothing is random; results do
//! not depend on the number of threads.
//!
//! # Features
//! `png`: pictures as PNG files.
//!
//! # Costs
//! A sample of a distance takes 0.3 µs (the bunny's 4.7 million: 1.3 s), a Shape-DNA of 35 000 vertices and 50 eigenvalues 1 s, MSDM2
//! and DAME less than a second each. Memory is about 500 bytes a vertex, for a Shape-DNA 3 KiB.
//!
//! # Sources
//! - Wang, Feng, Miao, *A robust confirmable watermarking algorithm for 3D mesh based on manifold harmonics analysis*, 2012, section 5
//! - Cignoni, Rocchini, Scopigno, *Metro: measuring error on simplified surfaces*, CGF 1998
//! - Aspert, Santa-Cruz, Ebrahimi, *MESH: measuring errors between surfaces using the Hausdorff distance*, ICME 2002
//! - Wang, Lavoué, Denis, Baskurt, He, *A benchmark for 3D mesh watermarking*, SMI 2010 (MRMS)
//! - Reuter, Wolter, Peinecke, *Laplace–Beltrami spectra as "Shape-DNA" of surfaces and solids*, CAD 2006
//! - Lavoué, *A multiscale metric for 3D mesh visual quality assessment*, CGF 2011
//! - Váša, Rus, *Dihedral Angle Mesh Error*, CGF 2012

mod distance;
mod error;
mod facet_turn;
mod heatmap;
mod metric;
mod perceptual;
pub mod picture;
mod sampling;
mod shape_dna;

pub use distance::{
    DistanceMetric, DistanceOptions, SurfaceDistance, SymmetricDistance, surface_distance, vertex_distances,
};
pub use error::{QualityError, Side};
pub use facet_turn::{FacetTurn, FacetTurnMetric, TurnSummary};
pub use heatmap::{Scale, heatmap};
pub use metric::{Figure, Measurement, Metric, Needs};
pub use mhb_core::Mass;
pub use perceptual::{Dame, DameMetric, Msdm2, Msdm2Metric, Visibility, same_connectivity};
pub use shape_dna::{Normalisation, ShapeDna, ShapeDnaMetric, ShapeDnaOptions};
