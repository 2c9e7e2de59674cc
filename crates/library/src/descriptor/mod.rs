//! Shapes in some bytes.

mod cloud;
mod grid;
mod harmonics;
mod local;
mod parts;

use mesh::TriMesh;

use crate::LibraryError;
use cloud::Cloud;
use harmonics::{PART, WHOLE, quantised};
pub(crate) use parts::{Cuttable, KEPT_LENGTH, PART_LENGTH, PARTS};

/// Bytes of the whole.
pub(crate) const WHOLE_LENGTH: usize = WHOLE.length();
/// Bytes of the small shapes.
pub(crate) const LOCAL_LENGTH: usize = local::LENGTH;

/// Every so many of the samples is enough for parts.
const PARTS_STEP: usize = 2;

/// What is kept of an original, by which it is found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Descriptor {
    pub(crate) whole: Vec<u8>,
    pub(crate) parts: Vec<u8>,
    pub(crate) local: Vec<u8>,
    /// Samples, to which planes are fitted.
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
    pub(crate) whole: Vec<u8>,
    pub(crate) part: Vec<u8>,
    pub(crate) local: Vec<u8>,
    pub(crate) fitted: Vec<f64>,
}

impl Descriptor {
    /// Describes an original: some 15 ms, and a microsecond a triangle.
    ///
    /// # Errors
    /// [`LibraryError::NoArea`].
    pub fn of(mesh: &TriMesh) -> Result<Self, LibraryError> {
        let cloud = Cloud::of(mesh)?;
        Ok(Self {
            whole: whole(&cloud),
            parts: parts::describe(&cloud.thinned(PARTS_STEP)),
            local: local::describe(&cloud).to_vec(),
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
        let cloud = Cloud::of(mesh)?;
        Ok(Self {
            whole: whole(&cloud),
            part: quantised(&PART.describe(&cloud.points, &cloud.weights)).collect(),
            local: local::describe(&cloud).to_vec(),
            fitted: parts::fitted(&cloud),
        })
    }

    /// How far the whole suspect is from an original: the mean absolute difference of their bytes.
    pub fn distance(&self, original: &Descriptor) -> f64 {
        f64::from(difference(&self.whole, &original.whole)) / WHOLE_LENGTH as f64
    }
}

fn whole(cloud: &Cloud) -> Vec<u8> {
    quantised(&WHOLE.describe(&cloud.points, &cloud.weights)).collect()
}

/// The sum of absolute differences of bytes.
#[inline]
pub(crate) fn difference(a: &[u8], b: &[u8]) -> u32 {
    a.iter().zip(b).map(|(&a, &b)| u32::from(a.abs_diff(b))).sum()
}
