//! Reading a suspect all of whose vertices were found again.

use job::Job;
use mesh::Similarity;
use registration::{Correspondence, PreparedMesh};

use super::{Reading, ReadingMethod, generalised, suspect::carried};
use crate::mark::{CoefficientDetector, MarkError, Registered, SoftBits};

/// The pose of a suspect under a map of its vertices, and a look by the paper's rule, which is cheap, or by the method's own detector.
pub(super) fn first_look(
    suspect: &PreparedMesh,
    map: &Correspondence,
    method: &ReadingMethod,
    job: &Job,
) -> Result<(Similarity, SoftBits), MarkError> {
    let papers_rule = CoefficientDetector::new(method.layout());
    let detector = method.detector().unwrap_or(&papers_rule);
    let pose = generalised::fit(method.layout(), suspect, map, job)?;
    let soft = detector.detect(&carried(map, suspect, &pose), job)?;
    Ok((pose, soft))
}

/// What was read at a first look, with what it was read from.
pub(super) fn reading(
    original: &PreparedMesh,
    suspect: &PreparedMesh,
    map: &Correspondence,
    pose: &Similarity,
    soft: &SoftBits,
) -> Reading {
    let registered = carried(map, suspect, pose);
    Reading::new(original.mesh(), registered, *pose, soft.clone(), None)
}

/// Reads by the joint estimate, or by the method's detector in the pose that the joint estimate betters.
pub(super) fn read_again(
    original: &PreparedMesh,
    first: &Reading,
    method: &ReadingMethod,
    job: &Job,
) -> Result<Reading, MarkError> {
    let estimate = method.estimator().estimate(&first.registered, job)?;
    let better = first.transform.then(&estimate.misalignment.inverse());
    let model = Some(estimate.attack_model);
    let (registered, soft) = match method.detector() {
        None => (first.registered.clone(), estimate.bits),
        Some(detector) => {
            let moved = moved(&first.registered, &first.transform.inverse().then(&better));
            let soft = detector.detect(&moved, job)?;
            (moved, soft)
        }
    };
    Ok(Reading::new(original.mesh(), registered, better, soft, model))
}

/// Vertices that were registered in one pose, in another.
fn moved(registered: &Registered, by: &Similarity) -> Registered {
    let positions = registered.positions.iter();
    Registered::by_vertices(positions.map(|p| p.map(|p| by.apply(p))).collect())
}
