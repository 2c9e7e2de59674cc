//! What each part of the reader is worth: the same marks, read by ever better readers, all patches in one look.

use anyhow::Result;
use baselines::DetectorId;
use job::Job;
use mesh::{Similarity, TriMesh};
use registration::PreparedMesh;
use sigmark::{
    claim::statistics::margin,
    mark::{CoefficientDetector, Detector, JointEstimator, JointModel, ReadingMethod, SoftBits, Suspect},
};

use super::{Step, product::rate};
use crate::reading::Finder;

/// A reader: what it is known by, and in words what it has that the one before has not.
pub(crate) struct Reader {
    pub(crate) id: DetectorId,
    pub(crate) adds: &'static str,
    by: By,
}

enum By {
    /// The paper's, of the surface along normals wherever vertices are.
    PaperAlongNormals,
    /// The paper's, at vertices where they were found again.
    Paper,
    Joint(JointModel),
}

const fn reader(id: &'static str, adds: &'static str, by: By) -> Reader {
    Reader {
        id: DetectorId::new(id),
        adds,
        by,
    }
}

/// The worst first.
pub(crate) static READERS: [Reader; 6] = [
    reader(
        "step-normals",
        "the paper's rule, along normals",
        By::PaperAlongNormals,
    ),
    reader("step-vertices", "+ vertices that are found again", By::Paper),
    reader(
        "step-least-squares",
        "+ least squares",
        By::Joint(JointModel::Bits),
    ),
    reader(
        "step-interference",
        "+ misalignment, smoothing, flat triangles",
        By::Joint(JointModel::Interference),
    ),
    reader("step-shape", "+ quadrics, bending", By::Joint(JointModel::Shape)),
    reader(
        "step-noise",
        "+ weights by noise, gains by frequency",
        By::Joint(JointModel::Noise),
    ),
];

/// What all of them read of a suspect that may have this mark, in the pose of the registration, which joint estimates better as they can.
pub(super) fn read(mark: &sigmark::Signed, original: &PreparedMesh, suspect: &TriMesh) -> Result<Vec<Step>> {
    let finder = Finder::new(original.clone())?;
    let found = finder.find(suspect)?;
    let (along_normals, pose) = (finder.surface(&found), found.alignment.transform);
    let bits = mark.certificate().bits();
    let readers = READERS.iter().map(|reader| {
        let soft = match &reader.by {
            By::PaperAlongNormals => by_papers_rule(mark, &along_normals, &pose),
            By::Paper => by_papers_rule(mark, &found.suspect, &pose),
            By::Joint(model) => jointly(mark, *model, &found.suspect, &pose),
        }?;
        Ok(Step {
            reader: reader.id.clone(),
            rate: rate(&bits, &soft),
            margin: margin(&bits, &soft.weights()),
        })
    });
    readers.collect()
}

fn by_papers_rule(mark: &sigmark::Signed, suspect: &Suspect, pose: &Similarity) -> Result<SoftBits> {
    let job = Job::default();
    let sampled = suspect.sample_positions(pose, &job)?;
    Ok(CoefficientDetector::new(mark.layout()).detect(&sampled, &job)?)
}

fn jointly(
    mark: &sigmark::Signed,
    model: JointModel,
    suspect: &Suspect,
    pose: &Similarity,
) -> Result<SoftBits> {
    let estimator = JointEstimator::new(mark.layout()).with_model(model);
    let method = ReadingMethod::joint(estimator.into());
    Ok(suspect.read(&method, pose, &Job::default())?.soft)
}
