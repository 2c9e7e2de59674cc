//! Brings a suspect mesh back onto its original, and samples it at the original's vertices (section 4.4.1 of
//! the paper).
//!
//! [`align`] finds the similarity y = s R x + t that takes the suspect to the original, wherever that lies:
//!
//! 1. by vertices that survived, where the suspect kept the original's connectivity, wholly
//!    ([`match_connectivity`]) or in part ([`match_surroundings`]): the least-squares similarity between
//!    corresponding points ([`fit_similarity`]);
//! 2. else by the surfaces: pose hypotheses from the given pose, from principal axes, from rotations all around and
//!    from congruent pairs of oriented points, refined from coarse to fine by point-to-plane ICP with scale, robust
//!    weights and trimming.
//!
//! The paper takes 4-points congruent sets (Aiger et al. 2008) for the coarse alignment. Pairs of oriented
//! points stand in their place here: where the scale is unknown, four points of 1000 leave about 10⁶ congruent
//! sets for a base, two points with their normals 1500. `congruent.rs` has the count. They are needed for
//! suspects alone that are cut and lost all their vertices.
//!
//! [`align_points`] begins from given pairs of points instead. [`Aligner`] keeps what it knows of an original
//! for the next suspect, and [`PreparedMesh`] what alignment and resampling both need of a mesh. The stages that
//! a [`Job`](job::Job) reports are those of [`RegistrationStage`].
//!
//! An original may be symmetric, or nearly so. Where the surfaces alone speak, it is aligned with itself once, which gives
//! its symmetries and, by composition, the group that they generate; every pose of the suspect comes with those that the
//! group makes of it. What near symmetries make of it, as the other side of an animal, is refined and compared: it may fit
//! a part of the shape as well, or better.
//!
//! [`resample`] then gives for each vertex v with normal n of the original the offset h at which v + h n lies
//! on the suspect.
//!
//! ```
//! use mesh::{Similarity, shapes};
//! use registration::{PreparedMesh, align, resample};
//!
//! let original = shapes::bumpy_torus(24, 16, 1);
//! let turn = Similarity::from_quaternion([1.0, 2.0, 3.0, 4.0]);
//! let moved = Similarity { scale: 0.01, translation: [1.0, 2.0, 3.0], ..turn };
//! let suspect = shapes::shuffled(&shapes::moved(&original, &moved), 5);
//!
//! let job = job::Job::default();
//! let (original, suspect) = (PreparedMesh::from(original), PreparedMesh::from(suspect));
//! let found = align(&original, &suspect, &Default::default(), &job)?;
//! assert!(found.aligned && (found.transform.scale - 100.0).abs() < 1e-9);
//! let seen = resample(&original, &suspect, &found.transform, &Default::default(), &job)?;
//! assert!(seen.offsets.iter().all(|h| h.unwrap().abs() < 1e-12));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Conventions
//! Points are `[x, y, z]` in the unit of their model, vertices and triangles count from 0, and every
//! transform takes the suspect to the original. Distances that options and results express as fractions are
//! fractions of a bounding-box diagonal. Nothing is random; results do not depend on the number of threads.
//!
//! # Costs
//! Matching vertices is O(n log n): with the judgement of the surfaces 0.3 s for 43 000 vertices. Aligning
//! surfaces of that size costs about a second, two for suspects that are cut and altered and for other models,
//! most of it in nearest-point queries on fixed numbers of samples. A million vertices against as many take five
//! seconds on two threads, most of it in building search trees and in looking for vertices, and a microsecond a
//! vertex to resample. Memory is about 600 bytes a vertex of each mesh.
//!
//! # What comes back from odd suspects
//! | suspect | answer |
//! |---|---|
//! | mirrored, inside out, of another size, in many pieces | aligned; [`Alignment::mirrored`] says so of the first |
//! | symmetric, or a part that lies as well by a near symmetry | all other poses are [`Alignment::alternatives`], up to 128; try them |
//! | with vertices split along seams | aligned as if they were not |
//! | a sphere, a surface of revolution | aligned; [`Alignment::free_directions`] is 3, 1: the pose is not determined |
//! | a plane, one triangle | not aligned when the surfaces alone speak for it: it lies on any flat place |
//! | another model | not aligned, with the overlap measured |
//! | no area | [`RegistrationError::NoSurface`] |
//!
//! A point cloud has no triangles and is no [`TriMesh`](mesh::TriMesh), nor is anything with a coordinate that
//! is not finite.
//!
//! # Sources
//! - Umeyama, *Least-squares estimation of transformation parameters between two point patterns*, PAMI 1991
//! - Weisfeiler and Leman, *The reduction of a graph to canonical form*, 1968
//! - Aiger, Mitra, Cohen-Or, *4-points congruent sets for robust pairwise surface registration*, SIGGRAPH
//!   2008
//! - Drost, Ulrich, Navab, Ilic, *Model globally, match locally*, CVPR 2010
//! - Pottmann, Huang, Yang, Hu, *Geometry and convergence analysis of algorithms for registration of 3D
//!   shapes*, IJCV 2006
//! - Zhang, Yao, Deng, *Fast and robust iterative closest point*, PAMI 2021 (Welsch's weights)

mod align;
mod alignment;
mod congruent;
mod connectivity;
mod error;
mod field;
mod hypotheses;
mod icp;
mod local_frames;
mod matrix;
mod overlap;
mod pieces;
mod points;
mod prepared;
mod resample;
mod rigged;
mod sampled;
mod search;
mod stage;
mod survivors;
mod symmetries;
mod umeyama;

pub use align::{Aligner, Placement, align, align_points};
pub use alignment::{AlignOptions, Alignment, MatchedBy};
pub use connectivity::{
    Correspondence, Difference, match_candidates, match_connectivity, match_cut, match_surroundings,
};
pub use error::RegistrationError;
pub use local_frames::{Degree, FrameOptions, LeftOfScalar, LocalFrames, bearable};
pub use pieces::{Piece, PiecePlace};
pub use points::PointPair;
pub use prepared::PreparedMesh;
pub use resample::{ResampleOptions, Resampled, resample};
pub use rigged::{
    Unposed, UnposedSurface, UnposedSuspect, unpose, unpose_any, unpose_bent, unpose_placed, unpose_surface,
};
pub use stage::RegistrationStage;
pub use umeyama::{Fit, Handedness, fit_similarity};
