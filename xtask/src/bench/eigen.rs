//! The lowest eigenpairs of the same matrices by ours and by the peers.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use bench_harness::{largest_patch, mesh_files, name_of, worst_residual};
use mesh::Asset;
use mhb_core::{Laplacian, Spectrum, SpectrumOptions};
use serde_json::{Value, json};

use super::{
    chart::Chart,
    measure::{median, timed},
    peers,
};
use crate::{machine, python::Python, table::Table};

/// Patches of a watermark are smaller; a few whole meshes of the comparison are not.
const LARGEST: usize = 60_000;

const TOLERANCES: [f64; 2] = [1e-6, 1e-8];

/// The name in the table, and the name that eigen.py knows.
struct Peer {
    name: &'static str,
    option: &'static str,
}

const PEERS: [Peer; 3] = [
    Peer {
        name: "ARPACK, SuperLU",
        option: "superlu",
    },
    Peer {
        name: "ARPACK, CHOLMOD",
        option: "cholmod",
    },
    Peer {
        name: "LOBPCG",
        option: "lobpcg",
    },
];

/// One computation, measured over the rounds.
struct Cell {
    mesh: String,
    vertices: usize,
    count: usize,
    tolerance: f64,
    solver: String,
    cpu: f64,
    wall: f64,
    residual: f64,
}

/// A mesh whose matrices lie in a folder, where the peers read them.
struct Problem {
    name: String,
    laplacian: Laplacian,
    matrices: PathBuf,
}

pub(crate) fn run(
    meshes: &Path,
    only: &[String],
    counts: &[usize],
    rounds: usize,
    with_lobpcg: bool,
) -> Result<()> {
    let folder = peers::folder("eigen")?;
    let python = match peers::prepare() {
        Ok(python) => Some(python),
        Err(missing) => {
            eprintln!("No peers: {missing:#}.");
            None
        }
    };
    let peers = python
        .as_ref()
        .map_or_else(Vec::new, |python| available(python, with_lobpcg));
    let mut cells = Vec::new();
    for path in mesh_files(meshes)? {
        let name = name_of(&path);
        if !only.is_empty() && !only.iter().any(|wanted| name.starts_with(wanted.as_str())) {
            continue;
        }
        let problem = Problem::new(&path, &folder)?;
        for &count in counts {
            for tolerance in TOLERANCES {
                cells.extend(ours(&problem, count, tolerance, rounds)?);
                let Some(python) = &python else { continue };
                for peer in &peers {
                    cells.push(theirs(&problem, python, peer, count, tolerance, rounds)?);
                }
            }
        }
    }
    if cells.is_empty() {
        bail!(
            "{}: no mesh file there has a name that was asked for",
            meshes.display()
        );
    }
    write(&cells, rounds, python.as_ref())
}

/// The peers that run here; CHOLMOD has to be built, for which its headers must be there.
fn available(python: &Python, with_lobpcg: bool) -> Vec<&'static Peer> {
    let wanted = python.scripts().join("requirements-cholmod.txt");
    let has_cholmod = python.install(&wanted).is_ok();
    if !has_cholmod {
        eprintln!(
            "No CHOLMOD: scikit-sparse does not build; install SuiteSparse (Debian: apt-get install libsuitesparse-dev)."
        );
    }
    PEERS
        .iter()
        .filter(|peer| has_cholmod || peer.option != "cholmod")
        .filter(|peer| with_lobpcg || peer.option != "lobpcg")
        .collect()
}

impl Problem {
    fn new(path: &Path, folder: &Path) -> Result<Self> {
        let mesh = largest_patch(Asset::open(path)?.mesh(), LARGEST)?;
        let laplacian = Laplacian::cotangent(&mesh)?;
        let name = name_of(path);
        let matrices = folder.join(&name);
        fs::create_dir_all(&matrices).with_context(|| matrices.display().to_string())?;
        let stiffness = laplacian.stiffness();
        let offsets: Vec<u64> = stiffness
            .indptr()
            .raw_storage()
            .iter()
            .map(|&i| i as u64)
            .collect();
        let columns: Vec<u64> = stiffness.indices().iter().map(|&i| i as u64).collect();
        let write = |name: &str, bytes: Vec<u8>| {
            let path = matrices.join(name);
            fs::write(&path, bytes).with_context(|| path.display().to_string())
        };
        write(
            "offsets.u64",
            offsets.iter().flat_map(|i| i.to_le_bytes()).collect(),
        )?;
        write(
            "columns.u64",
            columns.iter().flat_map(|i| i.to_le_bytes()).collect(),
        )?;
        write(
            "values.f64",
            stiffness.data().iter().flat_map(|x| x.to_le_bytes()).collect(),
        )?;
        write(
            "mass.f64",
            laplacian.mass().iter().flat_map(|x| x.to_le_bytes()).collect(),
        )?;
        Ok(Self {
            name,
            laplacian,
            matrices,
        })
    }

    fn cell(&self, solver: &str, count: usize, tolerance: f64, measured: &[Value]) -> Cell {
        let figure = |key: &'static str| {
            measured
                .iter()
                .map(move |value| value[key].as_f64().unwrap_or(f64::NAN))
        };
        let cell = Cell {
            mesh: self.name.clone(),
            vertices: self.laplacian.mass().len(),
            count,
            tolerance,
            solver: solver.into(),
            cpu: median(figure("cpu")),
            wall: median(figure("wall")),
            residual: figure("residual").fold(0.0, f64::max),
        };
        println!(
            "{}: {count} pairs, {tolerance:e}, {solver}: CPU {:.2} s, wall {:.2} s, worst residual {:.1e}",
            cell.mesh, cell.cpu, cell.wall, cell.residual
        );
        cell
    }
}

/// On one thread and on two.
fn ours(problem: &Problem, count: usize, tolerance: f64, rounds: usize) -> Result<Vec<Cell>> {
    [(1, "ours"), (2, "ours, 2 threads")]
        .into_iter()
        .map(|(threads, name)| {
            let options = SpectrumOptions {
                count,
                tolerance,
                threads,
                ..Default::default()
            };
            let round = |_| {
                let (spectrum, cost) = timed(|| Spectrum::of_laplacian(&problem.laplacian, &options));
                let spectrum = spectrum?;
                if !spectrum.certificate().complete {
                    bail!("{}: pairs are missing", problem.name);
                }
                let residual = worst_residual(&problem.laplacian, spectrum.eigenvalues(), |k| {
                    spectrum.eigenfunction(k)
                });
                Ok(json!({"cpu": cost.cpu, "wall": cost.wall, "residual": residual}))
            };
            let measured: Vec<Value> = (0..rounds).map(round).collect::<Result<_>>()?;
            Ok(problem.cell(name, count, tolerance, &measured))
        })
        .collect()
}

fn theirs(
    problem: &Problem,
    python: &Python,
    peer: &Peer,
    count: usize,
    tolerance: f64,
    rounds: usize,
) -> Result<Cell> {
    let round = |round: usize| {
        let name = format!("{}-{count}-{tolerance:e}-{round}", peer.option);
        peers::cell(&problem.matrices, &name, || {
            solve(problem, python, peer, count, tolerance)
        })
    };
    let measured: Vec<Value> = (0..rounds).map(round).collect::<Result<_>>()?;
    Ok(problem.cell(peer.name, count, tolerance, &measured))
}

fn solve(problem: &Problem, python: &Python, peer: &Peer, count: usize, tolerance: f64) -> Result<Value> {
    let folder = problem.matrices.join(peer.option);
    fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let arguments = [
        peer.option.into(),
        problem.matrices.clone().into_os_string(),
        count.to_string().into(),
        tolerance.to_string().into(),
        folder.clone().into_os_string(),
    ];
    let report = python.run("eigen.py", arguments)?;
    let cost: Value = serde_json::from_str(&report).context("the report of eigen.py")?;
    let values = take_numbers(&folder.join("eigenvalues.f64"))?;
    let functions = take_numbers(&folder.join("eigenfunctions.f64"))?;
    let n = problem.laplacian.mass().len();
    if values.len() != count || functions.len() != n * count {
        bail!("{}: {} pairs instead of {count}", peer.name, values.len());
    }
    let residual = worst_residual(&problem.laplacian, &values, |k| &functions[k * n..(k + 1) * n]);
    Ok(json!({"cpu": cost["cpu"], "wall": cost["wall"], "residual": residual}))
}

/// Reads a file of numbers and removes it: eigenfunctions are large.
fn take_numbers(path: &Path) -> Result<Vec<f64>> {
    let bytes = fs::read(path).with_context(|| path.display().to_string())?;
    fs::remove_file(path).with_context(|| path.display().to_string())?;
    let (numbers, _) = bytes.as_chunks::<8>();
    Ok(numbers.iter().map(|&number| f64::from_le_bytes(number)).collect())
}

fn write(cells: &[Cell], rounds: usize, python: Option<&Python>) -> Result<()> {
    let results = crate::process::root().join("results");
    fs::create_dir_all(&results).with_context(|| results.display().to_string())?;
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
        table.row([
            cell.mesh.clone(),
            cell.vertices.to_string(),
            cell.count.to_string(),
            format!("{:e}", cell.tolerance),
            cell.solver.clone(),
            format!("{:.2}", cell.cpu),
            format!("{:.2}", cell.wall),
            format!("{:.1e}", cell.residual),
            ratio(cells, cell).map_or_else(String::new, |ratio| format!("{ratio:.2}")),
        ]);
    }
    table.write_csv(&results.join("eigen.csv"))?;
    let (median_ratios, speed_up) = summary(cells);
    let environment = python
        .map(Python::versions)
        .transpose()?
        .map_or_else(String::new, |versions| format!("; {versions}"));
    let page = format!(
        "# The eigen-solver beside its peers\n\nWritten by `cargo xtask bench eigen`. Everyone solves the same matrices, cotangent stiffness and lumped mass, for the lowest pairs; \
         one judge takes the residual max ‖S h − λ D h‖_{{D⁻¹}} / λ of what they return. CPU seconds are user and system time of the solve, factorisation included, \
         on one thread unless said otherwise; medians of {rounds} round(s). ARPACK runs in shift-invert mode, σ = −0.01 on unit area, with scipy's default of vectors; LOBPCG, where it stands, with the exact inverse as preconditioner, stopped after 60 steps. \
         Ours proves by inertia that no pair is missing. Cells of the peers that an earlier run finished are not measured again.\n\n![CPU seconds](eigen.svg)\n\n{median_ratios}{speed_up}\n{}\n{}{environment}; {}.\n",
        table.markdown(),
        machine::description(),
        machine::load(),
    );
    let path = results.join("eigen.md");
    fs::write(&path, page).with_context(|| path.display().to_string())?;
    let path = results.join("eigen.svg");
    fs::write(&path, chart(cells).svg()).with_context(|| path.display().to_string())?;
    println!("written: {}", results.join("eigen.md").display());
    Ok(())
}

/// The cell's CPU time over ours for the same case.
fn ratio(cells: &[Cell], cell: &Cell) -> Option<f64> {
    let same = |other: &&Cell| {
        (&other.mesh, other.count) == (&cell.mesh, cell.count) && other.tolerance == cell.tolerance
    };
    let ours = cells.iter().filter(same).find(|other| other.solver == "ours")?;
    Some(cell.cpu / ours.cpu)
}

/// Medians over the cases: how many times the CPU time each peer needs; how much two threads gain.
fn summary(cells: &[Cell]) -> (String, String) {
    let mut text = String::new();
    for peer in &PEERS {
        for tolerance in TOLERANCES {
            let ratios: Vec<f64> = cells
                .iter()
                .filter(|cell| cell.solver == peer.name && cell.tolerance == tolerance)
                .filter_map(|cell| ratio(cells, cell))
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
    let gains = cells
        .iter()
        .filter(|cell| cell.solver == "ours")
        .filter_map(|one| {
            let two = cells.iter().find(|two| {
                two.solver == "ours, 2 threads"
                    && (&two.mesh, two.count) == (&one.mesh, one.count)
                    && two.tolerance == one.tolerance
            })?;
            Some(one.wall / two.wall)
        });
    let gain = format!(
        "- two threads make ours {:.2} times faster by the clock (median)\n",
        median(gains)
    );
    (text, gain)
}

/// The first mesh's first case.
fn chart(cells: &[Cell]) -> Chart {
    let first = &cells[0];
    let mut chart = Chart::new(
        &format!(
            "{} lowest pairs of {} ({} vertices), one thread",
            first.count, first.mesh, first.vertices
        ),
        "CPU seconds",
    );
    for cell in cells {
        if (&cell.mesh, cell.count, cell.tolerance) == (&first.mesh, first.count, first.tolerance)
            && !cell.solver.ends_with("threads")
        {
            chart.bar(
                &cell.solver,
                cell.cpu,
                &format!("{:.1} s, residual {:.0e}", cell.cpu, cell.residual),
            );
        }
    }
    chart
}
