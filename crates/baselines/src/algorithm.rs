use std::fmt::Debug;

use job::Job;
use mesh::TriMesh;
use sigmark::mark::{JointEstimator, Patches, ReadingMethod, Registered, SoftBits};

use crate::{Adapted, AlgorithmId, BaselineError, DetectorId, Lbf, Mhb, Rbf};

/// What every algorithm is given: the same for all that are compared.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// The original.
    pub mesh: &'a TriMesh,
    /// Its patches. Algorithms that work on whole meshes do not look at them.
    pub patches: &'a Patches,
    /// l, the length of a signature.
    pub bits: usize,
}

/// Which mesh a suspect is aligned with and sampled on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// The original, which knows nothing of the signature.
    Original,
    /// The marked mesh. Samples along its normals bear the mark's own displacement across them, so that an unmarked suspect
    /// also shows the mark: no bound on false positives holds.
    Marked,
}

/// A watermark: how to prepare a mesh for it.
pub trait Algorithm: Debug + Send + Sync {
    /// What it is known by, whatever its parameters are.
    fn id(&self) -> AlgorithmId;

    /// All that its marks and readings depend on beside the subject, by name: with [`id`](Self::id) the key of finished work.
    fn parameters(&self) -> Vec<(&'static str, String)>;

    /// What a table's row is called.
    fn name(&self) -> String;

    /// What suspects are registered to.
    fn reference(&self) -> Reference;

    /// α of the paper's tables, where it has no unit and so fits any mesh.
    fn paper_alpha(&self) -> Option<f64> {
        None
    }

    /// Everything that depends on neither signature nor strength: nearly all of the time.
    ///
    /// # Errors
    /// When the patches are not the mesh's, or have no room for the signature, or a basis can't be computed; [`BaselineError::Job`].
    fn prepare(&self, subject: &Subject<'_>, job: &Job) -> Result<Box<dyn Prepared>, BaselineError>;
}

/// A mesh that signatures can be written into and read from.
pub trait Prepared: Debug + Send + Sync {
    /// n_p, how many patches carry the signature.
    fn patches(&self) -> usize;

    /// m, how many basis functions were computed for each patch.
    fn functions(&self) -> usize;

    /// The marked positions, #V: affine in α. At α = 0 they are what the algorithm leaves of an unmarked mesh.
    ///
    /// # Errors
    /// When there are not l bits, or α is negative or no number.
    fn embed(&self, bits: &[bool], alpha: f64, job: &Job) -> Result<Vec<[f64; 3]>, BaselineError>;

    /// The bits of a suspect, marked with strength α if it is, by the paper's rule.
    ///
    /// # Errors
    /// When there is not one observation a vertex of the original, or α is negative or no number; [`BaselineError::Job`].
    fn extract(&self, suspect: &Registered, alpha: f64, job: &Job) -> Result<SoftBits, BaselineError>;

    /// What else reads marks of strength α, by ids: from a suspect that was found, as `sigmark verify` does it.
    ///
    /// # Errors
    /// When α is negative or no number.
    fn methods(&self, _alpha: f64) -> Result<Vec<(DetectorId, ReadingMethod)>, BaselineError> {
        Ok(Vec::new())
    }
}

/// The algorithms that the reproduction runs: the paper's three, MHBs also read by least squares, then what the paper did not try.
/// `functions` is m for [`Lbf`].
pub fn entries(functions: usize) -> Vec<Box<dyn Algorithm>> {
    vec![
        Box::new(Mhb::default().method(DetectorId::LEAST_SQUARES, |layout| {
            ReadingMethod::joint(JointEstimator::new(layout).into())
        })),
        Box::new(Lbf::new(functions)),
        Box::new(Rbf::default()),
        Box::new(Lbf::new(functions).compensated()),
        Box::new(Adapted::laplacian()),
        Box::new(Adapted::radial()),
    ]
}

/// Whether α is one that a mark can have, or 0.
pub(crate) fn check_alpha(alpha: f64) -> Result<(), BaselineError> {
    if alpha >= 0.0 && alpha.is_finite() {
        return Ok(());
    }
    Err(BaselineError::Alpha { alpha })
}

/// Whether there are as many bits as were prepared for.
pub(crate) fn check_bits(given: usize, wanted: usize) -> Result<(), BaselineError> {
    if given == wanted {
        return Ok(());
    }
    Err(BaselineError::Bits { given, wanted })
}

/// Whether a field has one value a vertex.
pub(crate) fn check_vertices(given: usize, vertices: usize) -> Result<(), BaselineError> {
    if given == vertices {
        return Ok(());
    }
    Err(BaselineError::Vertices { given, vertices })
}
