//! What is compared, as a study sees it: a way to mark meshes, and to judge suspects.

use anyhow::Result;
use baselines::AlgorithmId;
use job::Job;
use mesh::{Similarity, TriMesh};
use serde_json::Value;

use super::{Cell, Scene, Signed};

/// A way to mark meshes and to read them.
pub(crate) trait Marking: Sync {
    fn id(&self) -> AlgorithmId;

    /// For people.
    fn name(&self) -> String;

    /// All that its marks and readings depend on beside mesh and signatures: what finished work knows it by.
    fn key(&self) -> Value;

    /// α of the paper's tables, where it has no unit and so fits any mesh.
    fn paper_alpha(&self) -> Option<f64>;

    /// Computes what does not depend on the signature.
    fn prepare(&self, scene: &Scene<'_>, job: &Job) -> Result<Box<dyn Ready>>;
}

/// What was prepared for one mesh.
pub(crate) trait Ready: Send + Sync {
    /// n_p.
    fn patches(&self) -> usize;

    /// m, of the patch that has most.
    fn functions(&self) -> usize;

    /// The marked positions, #V: nearly affine in α.
    fn positions(&self, signed: &Signed, alpha: f64, job: &Job) -> Result<Vec<[f64; 3]>>;

    /// Who reads suspects as if they had this mark.
    fn judge<'a>(
        &'a self,
        scene: &'a Scene<'a>,
        signed: &'a Signed,
        alpha: f64,
    ) -> Result<Box<dyn Judge + 'a>>;
}

/// Reads suspects, of which it knows no pose, and judges what it read.
pub(crate) trait Judge: Sync {
    fn judged(&self, suspect: Attacked) -> Result<Cell>;
}

/// A mesh after an attack, moved to where nobody knows.
pub(crate) struct Attacked {
    pub(crate) mesh: TriMesh,
    /// What takes it back, where that is known: to explain what was lost, never to find it.
    pub(crate) true_pose: Option<Similarity>,
    /// What the attack said of itself.
    pub(crate) report: Value,
    pub(crate) seconds: f64,
    /// Whether plainer readers are asked, too.
    pub(crate) by_steps: bool,
}
