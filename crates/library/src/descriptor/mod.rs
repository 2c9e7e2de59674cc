//! Shapes in some bytes.

mod balls;
mod cloud;
mod grid;
mod harmonics;
mod local;
mod places;
mod regions;
mod smoothing;
mod stars;
mod surface;
mod words;

use job::Job;
use mesh::{Edges, LargeParts, TriMesh, Vec3, near_part};

use crate::LibraryError;
use cloud::Cloud;
pub(crate) use grid::Grid;
use harmonics::WHOLE;
pub(crate) use places::{Place, Sought, WORDS};
pub(crate) use stars::{SAME, STAR, STARS, Star};
pub(crate) use surface::{SURFACE_LENGTH, Surface};
pub(crate) use words::CODE;

/// Bytes of the whole.
pub(crate) const WHOLE_LENGTH: usize = WHOLE.length();
/// Bytes of the small shapes.
pub(crate) const LOCAL_LENGTH: usize = local::LENGTH;

/// What is kept of an original, by which it is found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Descriptor {
    pub(crate) summary: Summary,
    /// On which suspects are laid.
    pub(crate) surface: Vec<u8>,
}

/// What an index has of an original.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Summary {
    pub(crate) whole: [u8; WHOLE_LENGTH],
    /// Of what smoothing leaves.
    pub(crate) smooth: [u8; WHOLE_LENGTH],
    pub(crate) local: [u8; LOCAL_LENGTH],
    /// Of its places, each once.
    pub(crate) words: Vec<u16>,
    /// Vertices of its file.
    pub(crate) stars: Vec<Star>,
}

/// What is asked of a suspect.
///
/// ```
/// use job::Job;
/// use library::{Descriptor, Query};
/// let mesh = mesh::shapes::bumpy_torus(48, 24, 1);
/// let (original, suspect) = (Descriptor::of(&mesh)?, Query::of(&mesh::shapes::scaled(&mesh, 3.0), &Job::default())?);
/// assert!(suspect.distance(&original) < 2.0);
/// # Ok::<(), library::LibraryError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Query {
    pub(crate) whole: [u8; WHOLE_LENGTH],
    pub(crate) local: [u8; LOCAL_LENGTH],
    pub(crate) sizes: Vec<Sought>,
    pub(crate) stars: Vec<Star>,
    /// Large parts alone, where most of the surface is not their own: a floor may have been put under a copy, or it may stand among other models.
    pub(crate) alone: Vec<Query>,
}

impl Descriptor {
    /// Describes an original.
    ///
    /// # Errors
    /// [`LibraryError::NoArea`].
    pub fn of(mesh: &TriMesh) -> Result<Self, LibraryError> {
        let fine = Cloud::fine(mesh)?;
        let cloud = fine.evened();
        let fine = fine.in_roots();
        let places = places::of_original(&fine);
        let whole = WHOLE.bytes(&cloud.points, &cloud.weights);
        let smooth = match smoothing::smoothed(mesh).map(|smooth| Cloud::fine(&smooth)) {
            Some(Ok(smooth)) => {
                let smooth = smooth.evened();
                WHOLE.bytes(&smooth.points, &smooth.weights)
            }
            // It may have shrunk to nothing.
            _ => whole,
        };
        Ok(Self {
            surface: surface::pack(&fine, &places),
            summary: Summary {
                whole,
                smooth,
                local: local::describe(&cloud),
                words: places::words(&places),
                stars: stars::of_original(mesh),
            },
        })
    }
}

impl Query {
    /// Describes a suspect, without what is [far away](near_part) from all the rest.
    ///
    /// # Errors
    /// [`LibraryError::NoArea`], or that the job was cancelled.
    pub fn of(mesh: &TriMesh, job: &Job) -> Result<Self, LibraryError> {
        let near = near_part(mesh);
        let mesh = near.as_ref().unwrap_or(mesh);
        let is_outweighed = |part: &TriMesh| part.area() < 0.5 * mesh.area();
        let mut alone = Vec::new();
        for part in LargeParts::of(mesh).meshes().filter(is_outweighed) {
            match Self::of_all(&part, job) {
                Err(LibraryError::NoArea) => {}
                part => alone.push(part?),
            }
        }
        Ok(Self {
            alone,
            ..Self::of_all(mesh, job)?
        })
    }

    /// Describes all of a suspect.
    fn of_all(mesh: &TriMesh, job: &Job) -> Result<Self, LibraryError> {
        let of_samples = || -> Result<Self, LibraryError> {
            let fine = Cloud::fine(mesh)?;
            let cloud = fine.evened();
            let fine = fine.in_roots();
            let borders = places::borders(mesh, &Edges::of(mesh), &fine);
            Ok(Self {
                whole: WHOLE.bytes(&cloud.points, &cloud.weights),
                local: local::describe(&cloud),
                sizes: places::sought(&fine, &borders, job)?,
                stars: Vec::new(),
                alone: Vec::new(),
            })
        };
        let (query, stars) = job.join(of_samples, || stars::of_suspect(mesh))?;
        Ok(Self { stars, ..query? })
    }

    /// How far the whole suspect is from an original: the mean absolute difference of their bytes.
    pub fn distance(&self, original: &Descriptor) -> f64 {
        f64::from(self.distance_from_whole(&original.summary)) / WHOLE_LENGTH as f64
    }
}

impl Query {
    /// How far the whole is from an original, or from what smoothing leaves of it.
    pub(crate) fn distance_from_whole(&self, original: &Summary) -> u32 {
        difference(&self.whole, &original.whole).min(difference(&self.whole, &original.smooth))
    }
}

/// The sum of absolute differences of bytes.
#[inline]
pub(crate) fn difference<const N: usize>(a: &[u8; N], b: &[u8; N]) -> u32 {
    a.iter().zip(b).map(|(&a, &b)| u32::from(a.abs_diff(b))).sum()
}

/// Two directions across a third, and each other.
fn across(n: Vec3) -> [Vec3; 2] {
    let least = (0..3).fold(0, |least, axis| {
        if n.0[axis].abs() < n.0[least].abs() {
            axis
        } else {
            least
        }
    });
    let mut axis = Vec3::ZERO;
    axis[least] = 1.0;
    let a = n.cross(axis).unit();
    [a, n.cross(a)]
}
