//! Queries and fine alignment beside the peers.

use std::{
    ffi::OsStr,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use evaluation::{
    inputs::{name_of, named},
    python::Python,
    table::Table,
};
use job::Job;
use mesh::{Similarity, Surface, TriMesh, Vec3, shapes};
use mesh_io::{Asset, Format, Precision, write_mesh};
use registration::{AlignOptions, PointPair, PreparedMesh, ResampleOptions, align_points, resample};
use serde::{Deserialize, de::DeserializeOwned};

use crate::{
    kept,
    measure::timed,
    peers, results,
    suspects::{attacked, misfit},
};

/// Meshes of the comparison: small, middling, large.
const MESHES: [&str; 3] = ["rocker_arm_10k", "stanford_bunny_closed_35k", "igea_134k"];

const ICP_PEERS: [&str; 3] = ["open3d", "small_gicp", "pymeshlab"];

/// A re-meshed suspect near its place: the same surface, other vertices.
struct NearPair {
    name: String,
    original: TriMesh,
    suspect: TriMesh,
    /// What takes the suspect back.
    back: Similarity,
    original_file: PathBuf,
    suspect_file: PathBuf,
}

pub(crate) fn run(files: &[PathBuf], attacks: &Python) -> Result<String> {
    let python = peers::prepare()?;
    let list = python.scripts().join("requirements-registration.txt");
    if let Err(missing) = python.install(&list) {
        eprintln!("No peers of registration: {missing:#}.");
        return Ok(String::new());
    }
    let title = "Fine alignment from the same start beside peers";
    let mut fine = Table::new(title, ["mesh", "program", "error", "CPU (s)"]);
    let header = ["mesh", "query", "program", "CPU (µs a query)"];
    let mut queries = Table::new("Queries beside peers", header);
    for name in MESHES {
        let Some(path) = named(files, name) else { continue };
        let pair = NearPair::of(path, attacks)?;
        pair.align(&python, &mut fine)?;
        pair.query(&python, &mut queries)?;
    }
    Ok(format!(
        "{}\nThe suspect is the re-meshed surface, turned by 2° and shifted by 1 % of the diagonal. The peers align vertices to vertices with the scale given; ours finds the scale, too, and its \
         time includes looking for surviving vertices and building search trees. Errors are of the vertices, over the diagonal.\n\n{}\nAlong normals: from each vertex of \
         the original both ways to the first hit of the suspect, however far; one line of ours, two rays of Embree's. Resampling is the whole of `resample`: with normals, moved points and a second \
         look where the first hit faces the wrong way. Nearest points are from samples of the suspect. A peer that is not there could not be installed or started.\n\n",
        fine.markdown(),
        queries.markdown(),
    ))
}

impl NearPair {
    fn of(path: &Path, attacks: &Python) -> Result<Self> {
        let name = name_of(path);
        let original = Asset::open(path)?.mesh().clone();
        let remeshed = attacked(attacks, &original, &name, "remesh:100", 0)?;
        let (turn, shift) = (1.0_f64.to_radians(), 0.01 * original.bounding_box().diagonal());
        let moved = Similarity {
            translation: [0.6 * shift, 0.0, 0.8 * shift],
            ..Similarity::from_quaternion([turn.cos(), 0.6 * turn.sin(), 0.8 * turn.sin(), 0.0])
        };
        // About the middle, so that what is near stays near.
        let centre = original.bounding_box().centre();
        let to_middle = Similarity {
            translation: centre.map(|x| -x),
            ..Similarity::IDENTITY
        };
        let moved = to_middle.then(&moved).then(&to_middle.inverse());
        let suspect = shapes::moved(&remeshed, &moved);
        let folder = kept::folder("registration")?;
        let written = |mesh: &TriMesh, role: &str| {
            let file = folder.join(format!("{name}-{role}.ply"));
            results::write(&file, write_mesh(mesh, Format::Ply, Precision::Double))?;
            anyhow::Ok(file)
        };
        Ok(Self {
            original_file: written(&original, "original")?,
            suspect_file: written(&suspect, "near")?,
            name,
            original,
            suspect,
            back: moved.inverse(),
        })
    }

    /// How far a transform misses, over the diagonal.
    fn error(&self, found: &Similarity) -> f64 {
        let there_and_back = self.back.inverse().then(found);
        let placed = shapes::moved(&self.suspect, &self.back);
        misfit(&placed, &there_and_back) / self.original.bounding_box().diagonal()
    }

    /// Ours and the peers from the same start: the pose as it stands.
    fn align(&self, python: &Python, table: &mut Table) -> Result<()> {
        let mut row = |program: &str, found: &Similarity, cpu: f64| {
            let cells = [
                program.into(),
                format!("{:.1e}", self.error(found)),
                format!("{cpu:.2}"),
            ];
            table.row([self.name.clone()].into_iter().chain(cells));
        };
        // To ours, the pose is said by pairs of points.
        let step = self.original.vertex_count() / 4;
        let places = (0..4).map(|k| self.original.positions()[k * step]);
        let pairs: Vec<PointPair> = places
            .map(|p| PointPair {
                suspect: p,
                original: p,
            })
            .collect();
        let (options, job) = (AlignOptions::default(), Job::default());
        let (found, cost) = timed(|| align_points(&self.original, &self.suspect, &pairs, &options, &job));
        row("ours", &found?.transform, cost.cpu);
        for peer in ICP_PEERS {
            if let Some(report) = self.ask::<IcpReport>(python, &["icp", peer]) {
                row(peer, &report.transform(), report.cpu);
            }
        }
        Ok(())
    }

    fn query(&self, python: &Python, table: &mut Table) -> Result<()> {
        let mut row = |query: &str, program: &str, report: QueryReport| {
            let each = format!("{:.2}", 1e6 * report.cpu / report.queries as f64);
            table.row([self.name.clone(), query.into(), program.into(), each]);
        };
        row("resampling", "ours", self.resampling()?);
        row("along normals", "ours", self.rays());
        if let Some(report) = self.ask(python, &["rays"]) {
            row("along normals", "embreex through trimesh", report);
        }
        if let Some(report) = self.ask(python, &["nearest"]) {
            row("nearest point", "pymeshlab", report);
        }
        row("nearest point", "ours", self.nearest());
        Ok(())
    }

    /// The suspect sampled at every vertex of the original.
    fn resampling(&self) -> Result<QueryReport> {
        let [original, suspect] = [&self.original, &self.suspect].map(PreparedMesh::from);
        // Its search tree is built when it is first asked for.
        suspect.surface();
        let (options, job) = (ResampleOptions::default(), Job::default());
        let (seen, cost) = timed(|| resample(&original, &suspect, &self.back, &options, &job));
        seen?;
        Ok(QueryReport {
            queries: self.original.vertex_count(),
            cpu: cost.cpu,
        })
    }

    /// Where lines along the original's normals first meet the suspect, either way.
    fn rays(&self) -> QueryReport {
        let surface = Surface::new(&self.suspect);
        let there = self.back.inverse();
        let normals = self.original.vertex_normals();
        let lines: Vec<[Vec3; 2]> = (0..self.original.vertex_count())
            .map(|v| {
                let p = self.original.point(v);
                let ahead = there.apply(p + Vec3::from(normals[v]));
                let p = there.apply(p);
                [p, ahead - p]
            })
            .collect();
        let met = |&&[p, d]: &&[Vec3; 2]| surface.hit(p.into(), d.into(), f64::INFINITY, |_| true).is_some();
        QueryReport::of(lines.len(), || lines.iter().filter(met).count())
    }

    /// Nearest points of the original from points spread over the suspect's triangles.
    fn nearest(&self) -> QueryReport {
        const EACH: usize = 4;
        let surface = Surface::new(&self.original);
        let spread = |t| {
            let [a, b, c] = self.suspect.corners(t);
            (0..EACH).map(move |k| {
                let (u, v) = (0.1 + 0.2 * k as f64, 0.1);
                (a + u * (b - a) + v * (c - a)).into()
            })
        };
        let points: Vec<[f64; 3]> = (0..self.suspect.triangle_count()).flat_map(spread).collect();
        let distance = |&p: &[f64; 3]| surface.nearest(p).distance;
        QueryReport::of(points.len(), || points.iter().map(distance).sum::<f64>())
    }

    /// What a peer printed last; none, with a word about it, if it failed.
    fn ask<T: DeserializeOwned>(&self, python: &Python, task: &[&str]) -> Option<T> {
        let files = [&self.original_file, &self.suspect_file].map(|file| file.as_os_str());
        let arguments = task.iter().map(OsStr::new).chain(files);
        let report = python.run("registration.py", arguments).and_then(|text| {
            let last = text.lines().last().context("it printed nothing")?;
            Ok(serde_json::from_str(last)?)
        });
        report
            .inspect_err(|why| eprintln!("{}: left out: {why:#}", task.join(" ")))
            .ok()
    }
}

/// What `peers/registration.py` says of a fine alignment.
#[derive(Deserialize)]
struct IcpReport {
    /// Of the rigid transform, 4 by 4.
    matrix: [[f64; 4]; 4],
    cpu: f64,
}

impl IcpReport {
    fn transform(&self) -> Similarity {
        let [r, s, t, _] = self.matrix;
        Similarity {
            rotation: [r, s, t].map(|row| [row[0], row[1], row[2]]),
            translation: [r[3], s[3], t[3]],
            ..Similarity::IDENTITY
        }
    }
}

/// How many queries, and their CPU seconds together; also what `peers/registration.py` says of them.
#[derive(Deserialize)]
struct QueryReport {
    queries: usize,
    cpu: f64,
}

impl QueryReport {
    /// Takes the time of `work`, which makes so many queries.
    fn of<T>(queries: usize, work: impl FnOnce() -> T) -> Self {
        let (answer, cost) = timed(work);
        std::hint::black_box(answer);
        Self {
            queries,
            cpu: cost.cpu,
        }
    }
}
