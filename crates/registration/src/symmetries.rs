//! Poses that an original's symmetries make of one that was found.
//!
//! An original is aligned with itself once. What fits as well as no motion at all is a symmetry, and products of symmetries
//! are symmetries. What fits nearly as well, as the left side of an animal on its right one, is a near symmetry: a part of
//! the shape may lie by it as well as by the true pose, and the search may have come upon the wrong one of the two. So
//! the poses that near symmetries make of the found one are refined on the suspect itself, and compared with it.

use std::mem;

use job::JobError;
use mesh::Similarity;

use crate::{
    alignment::Alignment,
    hypotheses,
    icp::Pairing,
    search::{COARSE, COARSE_RANKING, EQUIVALENT, FINE, KEPT, MEDIUM, Ranked, Search, poses},
};

/// Motions whose coarse score is less than this fraction of a perfect fit's are no near symmetries. From 0.4 to 0.95 all poses of
/// ten symmetric and other shapes are found, and from 0.6 to 0.9 all of six halves of nearly symmetric animals; the less it is
/// the longer it takes, at 0.4 1.5 times.
const NEAR: f64 = 0.8;

/// Symmetries that are told apart: those of a dodecahedron are 120, of which 64 leave out half.
const MOST_SYMMETRIES: usize = 128;

/// The motions that take an original onto itself, apart from none at all.
#[derive(Default)]
pub(crate) struct Symmetries {
    /// As well as none at all does.
    exact: Vec<Similarity>,
    /// Nearly as well.
    near: Vec<Similarity>,
}

impl Search<'_> {
    /// The symmetries of the original, the suspect being the original too: those that hypotheses lead to, and the products
    /// of the exact ones. None of a shape that slides on itself.
    pub(crate) fn symmetries(&self) -> Result<Symmetries, JobError> {
        if self.free_directions(&Similarity::IDENTITY)? > 0 {
            return Ok(Symmetries::default());
        }
        let mut hypotheses = hypotheses::principal_axes(self.original, self.suspect);
        if !hypotheses::axes_are_distinct(self.original) {
            hypotheses.extend(self.best_rotations()?);
        }
        let coarse = self.refined(hypotheses, COARSE, Pairing::Grid)?;
        let perfect = self.overlap(&Similarity::IDENTITY, COARSE_RANKING)?.score;
        let mut candidates = vec![Similarity::IDENTITY];
        for (score, motion) in self.ranked(coarse, COARSE_RANKING)? {
            if score >= NEAR * perfect && self.differs_from_all(&candidates, &motion) {
                candidates.push(motion);
            }
        }
        let candidates = candidates.split_off(1);
        let (mut exact, mut near) = (vec![Similarity::IDENTITY], Vec::new());
        for motion in self.refined(candidates, FINE[0], Pairing::Surfaces)? {
            if !self.add(&mut exact, motion)? && self.differs_from_all(&exact, &motion) {
                near.push(motion);
            }
        }
        self.close(&mut exact)?;
        Ok(Symmetries {
            exact: exact.split_off(1),
            near,
        })
    }

    /// Adds all products of motions.
    fn close(&self, group: &mut Vec<Similarity>) -> Result<(), JobError> {
        let mut done = 1;
        while done < group.len() && group.len() < MOST_SYMMETRIES {
            self.job.go_on()?;
            for other in 1..=done {
                let products = [group[done].then(&group[other]), group[other].then(&group[done])];
                for product in products {
                    self.add(group, product)?;
                }
            }
            done += 1;
        }
        group.truncate(MOST_SYMMETRIES);
        Ok(())
    }

    /// Adds a motion if it is new and fits about as well as the first; says whether it was added.
    fn add(&self, group: &mut Vec<Similarity>, motion: Similarity) -> Result<bool, JobError> {
        let score = |motion: &Similarity| Ok::<_, JobError>(self.overlap(motion, MEDIUM[1].samples)?.score);
        let added =
            self.differs_from_all(group, &motion) && score(&motion)? >= EQUIVALENT * score(&group[0])?;
        if added {
            group.push(motion);
        }
        Ok(added)
    }

    fn differs_from_all(&self, others: &[Similarity], pose: &Similarity) -> bool {
        others.iter().all(|other| self.differ(other, pose))
    }

    /// The found pose with those that fit as well because the original is symmetric, or nearly so; another in its place if
    /// that fits better.
    pub(crate) fn with_symmetries(
        &self,
        mut found: Alignment,
        symmetries: &Symmetries,
    ) -> Result<Alignment, JobError> {
        let score = |pose: &Similarity| Ok::<_, JobError>(self.overlap(pose, MEDIUM[1].samples)?.score);
        let near = self.near_poses(&found.transform, &symmetries.near)?;
        let mut others = mem::take(&mut found.alternatives);
        if let Some((better, pose)) = near.first()
            && score(&found.transform)? < EQUIVALENT * better
        {
            others.push(found.transform);
            found = self.judged(self.fine(*pose)?, found.matched_by)?;
        }
        let least = EQUIVALENT * score(&found.transform)?;
        // Exact to rounding where the original is, unlike the same pose found from another hypothesis.
        let composed = symmetries
            .exact
            .iter()
            .map(|symmetry| found.transform.then(symmetry));
        let mut fitting = vec![found.transform];
        for other in composed.chain(others).chain(poses(near)) {
            if self.differs_from_all(&fitting, &other) && score(&other)? >= least {
                fitting.push(other);
            }
        }
        found.alternatives = fitting.split_off(1);
        Ok(found)
    }

    /// The poses that near symmetries make of one, refined medium, if they score not much less on the suspect.
    fn near_poses(&self, pose: &Similarity, near: &[Similarity]) -> Result<Ranked, JobError> {
        if near.is_empty() {
            return Ok(Ranked::new());
        }
        let composed = near.iter().map(|motion| pose.then(motion)).collect();
        let by_grid = self.refined(composed, MEDIUM[0], Pairing::Grid)?;
        let mut by_grid = self.ranked(by_grid, COARSE_RANKING)?;
        let least = KEPT * self.overlap(pose, COARSE_RANKING)?.score;
        by_grid.retain(|(score, _)| *score >= least);
        let exact = self.refined(poses(by_grid), MEDIUM[1], Pairing::Surfaces)?;
        self.ranked(exact, MEDIUM[1].samples)
    }
}

#[cfg(test)]
mod tests {
    use std::iter;

    use job::Job;
    use mesh::{TriMesh, Vec3, Welded, shapes};

    use super::*;
    use crate::{AlignOptions, MatchedBy, PreparedMesh};

    /// A body with a head, a tail, legs, ears and flanks, left like right but for `uneven`: a walking animal. 10 242 vertices.
    fn animal(uneven: f64) -> TriMesh {
        let pairs = [
            ([0.45, 0.7, -0.75], 40.0, 0.9),
            ([0.45, -0.7, -0.75], 40.0, 0.95),
            ([0.35, 1.1, 0.55], 120.0, 0.3),
            ([0.8, 0.3, 0.3], 15.0, 0.15),
        ];
        let sides = pairs.into_iter().flat_map(|([x, y, z], sharpness, height)| {
            let left = ([-x, y * (1.0 + uneven), z], sharpness, height * (1.0 - uneven));
            [([x, y, z], sharpness, height), left]
        });
        let middle = [([0.0, 1.0, 0.3], 12.0, 0.6), ([0.0, -1.0, 0.4], 60.0, 0.4)];
        let bumps: Vec<_> = sides
            .chain(middle)
            .map(|(towards, sharpness, height)| (Vec3(towards).unit(), sharpness, height))
            .collect();
        let ball = shapes::flipped(&shapes::jittered(&shapes::icosphere(5), 0.15, 3), 3);
        let grown = (0..ball.vertex_count()).map(|v| {
            let u = ball.point(v).unit();
            let bump = |&(towards, sharpness, height): &(Vec3, f64, f64)| {
                height * (sharpness * (u.dot(towards) - 1.0)).exp()
            };
            let Vec3([x, y, z]) = u * (1.0 + bumps.iter().map(bump).sum::<f64>());
            [0.7 * x, 1.6 * y, 0.8 * z]
        });
        ball.with_positions(grown.collect()).expect("a valid mesh")
    }

    /// The half of a mesh where a coordinate is less than the original's centroid has it.
    fn half(mesh: &TriMesh, axis: usize) -> TriMesh {
        let middle = mesh.positions().iter().map(|p| p[axis]).sum::<f64>() / mesh.vertex_count() as f64;
        let is_left = |t: usize| mesh.corners(t).iter().all(|p| p[axis] < middle);
        let left = (0..mesh.triangle_count()).filter(|&t| is_left(t));
        let left: Vec<_> = left.map(|t| mesh.triangles()[t]).collect();
        let welded = Welded::new(mesh.positions(), &left).expect("half of the triangles");
        welded.into_mesh()
    }

    const MIRROR: Similarity = Similarity {
        rotation: [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        ..Similarity::IDENTITY
    };

    #[test]
    fn half_an_animal_that_was_found_on_the_other_side_is_brought_back_or_called_ambiguous() {
        let (options, job) = (AlignOptions::default(), Job::default());
        for uneven in [0.02, 0.08] {
            let whole = animal(uneven);
            let original = PreparedMesh::from(&whole);
            let original = original.sampled("original").expect("an animal has a skin");
            let itself = Search {
                original,
                suspect: original,
                options: &options,
                job: &job,
            };
            let symmetries = itself.symmetries().expect("nobody cancels");
            for axis in [0, 1, 2] {
                let suspect = PreparedMesh::from(shapes::jittered(&half(&whole, axis), 0.1, 7));
                let suspect = suspect.sampled("suspect").expect("half a skin");
                let search = Search { suspect, ..itself };
                let other_side = search
                    .fine(MIRROR)
                    .and_then(|pose| search.judged(pose, MatchedBy::Surface));
                let other_side = other_side.expect("nobody cancels");
                assert!(other_side.aligned && search.differ(&other_side.transform, &Similarity::IDENTITY));
                let found = search
                    .with_symmetries(other_side, &symmetries)
                    .expect("nobody cancels");
                let is_true = |pose: &Similarity| !search.differ(pose, &Similarity::IDENTITY);
                assert!(
                    iter::once(&found.transform)
                        .chain(&found.alternatives)
                        .any(is_true)
                );
                assert!(is_true(&found.transform) || found.ambiguous());
            }
        }
    }
}
