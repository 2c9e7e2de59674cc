//! Libraries of originals.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{Common, TimeLimit, numbers};

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark library add models/ copies/ --library lib.sigmark
  sigmark library search found.obj --library lib.sigmark

A library is one file with all your originals and certificates. A suspect is searched in it without saying which model it \
might be, or whose copy. The file is an SQLite database. It holds no signing key; but who has originals and certificates can remove marks: keep it as you keep them. On Unix it is made so that its owner alone can read it. Where it can be read and not written to, it is searched as it is.")]
pub(crate) struct Library {
    #[command(subcommand)]
    pub(crate) step: LibraryStep,
}

#[derive(Debug, Subcommand)]
pub(crate) enum LibraryStep {
    /// Put originals and certificates into a library
    Add(LibraryAdd),
    /// Show what is in a library
    List(LibraryList),
    /// Find the original of a suspect, and whose copy it was
    Search(LibrarySearch),
    /// Find the original of a suspect, and judge it as verify does
    Verify(LibraryVerify),
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark library add models/ copies/ --library lib.sigmark

Folders are walked for meshes and for certificates (their names end in .cert.json), in any order and in several runs: a certificate finds its \
original by the digest of the geometry. A mesh that lies beside a certificate of its own name is a signed copy and no original, unless a certificate names it as \
its original; it is passed over and counted. Files that have not changed since they were added are not read again, unless their geometry was not kept and is to be kept now.

Of each original the geometry itself is kept, without loss, so that a file that is moved, lost or exported anew costs no claim. With --no-geometry only \
descriptors and the file's path are kept: then the file has to stay where it is for marks to be read. The library is whole whenever the program is stopped, and several may add at once.

Exit code 2 if a file could not be added, with the reason on standard error; the others are added.

--json prints: library (file name), originals (how many are new), known (files of originals that were there), unchanged (files that were not read again), copies (signed copies, \
which were passed over), certificates (how many are new), waiting (certificates in the library whose originals are not in it), failed (files that could not be added), total (originals in the library), seconds (of each stage).")]
pub(crate) struct LibraryAdd {
    /// Meshes and certificates, or folders of them
    #[arg(required = true, value_name = "DIR")]
    pub(crate) paths: Vec<PathBuf>,
    /// The library; it is made if there is none
    #[arg(long, value_name = "FILE")]
    pub(crate) library: PathBuf,
    /// Keep descriptors and file names alone
    #[arg(long)]
    pub(crate) no_geometry: bool,
    #[command(flatten)]
    pub(crate) common: Common,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark library list --library lib.sigmark

--json prints: library (file name), waiting (certificates whose originals are not in it), originals, of each number, name, digest (as certificates have it), vertices, \
triangles, geometry (bytes that are kept, or null), files (where it lay) and certificates (for each recipient, message and public_key, its fingerprint).")]
pub(crate) struct LibraryList {
    /// The library
    #[arg(long, value_name = "FILE")]
    pub(crate) library: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark library search found.obj --library lib.sigmark

The originals that the suspect resembles most are found by descriptors of their shapes: of the whole, of its surface, of small shapes wherever they lie, and of how the triangles hang together. The suspect \
is laid onto each, the nearest first, and read with the certificates of that original, until a mark is found. One certificate is judged as `sigmark verify` does; \
of several the buyer is named as `sigmark trace` does, and his certificate is judged. The library keeps geometry alone: a suspect in another pose is brought back where the original's file is still where it was when it was added, \
with the joints and morph targets that were signed. The library says what was signed by whom; --public-key says by whom it has to be. Certificates of the paper's profile are passed over, with a word on standard error.

verified and detected are a mark, and the answer says whose. shape: the suspect is, or lies on, an original, but no mark of its certificates was found in it, or it has none: that says which model it is, and is no \
claim. p counts all originals and certificates with which the suspect was, or would have been, read.

Exit code 0 if an original was found, with or without a mark, 1 if none; of several suspects 0 if of one, and 2 if one could not be judged: \
one that resembles an original whose geometry was not kept, and whose file is gone, can't be, unless another is found.

--json prints: an object a suspect, each in a line, of suspect (file name), outcome (verified, detected, shape or not_found), original (number, name, digest and files of the one that was found), recipient, message, public_key (fingerprint), p_value (all readings counted), \
evidence (whether that is at most 2^-120), readings (how many were counted), margin (T0), overlap (share of the suspect's surface that lies on the original), coverage (share of the original's on the suspect), registration (what it was recognised by, as `sigmark verify` has it), transform (4 × 4, suspect to \
original; null where it was bent or posed), candidates (the originals that it resembles most: original, its digest, name, score, from 1, the same, to 0, by, whole, surface, local or tessellation, and verdict, as outcome, another_shape, or null for those that were not read), searched (originals in the library), library (file name), seconds (of each \
stage). What can't be said is null. Of one of several suspects that could not be judged: suspect and error alone.")]
pub(crate) struct LibrarySearch {
    /// The meshes in question, or folders of them
    #[arg(required = true, value_name = "SUSPECT")]
    pub(crate) suspects: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) search: Searching,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark library verify found.obj --library lib.sigmark --public-key owner.pub.pem

Finds the original as `sigmark library search` does, and then judges the suspect with the certificate that was found by the code of `sigmark verify`, whose --help says what is printed and what it means. \
The certificate was chosen by what was read with all those of the originals that were looked at, so p counts them all; that of a search counts readings, of which there is one for all certificates of a key.

Exit code 0 if the mark was found, 1 if not.

--json prints: what `sigmark verify --json` prints; where no original with a certificate was found, what `sigmark library search --json` does.")]
pub(crate) struct LibraryVerify {
    /// The mesh in question
    #[arg(value_name = "SUSPECT")]
    pub(crate) suspect: PathBuf,
    /// Ask for evidence that holds against a stranger, who may have made his claim after he saw the suspect: with --public-key, which nothing is taken for
    #[arg(long, requires = "public_key")]
    pub(crate) dispute: bool,
    #[command(flatten)]
    pub(crate) search: Searching,
}

/// How to search. A doc comment that is no help: clap shows the commands' own.
#[derive(Debug, Args)]
pub(crate) struct Searching {
    /// The library
    #[arg(long, value_name = "FILE")]
    pub(crate) library: PathBuf,
    /// The signer's public key: certificates of others are passed over [default: every certificate's own]
    #[arg(long, value_name = "PEM")]
    pub(crate) public_key: Option<PathBuf>,
    /// The largest probability of being wrong that counts as detected, for all readings together
    #[arg(long, value_name = "P", default_value = "1e-6", allow_negative_numbers = true, value_parser = numbers::between_0_and_1)]
    pub(crate) p_bound: f64,
    /// How many originals are looked at
    #[arg(long, value_name = "N", default_value_t = 10, allow_negative_numbers = true, value_parser = numbers::count)]
    pub(crate) candidates: usize,
    #[command(flatten)]
    pub(crate) time_limit: TimeLimit,
    #[command(flatten)]
    pub(crate) common: Common,
}
