use std::sync::Arc;

use super::{MarkError, Settling};

/// A suspect brought onto an original, and sampled at the original's vertices; everything is in the original's order and frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Registered {
    /// Where the suspect passes each vertex of the original (#V); `None` where it has no surface.
    pub positions: Vec<Option<[f64; 3]>>,
    /// Where only the surface was found again, not the vertex: the vector u for which u·δ is known of a displacement δ (#V).
    /// A line along the normal n that meets a plane with normal f tells u = f / (f·n).
    pub along: Vec<Option<[f64; 3]>>,
    /// What u·δ would be if the suspect's vertices lay on the original: flat triangles cut the corners of a curved surface (#V). Zero
    /// where the vertex itself was found again.
    pub tessellation_bias: Vec<f64>,
    /// The same if the suspect's vertices lay where collapses of edges would have put them: by quadrics of planes that weigh alike, and by area (#V). Zero where
    /// the vertex itself was found again, and where the suspect is no coarser than the original.
    pub quadric_bias: Vec<[f64; 2]>,
    /// By how much the suspect's vertices around are off from there along the surface, in the original's unit: how little that bias is to be trusted (#V).
    /// Zero where it is.
    pub misfit: Vec<f64>,
    /// How the suspect's vertices follow a displacement of the original, if it was decimated.
    pub(crate) settling: Option<Arc<Settling>>,
    /// How many vertices the suspect has: no more samples than that are independent.
    pub suspect_vertices: usize,
}

impl Registered {
    /// A suspect whose vertices are known to correspond to the original's.
    pub fn by_vertices(positions: Vec<Option<[f64; 3]>>) -> Self {
        Self {
            along: vec![None; positions.len()],
            tessellation_bias: vec![0.0; positions.len()],
            quadric_bias: vec![[0.0; 2]; positions.len()],
            misfit: vec![0.0; positions.len()],
            settling: None,
            suspect_vertices: positions.len(),
            positions,
        }
    }

    /// How many samples there are to a vertex of the suspect; at least 1.
    pub(crate) fn redundancy(&self) -> f64 {
        let seen = self.positions.iter().flatten().count();
        (seen as f64 / self.suspect_vertices.max(1) as f64).max(1.0)
    }

    /// Whether there is one observation for each of so many vertices.
    ///
    /// # Errors
    /// [`MarkError::Vertices`] where there isn't.
    pub fn check(&self, vertices: usize) -> Result<(), MarkError> {
        let fields = [
            self.positions.len(),
            self.along.len(),
            self.tessellation_bias.len(),
            self.quadric_bias.len(),
            self.misfit.len(),
        ];
        match fields.into_iter().find(|&given| given != vertices) {
            Some(given) => Err(MarkError::Vertices { given, vertices }),
            None => Ok(()),
        }
    }

    /// The share of the original's vertices at which the suspect has no surface, from 0 to 1.
    pub fn missing(&self) -> f64 {
        let missing = self.positions.iter().filter(|seen| seen.is_none()).count();
        missing as f64 / self.positions.len().max(1) as f64
    }
}
