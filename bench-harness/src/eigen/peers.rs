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
use crate::{
    kept::{self, Key},
    peers,
};

/// Another solver.
pub(crate) struct EigenPeer {
    /// As it stands in the tables.
    pub(crate) name: &'static str,
    program: PeerProgram,
    /// What chooses it among those that the program has.
    word: &'static str,
    /// Whether it solves all problems, or, because it takes minutes, the first alone.
    pub(crate) everywhere: bool,
}

/// What runs a peer; the name is part of files'.
#[derive(Clone, Copy, Debug)]
enum PeerProgram {
    /// `peers/eigen.py`.
    Scipy,
    /// `peers/spectra.cpp`.
    Spectra,
    /// This program, in a process of its own: `ours.rs`.
    Rust,
}

const fn peer(name: &'static str, program: PeerProgram, word: &'static str) -> EigenPeer {
    EigenPeer {
        name,
        program,
        word,
        everywhere: true,
    }
}

const fn slow(peer: EigenPeer) -> EigenPeer {
    EigenPeer {
        everywhere: false,
        ..peer
    }
}

pub(crate) const EIGEN_PEERS: [EigenPeer; 6] = [
    peer("ARPACK, SuperLU", PeerProgram::Scipy, "superlu"),
    peer("ARPACK, CHOLMOD", PeerProgram::Scipy, "cholmod"),
    peer("Spectra, Eigen", PeerProgram::Spectra, "eigen"),
    peer("Spectra, CHOLMOD", PeerProgram::Spectra, "cholmod"),
    slow(peer("faer's Lanczos", PeerProgram::Rust, "faer")),
    slow(peer("LOBPCG", PeerProgram::Scipy, "lobpcg")),
];

impl EigenPeer {
    /// As it stands in the names of files.
    fn id(&self) -> String {
        format!("{:?}-{}", self.program, self.word).to_lowercase()
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
        EIGEN_PEERS.iter().filter(|peer| {
            let needs_cholmod = peer.word == "cholmod";
            match (peer.program, &self.spectra) {
                (PeerProgram::Scipy, _) => self.python.is_some() && (!needs_cholmod || self.has_cholmod),
                (PeerProgram::Spectra, Some(spectra)) => !needs_cholmod || spectra.has_cholmod,
                (PeerProgram::Spectra, None) => false,
                (PeerProgram::Rust, _) => true,
            }
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
        let name = format!("{}-{count}-{tolerance:e}-{round}", peer.id());
        // With more time it might have come to its end.
        let enough = |kept: &SolveOutcome| match *kept {
            SolveOutcome::Stopped { after } => after >= self.limit as f64,
            SolveOutcome::Done { .. } => true,
        };
        // The folder is of these matrices alone.
        kept::figures_if(&problem.matrices, &Key::new(name), enough, || {
            self.run(peer, problem, task)
                .with_context(|| format!("{} on {}", peer.name, problem.name))
        })
    }

    fn run(&self, peer: &EigenPeer, problem: &EigenProblem, task: EigenTask) -> Result<SolveOutcome> {
        let arguments: [OsString; 4] = [
            peer.word.into(),
            problem.matrices.clone().into_os_string(),
            task.count.to_string().into(),
            task.tolerance.to_string().into(),
        ];
        let mut command = match (peer.program, &self.python, &self.spectra) {
            (PeerProgram::Scipy, Some(python), _) => python.command("eigen.py", &arguments),
            (PeerProgram::Spectra, _, Some(spectra)) => spectra.command(&arguments),
            (PeerProgram::Rust, _, _) => return self.run_ourselves(&arguments),
            _ => bail!("{} can't run here", peer.name),
        };
        let result = problem.matrices.join(peer.id());
        fs::create_dir_all(&result).with_context(|| result.display().to_string())?;
        let Some(report) = output_within(self.limit, command.arg(&result))? else {
            return Ok(self.stopped());
        };
        let PeerCost { cpu, wall } = serde_json::from_str(&report).context("the report of the peer")?;
        let residual = judged(&result, problem, task.count)?;
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
