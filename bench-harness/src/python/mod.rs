//! `sigmark.spectrum` beside what else Python offers for the lower Laplace–Beltrami spectrum, each called as its makers show it.
//!
//! `peers/python/spectrum.py` solves one problem one way, in a process of its own; `page.rs` writes.

mod page;

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, bail};
use clap::Args;
use evaluation::{
    inputs::{mesh_files, name_of, named},
    process::{output_within, root},
    python::Python,
};
use mesh_io::Asset;
use serde::{Deserialize, Serialize};

use crate::{
    kept::{self, Key},
    measure::{greatest, median},
    peers::ONE_THREAD,
    wheel,
};

/// The meshes that are compared on unless others are asked for.
const MESHES: [&str; 3] = ["rocker_arm_10k", "stanford_bunny_bun_zipper_36k", "igea_134k"];

/// What to measure, and on what.
#[derive(Args)]
pub struct PythonBench {
    /// Mesh files
    #[arg(long, value_name = "DIR")]
    pub meshes: PathBuf,
    /// Files of these names, in this order; may be given again
    #[arg(long, value_name = "NAME", default_values = MESHES)]
    pub only: Vec<String>,
    /// Numbers of pairs
    #[arg(long, value_delimiter = ',', default_value = "50,325")]
    pub counts: Vec<usize>,
    /// The relative residual that is asked for
    #[arg(long, value_name = "RESIDUAL", default_value_t = 1e-8)]
    pub tolerance: f64,
    /// Our times are medians over so many rounds; the peers, who take minutes, have one
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub rounds: usize,
    /// A peer is stopped after so many CPU seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 900)]
    pub limit: u64,
    /// The wheel; by default the latest that `cargo xtask wheel` wrote
    #[arg(long, value_name = "FILE")]
    pub wheel: Option<PathBuf>,
}

/// The same problem, solved by ours and by others.
struct Operator {
    /// As it stands in the table.
    name: &'static str,
    /// What chooses ours in the script.
    ours: &'static str,
    peers: &'static [Way],
}

/// A way to solve it.
struct Way {
    /// As it stands in the table.
    name: &'static str,
    /// What chooses it in the script.
    word: &'static str,
}

const OPERATORS: [Operator; 3] = [
    Operator {
        name: "cotangent, lumped mass",
        ours: "sigmark-cotangent",
        peers: &[
            Way {
                name: "libigl + scipy",
                word: "libigl",
            },
            Way {
                name: "potpourri3d + scipy",
                word: "potpourri3d",
            },
        ],
    },
    Operator {
        name: "cotangent, full mass",
        ours: "sigmark-full",
        peers: &[Way {
            name: "LaPy",
            word: "lapy",
        }],
    },
    Operator {
        name: "intrinsic, lumped mass",
        ours: "sigmark-intrinsic",
        peers: &[Way {
            name: "robust_laplacian + scipy",
            word: "robust_laplacian",
        }],
    },
];

/// What became of one computation.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(untagged)]
enum Outcome {
    Done {
        cpu: f64,
        wall: f64,
        residual: f64,
        eigenvalues: Vec<f64>,
    },
    /// Stopped after so many CPU seconds.
    Stopped {
        #[serde(rename = "stopped")]
        after: f64,
    },
}

/// A line of the table.
struct Measured {
    mesh: String,
    vertices: usize,
    count: usize,
    operator: &'static str,
    name: &'static str,
    outcome: Outcome,
    /// The CPU time over ours for the same operator, and how far the eigenvalues are from ours; of a peer.
    beside: Option<(f64, Option<f64>)>,
}

/// What solves.
struct Solvers {
    python: Python,
    folder: PathBuf,
    limit: u64,
    tolerance: f64,
}

impl PythonBench {
    /// Measures, and writes `results/python.md` and `python.csv`.
    ///
    /// # Errors
    /// Without Python, without the wheel, and where a peer can't be installed.
    pub fn run(&self) -> Result<()> {
        let folder = kept::folder("python")?;
        let scripts = root().join("bench-harness/peers/python");
        let python = Python::prepare_in(scripts, folder.join("venv"))?.with_variables(&ONE_THREAD);
        wheel::install(&python, self.wheel.as_deref())?;
        let solvers = Solvers {
            python,
            folder,
            limit: self.limit,
            tolerance: self.tolerance,
        };
        let files = mesh_files(&self.meshes)?;
        let mut measured = Vec::new();
        for name in &self.only {
            let Some(path) = named(&files, name) else {
                println!("{name}: not in {}, left out", self.meshes.display());
                continue;
            };
            for &count in &self.counts {
                for operator in &OPERATORS {
                    measured.extend(self.compare(&solvers, path, count, operator)?);
                    page::write(&measured, self, &solvers.python)?;
                }
            }
        }
        if measured.is_empty() {
            bail!(
                "{}: no mesh file there has a name that was asked for",
                self.meshes.display()
            );
        }
        Ok(())
    }

    /// Ours and the peers on one problem.
    fn compare(
        &self,
        solvers: &Solvers,
        path: &Path,
        count: usize,
        operator: &Operator,
    ) -> Result<Vec<Measured>> {
        let asset = Asset::open(path)?;
        let (mesh, vertices) = (name_of(path), asset.mesh().vertex_count());
        let line = |name, outcome, beside| Measured {
            mesh: mesh.clone(),
            vertices,
            count,
            operator: operator.name,
            name,
            outcome,
            beside,
        };
        let rounds = (0..self.rounds.max(1)).map(|_| solvers.solve(operator.ours, path, count));
        let ours = Outcome::median(rounds.collect::<Result<_>>()?);
        let mut lines = Vec::new();
        for peer in operator.peers {
            let key = Key::new(format!("{mesh}-{count}-{:e}-{}", self.tolerance, peer.word)).of_asset(&asset);
            let enough = |kept: &Outcome| kept.had(self.limit);
            let theirs = kept::figures_if(&solvers.folder, &key, enough, || {
                solvers.solve(peer.word, path, count)
            })?;
            let beside = (theirs.cpu() / ours.cpu(), theirs.difference(&ours));
            lines.push(line(peer.name, theirs, Some(beside)));
        }
        lines.insert(0, line("sigmark", ours, None));
        for Measured { name, outcome, .. } in &lines {
            println!(
                "{mesh}, {count} pairs, {}: {name} {:.2} s",
                operator.name,
                outcome.cpu()
            );
        }
        Ok(lines)
    }
}

impl Solvers {
    fn solve(&self, word: &str, path: &Path, count: usize) -> Result<Outcome> {
        let mut command: Command = self.python.command("spectrum.py", [word]);
        command
            .arg(path)
            .args([count.to_string(), self.tolerance.to_string()]);
        match output_within(self.limit, &command)? {
            Some(report) => serde_json::from_str(&report).with_context(|| format!("{word}: {report}")),
            None => Ok(Outcome::Stopped {
                after: self.limit as f64,
            }),
        }
    }
}

impl Outcome {
    /// Of several rounds: the medians of the times, the worst residual.
    fn median(rounds: Vec<Self>) -> Self {
        let mut times = (Vec::new(), Vec::new());
        let mut found = None;
        for round in rounds {
            let Self::Done {
                cpu,
                wall,
                residual,
                eigenvalues,
            } = round
            else {
                return round;
            };
            times.0.push(cpu);
            times.1.push(wall);
            let worst = found.map_or(0.0, |(worst, _)| worst);
            found = Some((f64::max(worst, residual), eigenvalues));
        }
        let (residual, eigenvalues) = found.unwrap_or_default();
        Self::Done {
            cpu: median(times.0),
            wall: median(times.1),
            residual,
            eigenvalues,
        }
    }

    /// Whether more than so many CPU seconds would have changed nothing, or it had as many.
    fn had(&self, limit: u64) -> bool {
        match *self {
            Self::Done { .. } => true,
            Self::Stopped { after } => after >= limit as f64,
        }
    }

    fn cpu(&self) -> f64 {
        match self {
            Self::Done { cpu, .. } => *cpu,
            Self::Stopped { after } => *after,
        }
    }

    /// The greatest relative difference between eigenvalues, but for the first, which is 0.
    fn difference(&self, ours: &Self) -> Option<f64> {
        let (Self::Done { eigenvalues: a, .. }, Self::Done { eigenvalues: b, .. }) = (self, ours) else {
            return None;
        };
        let pairs = a.iter().zip(b).skip(1);
        Some(greatest(pairs.map(|(a, b)| (a / b - 1.0).abs())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_of_times_and_differences_of_all_but_the_first_eigenvalue() {
        let done = |cpu, values: [f64; 3]| Outcome::Done {
            cpu,
            wall: cpu,
            residual: cpu / 1024.0,
            eigenvalues: values.into(),
        };
        let ours = Outcome::median([3.0, 1.0, 2.0].map(|cpu| done(cpu, [0.0, 2.0, 4.0])).into());
        assert_eq!(ours.cpu(), 2.0);
        let worst = 3.0 / 1024.0;
        assert!(matches!(ours, Outcome::Done { residual, .. } if residual == worst));
        assert_eq!(done(1.0, [1e-9, 2.0, 5.0]).difference(&ours), Some(0.25));
        assert_eq!(
            done(1.0, [0.0, f64::NAN, 4.0]).difference(&ours),
            Some(f64::INFINITY)
        );
        assert_eq!(Outcome::Stopped { after: 900.0 }.difference(&ours), None);
    }

    #[test]
    fn a_peer_that_was_stopped_is_asked_again_with_more_time_alone() {
        let stopped = Outcome::Stopped { after: 60.0 };
        assert!(stopped.had(60) && stopped.had(30) && !stopped.had(900));
        assert!(Outcome::median(Vec::new()).had(900));
    }
}
