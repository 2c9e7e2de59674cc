//! What is known of a suspect at the vertices of a patch.

use mesh::Vec3;

use super::{fields::TESSELLATION_FIELDS, robust::first_weight};
use crate::mark::{BalancesOfPatch, Patch, PatchBasis, Registered};

/// One observation at a vertex of a patch: how far the suspect lies from it along a unit vector u, or one little longer.
#[derive(Clone, Copy)]
pub(super) struct Observation {
    /// Of the patch.
    pub(super) vertex: usize,
    /// u.
    pub(super) along: Vec3,
    /// u·d, in diagonals.
    pub(super) displacement: f64,
    /// What flat triangles alone do to u·d, what harmonics hold of that, and what they do where quadrics put their corners, in diagonals.
    pub(super) tessellation_bias: [f64; TESSELLATION_FIELDS],
    /// How little the latter is to be trusted, in diagonals.
    pub(super) misfit: f64,
    pub(super) kind: ObservationKind,
    /// The area that it stands for.
    pub(super) mass: f64,
    /// What its misfit says until the residuals are known; see [`reweight`](super::robust::reweight).
    pub(super) robust_weight: f64,
}

/// Observations of a kind have one distribution of noise.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum ObservationKind {
    /// Coordinates of vertices that were found again.
    X,
    Y,
    Z,
    /// Samples of the surface.
    Surface,
}

/// Less of a direction says nothing that the other two don't.
const LEAST_LEFT: f64 = 1e-3;

impl Observation {
    /// The same where nothing is seen along a unit vector, or 0: along what is left of its direction, and counting as much as that. None where nothing is left.
    pub(super) fn across(mut self, hidden: Vec3) -> Option<Self> {
        let left = self.along - hidden * hidden.dot(self.along);
        let share = left.norm() / self.along.norm();
        if share < LEAST_LEFT {
            return None;
        }
        self.along = left * (1.0 / share);
        self.displacement /= share;
        self.mass *= share * share;
        Some(self)
    }
}

impl ObservationKind {
    pub(super) const ALL: [Self; 4] = [Self::X, Self::Y, Self::Z, Self::Surface];

    /// The axes, with their directions.
    const AXES: [(Self, Vec3); 3] = [(Self::X, Vec3::X), (Self::Y, Vec3::Y), (Self::Z, Vec3::Z)];
}

/// All observations of a patch: three of a vertex that was found again, one where the surface was sampled, none elsewhere.
pub(super) fn observations(
    patch: &Patch,
    basis: &PatchBasis,
    suspect: &Registered,
    diagonal: f64,
) -> Vec<Observation> {
    let masses = basis.spectrum().mass();
    let mean_mass = masses.iter().sum::<f64>() / masses.len().max(1) as f64;
    let bias = patch.gather(&suspect.tessellation_bias);
    let held = held_by_harmonics(basis, &bias);
    let mut all = Vec::new();
    for (vertex, &v) in patch.vertices().iter().enumerate() {
        let Some(seen) = suspect.positions[v as usize] else {
            continue;
        };
        let displacement = Vec3(seen) - patch.mesh().point(vertex);
        let [alike, by_area] = suspect.quadric_bias[v as usize];
        let tessellation_bias = [bias[vertex], held[vertex], alike, by_area].map(|bias| bias / diagonal);
        let misfit = suspect.misfit[v as usize] / diagonal;
        let mut observe = |kind, along: Vec3, mass| {
            all.push(Observation {
                vertex,
                along,
                displacement: along.dot(displacement) / diagonal,
                tessellation_bias,
                misfit,
                kind,
                mass,
                robust_weight: first_weight(misfit),
            });
        };
        match suspect.along[v as usize] {
            Some(normal) => observe(ObservationKind::Surface, Vec3(normal), masses[vertex].max(0.0)),
            None => ObservationKind::AXES
                .into_iter()
                .for_each(|(kind, along)| observe(kind, along, mean_mass)),
        }
    }
    all
}

/// Three of each vertex of a decimated suspect, with noise of the same mean square.
pub(super) fn of_balances(balances: &BalancesOfPatch, diagonal: f64) -> Vec<Observation> {
    let equations = balances.equations().iter().enumerate();
    let equations = equations.filter_map(|(vertex, equations)| Some((vertex, (*equations)?)));
    let observed = equations.flat_map(|(vertex, equations)| {
        equations.along.map(|along| Observation {
            vertex,
            along,
            displacement: along.dot(equations.pull) / diagonal,
            tessellation_bias: [0.0; TESSELLATION_FIELDS],
            misfit: 0.0,
            kind: ObservationKind::Surface,
            mass: 1.0,
            robust_weight: 1.0,
        })
    });
    observed.collect()
}

/// The part of a scalar field over a patch that its harmonics span.
fn held_by_harmonics(basis: &PatchBasis, field: &[f64]) -> Vec<f64> {
    if field.iter().all(|&value| value == 0.0) {
        return field.to_vec();
    }
    let field: Vec<[f64; 3]> = field.iter().map(|&value| [value, 0.0, 0.0]).collect();
    let held = basis.inverse_transform(&basis.transform(&field));
    held.into_iter().map(|[value, ..]| value).collect()
}
