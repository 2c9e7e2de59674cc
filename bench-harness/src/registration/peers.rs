//! Queries and fine alignment beside the peers.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use evaluation::{inputs::name_of, python::Python, table::Table};
use job::Job;
use mesh::{Similarity, Surface, TriMesh, shapes};
use mesh_io::{Asset, Format, Precision, write_mesh};
use registration::{AlignOptions, PointPair, PreparedMesh, ResampleOptions, align_points, resample};
use serde_json::Value;

use super::suspects::{attacked, misfit};
use crate::{
    kept,
    measure::{Cost, timed},
    peers, results, selection,
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
    let mut fine = Table::new(
        "Fine alignment from the same start beside peers",
        &["mesh", "program", "error", "CPU (s)"],
    );
    let mut queries = Table::new(
        "Queries beside peers",
        &["mesh", "query", "program", "CPU (µs a query)"],
    );
    for name in MESHES {
        let Some(path) = selection::named(files, name) else {
            continue;
        };
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

    fn align(&self, python: &Python, table: &mut Table) -> Result<()> {
        let mut row = |program: &str, error: f64, cpu: f64| {
            let cells = [program.to_string(), format!("{error:.1e}"), format!("{cpu:.2}")];
            table.row([self.name.clone()].into_iter().chain(cells));
        };
        // The pose as it stands, said by pairs of points.
        let step = self.original.vertex_count() / 4;
        let pairs: Vec<PointPair> = (0..4)
            .map(|k| self.original.positions()[k * step])
            .map(|p| PointPair {
                suspect: p,
                original: p,
            })
            .collect();
        let options = AlignOptions::default();
        let (found, cost) =
            timed(|| align_points(&self.original, &self.suspect, &pairs, &options, &Job::default()));
        row("ours", self.error(&found?.transform), cost.cpu);
        for peer in ICP_PEERS {
            if let Some(report) = self.ask(python, &["icp", peer]) {
                let matrix = similarity(&report["matrix"]).context("a peer printed no matrix")?;
                row(
                    peer,
                    self.error(&matrix),
                    report["cpu"].as_f64().unwrap_or(f64::NAN),
                );
            }
        }
        Ok(())
    }

    fn query(&self, python: &Python, table: &mut Table) -> Result<()> {
        let mut row = |query: &str, program: &str, cpu: f64, count: usize| {
            let each = format!("{:.2}", 1e6 * cpu / count as f64);
            table.row([self.name.clone(), query.into(), program.into(), each]);
        };
        let [original, suspect] = [&self.original, &self.suspect].map(PreparedMesh::from);
        let surface = suspect.surface();
        let options = ResampleOptions::default();
        let (seen, cost) = timed(|| resample(&original, &suspect, &self.back, &options, &Job::default()));
        seen?;
        row("resampling", "ours", cost.cpu, self.original.vertex_count());
        let (count, cost) = self.rays(surface);
        row("along normals", "ours", cost.cpu, count);
        let mut peer = |query: &str, task: &str, program: &str| {
            let report = self.ask(python, &[task])?;
            row(
                query,
                program,
                report["cpu"].as_f64()?,
                report["queries"].as_u64()? as usize,
            );
            Some(())
        };
        peer("along normals", "rays", "embreex through trimesh");
        peer("nearest point", "nearest", "pymeshlab");
        let (count, cost) = self.nearest();
        row("nearest point", "ours", cost.cpu, count);
        Ok(())
    }

    /// Where lines along the original's normals first meet the suspect, either way.
    fn rays(&self, surface: &Surface) -> (usize, Cost) {
        let normals = self.original.vertex_normals();
        let there = self.back.inverse();
        let lines: Vec<[[f64; 3]; 2]> = self
            .original
            .positions()
            .iter()
            .zip(normals)
            .map(|(&p, n)| {
                let ahead = there.apply(std::array::from_fn(|i| p[i] + n[i]));
                let p = there.apply(p);
                [p, std::array::from_fn(|i| ahead[i] - p[i])]
            })
            .collect();
        let first = |[p, d]: &[[f64; 3]; 2]| surface.hit(*p, *d, f64::INFINITY, |_| true).is_some();
        let (met, cost) = timed(|| lines.iter().filter(|line| first(line)).count());
        std::hint::black_box(met);
        (lines.len(), cost)
    }

    /// Nearest points of the original from points spread over the suspect's triangles.
    fn nearest(&self) -> (usize, Cost) {
        const EACH: usize = 4;
        let surface = Surface::new(&self.original);
        let corners = (0..self.suspect.triangle_count()).map(|t| self.suspect.corners(t));
        let points: Vec<[f64; 3]> = corners
            .flat_map(|[a, b, c]| {
                (0..EACH).map(move |k| {
                    let (u, v) = (0.1 + 0.2 * k as f64, 0.1);
                    std::array::from_fn(|i| a[i] + u * (b[i] - a[i]) + v * (c[i] - a[i]))
                })
            })
            .collect();
        let (sum, cost) = timed(|| points.iter().map(|&p| surface.nearest(p).distance).sum::<f64>());
        std::hint::black_box(sum);
        (points.len(), cost)
    }

    /// What a peer printed last; none, with a word about it, if it failed.
    fn ask(&self, python: &Python, task: &[&str]) -> Option<Value> {
        let files = [&self.original_file, &self.suspect_file].map(|file| file.as_os_str().to_owned());
        let arguments = task.iter().map(Into::into).chain(files);
        let printed = python.run("registration.py", arguments.collect::<Vec<std::ffi::OsString>>());
        let report = printed.and_then(|text| {
            let last = text.lines().last().context("it printed nothing")?;
            Ok(serde_json::from_str(last)?)
        });
        report
            .inspect_err(|why| eprintln!("{}: left out: {why:#}", task.join(" ")))
            .ok()
    }
}

/// A rigid transform by its 4 by 4 matrix.
fn similarity(matrix: &Value) -> Option<Similarity> {
    let entry = |i: usize, j: usize| matrix[i][j].as_f64();
    let mut found = Similarity::IDENTITY;
    for i in 0..3 {
        for j in 0..3 {
            found.rotation[i][j] = entry(i, j)?;
        }
        found.translation[i] = entry(i, 3)?;
    }
    Some(found)
}
