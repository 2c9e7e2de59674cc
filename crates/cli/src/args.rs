//! What can be typed: every command, option and default, with the help texts.

use std::{path::PathBuf, time::Duration};

use clap::{Args, Parser, Subcommand, ValueEnum};
use mhb_core::LaplacianKind;
use sigmark::{Coverage, Curve, PatchCount, Scheme, Strength};

use crate::points::Pair;

/// Sign 3D models in their shape, and find the signature again
#[derive(Debug, Parser)]
#[command(
    name = "sigmark",
    bin_name = "sigmark",
    version,
    arg_required_else_help = true,
    max_term_width = 100,
    after_help = "\
A first session:
  sigmark keygen -o owner.pem
  sigmark embed model.obj -o signed.obj --key owner.pem --message \"© 2026 Studio, order 4711\"
  sigmark verify found.obj --original model.obj --certificate signed.obj.cert.json \\
      --public-key owner.pub.pem

Exit codes: 0 yes, or done; 1 no; 2 could not be done, with the reason on standard error.
`sigmark <COMMAND> --help` says more, with examples."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Make a key pair
    Keygen(Keygen),
    /// Sign a mesh: write a signature into its shape
    Embed(Embed),
    /// Ask whether a suspect mesh carries a signature
    Verify(Verify),
    /// Move a suspect onto its original
    Align(Align),
    /// Measure how far two meshes differ
    Compare(Compare),
    /// Report on a mesh file: topology, size, oddities
    Inspect(Inspect),
    /// Compute the lower Laplace-Beltrami spectrum of a mesh
    Spectrum(Spectrum),
    /// Cut a mesh or a graph into parts of equal size with short borders
    Partition(Partition),
}

/// A curve, a hash function, and what is signed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Profile {
    /// ECDSA on P-256 with SHA-256, 512 bits, over the message and the original's geometry
    #[default]
    Standard,
    /// The paper's: ECDSA on a binary curve (B-163) with SHA-1, 324 bits, over the message alone. For reproduction only
    Paper,
}

impl Profile {
    pub(crate) fn curve(self) -> Curve {
        self.scheme().curve()
    }

    pub(crate) fn scheme(self) -> Scheme {
        match self {
            Self::Standard => Scheme::EcdsaP256Sha256,
            Self::Paper => Scheme::EcdsaB163Sha1,
        }
    }

    pub(crate) fn coverage(self) -> Coverage {
        match self {
            Self::Standard => Coverage::MessageAndGeometry,
            Self::Paper => Coverage::Message,
        }
    }
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
  sigmark keygen -o owner.pem        writes owner.pem and owner.pub.pem

The private key is PKCS#8 PEM, readable by you alone; OpenSSL reads it too. Keep it secret and keep a copy: whoever \
has it can sign in your name, and without it nothing more can be signed. Give the public key to whoever is to verify.

--json prints: private_key, public_key (file names), curve, fingerprint.")]
pub(crate) struct Keygen {
    /// Where to write the private key; the public key goes beside it, as .pub.pem
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Which kind of signature the key is for
    #[arg(long, value_enum, default_value_t)]
    pub(crate) profile: Profile,
    /// Lock the private key with a passphrase, asked for or taken from SIGMARK_PASSPHRASE
    #[arg(long)]
    pub(crate) encrypt: bool,
    /// Replace files that exist
    #[arg(long)]
    pub(crate) force: bool,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark embed model.obj -o signed.obj --key owner.pem --message \"© 2026 Studio, order 4711\"

Writes signed.obj, the same file with other vertex positions, and signed.obj.cert.json, the certificate. Give away the \
signed file. Keep the original and the certificate: both are needed to verify, and whoever has both can remove the mark.

Reads and writes OBJ, PLY, STL and OFF, also gzipped. A locked key's passphrase is asked for, or taken from the \
environment variable SIGMARK_PASSPHRASE.

--json prints: output, certificate (file names), scheme, bits, chip_rate, laplacian, functions (manifold harmonics of a patch), \
patches, unmarked_vertices, alpha, distortion_rms (fraction of the diagonal), seconds (of each stage).")]
pub(crate) struct Embed {
    /// The mesh to sign
    pub(crate) model: PathBuf,
    /// Where to write the signed mesh: the same format as the model
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// The private key
    #[arg(short, long, value_name = "PEM")]
    pub(crate) key: PathBuf,
    /// What you assert: a text that stands in the certificate and is signed [default: none]
    #[arg(
        short,
        long,
        value_name = "TEXT",
        default_value = "",
        hide_default_value = true
    )]
    pub(crate) message: String,
    /// Where to write the certificate [default: the output's name and .cert.json]
    #[arg(long, value_name = "FILE")]
    pub(crate) certificate: Option<PathBuf>,
    /// Kind of signature; must suit the key [default: as the key's curve has it]
    #[arg(long, value_enum)]
    pub(crate) profile: Option<Profile>,
    /// Hash with SHA-1 in place of SHA-256 (P-256 keys)
    #[arg(long)]
    pub(crate) sha1: bool,
    /// How far the surface moves: RMS displacement as a fraction of the bounding box's diagonal [default: 0.0004]
    #[arg(long, value_name = "FRACTION", group = "strength", allow_negative_numbers = true, value_parser = numbers::distortion)]
    distortion: Option<f64>,
    /// Strength as α of eq. 12, for patches of unit area; in place of --distortion
    #[arg(long, value_name = "ALPHA", group = "strength", allow_negative_numbers = true, value_parser = numbers::positive)]
    alpha: Option<f64>,
    /// Strength as the paper's α, in the model's unit of length; in place of --distortion
    #[arg(long, value_name = "ALPHA", group = "strength", allow_negative_numbers = true, value_parser = numbers::positive)]
    paper_alpha: Option<f64>,
    /// How often each bit is repeated in a patch: more is more robust, but needs more vertices and time
    #[arg(long, value_name = "C", default_value_t = 3, allow_negative_numbers = true, value_parser = numbers::count)]
    pub(crate) chip_rate: usize,
    /// Into how many patches the mesh is cut, each with the whole signature: a number, or auto for as few as keep each below
    /// 30 000 vertices
    #[arg(long, value_name = "N", default_value = "auto", allow_negative_numbers = true, value_parser = numbers::patches)]
    pub(crate) patches: PatchCount,
    /// Which Laplacian gives the manifold harmonics
    #[arg(long, value_enum, default_value_t)]
    pub(crate) laplacian: Laplacian,
    #[command(flatten)]
    pub(crate) threads: Threads,
    /// Replace files that exist
    #[arg(long)]
    pub(crate) force: bool,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

impl Embed {
    pub(crate) fn strength(&self) -> Strength {
        match (self.distortion, self.alpha, self.paper_alpha) {
            (Some(fraction), _, _) => Strength::Distortion(fraction),
            (_, Some(alpha), _) => Strength::Alpha(alpha),
            (_, _, Some(alpha)) => Strength::PaperAlpha(alpha),
            _ => Strength::default(),
        }
    }
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark verify found.obj --original model.obj --certificate signed.obj.cert.json \\
      --public-key owner.pub.pem

Exit code 0 if the signature was read back (verified) or its presence is beyond doubt (detected), 1 if it was not found.

The suspect may be in any format, moved, turned, scaled, mirrored, its vertices and faces in any order. Where it lost the \
original's triangles, because it was cropped, decimated, subdivided or re-meshed, it is laid onto the original by its \
surface; at least 80 % of that must lie there.

--json prints: outcome (verified, detected or not_found), extraction_rate (0 to 1), p_value, correlation, bits, \
bit_errors, registration (connectivity, surroundings or surface), poses (how many were tried), overlap (share of the \
suspect's surface that lies on the original, 0 to 1), coverage (share of the original's that lies on the suspect), missing \
(share of the original's vertices that were not seen), residual (fraction of the diagonal), transform (4 × 4, suspect to \
original), mirrored, attack_model (of what moved the suspect, the shares of squared displacements that mark, misalignment, \
smoothing, tessellation_bias and noise explain; null where the paper's rule alone read it), remark (why it is another shape), message, public_key (fingerprint), seconds (of each stage). What can't be said \
is null.")]
pub(crate) struct Verify {
    /// The mesh in question
    pub(crate) suspect: PathBuf,
    /// The very file that was signed
    #[arg(long, value_name = "FILE")]
    pub(crate) original: PathBuf,
    /// The certificate that embed wrote
    #[arg(long, value_name = "FILE")]
    pub(crate) certificate: PathBuf,
    /// The signer's public key
    #[arg(long, value_name = "PEM")]
    pub(crate) public_key: PathBuf,
    /// The largest probability of being wrong that counts as detected
    #[arg(long, value_name = "P", default_value = "1e-6", allow_negative_numbers = true, value_parser = numbers::between_0_and_1)]
    pub(crate) p_bound: f64,
    #[command(flatten)]
    pub(crate) time_limit: TimeLimit,
    #[command(flatten)]
    pub(crate) threads: Threads,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

/// What can be measured of two meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Metric {
    /// Distances between the surfaces: d_rmse, mean, Hausdorff, MRMS
    Distance,
    /// Shape-DNA: distance of the normalised Laplace-Beltrami eigenvalues
    ShapeDna,
    /// MSDM2: what people notice, by curvature
    Msdm2,
    /// DAME: what people notice, by the angles at edges; needs the same triangles
    Dame,
}

/// What a heat map shows at each vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Heat {
    /// The distance from the reference, as a fraction of its diagonal
    #[default]
    Distance,
    /// The local distortion of MSDM2
    Msdm2,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark compare model.obj signed.obj --heatmap difference.png

The first mesh is the reference. Both are compared as they lie: nothing is aligned. Distances are fractions of the \
reference's diagonal in JSON and per cent of it for people; forward is from the second mesh to the first. DAME finds vertices \
that came in another order. What can't be computed is named with the reason; the exit code is 2 if that is everything.

--json prints: reference, distorted (file names), diagonal (in the models' unit), distance (d_rmse, mean, hausdorff_forward, \
hausdorff_backward, hausdorff, rmse_backward, mrms, samples, interval), shape_dna (p, m, distance, components of both), msdm2 \
(forward, backward, symmetric), dame (error in radians, edges), not_computed (reasons), heatmap (file, max), seconds (of each \
stage). What was not asked for or not computed is null.")]
pub(crate) struct Compare {
    /// The mesh to measure by
    pub(crate) reference: PathBuf,
    /// The mesh that differs from it
    pub(crate) distorted: PathBuf,
    /// What to measure, separated by commas [default: everything]
    #[arg(long, value_name = "METRICS", value_enum, value_delimiter = ',', hide_default_value = true,
        default_values_t = [Metric::Distance, Metric::ShapeDna, Metric::Msdm2, Metric::Dame])]
    pub(crate) metrics: Vec<Metric>,
    /// Largest distance between samples of a surface, as a fraction of its diagonal
    #[arg(long, value_name = "FRACTION", default_value_t = 5e-4, allow_negative_numbers = true, value_parser = numbers::between_0_and_1)]
    pub(crate) interval: f64,
    /// m of Shape-DNA's d_p,m: how many eigenvalues
    #[arg(long, value_name = "M", default_value_t = 50, allow_negative_numbers = true, value_parser = numbers::count)]
    pub(crate) eigenvalues: usize,
    /// p of Shape-DNA's d_p,m
    #[arg(long, value_name = "P", default_value_t = 2.0, allow_negative_numbers = true, value_parser = numbers::at_least_1)]
    pub(crate) norm: f64,
    /// Where to paint the second mesh in the colours of the difference: a .png picture of four sides, or a .ply mesh
    #[arg(long, value_name = "FILE")]
    pub(crate) heatmap: Option<PathBuf>,
    /// What the heat map shows
    #[arg(long, value_enum, default_value_t)]
    pub(crate) heatmap_of: Heat,
    /// What the last colour stands for; the same number makes pictures comparable [default: the greatest difference]
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true, value_parser = numbers::positive)]
    pub(crate) heatmap_max: Option<f64>,
    #[command(flatten)]
    pub(crate) threads: Threads,
    /// Replace a file that exists
    #[arg(long)]
    pub(crate) force: bool,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark align found.obj model.obj -o aligned.obj

Exit code 0 if the suspect lies on the original now, 1 if it does not align with it: then nothing is written.

The suspect may be moved, turned, scaled, mirrored, cropped, decimated or re-meshed; no first guess is needed. What is \
written is the suspect's file with other vertex positions; normals stored in it are kept as they are. Where the search \
fails, help it with at least three pairs of points, each good to a few hundredths of the diagonal:
  sigmark align found.obj model.obj -o aligned.obj --point 10,0,3=0.4,1,2 --point 17=4711 \\
      --point 9,9,8=220
A on the suspect belongs to B on the original; each is x,y,z in the coordinates of its file, or the number of a vertex in \
the order of its file, from 0. --points reads pairs from a text file, one a line: A=B, or six coordinates, or two vertex \
numbers, separated by blanks; # begins a comment.

--json prints: aligned, output (file name; null if nothing was written), transform (4 × 4, suspect to original), scale, \
rotation (3 × 3; determinant -1 where mirrored), translation, mirrored, registration (connectivity, surroundings, surface or \
points), overlap (share of the suspect's surface that lies on the original, 0 to 1), coverage (share of the original's that \
lies on the suspect), residual (RMS, fraction of the diagonal), ambiguous, alternatives (other transforms that fit a \
symmetric shape), free_directions (in which the shape slides on itself), seconds (of each stage).")]
pub(crate) struct Align {
    /// The mesh to move
    pub(crate) suspect: PathBuf,
    /// The mesh onto which it is moved
    pub(crate) original: PathBuf,
    /// Where to write the moved suspect: the same format as the suspect
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// A point of the suspect and where it belongs on the original: x,y,z or a vertex number on either side; three or more
    #[arg(long, value_name = "A=B", allow_hyphen_values = true, value_parser = Pair::parse)]
    pub(crate) point: Vec<Pair>,
    /// A text file with such pairs, one a line
    #[arg(long, value_name = "FILE")]
    pub(crate) points: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) time_limit: TimeLimit,
    #[command(flatten)]
    pub(crate) threads: Threads,
    /// Replace a file that exists
    #[arg(long)]
    pub(crate) force: bool,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark inspect model.obj

--json prints: file, format, gzipped, file_vertices, topology (counts and measures by name), remarks.")]
pub(crate) struct Inspect {
    /// The mesh
    pub(crate) model: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
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
    #[command(flatten)]
    pub(crate) threads: Threads,
    /// Replace a file that exists
    #[arg(long)]
    pub(crate) force: bool,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
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
pieces of each part), seconds (of each stage).")]
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
    #[command(flatten)]
    pub(crate) threads: Threads,
    /// Replace files that exist
    #[arg(long)]
    pub(crate) force: bool,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct TimeLimit {
    /// Give up after so many seconds [default: never]
    #[arg(long = "time-limit", value_name = "SECONDS", allow_negative_numbers = true, value_parser = numbers::seconds)]
    limit: Option<Duration>,
}

impl TimeLimit {
    pub(crate) fn duration(&self) -> Option<Duration> {
        self.limit
    }

    /// That it was reached.
    pub(crate) fn exceeded(&self) -> anyhow::Error {
        let seconds = self.limit.unwrap_or_default().as_secs_f64();
        anyhow::anyhow!("stopped at the time limit of {seconds} s; allow more with --time-limit")
    }
}

#[derive(Debug, Args)]
pub(crate) struct Threads {
    /// How many threads may work; results do not depend on it [default: all cores]
    #[arg(long = "threads", value_name = "N", allow_negative_numbers = true, value_parser = numbers::threads)]
    wanted: Option<usize>,
}

impl Threads {
    pub(crate) fn count(&self) -> usize {
        let all = || std::thread::available_parallelism().map_or(1, usize::from);
        self.wanted.unwrap_or_else(all)
    }
}

/// Numbers with bounds, refused before any work is done.
mod numbers {
    use std::time::Duration;

    use sigmark::{PatchCount, mark::MOST_DISTORTION};

    const MOST_THREADS: usize = 256;

    pub(super) fn positive(text: &str) -> Result<f64, String> {
        real(text, "a number above 0", |x| x > 0.0 && x.is_finite())
    }

    pub(super) fn seconds(text: &str) -> Result<Duration, String> {
        let seconds = positive(text)?;
        Duration::try_from_secs_f64(seconds).map_err(|_| "give a number of seconds".into())
    }

    pub(super) fn between_0_and_1(text: &str) -> Result<f64, String> {
        real(text, "a number between 0 and 1", |x| x > 0.0 && x < 1.0)
    }

    pub(super) fn at_least_1(text: &str) -> Result<f64, String> {
        real(text, "a number from 1", |x| x >= 1.0 && x.is_finite())
    }

    pub(super) fn distortion(text: &str) -> Result<f64, String> {
        let what = format!("a number above 0 and at most {MOST_DISTORTION}");
        real(text, &what, |x| x > 0.0 && x <= MOST_DISTORTION)
    }

    pub(super) fn count(text: &str) -> Result<usize, String> {
        whole(text, "a whole number from 1", |n| n >= 1)
    }

    pub(super) fn patches(text: &str) -> Result<PatchCount, String> {
        if text == "auto" {
            return Ok(PatchCount::Auto);
        }
        whole(text, "auto, or a whole number from 1", |n| n >= 1).map(PatchCount::Exactly)
    }

    pub(super) fn threads(text: &str) -> Result<usize, String> {
        let what = format!("a whole number from 1 to {MOST_THREADS}");
        whole(text, &what, |n| (1..=MOST_THREADS).contains(&n))
    }

    fn real(text: &str, what: &str, fits: impl Fn(f64) -> bool) -> Result<f64, String> {
        let value = text.trim().parse().ok().filter(|&x| fits(x));
        value.ok_or_else(|| format!("give {what}"))
    }

    fn whole(text: &str, what: &str, fits: impl Fn(usize) -> bool) -> Result<usize, String> {
        let value = text.trim().parse().ok().filter(|&n| fits(n));
        value.ok_or_else(|| format!("give {what}"))
    }
}
