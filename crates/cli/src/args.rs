//! What can be typed: every command, option and default, with the help texts.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use sigmark::{
    Coverage, Strength,
    signature::{Curve, Scheme},
};

/// Sign 3D models in their shape, and find the signature again
#[derive(Debug, Parser)]
#[command(
    name = "sigmark",
    version,
    arg_required_else_help = true,
    after_help = "\
Exit codes: 0 yes, or done; 1 no; 2 could not be done, with the reason on standard error.

A first session:
  sigmark keygen -o owner.pem
  sigmark embed model.obj -o signed.obj --key owner.pem --message \"© 2026 Studio, order 4711\"
  sigmark verify found.obj --original model.obj --certificate signed.obj.cert.json --public-key owner.pub.pem"
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
    /// Report on a mesh file: topology, size, oddities
    Inspect(Inspect),
    /// Compute the lower Laplace-Beltrami spectrum of a mesh
    Spectrum(Spectrum),
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

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark keygen -o owner.pem        writes owner.pem and owner.pub.pem

The private key is PKCS#8 PEM, readable by you alone; OpenSSL reads it too. Keep it secret and keep a copy: who has it
can sign in your name, and without it nothing more can be signed. Give the public key to whoever is to verify.")]
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

Writes signed.obj, the same file with other vertex positions, and signed.obj.cert.json, the certificate. Give away the
signed file. Keep the original and the certificate: both are needed to verify, and who has both can remove the mark.

Reads and writes OBJ, PLY, STL and OFF, also gzipped. A locked key's passphrase is asked for, or taken from the
environment variable SIGMARK_PASSPHRASE.")]
pub(crate) struct Embed {
    /// The mesh to sign
    pub(crate) model: PathBuf,
    /// Where to write the signed mesh: the same format as the model
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// The private key
    #[arg(short, long, value_name = "PEM")]
    pub(crate) key: PathBuf,
    /// What you assert: a text that stands in the certificate and is signed
    #[arg(short, long, value_name = "TEXT", default_value = "")]
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
    #[arg(long, value_name = "FRACTION", group = "strength")]
    distortion: Option<f64>,
    /// Strength as α of eq. 12, for patches of unit area
    #[arg(long, value_name = "ALPHA", group = "strength")]
    alpha: Option<f64>,
    /// Strength as the paper's α, in the model's unit of length
    #[arg(long, value_name = "ALPHA", group = "strength")]
    paper_alpha: Option<f64>,
    /// How often each bit is repeated in a patch
    #[arg(long, value_name = "C", default_value_t = 3)]
    pub(crate) chip_rate: usize,
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
  sigmark verify found.obj --original model.obj --certificate signed.obj.cert.json --public-key owner.pub.pem

Exit code 0 if the signature was read back (verified) or its presence is beyond doubt (detected), 1 if it was not found.
The suspect may be in any format, moved, turned, scaled, mirrored, its vertices and faces in any order; it must still
have the original's triangles. Re-meshed, decimated and cropped copies can't be judged yet.")]
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
    #[arg(long, value_name = "P", default_value_t = 1e-6)]
    pub(crate) p_bound: f64,
    #[command(flatten)]
    pub(crate) threads: Threads,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark inspect model.obj")]
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

Arrays in the file: eigenvalues (k, ascending, in 1/unit²), eigenfunctions (n × k, mass-orthonormal), mass (n, lumped),
vertex (n, the file vertex of each row: equal positions are welded, vertices that no face uses are left out).")]
pub(crate) struct Spectrum {
    /// The mesh
    pub(crate) model: PathBuf,
    /// How many eigenpairs
    #[arg(short = 'k', long, value_name = "K", default_value_t = 325)]
    pub(crate) count: usize,
    /// Largest relative residual of a pair
    #[arg(long, value_name = "EPS")]
    pub(crate) tolerance: Option<f64>,
    /// Where to write eigenvalues, eigenfunctions and masses, as NPZ
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
pub(crate) struct Threads {
    /// How many threads may work; results do not depend on it [default: all cores]
    #[arg(long = "threads", value_name = "N")]
    wanted: Option<std::num::NonZeroUsize>,
}

impl Threads {
    pub(crate) fn count(&self) -> usize {
        let all = || std::thread::available_parallelism().map_or(1, usize::from);
        self.wanted.map_or_else(all, usize::from)
    }
}
