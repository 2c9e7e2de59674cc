//! Metrics of the same pairs of meshes by ours and by the peers.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use evaluation::inputs::{mesh_files, name_of};
use job::Job;
use mesh::{TriMesh, shapes};
use mesh_io::Asset;
use quality::{DistanceOptions, ShapeDna, ShapeDnaOptions, SurfaceDistance, surface_distance};
use serde_json::Value;

use crate::{
    kept,
    measure::{greatest, median, timed},
    peers,
};
use evaluation::{machine, process::root, python::Python, table::Table};

/// The peers need minutes for larger meshes.
const LARGEST: usize = 140_000;

/// Eigenvalues of a Shape-DNA: d_{2,50}.
const COUNT: usize = 50;

/// How the distorted meshes are made, by name.
type Distortion = (&'static str, fn(&TriMesh) -> TriMesh);

const DISTORTIONS: [Distortion; 2] = [
    // A mark's size: waves of up to 0.1 % of the model.
    ("waves", |mesh| shapes::bumped(mesh, 1e-3, 1)),
    ("noise", |mesh| shapes::jittered(mesh, 0.3, 1)),
];

/// One pair, measured by ours and by MeshLab's filter.
struct Pair {
    name: String,
    ours: SurfaceDistance,
    diagonal: f64,
    cpu: f64,
    theirs: Option<Theirs>,
}

struct Theirs {
    rms: f64,
    mean: f64,
    maximum: f64,
    samples: f64,
    cpu: f64,
}

/// Eigenvalues of one mesh by everyone.
struct Spectra {
    name: String,
    vertices: usize,
    cpu: f64,
    /// Name, CPU seconds, largest relative difference from ours.
    peers: Vec<(&'static str, f64, f64)>,
}

pub fn run(meshes: &Path, only: &[String], rounds: usize) -> Result<()> {
    let folder = kept::folder("quality")?;
    let python = match peers::prepare() {
        Ok(python) => Some(python),
        Err(missing) => {
            eprintln!("No peers: {missing:#}.");
            None
        }
    };
    let (mut pairs, mut spectra) = (Vec::new(), Vec::new());
    for path in mesh_files(meshes)? {
        let name = name_of(&path);
        if !only.is_empty() && !only.iter().any(|wanted| name.starts_with(wanted.as_str())) {
            continue;
        }
        let asset = Asset::open(&path)?;
        if asset.mesh().vertex_count() > LARGEST {
            println!("{name}: too large for the peers, passed over");
            continue;
        }
        let original = folder.join(&name);
        write_mesh(asset.mesh(), &original)?;
        for (kind, distort) in DISTORTIONS {
            let distorted = distort(asset.mesh());
            let theirs = folder.join(format!("{name}-{kind}"));
            write_mesh(&distorted, &theirs)?;
            pairs.push(pair(
                format!("{name}, {kind}"),
                (&distorted, &theirs),
                (asset.mesh(), &original),
                python.as_ref(),
                rounds,
            )?);
        }
        spectra.push(spectrum(name, asset.mesh(), &original, python.as_ref(), rounds)?);
    }
    if pairs.is_empty() {
        bail!(
            "{}: no mesh file there has a name that was asked for",
            meshes.display()
        );
    }
    write(&pairs, &spectra, rounds, python.as_ref())
}

/// Positions and triangles as the peers read them.
fn write_mesh(mesh: &TriMesh, folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let positions = mesh
        .positions()
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let triangles = mesh
        .triangles()
        .as_flattened()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    for (name, bytes) in [("positions.f64", positions), ("triangles.u32", triangles)] as [(&str, Vec<u8>); 2]
    {
        let path = folder.join(name);
        fs::write(&path, bytes).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

fn pair(
    name: String,
    (distorted, from): (&TriMesh, &PathBuf),
    (original, to): (&TriMesh, &PathBuf),
    python: Option<&Python>,
    rounds: usize,
) -> Result<Pair> {
    let mut costs = Vec::new();
    let mut ours = None;
    for _ in 0..rounds {
        let (distance, cost) =
            timed(|| surface_distance(distorted, original, &DistanceOptions::default(), &Job::default()));
        ours = Some(distance?);
        costs.push(cost.cpu);
    }
    let ours = ours.context("no round was run")?;
    let theirs = python
        .map(|python| filter(python, from, to, &ours, rounds))
        .transpose()?;
    let pair = Pair {
        name,
        ours,
        diagonal: original.bounding_box().diagonal(),
        cpu: median(costs),
        theirs,
    };
    println!(
        "{}: d_rmse {:.5} %, CPU {:.2} s{}",
        pair.name,
        100.0 * pair.ours.rmse / pair.diagonal,
        pair.cpu,
        pair.theirs.as_ref().map_or_else(String::new, |t| format!(
            "; MeshLab {:.5} %, CPU {:.2} s",
            100.0 * t.rms / pair.diagonal,
            t.cpu
        ))
    );
    Ok(pair)
}

/// MeshLab's filter with as many samples as the interval asks for: area / interval².
fn filter(python: &Python, from: &Path, to: &Path, ours: &SurfaceDistance, rounds: usize) -> Result<Theirs> {
    let samples = (ours.area / ours.interval.powi(2)).round();
    let round = |round: usize| {
        kept::figures(from, &format!("hausdorff-{round}"), || {
            let arguments = [
                "hausdorff".into(),
                from.into(),
                to.into(),
                samples.to_string().into(),
            ] as [std::ffi::OsString; 4];
            let report = python.run("quality.py", arguments)?;
            serde_json::from_str(&report).context("the report of quality.py")
        })
    };
    let reports: Vec<Value> = (0..rounds).map(round).collect::<Result<_>>()?;
    let figure = |key: &'static str| reports.iter().map(move |r| r[key].as_f64().unwrap_or(f64::NAN));
    Ok(Theirs {
        rms: median(figure("rms")),
        mean: median(figure("mean")),
        maximum: median(figure("max")),
        samples: median(figure("samples")),
        cpu: median(figure("cpu")),
    })
}

fn spectrum(
    name: String,
    mesh: &TriMesh,
    folder: &Path,
    python: Option<&Python>,
    rounds: usize,
) -> Result<Spectra> {
    let options = ShapeDnaOptions {
        count: COUNT,
        ..Default::default()
    };
    let (mut costs, mut ours) = (Vec::new(), Vec::new());
    for _ in 0..rounds {
        let (dna, cost) = timed(|| ShapeDna::of(mesh, &options, &Job::default()));
        ours = dna?.eigenvalues().to_vec();
        costs.push(cost.cpu);
    }
    let mut spectra = Spectra {
        name,
        vertices: mesh.vertex_count(),
        cpu: median(costs),
        peers: Vec::new(),
    };
    for (name, script) in [("scipy", "scipy"), ("LaPy", "lapy")] {
        let Some(python) = python else { break };
        let report: Value = kept::figures(folder, script, || {
            let arguments =
                [script.into(), folder.into(), COUNT.to_string().into()] as [std::ffi::OsString; 3];
            serde_json::from_str(&python.run("quality.py", arguments)?).context("the report of quality.py")
        })?;
        let values = report["eigenvalues"]
            .as_array()
            .context("no eigenvalues in the report of quality.py")?;
        if values.len() != ours.len() {
            bail!("{name}: {} eigenvalues instead of {COUNT}", values.len());
        }
        let differences = values
            .iter()
            .zip(&ours)
            .map(|(theirs, ours)| (theirs.as_f64().unwrap_or(f64::NAN) / ours - 1.0).abs());
        // NaN must show, so it may not be lost in a maximum.
        let worst = differences.fold(
            0.0,
            |a, d| if d.is_nan() { f64::INFINITY } else { f64::max(a, d) },
        );
        spectra
            .peers
            .push((name, report["cpu"].as_f64().unwrap_or(f64::NAN), worst));
    }
    println!(
        "{}: Shape-DNA CPU {:.2} s; {:?}",
        spectra.name, spectra.cpu, spectra.peers
    );
    Ok(spectra)
}

fn write(pairs: &[Pair], spectra: &[Spectra], rounds: usize, python: Option<&Python>) -> Result<()> {
    let results = root().join("results");
    fs::create_dir_all(&results).with_context(|| results.display().to_string())?;
    let (distances, shape_dna) = (distance_table(pairs), shape_dna_table(spectra));
    distances.write_csv(&results.join("quality_distances.csv"))?;
    shape_dna.write_csv(&results.join("quality_shape_dna.csv"))?;
    let environment = python
        .map(Python::versions)
        .transpose()?
        .map_or_else(String::new, |versions| format!("; {versions}"));
    let page = format!(
        "# The metrics beside their peers\n\nWritten by `cargo xtask bench quality`. Distances (eq. 21) are from the distorted mesh, sampled every 0.05 % of its diagonal, to the original, \
         in per cent of the original's diagonal; MeshLab's filter (Metro) draws area / interval² samples at random, ours lays them in rows and adds the vertices; \
         theirs is the greatest over both, too. *Waves* move vertices smoothly by up to 0.1 % of the model, *noise* at random by up to 0.3 of the shortest edge. \
         Shape-DNA is the {COUNT} lowest non-zero eigenvalues with the full mass matrix: scipy's `eigsh` (ARPACK, SuperLU) on matrices that the script assembles itself, LaPy on its own. \
         CPU seconds are user and system time on one thread, medians of {rounds} round(s) (of the eigenvalue peers, one). Cells of the peers that an earlier run finished are not measured again.\n\n\
         {}\n{}\n{}\n{}\n{}{environment}; {}.\n",
        summary(pairs, spectra),
        distances.markdown(),
        shape_dna.markdown(),
        "Differences between ours and MeshLab's are theirs against ours, relatively; those of eigenvalues are the largest of all.\n",
        machine::description(),
        machine::load(),
    );
    let path = results.join("quality.md");
    fs::write(&path, page).with_context(|| path.display().to_string())?;
    println!("written: {}", path.display());
    Ok(())
}

/// Theirs against ours, relatively.
fn difference(theirs: f64, ours: f64) -> f64 {
    (theirs / ours - 1.0).abs()
}

fn distance_table(pairs: &[Pair]) -> Table {
    let header = [
        "pair",
        "who",
        "samples",
        "d_rmse (%)",
        "mean (%)",
        "Hausdorff, forward (%)",
        "largest difference (%)",
        "CPU (s)",
        "CPU / theirs",
    ];
    let mut table = Table::new("Distances", &header);
    for pair in pairs {
        let (ours, cent) = (&pair.ours, |length: f64| {
            format!("{:.6}", 100.0 * length / pair.diagonal)
        });
        let ratio = pair.theirs.as_ref().map(|t| format!("{:.3}", pair.cpu / t.cpu));
        table.row([
            pair.name.clone(),
            "ours".into(),
            ours.samples.to_string(),
            cent(ours.rmse),
            cent(ours.mean),
            cent(ours.maximum),
            String::new(),
            format!("{:.2}", pair.cpu),
            ratio.unwrap_or_default(),
        ]);
        let Some(theirs) = &pair.theirs else { continue };
        table.row([
            pair.name.clone(),
            "MeshLab".into(),
            format!("{}", theirs.samples),
            cent(theirs.rms),
            cent(theirs.mean),
            cent(theirs.maximum),
            format!("{:.3}", 100.0 * theirs.worst_difference(ours)),
            format!("{:.2}", theirs.cpu),
            String::new(),
        ]);
    }
    table
}

impl Theirs {
    fn worst_difference(&self, ours: &SurfaceDistance) -> f64 {
        let figures = [
            (self.rms, ours.rmse),
            (self.mean, ours.mean),
            (self.maximum, ours.maximum),
        ];
        greatest(figures.map(|(theirs, ours)| difference(theirs, ours)))
    }
}

fn shape_dna_table(spectra: &[Spectra]) -> Table {
    let header = [
        "mesh",
        "n",
        "who",
        "CPU (s)",
        "CPU / ours",
        "largest difference of an eigenvalue",
    ];
    let mut table = Table::new("Shape-DNA", &header);
    for mesh in spectra {
        let first = [mesh.name.clone(), mesh.vertices.to_string()];
        let ours = [
            "ours".into(),
            format!("{:.2}", mesh.cpu),
            String::new(),
            String::new(),
        ];
        table.row(first.clone().into_iter().chain(ours));
        for (name, cpu, worst) in &mesh.peers {
            let theirs = [
                (*name).into(),
                format!("{cpu:.2}"),
                format!("{:.1}", cpu / mesh.cpu),
                format!("{worst:.1e}"),
            ];
            table.row(first.clone().into_iter().chain(theirs));
        }
    }
    table
}

/// The worst of all, in words.
fn summary(pairs: &[Pair], spectra: &[Spectra]) -> String {
    let theirs = || {
        pairs
            .iter()
            .filter_map(|pair| Some((pair, pair.theirs.as_ref()?)))
    };
    let mut text = String::new();
    if theirs().next().is_some() {
        text += &format!(
            "- d_rmse, mean and Hausdorff distance agree with MeshLab's within {:.2} % on {} pairs, in {:.2} of its CPU time (median; most {:.2})\n",
            100.0 * greatest(theirs().map(|(pair, t)| t.worst_difference(&pair.ours))),
            theirs().count(),
            median(theirs().map(|(pair, t)| pair.cpu / t.cpu)),
            greatest(theirs().map(|(pair, t)| pair.cpu / t.cpu)),
        );
    }
    for name in ["scipy", "LaPy"] {
        let cells = || {
            spectra.iter().flat_map(|mesh| {
                mesh.peers
                    .iter()
                    .filter(|(peer, _, _)| *peer == name)
                    .map(|&(_, cpu, worst)| (cpu / mesh.cpu, worst))
            })
        };
        if cells().next().is_some() {
            text += &format!(
                "- eigenvalues agree with {name}'s within {:.1e}, relatively; {name} takes {:.1} times our CPU time (median of {})\n",
                greatest(cells().map(|(_, worst)| worst)),
                median(cells().map(|(ratio, _)| ratio)),
                cells().count(),
            );
        }
    }
    text
}
