//! Shapes in some bytes.

mod cloud;
mod grid;
mod harmonics;
mod local;
mod parts;

use mesh::TriMesh;

use crate::LibraryError;
use cloud::Cloud;
use harmonics::WHOLE;
pub(crate) use parts::{Cut, Cuttable, KEPT_LENGTH, PART_LENGTH, PARTS};

/// Bytes of the whole.
pub(crate) const WHOLE_LENGTH: usize = WHOLE.length();
/// Bytes of the small shapes.
pub(crate) const LOCAL_LENGTH: usize = local::LENGTH;

/// What is kept of an original, by which it is found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Descriptor {
    pub(crate) whole: [u8; WHOLE_LENGTH],
    pub(crate) local: [u8; LOCAL_LENGTH],
    /// [`PART_LENGTH`] bytes each.
    pub(crate) parts: Vec<u8>,
    /// Samples, which planes cut.
    pub(crate) samples: Vec<u8>,
}

/// What is asked of a suspect.
///
/// ```
/// use library::{Descriptor, Query};
/// let mesh = mesh::shapes::bumpy_torus(48, 24, 1);
/// let (original, suspect) = (Descriptor::of(&mesh)?, Query::of(&mesh::shapes::scaled(&mesh, 3.0))?);
/// assert!(suspect.distance(&original) < 2.0);
/// # Ok::<(), library::LibraryError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Query {
    pub(crate) whole: [u8; WHOLE_LENGTH],
    pub(crate) local: [u8; LOCAL_LENGTH],
    pub(crate) part: [u8; PART_LENGTH],
    pub(crate) fitted: Vec<f64>,
}

impl Descriptor {
    /// Describes an original.
    ///
    /// # Errors
    /// [`LibraryError::NoArea`].
    pub fn of(mesh: &TriMesh) -> Result<Self, LibraryError> {
        let cloud = Cloud::fine(mesh)?.evened();
        Ok(Self {
            whole: WHOLE.bytes(&cloud.points, &cloud.weights),
            local: local::describe(&cloud),
            parts: parts::describe(&cloud),
            samples: parts::kept(&cloud),
        })
    }
}

impl Query {
    /// Describes a suspect.
    ///
    /// # Errors
    /// [`LibraryError::NoArea`].
    pub fn of(mesh: &TriMesh) -> Result<Self, LibraryError> {
        let cloud = Cloud::fine(mesh)?.evened();
        Ok(Self {
            whole: WHOLE.bytes(&cloud.points, &cloud.weights),
            local: local::describe(&cloud),
            part: parts::as_part(&cloud),
            fitted: parts::fitted(&cloud),
        })
    }

    /// How far the whole suspect is from an original: the mean absolute difference of their bytes.
    pub fn distance(&self, original: &Descriptor) -> f64 {
        f64::from(difference(&self.whole, &original.whole)) / WHOLE_LENGTH as f64
    }
}

/// The sum of absolute differences of bytes.
#[inline]
pub(crate) fn difference<const N: usize>(a: &[u8; N], b: &[u8; N]) -> u32 {
    a.iter().zip(b).map(|(&a, &b)| u32::from(a.abs_diff(b))).sum()
}
