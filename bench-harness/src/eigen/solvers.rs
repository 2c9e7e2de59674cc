//! Ours and the peers: how each is run, how long it may take, and one judge for what it returns.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{faer_lanczos, read_matrices, worst_residual};
use anyhow::{Context, Result, bail};
use clap::Args;
use job::Job;
use mhb_core::{Laplacian, Spectrum, SpectrumOptions};
use serde_json::{Value, json};

use super::problem::Problem;
use crate::{kept, measure::timed, peers};
use evaluation::{
    machine::peak_memory,
    process::{output, output_within},
    python::Python,
};

/// How many pairs, and how accurate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Case {
    pub(crate) count: usize,
    pub(crate) tolerance: f64,
}

impl Case {
    fn options(self) -> SpectrumOptions {
        SpectrumOptions {
            count: self.count,
            tolerance: self.tolerance,
            ..Default::default()
        }
    }
}

/// Another solver.
pub(crate) struct Peer {
    /// As it stands in the tables.
    pub(crate) name: &'static str,
    program: Program,
    /// Whether it solves all problems, or, because it takes minutes, the first alone.
    pub(crate) everywhere: bool,
}

/// What runs a peer, with the word that chooses it.
#[derive(Clone, Copy)]
enum Program {
    /// `peers/eigen.py`.
    Python(&'static str),
    /// `peers/spectra.cpp`.
    Spectra(&'static str),
    /// This program, see [`solve_alone`].
    Rust(&'static str),
}

pub(crate) const PEERS: [Peer; 6] = [
    Peer {
        name: "ARPACK, SuperLU",
        program: Program::Python("superlu"),
        everywhere: true,
    },
    Peer {
        name: "ARPACK, CHOLMOD",
        program: Program::Python("cholmod"),
        everywhere: true,
    },
    Peer {
        name: "Spectra, Eigen",
        program: Program::Spectra("eigen"),
        everywhere: true,
    },
    Peer {
        name: "Spectra, CHOLMOD",
        program: Program::Spectra("cholmod"),
        everywhere: true,
    },
    Peer {
        name: "faer's Lanczos",
        program: Program::Rust("faer"),
        everywhere: false,
    },
    Peer {
        name: "LOBPCG",
        program: Program::Python("lobpcg"),
        everywhere: false,
    },
];

impl Program {
    fn word(self) -> &'static str {
        match self {
            Self::Python(word) | Self::Spectra(word) | Self::Rust(word) => word,
        }
    }

    /// As it stands in the names of cells.
    fn kind(self) -> &'static str {
        match self {
            Self::Python(_) => "scipy",
            Self::Spectra(_) => "spectra",
            Self::Rust(_) => "rust",
        }
    }
}

/// The peers that can run here.
pub(crate) struct Bench {
    python: Option<Python>,
    has_cholmod: bool,
    spectra: Option<Spectra>,
    /// CPU seconds after which a peer is stopped.
    limit: u64,
}

/// What became of one computation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Outcome {
    Done {
        cpu: f64,
        wall: f64,
        residual: f64,
    },
    /// Stopped after so many CPU seconds.
    Stopped(f64),
}

impl Bench {
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
        let spectra = Spectra::compile(folder)
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

    pub(crate) fn peers(&self) -> impl Iterator<Item = &'static Peer> {
        PEERS.iter().filter(|peer| match peer.program {
            Program::Python(word) => self.python.is_some() && (word != "cholmod" || self.has_cholmod),
            Program::Spectra(word) => self
                .spectra
                .as_ref()
                .is_some_and(|spectra| word != "cholmod" || spectra.has_cholmod),
            Program::Rust(_) => true,
        })
    }

    /// Versions of what the peers are made of.
    pub(crate) fn versions(&self) -> Result<String> {
        let mut versions = String::new();
        if let Some(python) = &self.python {
            versions += &format!("; {}", python.versions()?);
        }
        if let Some(spectra) = &self.spectra {
            versions += &format!("; {}", spectra.compiler);
        }
        Ok(versions)
    }

    /// One computation by a peer, or, if an earlier run finished it, what it found.
    pub(crate) fn theirs(&self, problem: &Problem, peer: &Peer, case: Case, round: usize) -> Result<Outcome> {
        let Case { count, tolerance } = case;
        let (kind, word) = (peer.program.kind(), peer.program.word());
        let name = format!("{kind}-{word}-{count}-{tolerance:e}-{round}");
        let enough = |cell: &Value| {
            cell["stopped"]
                .as_u64()
                .is_none_or(|seconds| seconds >= self.limit)
        };
        let cell = kept::figures_if(&problem.matrices, &name, enough, || {
            self.run(problem, peer, case)
                .with_context(|| format!("{} on {}", peer.name, problem.name))
        })?;
        Ok(outcome(&cell))
    }

    fn run(&self, problem: &Problem, peer: &Peer, case: Case) -> Result<Value> {
        let result = problem
            .matrices
            .join(format!("{}-{}", peer.program.kind(), peer.program.word()));
        fs::create_dir_all(&result).with_context(|| result.display().to_string())?;
        let arguments = [
            peer.program.word().into(),
            problem.matrices.clone().into_os_string(),
            case.count.to_string().into(),
            case.tolerance.to_string().into(),
        ];
        let mut command = match (peer.program, &self.python, &self.spectra) {
            (Program::Python(_), Some(python), _) => python.command("eigen.py", arguments),
            (Program::Spectra(_), _, Some(spectra)) => spectra.command(arguments),
            (Program::Rust(_), _, _) => return self.alone(arguments),
            _ => bail!("{} can't run here", peer.name),
        };
        let Some(report) = output_within(self.limit, command.arg(&result))? else {
            return Ok(json!({"stopped": self.limit}));
        };
        let cost: Value = serde_json::from_str(&report).context("the report of the peer")?;
        let values = take_numbers(&result.join("eigenvalues.f64"))?;
        let functions = take_numbers(&result.join("eigenfunctions.f64"))?;
        let n = problem.size();
        if values.len() != case.count || functions.len() != n * case.count {
            bail!("{} pairs instead of {}", values.len(), case.count);
        }
        let residual = worst_residual(&problem.laplacian, &values, |k| &functions[k * n..(k + 1) * n]);
        Ok(json!({"cpu": cost["cpu"], "wall": cost["wall"], "residual": residual}))
    }

    fn alone(&self, arguments: impl IntoIterator<Item = std::ffi::OsString>) -> Result<Value> {
        let mut command = Command::new(std::env::current_exe()?);
        command.args(["bench", "solve"]).args(arguments);
        match output_within(self.limit, &command)? {
            Some(report) => serde_json::from_str(&report).context("the report of the peer"),
            None => Ok(json!({"stopped": self.limit})),
        }
    }
}

fn outcome(cell: &Value) -> Outcome {
    let figure = |key: &str| cell[key].as_f64();
    match figure("stopped") {
        Some(seconds) => Outcome::Stopped(seconds),
        None => Outcome::Done {
            cpu: figure("cpu").unwrap_or(f64::NAN),
            wall: figure("wall").unwrap_or(f64::NAN),
            residual: figure("residual").unwrap_or(f64::NAN),
        },
    }
}

/// `peers/spectra.cpp`, compiled for this machine.
struct Spectra {
    program: PathBuf,
    has_cholmod: bool,
    compiler: String,
}

impl Spectra {
    fn compile(folder: &Path) -> Result<Self> {
        let source = evaluation::process::root().join("bench-harness/peers/spectra.cpp");
        let program = folder.join("spectra");
        let compiler = output(Command::new("g++").arg("--version"))?;
        let compile = |cholmod: &[&str]| {
            let mut command = Command::new("g++");
            command.args(["-std=c++17", "-O3", "-march=native", "-DNDEBUG", "-w"]);
            command.args([
                "-isystem",
                "/usr/include/eigen3",
                "-isystem",
                "/usr/include/suitesparse",
            ]);
            output(command.arg(&source).arg("-o").arg(&program).args(cholmod))
        };
        let has_cholmod = compile(&["-DCHOLMOD", "-lcholmod"]).is_ok();
        if !has_cholmod {
            compile(&[])?;
        }
        Ok(Self {
            program,
            has_cholmod,
            compiler: compiler.lines().next().unwrap_or_default().into(),
        })
    }

    fn command(&self, arguments: impl IntoIterator<Item = std::ffi::OsString>) -> Command {
        let mut command = Command::new(&self.program);
        command.args(arguments).envs(peers::ONE_THREAD);
        command
    }
}

/// Ours, in this process.
pub(crate) fn ours(laplacian: &Laplacian, case: Case, threads: usize) -> Result<Outcome> {
    let (options, job) = (case.options(), Job::new(threads));
    let (spectrum, cost) = timed(|| Spectrum::of_laplacian(laplacian, &options, &job));
    let spectrum = spectrum?;
    let residual = worst_residual(laplacian, spectrum.eigenvalues(), |k| spectrum.eigenfunction(k));
    let (cpu, wall) = (cost.cpu, cost.wall);
    Ok(Outcome::Done { cpu, wall, residual })
}

/// One problem for a process of its own, which can be stopped, and whose memory can be told from others'.
#[derive(Args)]
pub struct Alone {
    /// ours or faer
    solver: String,
    /// Folder with the matrices
    matrices: PathBuf,
    count: usize,
    tolerance: f64,
}

/// Solves on one thread and prints what it cost, in seconds and bytes, and the worst residual, as JSON.
pub fn solve_alone(alone: &Alone) -> Result<()> {
    let laplacian = read_matrices(&alone.matrices)?;
    let &Alone { count, tolerance, .. } = alone;
    let (cost, peak, residual) = match alone.solver.as_str() {
        "ours" => {
            let options = Case { count, tolerance }.options();
            let (spectrum, cost) = timed(|| Spectrum::of_laplacian(&laplacian, &options, &Job::default()));
            let (spectrum, peak) = (spectrum?, peak_memory());
            let function = |k| spectrum.eigenfunction(k);
            (
                cost,
                peak,
                worst_residual(&laplacian, spectrum.eigenvalues(), function),
            )
        }
        "faer" => {
            let (pairs, cost) = timed(|| faer_lanczos(&laplacian, count, tolerance));
            let (pairs, peak) = (pairs?, peak_memory());
            let function = |k| pairs.eigenfunctions.col_as_slice(k);
            (
                cost,
                peak,
                worst_residual(&laplacian, &pairs.eigenvalues, function),
            )
        }
        other => bail!("{other}: no such solver"),
    };
    println!(
        "{}",
        json!({"cpu": cost.cpu, "wall": cost.wall, "peak": peak, "residual": residual})
    );
    Ok(())
}

/// [`solve_alone`] by ours: what it cost, and the most memory that the process held, in bytes.
pub(crate) fn ours_alone(problem: &Problem, case: Case) -> Result<(Outcome, Option<u64>)> {
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["bench", "solve", "ours"]).arg(&problem.matrices);
    command.args([case.count.to_string(), case.tolerance.to_string()]);
    let report: Value = serde_json::from_str(&output(&mut command)?).context("our own report")?;
    Ok((outcome(&report), report["peak"].as_u64()))
}

/// Reads a file of numbers and removes it: eigenfunctions are large.
fn take_numbers(path: &Path) -> Result<Vec<f64>> {
    let bytes = fs::read(path).with_context(|| path.display().to_string())?;
    fs::remove_file(path).with_context(|| path.display().to_string())?;
    let (numbers, _) = bytes.as_chunks::<8>();
    Ok(numbers.iter().map(|&number| f64::from_le_bytes(number)).collect())
}
