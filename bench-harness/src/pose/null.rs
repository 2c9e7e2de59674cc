//! Copies that nobody marked, posed, and asked for many words that are in no mesh.

use std::path::Path;

use anyhow::Result;
use job::Job;
use mesh::{Rig, TriMesh};
use mesh_io::Asset;
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sigmark::{
    claim::statistics::p_of_chosen,
    mark::{Found, JointEstimator, ReadingMethod},
};

use super::{
    blender::Blender,
    models::{Model, OWN_RIG, Pose},
    reading::{Signed, job},
    skinning,
};

/// Probabilities at which p-values are counted.
pub(super) const LEVELS: [f64; 4] = [0.1, 0.01, 1e-3, 1e-4];

/// Of each model so many poses are asked.
const POSES: usize = 3;

/// A posed copy without a mark.
#[derive(Serialize, Deserialize)]
pub(super) struct NullCopy {
    pub(super) pose: String,
    /// Of how many readings the best was chosen, by all ways; those of its own way are counted in p.
    pub(super) readings: usize,
    pub(super) trials: usize,
    /// How many p-values were at most each of [`LEVELS`], and the smallest.
    pub(super) below: [usize; 4],
    pub(super) least: f64,
}

/// Of the poses that Blender makes, those that are asked.
fn poses(model: &Model) -> Vec<Pose> {
    let by_blender = model.poses(&[], 1).filter(|pose| pose.group == OWN_RIG);
    by_blender.take(POSES).collect()
}

/// How many copies there are where none failed.
pub(super) fn count(model: &Model, signed: &Signed) -> usize {
    signed.rig().map_or(0, |_| 1 + poses(model).len())
}

/// Asks posed copies of the original, which bears no mark; those that could not be made are left out.
pub(super) fn of(
    model: &Model,
    original: &Path,
    signed: &Signed,
    blender: &Blender,
    trials: usize,
) -> Result<Vec<NullCopy>> {
    let Some(rig) = signed.rig() else {
        return Ok(Vec::new());
    };
    let asset = Asset::open(original)?;
    let poses = poses(model);
    let mut suspects = vec![(
        "our skinning".to_string(),
        skinning::posed(asset.mesh(), rig, 45.0, 9, None)?,
    )];
    for (pose, file) in poses.iter().zip(blender.pose(original, &poses)?) {
        if let Some(file) = file {
            suspects.push((pose.to_string(), Asset::open(file)?.mesh().clone()));
        }
    }
    let asked = (0..).zip(suspects);
    asked
        .map(|(number, (pose, suspect))| {
            let copy = asked_of(&suspect, rig, signed, (pose, number), trials)?;
            println!("{}: {}", model.name, serde_json::to_string(&copy)?);
            Ok(copy)
        })
        .collect()
}

/// As the verifier judges what has no parts: by any way the best of its readings, times the number of ways, whether or not they are taken.
fn asked_of(
    suspect: &TriMesh,
    rig: &Rig,
    signed: &Signed,
    (pose, number): (String, u64),
    trials: usize,
) -> Result<NullCopy> {
    let layout = signed.signed().layout();
    let method = ReadingMethod::joint(JointEstimator::new(layout).into());
    let found = signed.reader().find(suspect, &job())?;
    let unposed = found.unposed(rig, &job())?;
    let bent = found.in_local_frames(layout, &job())?;
    let unbent = found.unbent(&job())?;
    let lies = |found: &&Found| found.alignment().is_none_or(|alignment| alignment.aligned);
    let count = 2.0 + f64::from(u8::from(bent.is_some() || found.may_be_bent()));
    let ways = [Some(&found), unposed.as_ref(), bent.as_ref(), unbent.as_ref()].map(|way| way.filter(lies));
    let readings = ways
        .into_iter()
        .flatten()
        .map(|found| found.readings(&method, &job()))
        .collect::<Result<Vec<_>, _>>()?;
    let p_of = |trial: usize| -> Result<(f64, usize)> {
        let mut rng = ChaCha20Rng::seed_from_u64(number << 40 | trial as u64);
        let expected: Vec<bool> = (0..layout.bits()).map(|_| rng.next_u32() & 1 == 1).collect();
        let (mut p, mut tries) = (1.0f64, 0);
        for readings in &readings {
            let reading = readings.best(&expected, &Job::default())?;
            tries += reading.tries;
            p = p.min(count * p_of_chosen(&expected, &reading));
        }
        Ok((p, tries))
    };
    let asked: Result<Vec<(f64, usize)>> = (0..trials).into_par_iter().map(p_of).collect();
    let asked = asked?;
    Ok(NullCopy {
        pose,
        readings: asked.first().map_or(0, |&(_, tries)| tries),
        trials,
        below: LEVELS.map(|level| asked.iter().filter(|&&(p, _)| p <= level).count()),
        least: asked.iter().map(|&(p, _)| p).fold(1.0, f64::min),
    })
}
