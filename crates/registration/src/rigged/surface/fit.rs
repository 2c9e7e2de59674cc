//! Joints that all move together: robust least squares of distances from tangent planes.

use job::{Job, JobError};
use mesh::{Similarity, Vec3};

use super::{
    Motion, Pose, Rigid,
    equations::NormalEquations,
    placing::{OF_JOINTS, OF_NODES, Search},
    skeleton::{Link, Skeleton},
};
use crate::{PreparedMesh, RegistrationError, sampled::GRAIN};

/// How joints are moved for a while.
pub(super) struct Stage {
    /// What is farther from the suspect, in diagonals, is not looked at.
    tolerance: f64,
    rounds: usize,
    /// About so many samples are looked at.
    samples: usize,
    /// How much places between joints count, as [`HELD`].
    held: f64,
}

const fn stage(tolerance: f64, rounds: usize, samples: usize, held: f64) -> Stage {
    Stage {
        tolerance,
        rounds,
        samples,
        held,
    }
}

/// While joints are still looked for, and in the end.
pub(super) const COARSE: [Stage; 3] = [
    stage(0.03, 6, 2000, HELD),
    stage(0.015, 10, 2000, HELD),
    stage(0.006, 10, 3000, HELD),
];
pub(super) const FINE: [Stage; 4] = [
    stage(0.01, 4, 3000, HELD),
    stage(0.006, 4, 3000, LOOSE),
    stage(0.004, 6, 20_000, LOOSE),
    stage(0.002, 8, 20_000, LOOSE),
];

/// From where all nodes move as one: what lies on the suspect takes its neighbours there.
pub(super) const SPREADING: [Stage; 6] = [
    stage(0.06, 10, 2000, 100.0 * HELD),
    stage(0.06, 10, 2000, 10.0 * HELD),
    stage(0.06, 10, 2000, HELD),
    stage(0.03, 15, 2000, HELD),
    stage(0.015, 10, 2000, HELD),
    stage(0.006, 10, 3000, HELD),
];
/// Once nodes that lay badly were placed anew.
pub(super) const PLACED: [Stage; 3] = [
    stage(0.03, 6, 2000, HELD),
    stage(0.015, 20, 2000, 100.0 * HELD),
    stage(0.006, 10, 3000, HELD),
];
/// Of nodes that lie on the suspect, but slid along it where it is smooth: links are pulled tight, and then let go.
pub(super) const RELAXING: [Stage; 5] = [
    stage(0.06, 200, 2000, 3000.0 * HELD),
    stage(0.03, 200, 2000, 1000.0 * HELD),
    stage(0.015, 100, 2000, 100.0 * HELD),
    stage(0.006, 30, 3000, 30.0 * HELD),
    stage(0.006, 10, 3000, HELD),
];

/// Of many nodes, which lie nearly where they should.
pub(super) const BY_NODES: [Stage; 5] = [
    stage(0.03, 8, 3000, HELD),
    stage(0.015, 8, 5000, HELD),
    stage(0.01, 6, 20_000, HELD),
    stage(0.004, 8, 20_000, HELD),
    stage(0.002, 8, 20_000, HELD),
];

/// Normals that are farther apart belong to different sides.
const SAME_SIDE: f64 = 0.4;

/// What of a sample two joints count that move the place between them to the same place: joints are not dislocated, but where exactly they are, weights hardly tell.
pub(super) const HELD: f64 = 3e-4;

/// As much in the end: a joint of which enough is seen says better itself where it is.
const LOOSE: f64 = 1e-5;

/// How far, squared and in diagonals of a radian, the place about which two joints turn is looked for from the middle of what they share.
const NEAR_MIDDLE: f64 = 0.01;

/// Damping at first, beside the normal equations' diagonal, and what it is multiplied by after a step that helped, and one that did not.
const DAMPING: f64 = 1e-3;
const MORE: f64 = 0.2;
const LESS: f64 = 8.0;
const TRIES: usize = 4;

/// Equations of so many matches are summed up at a time.
const SUMMED: usize = 2500;

/// How far a size may be from what is known.
const MOST_RESIZED: f64 = 1.15;

/// A suspect on which joints are laid.
pub(super) struct Fit<'a> {
    pub(super) skeleton: &'a Skeleton<'a>,
    suspect: &'a PreparedMesh,
    normals: &'a [[f64; 3]],
    centre: Vec3,
    /// About how large the suspect is, to a diagonal of the original, if that is known: nodes could shrink onto any surface.
    size: Option<f64>,
    /// How it is found where joints lie, or nodes.
    pub(super) search: &'static Search,
}

/// A sample, the unit normal where the suspect is nearest to it, how far that is along the normal, and in all.
pub(super) struct Match {
    sample: usize,
    normal: Vec3,
    rest: f64,
    pub(super) distance: f64,
}

impl<'a> Fit<'a> {
    pub(super) fn new(
        skeleton: &'a Skeleton<'a>,
        suspect: &'a PreparedMesh,
    ) -> Result<Self, RegistrationError> {
        Ok(Self {
            skeleton,
            centre: suspect.sampled("suspect")?.centroid,
            normals: suspect.triangle_normals(),
            size: None,
            search: &OF_JOINTS,
            suspect,
        })
    }

    /// The same of nodes in place of joints.
    pub(super) fn by_nodes(mut self) -> Self {
        self.search = &OF_NODES;
        self
    }

    /// The same, and it is known about how large the suspect is.
    pub(super) fn about(mut self, seed: &Similarity) -> Self {
        self.size = Some(seed.inverse().scale * self.skeleton.diagonal());
        self
    }

    /// Whether a size is not too far from what is known.
    fn allows(&self, size: f64) -> bool {
        let near = 1.0 / MOST_RESIZED..MOST_RESIZED;
        self.size.is_none_or(|known| near.contains(&(size / known)))
    }

    /// The middle of the suspect, from which poses count.
    pub(super) fn centre(&self) -> Vec3 {
        self.centre
    }

    /// Where the suspect is nearest to a place, in its own frame from its middle, on the same side: a unit normal, the way there along it, and the distance.
    pub(super) fn near(&self, place: Vec3, normal: Vec3, limit: f64) -> Option<(Vec3, f64, f64)> {
        let near = self
            .suspect
            .surface()
            .nearest_within((place + self.centre).0, limit)?;
        let own = Vec3(self.normals[near.triangle as usize]);
        let rest = own.dot(Vec3(near.point) - self.centre - place);
        (own.dot(normal) > SAME_SIDE).then_some((own, rest, near.distance))
    }

    /// Samples that lie on the suspect within a tolerance, in diagonals of the original.
    pub(super) fn matches(
        &self,
        pose: &Rigid,
        samples: &[usize],
        tolerance: f64,
        job: &Job,
    ) -> Result<Vec<Match>, JobError> {
        let limit = tolerance * pose.scale();
        let found = job.quiet().map(samples.len(), GRAIN, |i| {
            let sample = &self.skeleton.samples[samples[i]];
            let (place, facing) = pose.moved_with(&sample.row, sample.normal);
            let (normal, rest, distance) = self.near(place, facing, limit)?;
            Some(Match {
                sample: samples[i],
                normal,
                rest,
                distance,
            })
        })?;
        Ok(found.into_iter().flatten().collect())
    }

    /// Rounds in which what is near pulls all joints, damped so that each leaves less (Levenberg and Marquardt).
    pub(super) fn descend(
        &self,
        mut pose: Rigid,
        samples: &[usize],
        tolerance: f64,
        rounds: usize,
        held: f64,
        job: &Job,
    ) -> Result<Rigid, JobError> {
        let mut damping = DAMPING;
        let mut matches = self.matches(&pose, samples, tolerance, job)?;
        for _round in 0..rounds {
            job.go_on()?;
            if matches.is_empty() {
                break;
            }
            let equations = self.equations(&pose, &matches, tolerance, held, job)?;
            let left = |pose: &Rigid, near: &[Match]| {
                self.left(pose, near, samples.len(), tolerance)
                    + self.strain(pose, matches.len(), held, tolerance)
            };
            let before = left(&pose, &matches);
            let mut is_better = false;
            for _try in 0..TRIES {
                let Some(step) = equations.solved(damping) else {
                    damping *= LESS;
                    continue;
                };
                let tried = pose.stepped(&step);
                if !self.allows(tried.scale()) {
                    damping *= LESS;
                    continue;
                }
                let again = self.matches(&tried, samples, tolerance, job)?;
                if left(&tried, &again) < before {
                    (pose, matches, is_better) = (tried, again, true);
                    damping *= MORE;
                    break;
                }
                damping *= LESS;
            }
            if !is_better {
                break;
            }
        }
        Ok(pose)
    }

    /// What a pose leaves of samples, in squares of the tolerance: those that are not near count one each.
    fn left(&self, pose: &Rigid, matches: &[Match], samples: usize, tolerance: f64) -> f64 {
        let limit = tolerance * pose.scale();
        let near: f64 = matches.iter().map(|found| (found.distance / limit).powi(2)).sum();
        near + (samples - matches.len()) as f64
    }

    fn equations(
        &self,
        pose: &Rigid,
        matches: &[Match],
        tolerance: f64,
        held: f64,
        job: &Job,
    ) -> Result<NormalEquations, JobError> {
        let mut off: Vec<f64> = matches.iter().map(|found| found.rest.abs()).collect();
        let middle = off.len() / 2;
        let median = *off.select_nth_unstable_by(middle, f64::total_cmp).1;
        let width = (3.0 * median).max(self.search.pulled * tolerance * pose.scale());
        let sums = job.quiet().map_chunks(matches.len(), SUMMED, |range| {
            let mut sum = NormalEquations::of_unknowns(pose.unknowns());
            let mut columns = Vec::new();
            let mut numbers: Vec<(usize, f64)> = Vec::new();
            for found in &matches[range] {
                columns.clear();
                pose.columns(&self.skeleton.samples[found.sample].row, &mut columns);
                numbers.clear();
                numbers.extend(columns.iter().map(|&(i, column)| (i, column.dot(found.normal))));
                numbers.sort_unstable_by_key(|&(i, _)| i);
                let weight = (-0.5 * (found.rest / width).powi(2)).exp();
                sum.add(&numbers, found.rest, weight);
            }
            sum
        })?;
        let mut sum = NormalEquations::of_unknowns(pose.unknowns());
        self.hold(pose, self.weight(matches.len(), held), &mut sum);
        Ok(sums.iter().fold(sum, NormalEquations::and))
    }

    /// What a link counts beside so many matches.
    fn weight(&self, matches: usize, held: f64) -> f64 {
        held * matches as f64 / self.skeleton.links.len().max(1) as f64
    }

    /// How far neighbours take the place apart about which they turn, in squares of the tolerance.
    fn strain(&self, pose: &Rigid, matches: usize, held: f64, tolerance: f64) -> f64 {
        let apart = |link: &Link| {
            let motions = link.joints.map(|joint| pose.joints()[joint]);
            let pivot = hinge(&motions, link.pivot);
            (motions[0].apply(pivot) - motions[1].apply(pivot)).squared()
        };
        let sum: f64 = self.skeleton.links.iter().map(apart).sum();
        self.weight(matches, held) * sum / (tolerance * tolerance)
    }

    /// Neighbours keep the place together about which they turn.
    fn hold(&self, pose: &Rigid, weight: f64, sum: &mut NormalEquations) {
        let scale = pose.scale();
        for link in &self.skeleton.links {
            let [a, b] = link.joints;
            let motions = [a, b].map(|joint| pose.joints()[joint]);
            let pivot = hinge(&motions, link.pivot);
            let [there, here] = motions.map(|motion| motion.apply(pivot));
            for unit in Vec3::AXES {
                let mut numbers = Vec::with_capacity(12);
                for (joint, place, sign) in [(a, there, 1.0), (b, here, -1.0)] {
                    let turned = place.cross(unit) * (sign * scale);
                    let shifted = unit * (sign * scale);
                    numbers.extend((0..3).map(|turn| (6 * joint + turn, turned[turn])));
                    numbers.extend((0..3).map(|shift| (6 * joint + 3 + shift, shifted[shift])));
                }
                numbers.sort_unstable_by_key(|&(i, _)| i);
                sum.add(&numbers, scale * (here - there).dot(unit), weight);
            }
        }
    }

    /// All joints together, from coarse to fine.
    pub(super) fn together(&self, mut pose: Rigid, course: &[Stage], job: &Job) -> Result<Rigid, JobError> {
        let all = self.skeleton.samples.len();
        for stage in course {
            let samples: Vec<usize> = (0..all).step_by((all / stage.samples).max(1)).collect();
            pose = self.descend(pose, &samples, stage.tolerance, stage.rounds, stage.held, job)?;
        }
        Ok(pose)
    }
}

/// The place that two motions take most nearly to the same place, not far from a given one: on the axis about which the second turns against the first.
fn hinge(motions: &[Motion; 2], middle: Vec3) -> Vec3 {
    let apart = |p: Vec3| motions[0].apply(p) - motions[1].apply(p);
    let (origin, rest) = (apart(Vec3::ZERO), apart(middle));
    let columns = Vec3::AXES.map(|unit| apart(unit) - origin);
    let mut sum = NormalEquations::of_unknowns(3);
    for i in 0..3 {
        let numbers: [(usize, f64); 3] = std::array::from_fn(|axis| (axis, columns[axis][i]));
        sum.add(&numbers, -rest[i], 1.0);
    }
    sum.hold_all(NEAR_MIDDLE);
    sum.solved(0.0).map_or(middle, |step| {
        middle + Vec3(std::array::from_fn(|i| step[(i, 0)]))
    })
}

/// A joint that moves as another, turned about a place of the original.
pub(super) fn turned_about(motion: &Motion, pivot: Vec3, turn: Vec3) -> Motion {
    let there = motion.apply(pivot);
    let turned = motion.turned(turn);
    turned.shifted(there - turned.apply(pivot))
}
