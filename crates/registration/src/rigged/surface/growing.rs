//! A pose, joint by joint: from one that lies on the suspect to those that share vertices with it.

use job::{Job, JobError};
use mesh::{Similarity, TriMesh, Vec3};

use super::{
    FACING, Scene, facing, heaviest_of,
    settling::{self, Rows, Tie},
};
use crate::{
    AlignOptions, PreparedMesh, RegistrationError, align,
    hypotheses::spiral,
    matrix::Mat3,
    rigged::{
        Row,
        rigid::{Motion, Rigid, turned_round},
    },
    sampled::GRAIN,
};

/// A joint's vertices are those that it moves by more than this share; so many stand for them.
const OWN: f64 = 0.5;
const FEWEST: usize = 30;
const SAMPLES: usize = 120;

/// Turns that are tried about the middle of what a joint shares with another, and those of them that are refined.
const TURNS: usize = 2500;
const REFINED: usize = 8;

/// How near a point counts, in diagonals: of a turn at first, of one that was refined.
const COARSE: f64 = 0.025;
const FINE: f64 = 0.004;

/// How wide a joint's vertices look for the suspect's surface.
const GATES: [f64; 10] = [0.06, 0.05, 0.04, 0.03, 0.03, 0.02, 0.02, 0.015, 0.01, 0.01];

/// How firmly joints hold together, beside all that is seen, while the gate is wide.
const HOLD: f64 = 0.05;

/// So many of the largest joints are looked for by themselves.
const SEEDS: usize = 4;

/// A joint that was laid onto the suspect by less than this is not there.
const LEAST_SEEN: f64 = 0.25;

/// Where a pose may grow from.
#[derive(Debug)]
pub(super) enum Seed {
    /// A similarity that takes the original to the suspect.
    Whole(Similarity),
    /// The vertices of one joint, to be aligned.
    Joint(usize),
}

/// What a pose grows over.
pub(super) struct Growing<'s> {
    scene: &'s Scene<'s>,
    /// Of each joint, the vertices that it moves most, some of them, by the numbers of rows.
    own: Vec<Vec<usize>>,
    /// By how much two joints share vertices and edges, and where.
    shared: Vec<Vec<(f64, Vec3)>>,
    /// Of all area, what each joint moves most.
    sizes: Vec<usize>,
}

/// A pose of which one joint is placed.
pub(super) struct Start {
    joint: usize,
    pose: Rigid,
}

impl<'s> Growing<'s> {
    pub(super) fn of(scene: &'s Scene<'s>) -> Self {
        let mut all = vec![Vec::new(); scene.joints];
        for (number, row) in scene.rows.iter().enumerate() {
            let joint = heaviest_of(row.weights);
            all[joint].push(number);
        }
        let sizes = all.iter().map(Vec::len).collect();
        let own = all.into_iter().map(|own| {
            let weight = |number: usize, joint: usize| {
                let weights = scene.rows[number].weights.iter();
                weights.filter(|own| own.0 as usize == joint).map(|own| own.1).sum::<f64>()
            };
            let joint = own.first().map_or(0, |&number| heaviest_of(scene.rows[number].weights));
            let mostly: Vec<usize> = own.iter().copied().filter(|&number| weight(number, joint) > OWN).collect();
            let own = if mostly.len() >= FEWEST { mostly } else { own };
            let step = (own.len() / SAMPLES).max(1);
            own.into_iter().step_by(step).collect()
        });
        let mut growing = Self {
            own: own.collect(),
            shared: vec![vec![(0.0, Vec3::ZERO); scene.joints]; scene.joints],
            sizes,
            scene,
        };
        growing.share();
        growing
    }

    fn share(&mut self) {
        let rows = self.scene.rows_of_vertices();
        for corners in self.scene.original.mesh().triangles() {
            for i in 0..3 {
                let [Some(a), Some(b)] = [corners[i], corners[(i + 1) % 3]].map(|v| rows[v as usize]) else {
                    continue;
                };
                let [a, b] = [a, b].map(|row| &self.scene.rows[row]);
                let middle = (a.x + b.x) * 0.5;
                for &(j, of_a) in a.weights {
                    for &(k, of_b) in b.weights.iter().filter(|of_b| of_b.0 != j) {
                        for (j, k) in [(j, k), (k, j)] {
                            let (weight, place) = &mut self.shared[j as usize][k as usize];
                            *weight += of_a * of_b;
                            *place += middle * (of_a * of_b);
                        }
                    }
                }
            }
        }
        for (weight, place) in self.shared.iter_mut().flatten() {
            *place = *place * (1.0 / weight.max(f64::MIN_POSITIVE));
        }
    }

    /// Where to begin, what costs least first.
    pub(super) fn seeds(&self, aligned: &[Similarity]) -> Vec<Seed> {
        let mut joints: Vec<usize> = (0..self.scene.joints).filter(|&j| self.own[j].len() >= FEWEST).collect();
        joints.sort_by_key(|&joint| std::cmp::Reverse(self.sizes[joint]));
        let whole = aligned.iter().take(SEEDS).map(|pose| Seed::Whole(pose.inverse()));
        whole.chain(joints.into_iter().take(SEEDS).map(Seed::Joint)).collect()
    }

    /// A seed's joint on the suspect.
    pub(super) fn start(&self, seed: &Seed, job: &Job) -> Result<Option<Start>, RegistrationError> {
        let similarity = match seed {
            Seed::Whole(similarity) => Some(*similarity),
            &Seed::Joint(joint) => self.laid(joint, job)?,
        };
        let Some(similarity) = similarity else {
            return Ok(None);
        };
        let (motion, scale, mirrors) = self.motion(&similarity);
        let pose = Rigid::of_joints(vec![motion; self.scene.joints], scale, mirrors);
        let joint = match seed {
            &Seed::Joint(joint) => Some(joint),
            Seed::Whole(_) => {
                let score = |joint: &usize| {
                    let seen = self.seen(*joint, &motion, &pose, 2.0 * FINE);
                    seen * (self.sizes[*joint] as f64).sqrt()
                };
                let joints = (0..self.scene.joints).filter(|&joint| self.own[joint].len() >= FEWEST);
                joints.max_by(|a, b| score(a).total_cmp(&score(b)))
            }
        };
        Ok(joint.map(|joint| Start { joint, pose }))
    }

    /// The similarity that lays the triangles of one joint onto the suspect.
    fn laid(&self, joint: usize, job: &Job) -> Result<Option<Similarity>, RegistrationError> {
        let mesh = self.scene.original.mesh();
        let rows = self.scene.rows_of_vertices();
        let is_own = |v: &u32| {
            rows[*v as usize].is_some_and(|row| {
                let weights = self.scene.rows[row].weights;
                weights.iter().any(|&(j, weight)| j as usize == joint && weight > 0.8)
            })
        };
        let triangles: Vec<[u32; 3]> =
            mesh.triangles().iter().filter(|corners| corners.iter().all(is_own)).copied().collect();
        if triangles.len() < FEWEST {
            return Ok(None);
        }
        let Ok(part) = TriMesh::new(mesh.positions().to_vec(), triangles) else {
            return Ok(None);
        };
        let Some(part) = part.gathered().or(Some(part)) else { return Ok(None) };
        let part = PreparedMesh::from(part);
        let laid = align(self.scene.suspect, &part, &AlignOptions::default(), &job.quiet())?;
        if std::env::var("DBG").is_ok() { eprintln!("joint {joint} laid: overlap {} residual {:e} alternatives {}", laid.overlap, laid.residual, laid.alternatives.len()); }
        Ok(laid.aligned.then_some(laid.transform))
    }

    /// A similarity of the original's coordinates to the suspect's as a motion of all that is counted from the centres in diagonals.
    fn motion(&self, similarity: &Similarity) -> (Motion, f64, bool) {
        let mirrors = similarity.mirrors();
        let Mat3([a, b, c]) = Mat3::from(similarity.rotation);
        let rotation = Mat3([a, b, if mirrors { -c } else { c }]);
        let scene = self.scene;
        let scale = similarity.scale * scene.diagonal / scene.sampled.diagonal;
        let centre = scene.back(similarity.apply(scene.centre));
        let offset = turned_round(centre, mirrors) * (1.0 / scale);
        (Motion::of(rotation, offset), scale, mirrors)
    }

    /// The share of a joint's vertices that a motion lays on the suspect, softly.
    fn seen(&self, joint: usize, motion: &Motion, pose: &Rigid, near: f64) -> f64 {
        let own = &self.own[joint];
        let score = own.iter().map(|&number| {
            let (place, facing) = self.at(number, motion, pose);
            let there = self.scene.there(place);
            let limit = 3.0 * near * self.scene.sampled.diagonal;
            let Some(found) = self.scene.sampled.surface.nearest_within(there.0, limit) else {
                return 0.0;
            };
            let cosine = self.scene.sampled.triangle_normal(found.triangle).dot(facing);
            soft(found.distance / self.scene.sampled.diagonal, cosine, near)
        });
        score.sum::<f64>() / own.len().max(1) as f64
    }

    /// As [`seen`](Self::seen), by samples near on a grid.
    fn seen_coarsely(&self, joint: usize, motion: &Motion, pose: &Rigid) -> f64 {
        let own = &self.own[joint];
        let score = own.iter().map(|&number| {
            let (place, facing) = self.at(number, motion, pose);
            match self.scene.sampled.near(self.scene.there(place)) {
                Some((sample, distance)) => {
                    let cosine = self.scene.sampled.normal(sample).dot(facing);
                    soft(distance / self.scene.sampled.diagonal, cosine, COARSE)
                }
                None => 0.0,
            }
        });
        score.sum::<f64>() / own.len().max(1) as f64
    }

    fn at(&self, number: usize, motion: &Motion, pose: &Rigid) -> (Vec3, Vec3) {
        let place = turned_round(motion.apply(self.scene.rows[number].x) * pose.scale, pose.mirrors);
        let facing = facing(motion, self.scene.normals[number], pose.mirrors);
        (place, facing)
    }

    /// All other joints placed, each by one that was.
    pub(super) fn grown(&self, start: Start, job: &Job) -> Result<Rigid, JobError> {
        let Start { joint, mut pose } = start;
        let joints = self.scene.joints;
        pose.joints[joint] = self.refined(joint, pose.joints[joint], &pose, None, job)?;
        let mut is_placed = vec![false; joints];
        let mut is_seen = vec![false; joints];
        (is_placed[joint], is_seen[joint]) = (true, true);
        loop {
            let ahead = (0..joints).filter(|&k| !is_placed[k]).flat_map(|k| {
                let placed = (0..joints).filter(|&j| is_placed[j]);
                placed.map(move |j| (j, k)).collect::<Vec<_>>()
            });
            let firmness = |&(j, k): &(usize, usize)| {
                self.shared[j][k].0 * if is_seen[j] { 1.0 } else { 1e-3 }
            };
            let Some((parent, joint)) = ahead.max_by(|a, b| firmness(a).total_cmp(&firmness(b))) else {
                return Ok(pose);
            };
            let (score, motion) = self.placed(parent, joint, &pose, job)?;
            if std::env::var("DBG").is_ok() { eprintln!("  {parent} -> {joint}: {score} ({} own)", self.sizes[joint]); }
            is_placed[joint] = true;
            is_seen[joint] = score >= LEAST_SEEN;
            pose.joints[joint] = if is_seen[joint] { motion } else { pose.joints[parent] };
        }
    }

    /// The best motion of a joint beside another, and the share of its vertices that it lays on the suspect.
    fn placed(&self, parent: usize, joint: usize, pose: &Rigid, job: &Job) -> Result<(f64, Motion), JobError> {
        job.go_on()?;
        let from = pose.joints[parent];
        let (_, pivot) = self.shared[parent][joint];
        let about = from.apply(pivot);
        let turned = |i: usize| match i {
            0 => from,
            _ => from.shifted(-about).turned(turn(spiral(i - 1, TURNS))).shifted(about),
        };
        let scores = job.map(TURNS + 1, GRAIN, |i| self.seen_coarsely(joint, &turned(i), pose))?;
        let mut order: Vec<usize> = (0..scores.len()).collect();
        order.sort_by(|&a, &b| scores[b].total_cmp(&scores[a]));
        order.truncate(REFINED);
        if !order.contains(&0) {
            order.push(0);
        }
        let mut best = (f64::NEG_INFINITY, from);
        for i in order {
            let motion = self.refined(joint, turned(i), pose, Some((pivot, about)), job)?;
            let score = self.seen(joint, &motion, pose, FINE);
            if score > best.0 {
                best = (score, motion);
            }
        }
        Ok(best)
    }

    /// One joint's motion, fitted by itself; held where a point of it belongs.
    fn refined(
        &self,
        joint: usize,
        motion: Motion,
        pose: &Rigid,
        held: Option<(Vec3, Vec3)>,
        job: &Job,
    ) -> Result<Motion, JobError> {
        const ALONE: [(u32, f64); 1] = [(0, 1.0)];
        let own = &self.own[joint];
        let alone = |&number: &usize| Row {
            weights: &ALONE,
            ..self.scene.rows[number].moved_alike()
        };
        let rows = Rows {
            rows: own.iter().map(alone).collect(),
            normals: own.iter().map(|&number| self.scene.normals[number]).collect(),
        };
        let mut alone = Rigid::of_joints(vec![motion], pose.scale, pose.mirrors);
        for gate in GATES {
            let ties: Vec<Tie> = held
                .iter()
                .map(|&(from, about)| Tie {
                    joint: 0,
                    from,
                    to: turned_round(about * pose.scale, pose.mirrors),
                    weight: 5.0 * HOLD,
                })
                .collect();
            if settling::step(self.scene, &mut alone, &rows, gate, &ties, job)?.is_none() {
                break;
            }
            alone.scale = pose.scale;
        }
        Ok(alone.joints[0])
    }

    /// What holds neighbouring joints together, less and less as the gate narrows.
    pub(super) fn ties(&self, pose: &Rigid, gate: f64) -> Vec<Tie> {
        let mut ties = Vec::new();
        let joints = self.scene.joints;
        for j in 0..joints {
            let neighbours = (0..joints).filter(|&k| k != j);
            let firmest = neighbours.max_by(|&a, &b| self.shared[j][a].0.total_cmp(&self.shared[j][b].0));
            let Some(k) = firmest.filter(|&k| self.shared[j][k].0 > 0.0) else {
                continue;
            };
            let (_, pivot) = self.shared[j][k];
            let to = turned_round(pose.joints[k].apply(pivot) * pose.scale, pose.mirrors);
            ties.push(Tie {
                joint: j as u32,
                from: pivot,
                to,
                weight: HOLD * gate / joints as f64,
            });
        }
        ties
    }
}

/// How much a point counts.
fn soft(distance: f64, cosine: f64, near: f64) -> f64 {
    let beside = distance / near;
    if cosine > FACING { (-0.5 * beside * beside).exp() } else { 0.0 }
}

/// A unit quaternion's turn: about a vector, by its length.
fn turn([w, x, y, z]: [f64; 4]) -> Vec3 {
    let (w, v) = if w < 0.0 { (-w, Vec3([-x, -y, -z])) } else { (w, Vec3([x, y, z])) };
    let sine = v.norm();
    v * (2.0 * sine.atan2(w) / sine.max(f64::MIN_POSITIVE))
}
