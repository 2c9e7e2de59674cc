//! Joints fitted together: points of the original to planes of the suspect, by Gauss–Newton with robust weights.

use faer::{Mat, Side, linalg::solvers::Solve};
use job::{Job, JobError};
use mesh::Vec3;

use super::{FACING, Scene, facing, heaviest_of};
use crate::{
    rigged::{
        Pose, Row,
        rigid::{Rigid, turned_round},
        robust_weights,
    },
    sampled::GRAIN,
};

/// About so many vertices are looked at at first, and at last.
pub(super) const A_FEW: usize = 5_000;
pub(super) const MANY: usize = 30_000;

/// How near the surfaces have to be at last, in diagonals.
pub(super) const NARROW: f64 = 0.004;
pub(super) const LAST_ROUNDS: usize = 12;

/// So small a step ends them.
pub(super) const SETTLED: f64 = 1e-7;

/// What holds joints of which little is seen, beside the mean of the normal equations' diagonal.
const DAMPING: f64 = 1e-4;

/// No step is longer than this, in radians and diagonals.
const LONGEST: f64 = 0.25;

/// Some vertices of the original with their normals.
pub(super) struct Rows<'a> {
    pub(super) rows: Vec<Row<'a>>,
    pub(super) normals: Vec<Vec3>,
}

impl<'a> Rows<'a> {
    /// About so many, evenly chosen.
    pub(super) fn some(scene: &Scene<'a>, count: usize) -> Self {
        let step = (scene.rows.len() / count).max(1);
        Self {
            rows: scene.rows.iter().step_by(step).map(Row::moved_alike).collect(),
            normals: scene.normals.iter().step_by(step).copied().collect(),
        }
    }
}

impl<'a> Row<'a> {
    /// The same vertex, not yet paired, and no morph target taken.
    pub(super) fn moved_alike(&self) -> Self {
        Self {
            offsets: Vec::new(),
            ..*self
        }
    }
}

/// A point that a joint should take somewhere.
pub(super) struct Tie {
    pub(super) joint: u32,
    pub(super) from: Vec3,
    pub(super) to: Vec3,
    /// As a share of all rows' weight.
    pub(super) weight: f64,
}

/// How large a step was, and how far the surfaces were apart before it (median).
pub(super) struct Step {
    pub(super) size: f64,
    pub(super) residual: f64,
}

/// A step of all joints towards the suspect; none where too little of it is near.
pub(super) fn step(
    scene: &Scene<'_>,
    pose: &mut Rigid,
    rows: &Rows<'_>,
    gate: f64,
    ties: &[Tie],
    job: &Job,
) -> Result<Option<Step>, JobError> {
    job.go_on()?;
    let met = job.map(rows.rows.len(), GRAIN, |i| {
        let row = &rows.rows[i];
        let place = pose.moved(row);
        let motion = &pose.joints[heaviest_of(row.weights)];
        let facing = facing(motion, rows.normals[i], pose.mirrors);
        scene.met(place, facing, gate)
    })?;
    let seen: Vec<(usize, Vec3, f64)> = met
        .into_iter()
        .enumerate()
        .filter_map(|(i, met)| met.map(|(normal, along)| (i, normal, along)))
        .collect();
    if seen.len() < 20 {
        return Ok(None);
    }
    let (weights, residual) = robust_weights(seen.iter().map(|(_, _, along)| along.abs()).collect());
    let size = pose.unknowns();
    let (mut normal, mut right) = (Mat::<f64>::zeros(size, size), Mat::<f64>::zeros(size, 1));
    let mut columns = Vec::new();
    for (&(i, plane, along), weight) in seen.iter().zip(&weights) {
        pose.columns(&rows.rows[i], &mut columns);
        let plane = turned_round(plane, pose.mirrors);
        let slopes: Vec<(usize, f64)> = columns.iter().map(|&(k, column)| (k, column.dot(plane))).collect();
        add(&mut normal, &mut right, &slopes, along, *weight);
    }
    let all: f64 = weights.iter().sum();
    for tie in ties {
        let weights = [(tie.joint, 1.0)];
        let row = Row {
            vertex: 0,
            x: tie.from,
            y: tie.to,
            weights: &weights,
            offsets: Vec::new(),
        };
        let rest = turned_round(tie.to - pose.moved(&row), pose.mirrors);
        pose.columns(&row, &mut columns);
        for axis in 0..3 {
            let slopes: Vec<(usize, f64)> = columns.iter().map(|&(k, column)| (k, column[axis])).collect();
            add(&mut normal, &mut right, &slopes, rest[axis], tie.weight * all);
        }
    }
    let mean = (0..size).map(|i| normal[(i, i)]).sum::<f64>() / size as f64;
    (0..size).for_each(|i| normal[(i, i)] += DAMPING * mean + f64::MIN_POSITIVE);
    let Ok(factor) = normal.llt(Side::Lower) else {
        return Ok(None);
    };
    let mut step = factor.solve(&right);
    let largest = (0..size).map(|i| step[(i, 0)].abs()).fold(0.0, f64::max);
    if !largest.is_finite() {
        return Ok(None);
    }
    if largest > LONGEST {
        (0..size).for_each(|i| step[(i, 0)] *= LONGEST / largest);
    }
    *pose = pose.stepped(&step);
    Ok(Some(Step {
        size: largest,
        residual,
    }))
}

fn add(normal: &mut Mat<f64>, right: &mut Mat<f64>, slopes: &[(usize, f64)], along: f64, weight: f64) {
    for &(i, a) in slopes {
        right[(i, 0)] += weight * a * along;
        for &(k, b) in slopes {
            normal[(i, k)] += weight * a * b;
        }
    }
}

impl Scene<'_> {
    /// The plane of the suspect that is nearest to a place, if it faces as it should, and how far that place is from it along its normal.
    pub(super) fn met(&self, place: Vec3, facing: Vec3, gate: f64) -> Option<(Vec3, f64)> {
        let there = self.there(place);
        let found = self.sampled.surface.nearest_within(there.0, gate * self.sampled.diagonal)?;
        let plane = self.sampled.triangle_normal(found.triangle);
        // Which side is out is not asked: a thin part's other side is farther than this one is off.
        if plane.dot(facing) < FACING {
            return None;
        }
        Some((plane, plane.dot(self.back(Vec3(found.point)) - place)))
    }
}

