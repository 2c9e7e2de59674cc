//! Reading a suspect all of whose vertices were found again.

use job::Job;
use mesh::Similarity;
use registration::{AlignOptions, Correspondence, PreparedMesh};

use super::{Reading, ReadingMethod, generalised, suspect::carried};
use crate::mark::{CoefficientDetector, MarkError, Registered};

/// A suspect under a map of its vertices, read by the paper's rule, which is cheap, or by the method's own detector.
pub(super) fn first_reading(
    suspect: &PreparedMesh,
    map: &Correspondence,
    method: &ReadingMethod,
    job: &Job,
) -> Result<Reading, MarkError> {
    let papers_rule = CoefficientDetector::new(method.layout());
    let detector = method.detector().unwrap_or(&papers_rule);
    let pose = generalised::fit(method.layout(), suspect, map, job)?;
    let registered = carried(map, suspect, &pose);
    let soft = detector.detect(&registered, job)?;
    Ok(Reading::new(method.layout(), &registered, pose, soft))
}

/// Reads by the joint estimate, in the pose that fits best.
pub(super) fn read_anew(
    suspect: &PreparedMesh,
    map: &Correspondence,
    method: &ReadingMethod,
    job: &Job,
) -> Result<Reading, MarkError> {
    let pose = generalised::fit(method.layout(), suspect, map, job)?;
    read_again(suspect, map, &pose, method, job)
}

/// Reads in a pose by the joint estimate, or by the method's detector in the pose that the joint estimate betters.
pub(super) fn read_again(
    suspect: &PreparedMesh,
    map: &Correspondence,
    pose: &Similarity,
    method: &ReadingMethod,
    job: &Job,
) -> Result<Reading, MarkError> {
    let seen = |pose: &Similarity| carried(map, suspect, pose);
    let mut registered = seen(pose);
    let estimate = method.estimator().estimate(&registered, job)?;
    let better = pose.then(&estimate.misalignment.inverse());
    let unbent = |mut registered: Registered| {
        if let Some(bending) = &estimate.bending {
            let places = registered.positions.iter_mut().flatten();
            places.for_each(|place| *place = bending.undone(*place));
        }
        registered
    };
    if method.detector().is_some() || estimate.bending.is_some() {
        registered = unbent(seen(&better));
    }
    let mut reading = Reading::of(method.layout(), &registered, better, &estimate);
    // Smoothing takes thin parts far away: what it would do to the original is no other shape.
    if reading.in_place < AlignOptions::default().least_overlap {
        let before = method
            .estimator()
            .unsmoothed(unbent(seen(&better)), &estimate, job)?;
        reading = reading.where_it_would_be(method.layout(), &before);
    }
    match method.detector() {
        None => Ok(reading),
        Some(detector) => Ok(reading.with_soft(detector.detect(&registered, job)?)),
    }
}
