//! Divisions of the same graphs by ours, METIS and KaFFPa-strong.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, bail};
use clap::Args;
use evaluation::inputs::{edge_graph, graph_files, mesh_files, name_of, read_graph};
use job::Job;
use mesh_io::Asset;
use partition::{Effort, Graph, Options, Partition, partition, write_metis};
use serde_json::{Value, json};

use crate::{
    kept,
    measure::{Cost, geometric_mean, greatest, median, timed},
    peers,
};
use evaluation::{
    machine,
    process::{output, peak_memory, root},
    python::Python,
    table::Table,
};

/// METIS' default, and the bound of all comparisons here.
const IMBALANCE: f64 = 0.03;

const PARTS: [usize; 6] = [2, 4, 8, 16, 32, 64];

/// Meshes of the anchors have their own numbers of parts.
const MESH_PARTS: [(&str, &[usize]); 5] = [
    ("stanford_bunny_closed_35k", &[2, 8, 32]),
    ("igea_134k", &[5, 16]),
    ("ct_skull_179k_boundary", &[6, 16]),
    ("dragon_vrip_438k", &[16, 64]),
    ("ct_skull_1081k_closed", &[33, 128]),
];

/// Below this, METIS' clock, which counts milliseconds, says nothing about a ratio.
const LEAST_SECONDS: f64 = 0.010;

struct Problem {
    name: String,
    graph: Graph,
    /// Where METIS reads it.
    file: PathBuf,
    parts: &'static [usize],
}

/// One division of one graph by ours and by the peers.
struct Case {
    graph: String,
    parts: usize,
    metis: Partition,
    ours: Partition,
    high: Partition,
    kaffpa: Option<i64>,
    metis_seconds: f64,
    one_thread: Cost,
    two_threads: Cost,
    high_seconds: f64,
    memory: Memory,
}

/// The most memory of a process that holds a graph and divides it, in bytes.
struct Memory {
    metis: Option<u64>,
    ours: Option<u64>,
}

pub fn run(graphs: &Path, meshes: &Path, rounds: usize, with_kaffpa: bool) -> Result<()> {
    output(Command::new("gpmetis").arg("-help"))
        .context("METIS is not there: install it (Debian: apt-get install metis)")?;
    let python = with_kaffpa
        .then(peers::prepare)
        .transpose()
        .unwrap_or_else(|missing| {
            eprintln!("No KaFFPa: {missing:#}.");
            None
        });
    let mut cases = Vec::new();
    for problem in problems(graphs, meshes)? {
        for &parts in problem.parts {
            let case = divide(&problem, parts, rounds, python.as_ref())?;
            println!(
                "{} in {parts}: METIS {}, ours {} ({:.3}), high effort {} ({:.3}){}",
                case.graph,
                case.metis.cut,
                case.ours.cut,
                case.ratio(),
                case.high.cut,
                case.high.cut as f64 / case.metis.cut as f64,
                case.kaffpa
                    .map_or_else(String::new, |cut| format!(", KaFFPa-strong {cut}"))
            );
            cases.push(case);
        }
    }
    write(&cases, rounds)
}

fn problems(graphs: &Path, meshes: &Path) -> Result<Vec<Problem>> {
    let folder = kept::folder("partition")?;
    let mut problems = Vec::new();
    let mut add = |name: String, graph: Graph, parts| {
        let file = folder.join(format!("{name}.graph"));
        fs::write(&file, write_metis(&graph)).with_context(|| file.display().to_string())?;
        problems.push(Problem {
            name,
            graph,
            file,
            parts,
        });
        anyhow::Ok(())
    };
    for path in graph_files(graphs)? {
        add(name_of(&path), read_graph(&path)?, &PARTS)?;
    }
    let mesh_files = mesh_files(meshes)?;
    for (name, parts) in MESH_PARTS {
        let Some(path) = mesh_files.iter().find(|path| name_of(path) == name) else {
            eprintln!("{}: no file {name}, left out", meshes.display());
            continue;
        };
        add(name.into(), edge_graph(Asset::open(path)?.mesh())?, parts)?;
    }
    if problems.is_empty() {
        bail!("no graphs: give folders with METIS graph files and mesh files");
    }
    Ok(problems)
}

impl Case {
    fn ratio(&self) -> f64 {
        self.ours.cut as f64 / self.metis.cut as f64
    }

    fn ratio_to_kaffpa(&self) -> Option<f64> {
        self.kaffpa.map(|cut| self.high.cut as f64 / cut as f64)
    }
}

fn divide(problem: &Problem, parts: usize, rounds: usize, python: Option<&Python>) -> Result<Case> {
    let with = |effort| Options {
        parts,
        imbalance: IMBALANCE,
        effort,
        ..Default::default()
    };
    let options = with(Effort::Default);
    let divided = |options: &Options, threads| partition(&problem.graph, options, &Job::new(threads));
    let (mut metis, mut one, mut two) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..rounds {
        metis.push(gpmetis(&problem.file, parts)?);
        one.push(timed(|| divided(&options, 1)).1);
        two.push(timed(|| divided(&options, 2)).1);
    }
    let high = timed(|| divided(&with(Effort::High), 1));
    let ours = divided(&options, 1);
    let by_metis = PathBuf::from(format!("{}.part.{parts}", problem.file.display()));
    let by_metis = fs::read_to_string(&by_metis).with_context(|| by_metis.display().to_string())?;
    let seconds = |costs: &[Cost], of: fn(&Cost) -> f64| median(costs.iter().map(of));
    let both = |costs: &[Cost]| Cost {
        cpu: seconds(costs, |cost| cost.cpu),
        wall: seconds(costs, |cost| cost.wall),
    };
    Ok(Case {
        graph: problem.name.clone(),
        parts,
        metis: judged(problem, &by_metis, &options)?,
        ours: ours?,
        high: high.0?,
        kaffpa: python
            .filter(|_| problem.parts == PARTS)
            .map(|python| kaffpa(problem, parts, python))
            .transpose()?,
        metis_seconds: median(metis),
        one_thread: both(&one),
        two_threads: both(&two),
        high_seconds: high.1.cpu,
        memory: memory(&problem.file, parts)?,
    })
}

/// One graph for a process of its own, whose memory can be told from others'.
#[derive(Args)]
pub struct Alone {
    /// METIS graph file
    file: PathBuf,
    parts: usize,
}

/// Divides at default effort on one thread and prints the most memory held after the file was read, in bytes, as JSON.
pub fn divide_alone(alone: &Alone) -> Result<()> {
    let graph = read_graph(&alone.file)?;
    machine::forget_peak_memory();
    let options = Options {
        parts: alone.parts,
        imbalance: IMBALANCE,
        ..Default::default()
    };
    let divided = partition(&graph, &options, &Job::default())?;
    println!("{}", json!({"peak": machine::peak_memory(), "cut": divided.cut}));
    Ok(())
}

fn memory(file: &Path, parts: usize) -> Result<Memory> {
    let mut alone = Command::new(std::env::current_exe()?);
    alone.args(["bench", "divide"]).arg(file).arg(parts.to_string());
    let report: Value = serde_json::from_str(&output(&mut alone)?).context("our own report")?;
    let mut gpmetis = Command::new("gpmetis");
    gpmetis.arg("-nooutput").arg(file).arg(parts.to_string());
    Ok(Memory {
        metis: peak_memory(&mut gpmetis)?,
        ours: report["peak"].as_u64(),
    })
}

/// Divides a file with the defaults; answers with CPU seconds as METIS reports them.
fn gpmetis(file: &Path, parts: usize) -> Result<f64> {
    let report = output(Command::new("gpmetis").arg(file).arg(parts.to_string()))?;
    figure(&report, "Partitioning:")
}

/// The number that follows a label in METIS' report.
fn figure(report: &str, label: &str) -> Result<f64> {
    let number = report
        .lines()
        .find_map(|line| line.trim().strip_prefix(label)?.split_whitespace().next())
        .and_then(|word| word.parse().ok());
    number.with_context(|| format!("the report of METIS has no line \"{label}\""))
}

/// A division by its list of parts.
fn judged(problem: &Problem, part_of: &str, options: &Options) -> Result<Partition> {
    let part_of = part_of
        .split_ascii_whitespace()
        .map(str::parse)
        .collect::<Result<Vec<u32>, _>>()?;
    Ok(Partition::evaluate(
        &problem.graph,
        part_of,
        options,
        &Job::default(),
    )?)
}

/// The cut of KaFFPa-strong, once; it takes long, so that finished cells are kept.
fn kaffpa(problem: &Problem, parts: usize, python: &Python) -> Result<i64> {
    let cell = kept::figures(
        &kept::folder("partition")?,
        &format!("kaffpa-{}-{parts}", problem.name),
        || {
            let arguments = [
                problem.file.as_os_str().to_owned(),
                parts.to_string().into(),
                IMBALANCE.to_string().into(),
                "0".into(),
            ];
            let printed = python.run("kaffpa.py", arguments)?;
            let (cost, part_of) = printed
                .split_once('\n')
                .context("kaffpa.py printed no partition")?;
            let cost: Value = serde_json::from_str(cost)?;
            let options = Options {
                parts,
                imbalance: IMBALANCE,
                ..Default::default()
            };
            let cut = judged(problem, part_of, &options)?.cut;
            Ok(json!({"cut": cut, "cpu": cost["cpu"]}))
        },
    )?;
    cell["cut"].as_i64().context("a cell of KaFFPa without a cut")
}

fn write(cases: &[Case], rounds: usize) -> Result<()> {
    let results = root().join("results");
    fs::create_dir_all(&results).with_context(|| results.display().to_string())?;
    let cuts = cut_table(cases);
    cuts.write_csv(&results.join("partition.csv"))?;
    let page = format!(
        "# The partitioner beside METIS\n\nWritten by `cargo xtask bench partition`: METIS 5.1 (`gpmetis`, defaults, one run) and ours, default effort and seed 0, on the same graphs, \
         at 3 % imbalance. Everyone's parts are judged by the same code. METIS' seconds are those that it reports for the partitioning alone; ours are CPU seconds on one thread and \
         wall seconds on two; medians of {rounds} round(s). Memory is the most that a process held which divides on one thread: of METIS' from its start, of ours since it has read the graph. \"Pieces\" counts connected components of all parts.\n\n\
         {}\n{}\n{}; {}.\n",
        summary(cases),
        cuts.markdown(),
        machine::description(),
        machine::load(),
    );
    let path = results.join("partition.md");
    fs::write(&path, page).with_context(|| path.display().to_string())?;
    println!("\n{}written: {}", summary(cases), path.display());
    Ok(())
}

fn summary(cases: &[Case]) -> String {
    let ratios = || cases.iter().map(Case::ratio);
    let to_kaffpa = || cases.iter().filter_map(Case::ratio_to_kaffpa);
    let metis_to_kaffpa = cases
        .iter()
        .filter_map(|case| Some(case.metis.cut as f64 / case.kaffpa? as f64));
    let timed = || cases.iter().filter(|case| case.metis_seconds >= LEAST_SECONDS);
    let mut text = format!(
        "- cut / METIS' cut: {:.3} (geometric mean of {}), worst {:.3}\n\
         - CPU time / METIS' on one thread: {:.2}; wall time on two: {:.2} (geometric means of the cases in which METIS needs {LEAST_SECONDS} s or more)\n\
         - high effort: cut / METIS' cut {:.3}, CPU time / METIS' {:.1}\n",
        geometric_mean(ratios()),
        cases.len(),
        greatest(ratios()),
        geometric_mean(timed().map(|case| case.one_thread.cpu / case.metis_seconds)),
        geometric_mean(timed().map(|case| case.two_threads.wall / case.metis_seconds)),
        geometric_mean(
            cases
                .iter()
                .map(|case| case.high.cut as f64 / case.metis.cut as f64)
        ),
        geometric_mean(timed().map(|case| case.high_seconds / case.metis_seconds)),
    );
    let memory = cases
        .iter()
        .filter_map(|case| Some(case.memory.ours? as f64 / case.memory.metis? as f64));
    if memory.clone().next().is_some() {
        text += &format!(
            "- memory / METIS': {:.2} (geometric mean), worst {:.2}\n",
            geometric_mean(memory.clone()),
            greatest(memory)
        );
    }
    if to_kaffpa().next().is_some() {
        text += &format!(
            "- high effort: cut / KaFFPa-strong's cut (one run, seed 0) {:.3} (geometric mean of {}), worst {:.3}; METIS' {:.3}\n",
            geometric_mean(to_kaffpa()),
            to_kaffpa().count(),
            greatest(to_kaffpa()),
            geometric_mean(metis_to_kaffpa),
        );
    }
    text
}

fn cut_table(cases: &[Case]) -> Table {
    let header = [
        "graph",
        "k",
        "METIS cut",
        "our cut",
        "ratio",
        "high effort",
        "KaFFPa-strong",
        "METIS imbalance",
        "our imbalance",
        "METIS volume",
        "our volume",
        "METIS pieces",
        "our pieces",
        "METIS (s)",
        "ours, 1 thread (s)",
        "ours, 2 threads (s)",
        "high effort (s)",
        "METIS (MB)",
        "ours (MB)",
    ];
    let mut table = Table::new("Divisions", &header);
    for case in cases {
        let pieces = |partition: &Partition| partition.components.iter().sum::<usize>().to_string();
        table.row([
            case.graph.clone(),
            case.parts.to_string(),
            case.metis.cut.to_string(),
            case.ours.cut.to_string(),
            format!("{:.3}", case.ratio()),
            case.high.cut.to_string(),
            case.kaffpa.map_or_else(String::new, |cut| cut.to_string()),
            format!("{:.3}", case.metis.imbalance),
            format!("{:.3}", case.ours.imbalance),
            case.metis.communication_volume.to_string(),
            case.ours.communication_volume.to_string(),
            pieces(&case.metis),
            pieces(&case.ours),
            format!("{:.3}", case.metis_seconds),
            format!("{:.3}", case.one_thread.cpu),
            format!("{:.3}", case.two_threads.wall),
            format!("{:.3}", case.high_seconds),
            megabytes(case.memory.metis),
            megabytes(case.memory.ours),
        ]);
    }
    table
}

fn megabytes(bytes: Option<u64>) -> String {
    bytes.map_or_else(String::new, |bytes| format!("{:.1}", bytes as f64 / 1e6))
}
