//! Joints one after the other, each from its neighbour.

use faer::Mat;
use job::{Job, JobError};
use mesh::{Similarity, Vec3};

use super::{
    BLENDINGS, Blending, Motion, Pose, Rigid,
    fit::{COARSE, FINE, Fit, HELD, add, solved, turned_about},
    skeleton::Link,
};
use crate::matrix::Mat3;

/// Turns that are tried about a joint: so many axes, by these angles in degrees, and no turn.
const AXES: usize = 42;
const ANGLES: [f64; 9] = [15.0, 30.0, 45.0, 60.0, 75.0, 90.0, 105.0, 125.0, 150.0];

/// How near, in diagonals, a joint's samples have to come to count, while turns are tried and in the end.
const WIDE: f64 = 0.03;
const NARROW: f64 = 0.01;

/// Samples of a joint that are looked at.
const A_FEW: usize = 200;

/// Turns from which a joint is fitted by itself.
const FITTED: usize = 6;

/// Rounds in which a joint is fitted by itself, and all that are placed so far.
const ALONE: usize = 8;
const SO_FAR: usize = 4;

/// How often joints that lie badly are looked for again, which lie well, and by how much more has to lie there.
const PASSES: usize = 5;
const WELL: f64 = 0.85;
const BETTER: f64 = 0.03;

/// A joint by itself is damped by this much: where nothing is told of a direction, it stays.
const HELD_ALONE: f64 = 1e-4;

/// A joint of which no more than this lies on the suspect stays as its neighbour moves it: it may be cut off.
const LEAST: f64 = 0.15;

impl Fit<'_> {
    /// The pose of all joints, from a transform that takes the suspect to the original at one of them; if it isn't said which, at that which lies best there. None where nothing lies there.
    pub(super) fn grown(
        &self,
        seed: &Similarity,
        joint: Option<usize>,
        job: &Job,
    ) -> Result<Option<Rigid>, JobError> {
        let (motion, scale) = self.motion(seed);
        let joints = self.skeleton.joints();
        let score = |joint: usize, motion: &Motion| self.score(joint, motion, scale, WIDE);
        let first = match joint {
            Some(joint) => joint,
            None => {
                let worth = |&joint: &usize| {
                    score(joint, &motion) * (self.skeleton.of_joint[joint].len() as f64).sqrt()
                };
                let best = (0..joints).max_by(|a, b| worth(a).total_cmp(&worth(b)));
                best.unwrap_or(0)
            }
        };
        let (begun, scale) = self.settled(first, motion, scale, true);
        let mut pose = Rigid::of_joints(Blending::Linear, vec![begun; joints], scale);
        if self.score(first, &begun, scale, WIDE) < LEAST {
            return Ok(None);
        }
        let mut is_placed = vec![false; joints];
        is_placed[first] = true;
        let mut order = Vec::new();
        while let Some((link, from, next)) = self.next(&is_placed) {
            job.go_on()?;
            let open: Vec<usize> = (0..joints).filter(|&joint| !is_placed[joint]).collect();
            let base = pose.joints()[from];
            let placed = self.placed(next, &base, link.pivot, &pose, &open, job)?;
            for joint in open {
                pose.set_joint(joint, placed.unwrap_or(base));
            }
            is_placed[next] = true;
            order.push((link, from, next));
            pose = self.descend(pose, &self.samples_of(&is_placed), WIDE, SO_FAR, HELD, job)?;
        }
        for _pass in 0..PASSES {
            pose = self.together(pose, &COARSE, job)?;
            if !self.placed_again(&mut pose, &order, job)? {
                break;
            }
        }
        let mut best: Option<(f64, Rigid)> = None;
        for blending in BLENDINGS {
            let mut fitted = self.together(pose.blended(blending), &FINE, job)?;
            if self.placed_again(&mut fitted, &order, job)? {
                fitted = self.together(self.together(fitted, &COARSE, job)?, &FINE, job)?;
            }
            let off = self.off(&fitted, job)?;
            if best.as_ref().is_none_or(|(least, _)| off < *least) {
                best = Some((off, fitted));
            }
        }
        Ok(best.map(|(_, pose)| pose))
    }

    /// Joints that lie badly are looked for anew from where the neighbours are by now, with what hangs on them; whether any was placed better.
    fn placed_again(
        &self,
        pose: &mut Rigid,
        order: &[(Link, usize, usize)],
        job: &Job,
    ) -> Result<bool, JobError> {
        let mut changed = vec![false; self.skeleton.joints()];
        for &(link, from, joint) in order {
            let own = self.score_in(pose, joint, NARROW);
            if own > WELL && !changed[from] || self.skeleton.of_joint[joint].is_empty() {
                continue;
            }
            let mut hanging = vec![joint];
            for &(_, from, next) in order {
                if hanging.contains(&from) {
                    hanging.push(next);
                }
            }
            let base = pose.joints()[from];
            let Some(found) = self.placed(joint, &base, link.pivot, pose, &hanging, job)? else {
                continue;
            };
            let mut tried = pose.clone();
            hanging.iter().for_each(|&joint| tried.set_joint(joint, found));
            if self.score_in(&tried, joint, NARROW) > own + BETTER {
                *pose = tried;
                changed[joint] = true;
            }
        }
        Ok(changed.contains(&true))
    }

    /// The motion of the whole original by which a transform of the suspect is undone, and the suspect's size to a diagonal of the original.
    fn motion(&self, seed: &Similarity) -> (Motion, f64) {
        let back = seed.inverse();
        let scale = back.scale * self.skeleton.diagonal();
        let middle = back.apply(self.skeleton.centre()) - self.centre();
        (Motion::of(Mat3::from(back.rotation), middle / scale), scale)
    }

    /// The strongest link from a joint that is placed to one that isn't.
    fn next(&self, is_placed: &[bool]) -> Option<(Link, usize, usize)> {
        let open = self.skeleton.links.iter().filter_map(|link| {
            let [a, b] = link.joints;
            match (is_placed[a], is_placed[b]) {
                (true, false) => Some((*link, a, b)),
                (false, true) => Some((*link, b, a)),
                _ => None,
            }
        });
        open.max_by(|a, b| a.0.strength.total_cmp(&b.0.strength))
    }

    /// Samples that only joints move which are placed.
    fn samples_of(&self, is_placed: &[bool]) -> Vec<usize> {
        const MOST: usize = 3000;
        let all = self.skeleton.samples.iter().enumerate();
        let own = all.filter(|(_, sample)| {
            let mut weights = sample.row.weights.iter();
            weights.all(|&(joint, share)| is_placed[joint as usize] || share < 0.05)
        });
        let own: Vec<usize> = own.map(|(i, _)| i).collect();
        own.iter().step_by((own.len() / MOST).max(1)).copied().collect()
    }

    /// A joint turned about the place that it shares with its neighbour until it lies on the suspect.
    fn placed(
        &self,
        joint: usize,
        base: &Motion,
        pivot: Vec3,
        pose: &Rigid,
        hanging: &[usize],
        job: &Job,
    ) -> Result<Option<Motion>, JobError> {
        let turns = turns();
        let scale = pose.scale();
        let score = |motion: &Motion, tolerance| {
            let mut tried = pose.clone();
            hanging.iter().for_each(|&joint| tried.set_joint(joint, *motion));
            self.score_in(&tried, joint, tolerance)
        };
        let tried = job.quiet().map(turns.len(), 8, |i| {
            let motion = turned_about(base, pivot, turns[i]);
            (score(&motion, WIDE), motion)
        })?;
        let mut order: Vec<usize> = (0..tried.len()).collect();
        order.sort_by(|&a, &b| tried[b].0.total_cmp(&tried[a].0));
        let fitted = job.quiet().map(FITTED.min(order.len()), 1, |i| {
            let begun = tried[order[i]].1;
            let (motion, _) = self.settled(joint, begun, scale, false);
            let [begun, motion] = [begun, motion].map(|motion| (score(&motion, NARROW), motion));
            if motion.0 > begun.0 { motion } else { begun }
        })?;
        let best = fitted.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        Ok(best.filter(|(score, _)| *score > LEAST).map(|(_, motion)| motion))
    }

    /// A joint's samples laid on the suspect by themselves, point to plane; where asked, they say how large the suspect is, too.
    fn settled(&self, joint: usize, motion: Motion, scale: f64, is_scaled: bool) -> (Motion, f64) {
        let finest = if is_scaled { NARROW } else { WIDE };
        let mut best = (motion, scale);
        let mut score = self.score(joint, &motion, scale, finest);
        let (mut now, mut size) = best;
        for round in 0..ALONE * (1 + usize::from(is_scaled)) {
            let tolerance = if round < ALONE { WIDE } else { finest };
            let Some(step) = self.step_alone(joint, &now, size, tolerance, 6 + usize::from(is_scaled)) else {
                break;
            };
            let [turn, shift] = [0, 3].map(|first| Vec3(std::array::from_fn(|axis| step[(first + axis, 0)])));
            now = now.turned(turn).shifted(shift);
            if is_scaled {
                size *= step[(6, 0)].clamp(-0.1, 0.1).exp();
            }
            let reached = self.score(joint, &now, size, finest);
            if reached > score {
                (best, score) = ((now, size), reached);
            }
        }
        best
    }

    /// The least squares of what a joint's samples leave, over a turn, a shift, and, with seven unknowns, the logarithm of the scale; none where nothing is near.
    fn step_alone(
        &self,
        joint: usize,
        motion: &Motion,
        scale: f64,
        tolerance: f64,
        unknowns: usize,
    ) -> Option<Mat<f64>> {
        let (mut normal, mut right) = (
            Mat::<f64>::zeros(unknowns, unknowns),
            Mat::<f64>::zeros(unknowns, 1),
        );
        let origin = motion.apply(Vec3::ZERO);
        for i in self.few_of(joint) {
            let sample = &self.skeleton.samples[i];
            let place = motion.apply(sample.row.x);
            let facing = motion.apply(sample.normal) - origin;
            let limit = tolerance * scale;
            let Some((across, rest, distance)) = self.near(place * scale, facing, limit) else {
                continue;
            };
            let weight = (1.0 - (distance / limit).powi(2)).max(0.0).powi(2);
            let Vec3([x, y, z]) = place.cross(across);
            let numbers = [x, y, z, across[0], across[1], across[2], across.dot(place)];
            let numbers: Vec<(usize, f64)> = numbers.into_iter().enumerate().take(unknowns).collect();
            add(&mut normal, &mut right, &numbers, rest / scale, weight);
        }
        solved(&normal, &right, HELD_ALONE)
    }

    fn few_of(&self, joint: usize) -> impl Iterator<Item = usize> + '_ {
        let own = &self.skeleton.core_of_joint[joint];
        own.iter().step_by((own.len() / A_FEW).max(1)).copied()
    }

    /// How much of a joint's samples lies on the suspect, 0 to 1; the nearer the more.
    fn score(&self, joint: usize, motion: &Motion, scale: f64, tolerance: f64) -> f64 {
        let origin = motion.apply(Vec3::ZERO);
        let limit = tolerance * scale;
        let (mut sum, mut count) = (0.0, 0.0);
        for i in self.few_of(joint) {
            let sample = &self.skeleton.samples[i];
            let place = motion.apply(sample.row.x) * scale;
            let facing = motion.apply(sample.normal) - origin;
            if let Some((_, _, distance)) = self.near(place, facing, limit) {
                sum += 1.0 - (distance / limit).powi(2);
            }
            count += 1.0;
        }
        sum / f64::max(count, 1.0)
    }

    /// As [`score`](Self::score), of a joint's samples where all joints take them.
    fn score_in(&self, pose: &Rigid, joint: usize, tolerance: f64) -> f64 {
        const STEP: f64 = 1e-4;
        let limit = tolerance * pose.scale();
        let own = &self.skeleton.of_joint[joint];
        let (mut sum, mut count) = (0.0, 0.0);
        for &i in own.iter().step_by((own.len() / A_FEW).max(1)) {
            let sample = &self.skeleton.samples[i];
            let place = pose.moved(&sample.row);
            let ahead = pose.moved(&sample.row.shifted(sample.normal * STEP));
            if let Some((_, _, distance)) = self.near(place, (ahead - place).unit(), limit) {
                sum += 1.0 - (distance / limit).powi(2);
            }
            count += 1.0;
        }
        sum / f64::max(count, 1.0)
    }

    /// How far samples are off, in diagonals, none more than the narrow tolerance.
    fn off(&self, pose: &Rigid, job: &Job) -> Result<f64, JobError> {
        const LIMIT: f64 = 0.002;
        let samples: Vec<usize> = (0..self.skeleton.samples.len()).collect();
        let matches = self.matches(pose, &samples, LIMIT, job)?;
        let limit = LIMIT * pose.scale();
        let near: f64 = matches.iter().map(|found| (found.distance / limit).powi(2)).sum();
        Ok(near + (samples.len() - matches.len()) as f64)
    }
}

/// Turns all around: axes evenly over the sphere (Fibonacci's lattice).
fn turns() -> Vec<Vec3> {
    const GOLDEN: f64 = 2.399_963_229_728_653;
    let axis = |i: usize| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / AXES as f64;
        let (radius, angle) = ((1.0 - z * z).sqrt(), GOLDEN * i as f64);
        Vec3([radius * angle.cos(), radius * angle.sin(), z])
    };
    let all = (0..AXES).flat_map(|i| ANGLES.map(|angle| axis(i) * angle.to_radians()));
    [Vec3::ZERO].into_iter().chain(all).collect()
}
