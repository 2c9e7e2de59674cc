//! One mesh: its topology, its spectrum, its parts.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use mhb_core::LaplacianKind;

use super::{Common, numbers};

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark inspect model.obj

--json prints: file, format, gzipped, file_vertices, topology (counts and measures by name), remarks, capacity (chips: places for bits; \
payload: signature, or tag where there is little room; patches; unmarked_vertices; strengths: for subtle, standard and strong the strength, distortion_rms, payload, and as embed prints them margin_predicted, margin_read, noise_read, noise_evidence, noise_detected).")]
pub(crate) struct Inspect {
    /// The mesh
    pub(crate) model: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

/// A Laplacian of triangle meshes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Laplacian {
    /// Cotangent weights of the triangles as they are: the paper's
    #[default]
    Cotangent,
    /// The same after intrinsic Delaunay flips on the tufted cover: for slivers and non-manifold edges
    Intrinsic,
}

impl Laplacian {
    pub(crate) fn kind(self) -> LaplacianKind {
        match self {
            Self::Cotangent => LaplacianKind::Cotangent,
            Self::Intrinsic => LaplacianKind::Intrinsic,
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Cotangent => "cotangent",
            Self::Intrinsic => "intrinsic",
        }
    }
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark spectrum model.ply -k 325 -o basis.npz
  python3 -c \"import numpy; print(numpy.load('basis.npz')['eigenvalues'][:10])\"

Arrays in the file: eigenvalues (k, ascending, in 1/unit²), eigenfunctions (n × k, mass-orthonormal), residuals (k, \
relative), mass (n, lumped), vertex (n, the file vertex of each row: equal positions are welded, vertices that no face uses are left out).

--json prints: count, vertices, eigenvalues, laplacian, max_residual, residuals (of each pair), inertia_complete (whether it \
is proved that no pair is missing), inertia_counts (pairs of a shift and the number of eigenvalues that inertia proves below \
it), output, seconds (of each stage: reading, assembly, ordering, slicing, solving, finishing, writing).")]
pub(crate) struct Spectrum {
    /// The mesh
    pub(crate) model: PathBuf,
    /// How many eigenpairs
    #[arg(short = 'k', long, value_name = "K", default_value_t = 325, allow_negative_numbers = true, value_parser = numbers::count)]
    pub(crate) count: usize,
    /// Largest relative residual of a pair
    #[arg(long, value_name = "EPS", allow_negative_numbers = true, value_parser = numbers::between_0_and_1)]
    pub(crate) tolerance: Option<f64>,
    /// Which Laplacian
    #[arg(long, value_enum, default_value_t)]
    pub(crate) laplacian: Laplacian,
    /// Where to write eigenvalues, eigenfunctions, residuals and masses, as NPZ [default: nowhere]
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Replace a file that exists
    #[arg(long)]
    pub(crate) force: bool,
    #[command(flatten)]
    pub(crate) common: Common,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark partition model.ply -k 6 -o patches.ply --labels patches.txt
  sigmark partition grid.graph -k 16 --labels parts.txt

The input is a mesh file, whose vertices are divided, or a graph in METIS format (.graph). Parts are connected where the \
input is. The labels are one part number a line, from 0, in the order of the file's vertices; -1 for a vertex that no face \
uses. The mesh that -o writes is a binary PLY of the welded surface with a colour for each part.

--json prints: parts, cut (edges between parts), imbalance (heaviest part over the mean, less 1), components (connected \
pieces of each part), output, labels (file names, or null), seconds (of each stage).")]
pub(crate) struct Partition {
    /// The mesh, or a .graph file
    pub(crate) input: PathBuf,
    /// How many parts
    #[arg(short = 'k', long, value_name = "K", allow_negative_numbers = true, value_parser = numbers::count)]
    pub(crate) parts: usize,
    /// Where to write the mesh in the colours of its parts, as PLY
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Where to write the number of each vertex' part
    #[arg(long, value_name = "FILE")]
    pub(crate) labels: Option<PathBuf>,
    /// How unequal parts may be: the heaviest over the mean, less 1
    #[arg(
        long,
        value_name = "EPS",
        default_value_t = 0.03,
        allow_negative_numbers = true
    )]
    pub(crate) imbalance: f64,
    /// Take up to ten times longer for a shorter border
    #[arg(long)]
    pub(crate) high_effort: bool,
    /// Another number gives another partition
    #[arg(long, value_name = "SEED", default_value_t = 0)]
    pub(crate) seed: u64,
    /// Replace files that exist
    #[arg(long)]
    pub(crate) force: bool,
    #[command(flatten)]
    pub(crate) common: Common,
}
