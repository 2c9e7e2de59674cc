//! The lowest eigenpairs of the same matrices by ours and by the peers; ours at loose tolerances, on many patches, for many pairs.

mod loose;
mod problem;
mod scaling;
mod solvers;

use std::{fmt, fs, path::PathBuf};

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};

pub use self::solvers::{Alone, solve_alone};
use self::{
    problem::Problem,
    solvers::{Bench, Case, Outcome, PEERS, ours},
};
use crate::{kept, measure::median};
use evaluation::chart::Chart;
use evaluation::{machine, table::Table};

/// The meshes that are compared on, the one of the chart first.
const MESHES: [&str; 4] = [
    "stanford_bunny_closed_35k",
    "horse_48k",
    "elephant_refined_44k",
    "igea_134k",
];

/// The first number of pairs is solved to both, the others to the first: peers take minutes.
const TOLERANCES: [f64; 2] = [1e-6, 1e-8];

#[derive(Args)]
pub struct Options {
    /// Mesh files; of one with more than 60 000 vertices, the largest patch is taken
    #[arg(long, value_name = "DIR")]
    meshes: PathBuf,
    /// Files whose name begins so, in this order; may be repeated
    #[arg(long, value_name = "NAME", default_values = MESHES)]
    only: Vec<String>,
    /// Numbers of pairs; the first to 1e-6 and 1e-8, the others to 1e-6, and by the peers on the first mesh alone
    #[arg(long, value_delimiter = ',', default_value = "325,513")]
    counts: Vec<usize>,
    /// Our times are medians over so many rounds
    #[arg(long, default_value_t = 3)]
    rounds: usize,
    /// And the peers' over so many
    #[arg(long, default_value_t = 1)]
    peer_rounds: usize,
    /// A peer is stopped after so many CPU seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 900)]
    limit: u64,
    /// What to measure; all unless said
    #[arg(long, value_delimiter = ',', default_value = "comparison,loose,scaling")]
    parts: Vec<Part>,
    /// The mesh that is cut into patches for the scaling
    #[arg(long, value_name = "NAME", default_value = "ct_skull_1081k_closed")]
    scaling: String,
    /// Into so many
    #[arg(long, default_value_t = 33)]
    patches: usize,
    /// Where the tables and the chart go
    #[arg(long, value_name = "DIR", default_value_os_t = evaluation::process::root().join("results"))]
    output: PathBuf,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    /// Ours beside the peers
    Comparison,
    /// Ours at HSIM's tolerances
    Loose,
    /// Many patches; many pairs
    Scaling,
}

/// One computation, measured over the rounds.
struct Cell {
    mesh: String,
    vertices: usize,
    case: Case,
    solver: &'static str,
    outcome: Outcome,
}

const OURS: &str = "ours";
const OURS_ON_TWO: &str = "ours, 2 threads";

/// All that was measured; written again after every step, so that a run that ends early leaves what it has.
struct Results<'a> {
    options: &'a Options,
    cells: Vec<Cell>,
    loose: Option<Table>,
    scaling: Vec<Table>,
    versions: String,
}

pub fn run(options: &Options) -> Result<()> {
    fs::create_dir_all(&options.output).with_context(|| options.output.display().to_string())?;
    let folder = kept::folder("eigen")?;
    let mut results = Results {
        options,
        cells: Vec::new(),
        loose: None,
        scaling: Vec::new(),
        versions: String::new(),
    };
    if options.parts.contains(&Part::Scaling) {
        results.scaling =
            scaling::tables(&options.meshes, &options.scaling, options.patches, &folder)?.into();
        results.write()?;
    }
    if options.parts.contains(&Part::Loose) {
        results.loose = Some(loose::table(&options.meshes, &folder)?);
        results.write()?;
    }
    if options.parts.contains(&Part::Comparison) {
        let problems = problem::files(&options.meshes, &options.only)?
            .iter()
            .map(|path| Problem::of_file(path, &folder))
            .collect::<Result<Vec<_>>>()?;
        let bench = Bench::prepare(&folder, options.limit);
        results.versions = bench.versions()?;
        for case in cases(&options.counts) {
            for (i, problem) in problems.iter().enumerate() {
                // More pairs cost the peers minutes each: one mesh has to do.
                let with_peers = i == 0 || options.counts.first() == Some(&case.count);
                results.compare(&bench, problem, case, with_peers)?;
                results.write()?;
            }
        }
    }
    println!("written: {}", options.output.join("eigen.md").display());
    Ok(())
}

/// Those that take least first.
fn cases(counts: &[usize]) -> Vec<Case> {
    let first = counts.iter().take(1);
    let [coarse, fine] = TOLERANCES;
    let fine = first.map(|&count| Case {
        count,
        tolerance: fine,
    });
    let coarse = counts.iter().map(|&count| Case {
        count,
        tolerance: coarse,
    });
    let mut cases: Vec<Case> = coarse.chain(fine).collect();
    cases.sort_by_key(|case| case.count);
    cases
}

impl Results<'_> {
    /// Ours and the peers on one problem, one after the other.
    fn compare(&mut self, bench: &Bench, problem: &Problem, case: Case, with_peers: bool) -> Result<()> {
        let Options {
            rounds, peer_rounds, ..
        } = *self.options;
        let first = self.cells.is_empty();
        for (solver, threads) in [(OURS, 1), (OURS_ON_TWO, 2)] {
            let round = |_| ours(&problem.laplacian, case, threads);
            let measured = (0..rounds.max(1)).map(round).collect::<Result<Vec<_>>>();
            self.add(problem, case, solver, &measured.context(problem.name.clone())?);
        }
        for peer in bench
            .peers()
            .filter(|peer| first || with_peers && peer.everywhere)
        {
            let round = |round| bench.theirs(problem, peer, case, round);
            let measured = (0..peer_rounds.max(1)).map(round).collect::<Result<Vec<_>>>()?;
            self.add(problem, case, peer.name, &measured);
        }
        Ok(())
    }

    fn add(&mut self, problem: &Problem, case: Case, solver: &'static str, measured: &[Outcome]) {
        let outcome = Outcome::median(measured);
        println!(
            "{}: {} pairs, {:e}, {solver}: {outcome}",
            problem.name, case.count, case.tolerance
        );
        self.cells.push(Cell {
            mesh: problem.name.clone(),
            vertices: problem.size(),
            case,
            solver,
            outcome,
        });
    }

    fn write(&self) -> Result<()> {
        let file = |name: &str, text: String| {
            let path = self.options.output.join(name);
            fs::write(&path, text).with_context(|| path.display().to_string())
        };
        let mut sections = Vec::new();
        if !self.cells.is_empty() {
            let table = comparison(&self.cells);
            table.write_csv(&self.options.output.join("eigen.csv"))?;
            file("eigen.svg", chart(&self.cells).svg())?;
            sections.push(format!(
                "![CPU seconds](eigen.svg)\n\n{}\n{}",
                summary(&self.cells),
                table.markdown()
            ));
        }
        if let Some(table) = &self.loose {
            table.write_csv(&self.options.output.join("eigen_loose.csv"))?;
            sections.push(format!("{}\n{}\n", table.markdown(), loose::WORDS));
        }
        for (table, name) in self.scaling.iter().zip(["eigen_patches.csv", "eigen_pairs.csv"]) {
            table.write_csv(&self.options.output.join(name))?;
            sections.push(table.markdown());
        }
        let Options {
            rounds, peer_rounds, ..
        } = *self.options;
        let page = format!(
            "# The eigen-solver beside its peers\n\nWritten by `cargo xtask bench eigen`. Everyone solves the same matrices, cotangent stiffness and lumped mass, for the lowest pairs; \
             one judge takes the residual max ‖S h − λ D h‖_{{D⁻¹}} / λ of what they return. CPU seconds are user and system time of the solve, factorisation included, \
             on one thread unless said otherwise; medians of {rounds} round(s) of ours and {peer_rounds} of the peers'. Lanczos methods run in shift-invert mode, σ = −0.01 on unit area, \
             with as many vectors as their makers advise, twice the pairs. LOBPCG has the exact inverse as preconditioner, a fifth more vectors than pairs, and ends after 60 steps at the latest. \
             Ours proves by inertia that no pair is missing. Cells of the peers that an earlier run finished are not measured again.\n\n{}\n{}{}; {}.\n",
            sections.join("\n"),
            machine::description(),
            self.versions,
            machine::load(),
        );
        file("eigen.md", page)
    }
}

impl Outcome {
    /// Medians of the times, the worst of the residuals; of rounds of which one was stopped, that.
    fn median(rounds: &[Self]) -> Self {
        let stopped = rounds.iter().find(|round| matches!(round, Self::Stopped(_)));
        if let Some(&stopped) = stopped {
            return stopped;
        }
        let figure = |which: fn(f64, f64, f64) -> f64| {
            rounds.iter().filter_map(move |round| match *round {
                Self::Done { cpu, wall, residual } => Some(which(cpu, wall, residual)),
                Self::Stopped(_) => None,
            })
        };
        Self::Done {
            cpu: median(figure(|cpu, _, _| cpu)),
            wall: median(figure(|_, wall, _| wall)),
            residual: figure(|_, _, residual| residual).fold(0.0, f64::max),
        }
    }

    /// CPU seconds; of a computation that was stopped, those until then.
    fn cpu(&self) -> f64 {
        match *self {
            Self::Done { cpu, .. } => cpu,
            Self::Stopped(seconds) => seconds,
        }
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Done { cpu, wall, residual } => {
                write!(
                    f,
                    "CPU {cpu:.2} s, wall {wall:.2} s, worst residual {residual:.1e}"
                )
            }
            Self::Stopped(seconds) => write!(f, "stopped after {seconds:.0} CPU seconds"),
        }
    }
}

impl Cell {
    /// Whether the residuals are what was asked for.
    fn converged(&self) -> bool {
        matches!(self.outcome, Outcome::Done { residual, .. } if residual <= self.case.tolerance)
    }

    /// The CPU time over ours for the same case.
    fn ratio(&self, cells: &[Cell]) -> Option<f64> {
        let ours = cells
            .iter()
            .find(|other| other.solver == OURS && other.is_beside(self))?;
        Some(self.outcome.cpu() / ours.outcome.cpu())
    }

    fn is_beside(&self, other: &Self) -> bool {
        (&self.mesh, self.case) == (&other.mesh, other.case)
    }
}

fn comparison(cells: &[Cell]) -> Table {
    let header = [
        "mesh",
        "n",
        "pairs",
        "tolerance",
        "solver",
        "CPU (s)",
        "wall (s)",
        "worst residual",
        "CPU / ours",
    ];
    let mut table = Table::new("Lowest eigenpairs of S h = λ D h", &header);
    for cell in cells {
        let ratio = cell
            .ratio(cells)
            .map_or_else(String::new, |ratio| format!("{ratio:.2}"));
        let (cpu, wall, residual, ratio) = match cell.outcome {
            Outcome::Done { cpu, wall, residual } => {
                let missed = if cell.converged() { "" } else { ", not converged" };
                let residual = format!("{residual:.1e}{missed}");
                (format!("{cpu:.2}"), format!("{wall:.2}"), residual, ratio)
            }
            Outcome::Stopped(seconds) => (
                format!("> {seconds:.0}"),
                String::new(),
                "stopped".into(),
                format!("> {ratio}"),
            ),
        };
        table.row([
            cell.mesh.clone(),
            cell.vertices.to_string(),
            cell.case.count.to_string(),
            format!("{:e}", cell.case.tolerance),
            cell.solver.into(),
            cpu,
            wall,
            residual,
            ratio,
        ]);
    }
    table
}

/// Medians over the cases: how many times the CPU time each peer needs; how much two threads gain.
fn summary(cells: &[Cell]) -> String {
    let mut text = String::new();
    for peer in &PEERS {
        for tolerance in TOLERANCES {
            let ratios: Vec<f64> = cells
                .iter()
                .filter(|cell| cell.solver == peer.name && cell.case.tolerance == tolerance)
                .filter_map(|cell| cell.ratio(cells))
                .collect();
            if !ratios.is_empty() {
                let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
                text += &format!(
                    "- {} at {tolerance:e} takes {:.1} times our CPU time (median of {} case(s); least {least:.1})\n",
                    peer.name,
                    median(ratios.iter().copied()),
                    ratios.len()
                );
            }
        }
    }
    let gains = cells.iter().filter(|cell| cell.solver == OURS).filter_map(|one| {
        let two = cells
            .iter()
            .find(|two| two.solver == OURS_ON_TWO && two.is_beside(one))?;
        match (one.outcome, two.outcome) {
            (Outcome::Done { wall: one, .. }, Outcome::Done { wall: two, .. }) => Some(one / two),
            _ => None,
        }
    });
    text + &format!(
        "- two threads make ours {:.2} times faster by the clock (median)\n",
        median(gains)
    )
}

/// The first case, in which all peers are: ours, then the peers, the fastest first.
fn chart(cells: &[Cell]) -> Chart {
    let first = &cells[0];
    let title = format!(
        "The {} lowest pairs of {} ({} vertices) to {:e}, one thread",
        first.case.count, first.mesh, first.vertices, first.case.tolerance
    );
    let mut chart = Chart::new(&title, "CPU seconds");
    let beside = |cell: &&Cell| cell.is_beside(first) && cell.solver != OURS_ON_TWO;
    let mut shown: Vec<&Cell> = cells.iter().filter(beside).collect();
    shown.sort_by(|a, b| {
        let key = |cell: &Cell| (cell.solver != OURS, cell.outcome.cpu());
        key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal)
    });
    for cell in shown {
        let cpu = cell.outcome.cpu();
        let times = cell.ratio(cells).filter(|_| cell.solver != OURS);
        let times = times.map_or_else(String::new, |ratio| format!(", {ratio:.1} ×"));
        let words = match cell.outcome {
            Outcome::Stopped(_) => format!("stopped at {cpu:.0} s"),
            Outcome::Done { residual, .. } if !cell.converged() => {
                format!("{cpu:.1} s, residual only {residual:.0e}")
            }
            Outcome::Done { .. } => format!("{cpu:.1} s{times}"),
        };
        if cell.converged() {
            chart.bar(cell.solver, cpu, &words);
        } else {
            chart.open_bar(cell.solver, cpu, &words);
        }
    }
    chart
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_pairs_come_first_and_only_they_are_solved_to_both_tolerances() {
        let cases: Vec<_> = cases(&[325, 513])
            .iter()
            .map(|case| (case.count, case.tolerance))
            .collect();
        assert_eq!(cases, [(325, 1e-6), (325, 1e-8), (513, 1e-6)]);
    }

    #[test]
    fn a_round_that_was_stopped_leaves_no_median_and_a_bad_residual_shows() {
        let done = |cpu, residual| Outcome::Done {
            cpu,
            wall: cpu,
            residual,
        };
        let rounds = [done(3.0, 1e-7), done(1.0, 1e-3), done(2.0, 1e-8)];
        assert_eq!(
            Outcome::median(&rounds),
            Outcome::Done {
                cpu: 2.0,
                wall: 2.0,
                residual: 1e-3
            }
        );
        let stopped = Outcome::Stopped(900.0);
        assert_eq!(Outcome::median(&[rounds[0], stopped]), stopped);
    }

    #[test]
    fn what_was_stopped_or_missed_its_tolerance_says_so_in_table_and_chart() {
        let cell = |solver, outcome| Cell {
            mesh: "m".into(),
            vertices: 10,
            case: Case {
                count: 3,
                tolerance: 1e-6,
            },
            solver,
            outcome,
        };
        let done = |cpu, residual| Outcome::Done {
            cpu,
            wall: cpu,
            residual,
        };
        let cells = [
            cell(OURS, done(2.0, 1e-7)),
            cell("slow", Outcome::Stopped(60.0)),
            cell("loose", done(8.0, 1e-3)),
            cell("good", done(6.0, 1e-9)),
        ];
        let table = comparison(&cells);
        assert_eq!(table.rows[1][5..], ["> 60", "", "stopped", "> 30.00"]);
        assert_eq!(table.rows[2][7..], ["1.0e-3, not converged", "4.00"]);
        assert_eq!(table.rows[3][7..], ["1.0e-9", "3.00"]);
        let svg = chart(&cells).svg();
        assert_eq!(svg.matches("stroke-dasharray").count(), 2);
        let place = |words: &str| svg.find(words).unwrap();
        assert!(place("2.0 s") < place("6.0 s, 3.0 ×"));
        assert!(place("6.0 s, 3.0 ×") < place("residual only 1e-3"));
        assert!(place("residual only 1e-3") < place("stopped at 60 s"));
    }
}
