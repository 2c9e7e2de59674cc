use mesh::Similarity;

use crate::{Correspondence, RegistrationError, error::check_option};

/// How to align.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignOptions {
    /// How near the surfaces must be to count as overlapping, as a fraction of the smaller bounding-box
    /// diagonal.
    pub tolerance: f64,
    /// The least share of the suspect's area that must overlap for the suspect to count as aligned.
    pub least_overlap: f64,
}

impl Default for AlignOptions {
    fn default() -> Self {
        Self {
            tolerance: 0.01,
            least_overlap: 0.8,
        }
    }
}

impl AlignOptions {
    pub(crate) fn check(&self) -> Result<(), RegistrationError> {
        let (tolerance, least) = (self.tolerance, self.least_overlap);
        let fits = tolerance > 0.0 && tolerance < 1.0;
        check_option("tolerance", tolerance, fits, "greater than 0 and less than 1")?;
        let fits = (0.0..=1.0).contains(&least);
        check_option("least_overlap", least, fits, "between 0 and 1")
    }
}

/// What the alignment rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum MatchedBy {
    /// All vertices of the original were found again.
    Connectivity,
    /// Part of the original's net was found again: at least a quarter of the vertices of the smaller mesh.
    Surroundings,
    /// The surfaces alone.
    Surface,
    /// The surfaces, from pairs of points that were given.
    Points,
    /// Its connected parts, each by itself.
    Parts,
    /// Its vertices, after the joints of the original's rig had moved them.
    Rig,
    /// Its surface, after the joints of the original's rig had moved it.
    RigSurface,
    /// Its vertices, each seen from its own surroundings, after something had bent or posed them.
    LocalFrames,
    /// Its surface, after something had bent or posed it.
    BentSurface,
}

impl MatchedBy {
    /// Whether the pose was undone in which the joints of the original's rig had put the suspect.
    pub fn is_by_rig(self) -> bool {
        matches!(self, Self::Rig | Self::RigSurface)
    }

    /// Whether the suspect was bent or posed, and looked at without that: no one transform takes it to the original.
    pub fn is_bent(self) -> bool {
        self.is_by_rig() || matches!(self, Self::LocalFrames | Self::BentSurface)
    }
}

/// Where the suspect belongs, and how well it fits there.
#[derive(Clone, Debug, PartialEq)]
pub struct Alignment {
    /// Takes the suspect to the original.
    pub transform: Similarity,
    /// What it rests on.
    pub matched_by: MatchedBy,
    /// Share of the suspect's area that lies on the original, 0 to 1.
    pub overlap: f64,
    /// Share of the original's area that lies on the suspect, 0 to 1.
    pub coverage: f64,
    /// Root mean square distance of the overlapping surface, as a fraction of the original's diagonal.
    pub residual: f64,
    /// Whether the overlap is large enough to call the suspect aligned. A plane never is when the surfaces
    /// alone speak for it, since it lies on any flat place.
    pub aligned: bool,
    /// The vertices that were found again, if any.
    pub correspondence: Option<Correspondence>,
    /// Other transforms that fit about as well: the shape is symmetric, or nearly so.
    pub alternatives: Vec<Similarity>,
    /// In how many of the seven directions (three of rotation, three of translation, one of scale) the
    /// surfaces slide on each other: 3 for a sphere, 1 for another surface of revolution, 4 for a plane. 0
    /// when vertices were found again.
    pub free_directions: usize,
}

impl Alignment {
    /// Whether the suspect is a mirrored copy: det R = −1. The transform mirrors it back.
    pub fn mirrored(&self) -> bool {
        self.transform.mirrors()
    }

    /// Whether other poses fit about as well: the [alternatives](Self::alternatives), or, when there are
    /// [free directions](Self::free_directions), infinitely many.
    pub fn ambiguous(&self) -> bool {
        self.free_directions > 0 || !self.alternatives.is_empty()
    }
}
