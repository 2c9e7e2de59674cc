//! Reading a suspect all of whose vertices were found again.

use job::Job;
use mesh::Similarity;
use registration::{Correspondence, PreparedMesh};

use super::{Choice, Reading, ReadingMethod, generalised, suspect::carried};
use crate::mark::{CoefficientDetector, MarkError, MarkStage, Registered};

/// Reads the suspect by each of the maps, and once more by the best of them where that misreads a bit.
pub(super) fn read(
    original: &PreparedMesh,
    suspect: &PreparedMesh,
    maps: &[Correspondence],
    method: &ReadingMethod,
    expected: &[bool],
    job: &Job,
) -> Result<Reading, MarkError> {
    job.begin(MarkStage::Detection)?;
    let papers_rule = CoefficientDetector::new(method.layout());
    let detector = method.detector().unwrap_or(&papers_rule);
    let mut choice = Choice::new(expected);
    for map in maps {
        let pose = generalised::fit(method.layout(), suspect, map, job)?;
        let registered = carried(map, suspect, &pose);
        let soft = detector.detect(&registered, job)?;
        choice.offer(Reading::new(original.mesh(), registered, pose, soft, None));
    }
    let Some(first) = choice.misread() else {
        return choice.best(maps.len());
    };
    let again = read_again(original, first, method, job)?;
    choice.offer(again);
    // Any map might have been the one that is read twice.
    choice.best(2 * maps.len())
}

/// Reads by the joint estimate, or by the method's detector in the pose that the joint estimate betters.
fn read_again(
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
