//! How often suspects come back onto their originals, how exactly, and in what time.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use bench_harness::{mesh_files, name_of};
use mesh::{Asset, Format, Precision, Similarity, TriMesh, shapes, write_mesh};
use registration::{AlignOptions, align};
use serde_json::{Value, json};

use super::{
    measure::{greatest, median, timed},
    peers, registration_peers,
};
use crate::{machine, meshes::random_similarity, process::root, python::Python, table::Table};

/// What happens to a suspect before it is moved.
struct Attack {
    name: &'static str,
    /// Of `attack.py`: name and strength. None: another model takes the suspect's place.
    script: Option<(&'static str, f64)>,
    /// Whether the seed makes a difference.
    random: bool,
    /// Whether what is left of the surface lies exactly on the original's.
    exact: bool,
}

const fn attack(name: &'static str, script: (&'static str, f64), random: bool, exact: bool) -> Attack {
    Attack {
        name,
        script: Some(script),
        random,
        exact,
    }
}

const ATTACKS: [Attack; 8] = [
    // Keeping all is the crop that changes nothing.
    attack("none", ("crop", 100.0), false, true),
    attack("crop to 50 %", ("crop", 50.0), true, true),
    attack("crop to 25 %", ("crop", 25.0), true, true),
    attack("noise 0.5 %", ("noise", 0.5), true, false),
    attack("simplification to 5 %", ("simplify", 5.0), false, false),
    attack("isotropic re-meshing", ("remesh", 100.0), false, false),
    attack("Laplacian x5", ("laplacian", 5.0), false, false),
    attack("Loop", ("loop", 1.0), false, false),
];

const ANOTHER: Attack = Attack {
    name: "another model",
    script: None,
    random: false,
    exact: false,
};

/// Of attacks that are random, so many seeds are used in turn.
const VARIANTS: u64 = 4;

/// One draw in so many is mirrored.
const MIRRORED: u64 = 5;

/// Root mean square errors, as fractions of the diagonal: where geometry is unchanged, and a tenth of a mark.
const EXACT: f64 = 1e-6;
const TENTH_OF_MARK: f64 = 1e-5;

/// A pose that is off by less than this is the right one, if not exactly.
const RIGHT_POSE: f64 = 5e-3;

/// The draws of one mesh under one attack.
struct Cell {
    mesh: String,
    vertices: usize,
    attack: &'static Attack,
    draws: Vec<Draw>,
}

/// One alignment.
struct Draw {
    aligned: bool,
    /// Root mean square distance of the suspect's vertices from where they belong, over the original's diagonal.
    error: f64,
    hand_recognised: bool,
    overlap: f64,
    cpu: f64,
}

impl Draw {
    fn succeeded(&self) -> bool {
        self.aligned && self.hand_recognised && self.error < RIGHT_POSE
    }
}

/// What to measure.
pub(crate) struct Selection {
    pub(crate) only: Vec<String>,
    pub(crate) attacks: Vec<String>,
    pub(crate) draws: u64,
    pub(crate) most_vertices: usize,
    pub(crate) with_peers: bool,
}

pub(crate) fn run(folder: &Path, selection: &Selection) -> Result<()> {
    let attacks = Python::prepare()?;
    let chosen = |name: &str, wanted: &[String]| {
        wanted.is_empty() || wanted.iter().any(|prefix| name.starts_with(prefix.as_str()))
    };
    let mut cells = Vec::new();
    let files: Vec<PathBuf> = mesh_files(folder)?;
    for (i, path) in files.iter().enumerate() {
        if !chosen(&name_of(path), &selection.only) {
            continue;
        }
        let original = Asset::open(path)?.mesh().clone();
        if original.vertex_count() > selection.most_vertices {
            continue;
        }
        // Not the next: neighbours by name may be versions of one model.
        let stranger = &files[(i + 2) % files.len()];
        let bench = Bench {
            name: name_of(path),
            original: &original,
            stranger,
            attacks: &attacks,
        };
        for attack in ATTACKS.iter().chain([&ANOTHER]) {
            if chosen(attack.name, &selection.attacks) {
                let cell = bench.cell(attack, selection.draws)?;
                println!("{}", cell.line());
                cells.push(cell);
            }
        }
    }
    if cells.is_empty() {
        bail!("{}: no mesh files of such names", folder.display());
    }
    let peers = if selection.with_peers {
        registration_peers::run(&files, &attacks)?
    } else {
        String::new()
    };
    write(&cells, &attacks, &peers)
}

struct Bench<'a> {
    name: String,
    original: &'a TriMesh,
    stranger: &'a Path,
    attacks: &'a Python,
}

impl Bench<'_> {
    fn cell(&self, attack: &'static Attack, draws: u64) -> Result<Cell> {
        let folder = peers::folder("registration")?;
        let mut suspect: Option<(u64, TriMesh)> = None;
        let mut done = Vec::new();
        for seed in 0..draws {
            let variant = if attack.random { seed % VARIANTS } else { 0 };
            let name = format!("{}-{}-{seed}", self.name, slug(attack.name));
            let value = peers::cell(&folder, &name, || {
                if suspect.as_ref().is_none_or(|(of, _)| *of != variant) {
                    suspect = Some((variant, self.suspect(attack, variant)?));
                }
                let (_, suspect) = suspect.as_ref().context("a suspect was just made")?;
                self.draw(attack, suspect, seed)
            })?;
            done.push(draw_of(&value).with_context(|| format!("{name}: not a finished draw"))?);
        }
        Ok(Cell {
            mesh: self.name.clone(),
            vertices: self.original.vertex_count(),
            attack,
            draws: done,
        })
    }

    /// The attacked mesh, in the original's pose.
    fn suspect(&self, attack: &Attack, seed: u64) -> Result<TriMesh> {
        let Some((script, strength)) = attack.script else {
            return Ok(Asset::open(self.stranger)?.mesh().clone());
        };
        attacked(self.attacks, self.original, &self.name, script, strength, seed)
    }

    fn draw(&self, attack: &Attack, suspect: &TriMesh, seed: u64) -> Result<Value> {
        let mirrored = seed % MIRRORED == MIRRORED - 1;
        let mut moved = random_similarity(self.original, seed);
        if mirrored {
            moved.rotation = moved.rotation.map(|[x, y, z]| [-x, y, z]);
        }
        let suspect_there = shapes::moved(suspect, &moved);
        let options = AlignOptions::default();
        let (found, cost) = timed(|| align(self.original, &suspect_there, &options));
        let found = found?;
        let there_and_back = moved.then(&found.transform);
        Ok(json!({
            "attack": attack.name,
            "seed": seed,
            "aligned": found.aligned,
            "error": misfit(suspect, &there_and_back) / self.original.bounding_box().diagonal(),
            "hand_recognised": found.mirrored() == mirrored,
            "basis": found.basis,
            "overlap": found.overlap,
            "coverage": found.coverage,
            "residual": found.residual,
            "alternatives": found.alternatives.len(),
            "free_directions": found.free_directions,
            "cpu": cost.cpu,
            "wall": cost.wall,
        }))
    }
}

/// A mesh after an attack; finished ones are kept.
pub(super) fn attacked(
    attacks: &Python,
    original: &TriMesh,
    name: &str,
    script: &str,
    strength: f64,
    seed: u64,
) -> Result<TriMesh> {
    let folder = peers::folder("registration")?;
    let result = folder.join(format!("{name}-{script}-{strength}-{seed}.ply"));
    if !result.is_file() {
        let source = folder.join(format!("{name}.ply"));
        let bytes = write_mesh(original, Format::Ply, Precision::Double);
        fs::write(&source, bytes).with_context(|| source.display().to_string())?;
        // Under a name of its own until it is whole.
        let partial = folder.join(format!("{name}-{script}-{strength}-{seed}.partial.ply"));
        let words = [source.as_os_str(), partial.as_os_str(), script.as_ref()];
        let numbers = [
            "--strength".into(),
            strength.to_string(),
            "--seed".into(),
            seed.to_string(),
        ];
        let arguments = words.into_iter().map(Into::into).chain(numbers.map(Into::into));
        attacks.run("attack.py", arguments.collect::<Vec<std::ffi::OsString>>())?;
        fs::rename(&partial, &result).with_context(|| result.display().to_string())?;
    }
    Ok(Asset::open(&result)?.mesh().clone())
}

/// Root mean square distance by which a transform moves the vertices of a mesh.
pub(super) fn misfit(mesh: &TriMesh, transform: &Similarity) -> f64 {
    let moved = mesh.positions().iter().map(|&p| {
        let q = transform.apply(p);
        (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>()
    });
    (moved.sum::<f64>() / mesh.vertex_count() as f64).sqrt()
}

fn draw_of(value: &Value) -> Option<Draw> {
    Some(Draw {
        aligned: value["aligned"].as_bool()?,
        error: value["error"].as_f64()?,
        hand_recognised: value["hand_recognised"].as_bool()?,
        overlap: value["overlap"].as_f64()?,
        cpu: value["cpu"].as_f64()?,
    })
}

fn slug(name: &str) -> String {
    let kept = name.chars().filter(|c| c.is_ascii_alphanumeric() || *c == ' ');
    kept.map(|c| if c == ' ' { '_' } else { c }).collect()
}

impl Cell {
    fn right(&self) -> usize {
        let stranger = self.attack.script.is_none();
        let right = |draw: &&Draw| if stranger { !draw.aligned } else { draw.succeeded() };
        self.draws.iter().filter(right).count()
    }

    fn errors(&self) -> impl Iterator<Item = f64> {
        self.draws.iter().map(|draw| draw.error)
    }

    fn seconds(&self) -> impl Iterator<Item = f64> {
        self.draws.iter().map(|draw| draw.cpu)
    }

    fn line(&self) -> String {
        format!(
            "{}, {}: {} of {} right, error {:.1e} (worst {:.1e}), {:.2} s (worst {:.2})",
            self.mesh,
            self.attack.name,
            self.right(),
            self.draws.len(),
            median(self.errors()),
            greatest(self.errors()),
            median(self.seconds()),
            greatest(self.seconds()),
        )
    }
}

fn write(cells: &[Cell], attacks: &Python, peers: &str) -> Result<()> {
    let results = root().join("results");
    fs::create_dir_all(&results).with_context(|| results.display().to_string())?;
    all(cells).write_csv(&results.join("registration.csv"))?;
    let page = format!(
        "# Registration\n\nWritten by `cargo xtask bench registration`. Every suspect is attacked, then rotated at random, scaled by 0.01 to 100 and shifted by up to ten diagonals; one in \
         {MIRRORED} is mirrored. Of crops and noise, {VARIANTS} variants are used in turn. A draw is right when the suspect is reported as aligned, mirrored or not as it is, \
         and lies within {RIGHT_POSE} of where it belongs; with another model in the suspect's place, when it is reported as not aligned. Errors are root mean square distances of the suspect's \
         vertices from where they belong, over the original's diagonal. Smoothing and simplification change the surface by more than a mark does: there the pose that fits best is not the one \
         before the attack. Seconds are CPU seconds of the whole alignment on one thread. Single meshes are in [registration.csv](registration.csv).\n\n{}\n{}\n{peers}{}, {}; {}.\n",
        by_attack(cells).markdown(),
        by_mesh(cells).markdown(),
        machine::description(),
        attacks.versions()?,
        machine::load(),
    );
    let path = results.join("registration.md");
    fs::write(&path, page).with_context(|| path.display().to_string())?;
    println!("\nwritten: {}", path.display());
    Ok(())
}

/// Right draws of all draws, as it stands in the tables.
fn share<'a>(cells: impl Iterator<Item = &'a Cell>) -> String {
    let (mut right, mut all) = (0, 0);
    for cell in cells {
        right += cell.right();
        all += cell.draws.len();
    }
    if all == 0 {
        String::new()
    } else {
        format!("{right} of {all}")
    }
}

fn by_attack(cells: &[Cell]) -> Table {
    let header = [
        "attack",
        "right",
        "median error",
        "worst error",
        "up to 1e-6",
        "up to 1e-5",
        "up to 1e-4",
        "median (s)",
        "worst (s)",
    ];
    let mut table = Table::new("By attack", &header);
    for attack in ATTACKS.iter().chain([&ANOTHER]) {
        let rows = || cells.iter().filter(|cell| cell.attack.name == attack.name);
        if rows().next().is_none() {
            continue;
        }
        let errors: Vec<f64> = rows().flat_map(Cell::errors).collect();
        let within = |bound: f64| {
            let count = errors.iter().filter(|&&error| error <= bound).count();
            format!("{:.1} %", 100.0 * count as f64 / errors.len() as f64)
        };
        let figures = if attack.script.is_none() {
            [const { String::new() }; 5]
        } else {
            [
                format!("{:.1e}", median(errors.iter().copied())),
                format!("{:.1e}", greatest(errors.iter().copied())),
                within(EXACT),
                within(TENTH_OF_MARK),
                within(10.0 * TENTH_OF_MARK),
            ]
        };
        let seconds = [
            format!("{:.2}", median(rows().flat_map(Cell::seconds))),
            format!("{:.2}", greatest(rows().flat_map(Cell::seconds))),
        ];
        let name = if attack.exact {
            format!("{} (exact)", attack.name)
        } else {
            attack.name.into()
        };
        table.row([name, share(rows())].into_iter().chain(figures).chain(seconds));
    }
    table
}

fn by_mesh(cells: &[Cell]) -> Table {
    let names = ATTACKS.iter().chain([&ANOTHER]).map(|attack| attack.name);
    let header: Vec<&str> = ["mesh", "vertices"].into_iter().chain(names).collect();
    let mut table = Table::new("By mesh: draws that came out right", &header);
    let mut meshes: Vec<(&str, usize)> = cells
        .iter()
        .map(|cell| (cell.mesh.as_str(), cell.vertices))
        .collect();
    meshes.dedup();
    for (mesh, vertices) in meshes {
        let of = |attack: &Attack| {
            let cells = cells
                .iter()
                .filter(|cell| cell.mesh == mesh && cell.attack.name == attack.name);
            share(cells)
        };
        let shares = ATTACKS.iter().chain([&ANOTHER]).map(of);
        table.row([mesh.to_string(), vertices.to_string()].into_iter().chain(shares));
    }
    table
}

fn all(cells: &[Cell]) -> Table {
    let header = [
        "mesh",
        "vertices",
        "attack",
        "draws",
        "right",
        "median error",
        "worst error",
        "least overlap",
        "median (s)",
        "worst (s)",
    ];
    let mut table = Table::new("Alignments", &header);
    for cell in cells {
        table.row([
            cell.mesh.clone(),
            cell.vertices.to_string(),
            cell.attack.name.to_string(),
            cell.draws.len().to_string(),
            cell.right().to_string(),
            format!("{:.3e}", median(cell.errors())),
            format!("{:.3e}", greatest(cell.errors())),
            format!("{:.4}", -greatest(cell.draws.iter().map(|draw| -draw.overlap))),
            format!("{:.2}", median(cell.seconds())),
            format!("{:.2}", greatest(cell.seconds())),
        ]);
    }
    table
}
