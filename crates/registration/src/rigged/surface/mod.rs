//! The pose of a suspect that kept no vertices, by the surfaces.
//!
//! From one joint, whose vertices a similarity lays onto the suspect, a pose grows over the rig: each next joint turns about the middle of what
//! it shares with one that was placed, and of all turns the one is refined that lays most of its vertices on the suspect (`growing.rs`). All joints are then
//! fitted together, points to planes, with robust weights (`settling.rs`). What is best is what explains most of the suspect's area.

mod growing;
mod settling;

use job::{Job, JobError};
use mesh::{Rig, Similarity, Surface, TriMesh, Vec3};

use super::{
    MOST_JOINTS, Pose, Row,
    rigid::{Blending, Motion, Rigid, turned_round},
};
use crate::{
    AlignOptions, Alignment, MatchedBy, PreparedMesh, RegistrationError,
    overlap::Overlap,
    sampled::{GRAIN, SAMPLES, Sampled},
};
use growing::Growing;
use settling::Rows;

/// A suspect of other vertices, brought back into the original's pose.
#[derive(Clone)]
pub struct UnposedSurface {
    /// The suspect, its vertices in the original's frame; without triangles that lay across a fold.
    pub mesh: PreparedMesh,
    /// How it lies on the original now: where it should.
    pub alignment: Alignment,
}

/// A pose that explains so much of the suspect's area is not sought any further; nor is one used that explains less than the other.
const ENOUGH: f64 = 0.9;
const LEAST: f64 = 0.5;

/// Points of the suspect that say how much of it is explained, and how near they have to be, in diagonals.
const JUDGES: usize = 3000;
const NEAR: f64 = 0.005;

/// Least cosine between normals that belong together.
pub(super) const FACING: f64 = 0.3;

/// So much longer or shorter than before, an edge lies across a fold.
const TORN: f64 = 3.0;

/// Brings a suspect back into the original's pose by the surfaces and the joints of the original's rig; none where that explains too little of it. `aligned` are
/// similarities that take the suspect to the original as well as one can: a pose is sought from these first.
///
/// Morph targets are left as they are. Blind to what a mark says.
///
/// # Errors
/// When a mesh has no area; when the job was cancelled.
pub fn unpose_surface(
    original: &PreparedMesh,
    rig: &Rig,
    suspect: &PreparedMesh,
    aligned: &[Similarity],
    job: &Job,
) -> Result<Option<UnposedSurface>, RegistrationError> {
    if rig.vertices() != original.mesh().vertex_count() || !(1..=MOST_JOINTS / 4).contains(&rig.joints()) {
        return Ok(None);
    }
    let scene = Scene::of(original, rig, suspect)?;
    if scene.rows.len() < super::FEWEST_VERTICES {
        return Ok(None);
    }
    let growing = Growing::of(&scene);
    let mut best: Option<(f64, Rigid)> = None;
    for seed in growing.seeds(aligned) {
        let Some(start) = growing.start(&seed, job)? else {
            continue;
        };
        let pose = growing.grown(start, job)?;
        let pose = scene.settled(pose, &growing, job)?;
        let explained = scene.explained(&pose, job)?;
        if std::env::var("DBG").is_ok() { eprintln!("seed {seed:?} explained {explained}"); }
        if best.as_ref().is_none_or(|(most, _)| explained > *most) {
            best = Some((explained, pose));
        }
        if explained >= ENOUGH {
            break;
        }
    }
    let Some((_, pose)) = best.filter(|(explained, _)| *explained >= LEAST) else {
        return Ok(None);
    };
    let pose = scene.finished(pose, job)?;
    let Some(mesh) = scene.undone(&pose, job)? else {
        return Ok(None);
    };
    let mesh = PreparedMesh::from(mesh);
    Ok(Some(UnposedSurface {
        alignment: alignment(original, &mesh, job)?,
        mesh,
    }))
}

/// How a suspect lies on the original, that is there already.
fn alignment(
    original: &PreparedMesh,
    suspect: &PreparedMesh,
    job: &Job,
) -> Result<Alignment, RegistrationError> {
    let AlignOptions {
        tolerance,
        least_overlap,
    } = AlignOptions::default();
    let (original, suspect) = (original.sampled("original")?, suspect.sampled("suspect")?);
    let there = Similarity::IDENTITY;
    let overlap = Overlap::measure(original, suspect, &there, tolerance, SAMPLES, job)?;
    Ok(Alignment {
        transform: there,
        matched_by: MatchedBy::RigSurface,
        overlap: overlap.of_suspect,
        coverage: overlap.of_original,
        residual: overlap.residual,
        aligned: overlap.of_suspect >= least_overlap,
        correspondence: None,
        alternatives: Vec::new(),
        free_directions: 0,
    })
}

/// An original with its rig, and a suspect, both in diagonals of their own from their own centres.
struct Scene<'a> {
    original: &'a PreparedMesh,
    suspect: &'a PreparedMesh,
    sampled: &'a Sampled,
    joints: usize,
    /// The original's vertices that joints move.
    rows: Vec<Row<'a>>,
    /// Their normals.
    normals: Vec<Vec3>,
    centre: Vec3,
    diagonal: f64,
}

impl<'a> Scene<'a> {
    fn of(
        original: &'a PreparedMesh,
        rig: &'a Rig,
        suspect: &'a PreparedMesh,
    ) -> Result<Self, RegistrationError> {
        let (of_original, sampled) = (original.sampled("original")?, suspect.sampled("suspect")?);
        let (centre, diagonal) = (of_original.centroid, of_original.diagonal);
        let mesh = original.mesh();
        let moved = (0..mesh.vertex_count()).filter(|&v| !rig.weights_of(v).is_empty());
        let row = |vertex: usize| Row {
            vertex,
            x: (mesh.point(vertex) - centre) * (1.0 / diagonal),
            y: Vec3::ZERO,
            weights: rig.weights_of(vertex),
            offsets: Vec::new(),
        };
        let rows: Vec<Row<'a>> = moved.map(row).collect();
        let normals = original.vertex_normals();
        Ok(Self {
            normals: rows.iter().map(|row| Vec3(normals[row.vertex])).collect(),
            original,
            suspect,
            sampled,
            joints: rig.joints(),
            rows,
            centre,
            diagonal,
        })
    }

    /// A place in the suspect's own coordinates.
    fn there(&self, y: Vec3) -> Vec3 {
        y * self.sampled.diagonal + self.sampled.centroid
    }

    fn back(&self, p: Vec3) -> Vec3 {
        (p - self.sampled.centroid) * (1.0 / self.sampled.diagonal)
    }

    /// The original in a pose, in the suspect's coordinates: its vertices, and the triangles that joints move.
    fn posed(&self, pose: &Rigid) -> Option<TriMesh> {
        let mesh = self.original.mesh();
        let mut places = vec![None; mesh.vertex_count()];
        for row in &self.rows {
            places[row.vertex] = Some(self.there(pose.moved(row)).into());
        }
        let is_moved = |corners: &&[u32; 3]| corners.iter().all(|&v| places[v as usize].is_some());
        let triangles = mesh.triangles().iter().filter(is_moved).copied().collect();
        let somewhere: [f64; 3] = self.sampled.centroid.into();
        let places = places.iter().map(|place| place.unwrap_or(somewhere)).collect();
        TriMesh::new(places, triangles).ok()
    }

    /// The share of the suspect's area that lies on the posed original, facing as that does.
    fn explained(&self, pose: &Rigid, job: &Job) -> Result<f64, JobError> {
        let Some(posed) = self.posed(pose) else {
            return Ok(0.0);
        };
        let (surface, normals) = (Surface::new(&posed), posed.triangle_normals());
        let judges: Vec<usize> = self.sampled.some(JUDGES).collect();
        let facing = job.map(judges.len(), GRAIN, |i| {
            let point = self.sampled.points[judges[i]];
            let found = surface.nearest_within(point.0, NEAR * self.sampled.diagonal)?;
            let cosine = Vec3(normals[found.triangle as usize]).dot(self.sampled.normal(judges[i]));
            (cosine.abs() > FACING).then_some(cosine > 0.0)
        })?;
        let count = |side: bool| facing.iter().filter(|facing| **facing == Some(side)).count();
        Ok(count(true).max(count(false)) as f64 / judges.len().max(1) as f64)
    }

    /// The pose with all its joints fitted together.
    fn settled(&self, mut pose: Rigid, growing: &Growing<'_>, job: &Job) -> Result<Rigid, JobError> {
        let rows = Rows::some(self, settling::A_FEW);
        for gate in [0.05, 0.04, 0.03, 0.03, 0.02, 0.02, 0.015, 0.015, 0.01, 0.01] {
            let ties = growing.ties(&pose, gate);
            settling::step(self, &mut pose, &rows, gate, &ties, job)?;
        }
        Ok(pose)
    }

    /// The last digits, joints blended in the way that leaves less.
    fn finished(&self, pose: Rigid, job: &Job) -> Result<Rigid, JobError> {
        let rows = Rows::some(self, settling::MANY);
        let mut best: Option<(Rigid, f64)> = None;
        for blending in [Blending::Linear, Blending::DualQuaternions] {
            let mut tried = pose.clone();
            tried.blending = blending;
            let mut residual = f64::INFINITY;
            for _round in 0..settling::LAST_ROUNDS {
                let Some(step) = settling::step(self, &mut tried, &rows, settling::NARROW, &[], job)? else {
                    break;
                };
                residual = step.residual;
                if step.size < settling::SETTLED {
                    break;
                }
            }
            if std::env::var("DBG").is_ok() { eprintln!("{blending:?} residual {residual:e} scale {}", tried.scale); }
            if best.as_ref().is_none_or(|(_, least)| residual < *least) {
                best = Some((tried, residual));
            }
        }
        Ok(best.map_or(pose, |(best, _)| best))
    }

    /// The suspect as it was before. A point that lies beside a triangle of the posed original lies likewise beside that of the original.
    fn undone(&self, pose: &Rigid, job: &Job) -> Result<Option<TriMesh>, JobError> {
        let Some(posed) = self.posed(pose) else {
            return Ok(None);
        };
        let suspect = self.suspect.mesh();
        let nearest = Surface::new(&posed).nearest_of(suspect.positions(), job)?;
        let rows = self.rows_of_vertices();
        let mesh = self.original.mesh();
        let positions = job.map(suspect.vertex_count(), GRAIN, |v| {
            let found = &nearest[v];
            let corners = posed.triangles()[found.triangle as usize].map(|v| v as usize);
            let share = barycentric(corners.map(|v| posed.point(v)), Vec3(found.point));
            let on: Vec3 = (0..3).map(|i| mesh.point(corners[i]) * share[i]).sum();
            let beside = suspect.point(v) - Vec3(found.point);
            let heaviest = (0..3).max_by(|&i, &k| share[i].total_cmp(&share[k])).unwrap_or(0);
            let row = rows[corners[heaviest]].map(|row| &self.rows[row]);
            let motion = row.map(|row| pose.joints[heaviest_of(row.weights)]);
            let turned = motion.map_or(Vec3::ZERO, |motion| {
                let beside = turned_round(beside, pose.mirrors);
                motion.undo(beside) - motion.undo(Vec3::ZERO)
            });
            let unit = self.diagonal / (pose.scale * self.sampled.diagonal);
            <[f64; 3]>::from(on + turned * unit)
        })?;
        let unit = pose.scale * self.sampled.diagonal / self.diagonal;
        let place = |v: u32| Vec3(positions[v as usize]);
        let is_whole = |corners: &&[u32; 3]| {
            (0..3).all(|i| {
                let [a, b] = [corners[i], corners[(i + 1) % 3]];
                let before = (place(a) - place(b)).norm() * unit;
                let after = (suspect.point(a as usize) - suspect.point(b as usize)).norm();
                before <= TORN * after && after <= TORN * before
            })
        };
        let triangles = suspect.triangles().iter().filter(is_whole).copied().collect();
        Ok(TriMesh::new(positions, triangles).ok())
    }

    /// The row of each vertex of the original.
    fn rows_of_vertices(&self) -> Vec<Option<usize>> {
        let mut rows = vec![None; self.original.mesh().vertex_count()];
        for (number, row) in self.rows.iter().enumerate() {
            rows[row.vertex] = Some(number);
        }
        rows
    }
}

/// The joint that moves a vertex most.
fn heaviest_of(weights: &[(u32, f64)]) -> usize {
    let heaviest = weights.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    heaviest.map_or(0, |&(joint, _)| joint as usize)
}

/// A normal after a motion. Where z is turned round, triangles face the other way than their corners' order says.
fn facing(motion: &Motion, normal: Vec3, mirrors: bool) -> Vec3 {
    let turned = motion.apply(normal) - motion.apply(Vec3::ZERO);
    turned_round(turned, mirrors) * if mirrors { -1.0 } else { 1.0 }
}

/// The shares of a triangle's corners in a point of its plane; a third each where it has no area.
fn barycentric([a, b, c]: [Vec3; 3], p: Vec3) -> [f64; 3] {
    let normal = (b - a).cross(c - a);
    let square = normal.squared();
    if square == 0.0 {
        return [1.0 / 3.0; 3];
    }
    let of = |from: Vec3, to: Vec3| (to - from).cross(p - from).dot(normal) / square;
    [of(b, c), of(c, a), of(a, b)]
}
