//! Numbers that are no positions and yet turn with the mesh: normals, tangents, the offsets of morph targets.
//!
//! A mesh that moves by p ↦ s R p + t keeps its look if its normals and tangents go to R n and R t, also where R mirrors: a normal goes on
//! pointing to the side of the surface to which it pointed. Bitangents are w n × t in glTF, and R n × R t is det R · R (n × t), so that the
//! sign w changes where R mirrors. Offsets of positions go to s R d, those of normals and tangents to R d.
//!
//! Where a scene places the mesh by a linear map A, the file's own numbers are those of the scene undone: n ↦ Aᵀ R A⁻ᵀ n,
//! t ↦ A⁻¹ R A t, d ↦ A⁻¹ s R A d. Normals and tangents keep the length that they have in the file, which is 1 in most.

use mesh::Similarity;

use super::Slots;
use super::placement::Placement;
use crate::buffer::Buffer;

/// What numbers mean, and so what becomes of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Role {
    Normal,
    Tangent,
    /// The sign w of a tangent: one number, which its slot has three times.
    Handedness,
    /// By how much a morph target moves a vertex.
    PositionOffset,
    NormalOffset,
    TangentOffset,
}

/// Numbers of one role that lie together.
#[derive(Clone, Debug)]
pub(crate) struct Directions {
    pub(crate) slots: Slots,
    pub(crate) role: Role,
    /// Where the scene puts the vertices to which they belong.
    pub(crate) placement: Option<Placement>,
    /// Whether the i-th belongs to the file's i-th vertex, and so stays where that does.
    pub(crate) of_vertices: bool,
    /// For messages.
    pub(crate) what: String,
}

/// What was found in a file.
#[derive(Debug, Default)]
pub(crate) struct Found {
    /// In the order in which they lie in a text.
    pub(crate) lists: Vec<Directions>,
    pub(crate) left: Vec<Unturned>,
}

/// Something in a file that has to do with directions, and was left as it is when the mesh was moved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unturned {
    /// What it is, such as `the normals (accessor 3)`.
    pub what: String,
    /// Why it could not be turned.
    pub why: String,
}

impl Unturned {
    pub(crate) fn new(what: impl Into<String>, why: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            why: why.into(),
        }
    }
}

impl std::fmt::Display for Unturned {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({})", self.what, self.why)
    }
}

const STRETCHED: &str = "a node stretches the mesh more along one axis than along another";

impl Directions {
    /// Turns all that belong to vertices that move; or none, and says why. Zeros and what is not finite stay.
    pub(crate) fn turn(
        &self,
        buffers: &mut [Buffer],
        by: &Similarity,
        is_moved: impl Fn(usize) -> bool,
    ) -> Result<(), &'static str> {
        let is_stretched = self.placement.is_some_and(|placement| !placement.keeps_angles());
        if is_stretched && matches!(self.role, Role::NormalOffset | Role::TangentOffset) {
            return Err(STRETCHED);
        }
        let held = self.slots.positions(buffers);
        let is_plain = |vector: &[f64; 3]| vector.iter().all(|x| x.is_finite()) && *vector != [0.0; 3];
        let target = |i: usize| {
            let turns = is_plain(&held[i]) && (!self.of_vertices || is_moved(i));
            turns.then(|| self.turned(held[i], by)).filter(is_plain)
        };
        self.slots.overwrite(buffers, &target)
    }

    fn turned(&self, vector: [f64; 3], by: &Similarity) -> [f64; 3] {
        let turned = |vector: [f64; 3]| by.rotation.map(|row| (0..3).map(|i| row[i] * vector[i]).sum());
        let as_vector = |vector| match &self.placement {
            Some(placement) => placement.undo_vector(turned(placement.apply_vector(vector))),
            None => turned(vector),
        };
        let as_normal = |vector| match &self.placement {
            Some(placement) => placement.undo_normal(turned(placement.apply_normal(vector))),
            None => turned(vector),
        };
        let new = match self.role {
            Role::Normal => self.as_long_as(vector, as_normal(vector)),
            Role::Tangent => self.as_long_as(vector, as_vector(vector)),
            Role::Handedness if by.mirrors() => vector.map(|w| -w),
            Role::Handedness => vector,
            Role::PositionOffset => as_vector(vector).map(|x| by.scale * x),
            Role::NormalOffset => as_normal(vector),
            Role::TangentOffset => as_vector(vector),
        };
        // No minus before a zero.
        new.map(|x| x + 0.0)
    }

    /// A direction with the length that another has: of normalised integers at most 1, which is all that they can hold along an axis.
    fn as_long_as(&self, old: [f64; 3], new: [f64; 3]) -> [f64; 3] {
        let length = |vector: [f64; 3]| vector.iter().map(|x| x * x).sum::<f64>().sqrt();
        let wanted = match self.slots.is_normalised() {
            true => length(old).min(1.0),
            false => length(old),
        };
        let factor = wanted / length(new);
        // Unless it has that length but for rounding: what is not turned at all keeps its digits.
        match (factor - 1.0).abs() < 1e-12 {
            true => new,
            false => new.map(|x| x * factor),
        }
    }
}
