//! `cargo xtask bench`: ours beside the peers, on the same inputs in one run.

use anyhow::Result;
use bench_harness::{
    code::CodeBench,
    eigen::{EigenBench, LoneSolve},
    formats::FormatsBench,
    library::LibraryBench,
    partition::{LoneDivision, PartitionBench},
    pose::PoseBench,
    python::PythonBench,
    quality::QualityBench,
    registration::RegistrationBench,
    robustness::RobustnessBench,
    seconds::SecondsBench,
    security::SecurityBench,
    services::ServicesBench,
    tracing::TracingBench,
    visibility::VisibilityBench,
};
use clap::Subcommand;

#[derive(Subcommand)]
pub(crate) enum Bench {
    /// Partitioner beside METIS 5.1 and KaFFPa-strong: cut, balance, volume, connection, time, memory
    ///
    /// Needs gpmetis (Debian: apt-get install metis). What KaFFPa finished is kept in .cache/bench/partition.
    Partition(PartitionBench),
    /// Eigen-solver beside ARPACK, Spectra, LOBPCG and faer's Lanczos; at loose tolerances; on many patches, for many pairs
    ///
    /// Makes a Python environment in bench-harness/.venv, and compiles bench-harness/peers/spectra.cpp. What is missing is left out, and
    /// said. What peers finished is kept in .cache/bench/eigen, so that a run that was interrupted goes on; remove that folder to
    /// measure all anew.
    Eigen(EigenBench),
    /// Python: `sigmark.spectrum` beside robust_laplacian, potpourri3d and libigl with scipy, and LaPy
    ///
    /// Needs the wheel, which `cargo xtask wheel` makes. Makes a Python environment in .cache/bench/python. What peers finished is kept there; remove
    /// that folder to measure all anew.
    Python(PythonBench),
    /// Registration: how often, how exactly and how fast attacked and moved meshes come back; beside its peers
    ///
    /// Makes Python environments in attacks/.venv and bench-harness/.venv. Goes from the smallest mesh to the largest. Finished
    /// draws are kept in .cache/bench/registration by the digest of the code that made them, so that a run that was interrupted goes on.
    Registration(RegistrationBench),
    /// Distances beside MeshLab's filter, Shape-DNA beside scipy and LaPy: figures and time
    ///
    /// Makes a Python environment in bench-harness/.venv. What peers finished is kept in .cache/bench/quality.
    Quality(QualityBench),
    /// Robustness: what is read of signed models after every attack of the list
    ///
    /// Makes a Python environment in attacks/.venv. Some minutes for each model. Finished models are kept in .cache/bench/robustness by the digest
    /// of the code that made them, so that a run that was interrupted goes on.
    Robustness(RobustnessBench),
    /// Poses: models with skeletons and morph targets that were posed, bent or twisted, and what is read of them
    ///
    /// Makes Python environments in attacks/.venv and .cache/bench/pose; Blender comes as a package (bpy), for Python 3.11 alone. Some minutes for each model, half an hour in
    /// all on two cores. Posed files are kept in .cache/bench/pose, finished models there by the digest of the code that made them, so that a run that was interrupted goes on.
    Pose(PoseBench),
    /// Security: marks that were drowned, overwritten, averaged and extracted anew, and p-values where there is no mark
    ///
    /// Makes a Python environment in attacks/.venv. Some minutes for each model. Finished models are kept in .cache/bench/security by the digest
    /// of the code that made them, so that a run that was interrupted goes on.
    Security(SecurityBench),
    /// Tracing: buyers who mix their copies, and who of them is named, beside Tardos' code and chips on single harmonics
    ///
    /// Makes a Python environment in attacks/.venv. Some ten minutes for each model. Finished models are kept in .cache/bench/tracing by the digest of the code that made them.
    Tracing(TracingBench),
    /// Visibility: how far facets turn inside patches and at their borders, what people notice, and what is read after attacks
    ///
    /// Makes a Python environment in attacks/.venv. Finished models are kept in .cache/bench/visibility by the digest of the code that made them.
    Visibility(VisibilityBench),
    /// Seconds: what one waits for when meshes of a million vertices and more are signed and verified, and the memory that it takes
    ///
    /// Runs the program `sigmark` that lies beside this one: `cargo build --release -p sigmark-cli` makes it. Makes a Python environment in
    /// attacks/.venv. What is finished is kept in .cache/bench/seconds by the digest of the program and of the code that measures, so that a
    /// run that was interrupted goes on; the meshes that it works on are there, too.
    Seconds(SecondsBench),
    /// Formats: signed models that went through other programs, parts of them that come back alone, and pictures before and after
    ///
    /// Makes a Python environment and installs npm's packages in .cache/bench/formats. Programs that can't be had are left out, and said. Pictures
    /// are drawn by three.js in Chromium without its window (Debian: apt-get install chromium; elsewhere CHROMIUM says where it is).
    Formats(FormatsBench),
    /// Services: a shop that signs at download, under load and killed; batches by Daft, and what a thousand models cost
    ///
    /// Needs the wheel, which `cargo xtask wheel` makes. Makes a Python environment in .cache/bench/services.
    Services(ServicesBench),
    /// Polar code: frame error rates beside the bounds, other constructions and lengths, AFF3CT's published curves; seconds
    ///
    /// Half an hour and more. Points that are finished are kept in .cache/bench/code by the digest of the code that made them, so that a run that was
    /// interrupted goes on.
    Code(CodeBench),
    /// Libraries: how often the original of an attacked model is among the first ten of a hundred thousand, how long that takes, and what strangers' models bring up
    ///
    /// An hour and more the first time. The library is kept in .cache/bench/library by the digest of the code that made it, so that a run that was interrupted goes on.
    Library(LibraryBench),
    /// Solve one problem in a process of its own, for `eigen`
    #[command(hide = true)]
    Solve(LoneSolve),
    /// Divide one graph in a process of its own, for `partition`
    #[command(hide = true)]
    Divide(LoneDivision),
}

impl Bench {
    pub(crate) fn run(self) -> Result<()> {
        match self {
            Self::Partition(bench) => bench.run(),
            Self::Eigen(bench) => bench.run(),
            Self::Python(bench) => bench.run(),
            Self::Registration(bench) => bench.run(),
            Self::Quality(bench) => bench.run(),
            Self::Robustness(bench) => bench.run(),
            Self::Pose(bench) => bench.run(),
            Self::Security(bench) => bench.run(),
            Self::Tracing(bench) => bench.run(),
            Self::Visibility(bench) => bench.run(),
            Self::Seconds(bench) => bench.run(),
            Self::Formats(bench) => bench.run(),
            Self::Services(bench) => bench.run(),
            Self::Code(bench) => bench.run(),
            Self::Library(bench) => bench.run(),
            Self::Solve(alone) => alone.run(),
            Self::Divide(alone) => alone.run(),
        }
    }
}
