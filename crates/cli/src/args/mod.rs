//! What can be typed: every command, option and default, with the help texts.

mod analysing;
mod comparing;
mod disputing;
mod installing;
mod keeping;
mod numbers;
mod shared;
mod signing;
mod stamping;
mod tracing;

use clap::{Parser, Subcommand};

pub(crate) use self::{
    analysing::{Inspect, Laplacian, Partition, Spectrum},
    comparing::{Align, Compare, Heat, MetricName},
    disputing::Dispute,
    installing::{Completions, Man},
    keeping::{Library, LibraryAdd, LibraryList, LibrarySearch, LibraryStep, LibraryVerify, Searching},
    shared::{Common, TimeLimit},
    signing::{Embed, Keygen, Manifest, Profile, Verify},
    stamping::{Attach, Request, Stamp, Step},
    tracing::Trace,
};

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

Exit codes: 0 yes, or done; 1 no; 2 could not be done, with the reason on standard error; 130 Ctrl-C.
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
    /// Ask of whose copies a suspect mesh was made
    Trace(Trace),
    /// Keep originals and certificates in one file, and search suspects in it
    Library(Library),
    /// Have an authority say when a certificate existed
    Stamp(Stamp),
    /// Ask which of two claims on a model came first
    Dispute(Dispute),
    /// Move a suspect onto its original
    Align(Align),
    /// Measure how far two meshes differ
    Compare(Compare),
    /// Report on a mesh file: topology, size, oddities, and what a mark in it would hold and survive
    Inspect(Inspect),
    /// Compute the lower Laplace-Beltrami spectrum of a mesh
    Spectrum(Spectrum),
    /// Cut a mesh or a graph into parts of equal size with short borders
    Partition(Partition),
    /// Print what makes a shell complete commands and options
    Completions(Completions),
    /// Write the manual pages
    #[command(hide = true)]
    Man(Man),
}
