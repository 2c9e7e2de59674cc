//! The other solvers: which there are, how each is run, how long it may take.

use std::{ffi::OsString, fs, path::Path, process::Command};

use anyhow::{Context, Result, bail, ensure};
use evaluation::{process::output_within, python::Python};
use serde::Deserialize;

use super::{
    problem::EigenProblem,
    residual::worst_residual,
    spectra::SpectraProgram,
    task::{EigenTask, SolveOutcome},
};
use crate::{kept, peers};

/// Another solver.
pub(crate) struct EigenPeer {
    /// As it stands in the tables.
    pub(crate) name: &'static str,
    program: PeerProgram,
    /// Whether it solves all problems, or, because it takes minutes, the first alone.
    pub(crate) everywhere: bool,
}

/// What runs a peer, with the word that chooses it.
#[derive(Clone, Copy)]
enum PeerProgram {
    /// `peers/eigen.py`.
    Python(&'static str),
    /// `peers/spectra.cpp`.
    Spectra(&'static str),
    /// This program, in a process of its own: `ours.rs`.
    Rust(&'static str),
}

const fn peer(name: &'static str, program: PeerProgram, everywhere: bool) -> EigenPeer {
    EigenPeer {
        name,
        program,
        everywhere,
    }
}

pub(crate) const EIGEN_PEERS: [EigenPeer; 6] = [
    peer("ARPACK, SuperLU", PeerProgram::Python("superlu"), true),
    peer("ARPACK, CHOLMOD", PeerProgram::Python("cholmod"), true),
    peer("Spectra, Eigen", PeerProgram::Spectra("eigen"), true),
    peer("Spectra, CHOLMOD", PeerProgram::Spectra("cholmod"), true),
    peer("faer's Lanczos", PeerProgram::Rust("faer"), false),
    peer("LOBPCG", PeerProgram::Python("lobpcg"), false),
];

impl PeerProgram {
    fn word(self) -> &'static str {
        match self {
            Self::Python(word) | Self::Spectra(word) | Self::Rust(word) => word,
        }
    }

    /// As it stands in the names of files.
    fn kind(self) -> &'static str {
        match self {
            Self::Python(_) => "scipy",
            Self::Spectra(_) => "spectra",
            Self::Rust(_) => "rust",
        }
    }
}

/// The peers that can run here.
pub(crate) struct EigenPeers {
    python: Option<Python>,
    has_cholmod: bool,
    spectra: Option<SpectraProgram>,
    /// CPU seconds after which a peer is stopped.
    limit: u64,
}

/// What the peers in other languages print.
#[derive(Deserialize)]
struct PeerCost {
    cpu: f64,
    wall: f64,
}

impl EigenPeers {
    /// Makes ready what can be; says what can't, and why.
    pub(crate) fn prepare(folder: &Path, limit: u64) -> Self {
        let python = peers::prepare()
            .inspect_err(|missing| eprintln!("No peers in Python: {missing:#}."))
            .ok();
        let has_cholmod = python.as_ref().is_some_and(|python| {
            let wanted = python.scripts().join("requirements-cholmod.txt");
            python.install(&wanted).is_ok()
        });
        if python.is_some() && !has_cholmod {
            eprintln!(
                "No CHOLMOD: scikit-sparse does not build; install SuiteSparse (Debian: apt-get install libsuitesparse-dev)."
            );
        }
        let spectra = SpectraProgram::compile(folder)
            .inspect_err(|missing| {
                eprintln!("No Spectra: {missing:#}\nIt needs g++, Spectra and Eigen (Debian: apt-get install g++ libspectra-dev libeigen3-dev libsuitesparse-dev).");
            })
            .ok();
        Self {
            python,
            has_cholmod,
            spectra,
            limit,
        }
    }

    /// In the order of the tables.
    pub(crate) fn all(&self) -> impl Iterator<Item = &'static EigenPeer> {
        EIGEN_PEERS.iter().filter(|peer| match peer.program {
            PeerProgram::Python(word) => self.python.is_some() && (word != "cholmod" || self.has_cholmod),
            PeerProgram::Spectra(word) => self
                .spectra
                .as_ref()
                .is_some_and(|spectra| word != "cholmod" || spectra.has_cholmod),
            PeerProgram::Rust(_) => true,
        })
    }

    /// Versions of what the peers are made of, each behind a semicolon.
    pub(crate) fn versions(&self) -> Result<String> {
        let python = self.python.as_ref().map(Python::versions).transpose()?;
        let compiler = self.spectra.as_ref().map(|spectra| spectra.compiler.clone());
        let versions = python.into_iter().chain(compiler);
        Ok(versions.map(|version| format!("; {version}")).collect())
    }

    /// One computation by a peer, or, if an earlier run finished it, what it found.
    pub(crate) fn solve(
        &self,
        peer: &EigenPeer,
        problem: &EigenProblem,
        task: EigenTask,
        round: usize,
    ) -> Result<SolveOutcome> {
        let EigenTask { count, tolerance } = task;
        let (kind, word) = (peer.program.kind(), peer.program.word());
        let name = format!("{kind}-{word}-{count}-{tolerance:e}-{round}");
        // With more time it might have come to its end.
        let enough = |kept: &SolveOutcome| match *kept {
            SolveOutcome::Stopped { after } => after >= self.limit as f64,
            SolveOutcome::Done { .. } => true,
        };
        kept::figures_if(&problem.matrices, &name, enough, || {
            self.run(peer, problem, task)
                .with_context(|| format!("{} on {}", peer.name, problem.name))
        })
    }

    fn run(&self, peer: &EigenPeer, problem: &EigenProblem, task: EigenTask) -> Result<SolveOutcome> {
        let arguments: [OsString; 4] = [
            peer.program.word().into(),
            problem.matrices.clone().into_os_string(),
            task.count.to_string().into(),
            task.tolerance.to_string().into(),
        ];
        let mut command = match (peer.program, &self.python, &self.spectra) {
            (PeerProgram::Python(_), Some(python), _) => python.command("eigen.py", &arguments),
            (PeerProgram::Spectra(_), _, Some(spectra)) => spectra.command(&arguments),
            (PeerProgram::Rust(_), _, _) => return self.run_ourselves(&arguments),
            _ => bail!("{} can't run here", peer.name),
        };
        let program = format!("{}-{}", peer.program.kind(), peer.program.word());
        let result = problem.matrices.join(program);
        fs::create_dir_all(&result).with_context(|| result.display().to_string())?;
        let Some(report) = output_within(self.limit, command.arg(&result))? else {
            return Ok(self.stopped());
        };
        let cost: PeerCost = serde_json::from_str(&report).context("the report of the peer")?;
        let residual = judged(&result, problem, task.count)?;
        let PeerCost { cpu, wall } = cost;
        Ok(SolveOutcome::Done { cpu, wall, residual })
    }

    /// A peer in Rust, in a process of its own.
    fn run_ourselves(&self, arguments: &[OsString]) -> Result<SolveOutcome> {
        let mut command = Command::new(std::env::current_exe()?);
        command.args(["bench", "solve"]).args(arguments);
        match output_within(self.limit, &command)? {
            Some(report) => serde_json::from_str(&report).context("the report of the peer"),
            None => Ok(self.stopped()),
        }
    }

    fn stopped(&self) -> SolveOutcome {
        let after = self.limit as f64;
        SolveOutcome::Stopped { after }
    }
}

/// The worst residual of the pairs that a peer wrote into `folder`.
fn judged(folder: &Path, problem: &EigenProblem, count: usize) -> Result<f64> {
    let values = take_numbers(&folder.join("eigenvalues.f64"))?;
    let functions = take_numbers(&folder.join("eigenfunctions.f64"))?;
    let n = problem.size();
    ensure!(
        values.len() == count && functions.len() == n * count,
        "{} pairs instead of {count}",
        values.len()
    );
    let function = |k| &functions[k * n..(k + 1) * n];
    Ok(worst_residual(&problem.laplacian, &values, function))
}

/// Reads a file of numbers and removes it: eigenfunctions are large.
fn take_numbers(path: &Path) -> Result<Vec<f64>> {
    let bytes = fs::read(path).with_context(|| path.display().to_string())?;
    fs::remove_file(path).with_context(|| path.display().to_string())?;
    let (numbers, _) = bytes.as_chunks::<8>();
    Ok(numbers.iter().map(|&number| f64::from_le_bytes(number)).collect())
}
