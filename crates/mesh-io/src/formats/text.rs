//! What the text formats have in common.

use std::ops::Range;

use super::geometry::{Geometry, fan};
use crate::error::{CUT_SHORT, Fault};
use crate::number;
use crate::scalar::Scalar;
use crate::slots::{Slots, directions::Directions, placement::Placement, text::TextSlots};
use crate::words::{Word, Words, not_a_number};

/// Gathers the vertices and triangles of a text file.
#[derive(Default)]
pub(crate) struct TextGeometry {
    positions: Vec<[f64; 3]>,
    starts: Vec<[usize; 3]>,
    triangles: Vec<[u32; 3]>,
    placed: Vec<(Range<usize>, Placement)>,
    /// Whether a coordinate has more digits than single precision.
    double: bool,
}

impl TextGeometry {
    pub(crate) fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// Takes a vertex's coordinates, x, y, z.
    pub(crate) fn push_vertex(&mut self, words: &Words<'_>, xyz: [Word<'_>; 3]) -> Result<(), Fault> {
        self.push_words(xyz).map_err(|word| not_a_number(words, word))
    }

    /// Takes a vertex's coordinates, or returns the one that is no number.
    pub(crate) fn push_words<'a>(&mut self, xyz: [Word<'a>; 3]) -> Result<(), Word<'a>> {
        let mut position = [0.0; 3];
        for (value, word) in position.iter_mut().zip(xyz) {
            *value = number::parse(word.text).ok_or(word)?;
            self.double = self.double || !number::fits_single(word.text, *value);
        }
        self.positions.push(position);
        self.starts.push(xyz.map(|word| word.start));
        Ok(())
    }

    /// Takes the next three words of the line as a vertex.
    pub(crate) fn read_vertex(&mut self, words: &mut Words<'_>) -> Result<(), Fault> {
        let mut next = || words.next_in_line();
        match (next(), next(), next()) {
            (Some(x), Some(y), Some(z)) => self.push_vertex(words, [x, y, z]),
            _ => Err(words.fault(format!(
                "vertex {} needs three coordinates{CUT_SHORT}",
                self.vertex_count()
            ))),
        }
    }

    /// Takes a polygon of at least three corners, as triangles that share its first one.
    pub(crate) fn push_polygon(&mut self, corners: &[u32]) {
        fan(corners, &mut self.triangles);
    }

    pub(crate) fn push_triangles(&mut self, triangles: impl IntoIterator<Item = [u32; 3]>) {
        self.triangles.extend(triangles);
    }

    /// Puts vertices where the file says that they are shown; each vertex once.
    pub(crate) fn place(&mut self, vertices: Range<usize>, placement: Placement) {
        for position in &mut self.positions[vertices.clone()] {
            *position = placement.apply(*position);
        }
        self.placed.push((vertices, placement));
    }

    /// The geometry, in the precision that the digits show.
    pub(crate) fn finish(self) -> Geometry {
        let precision = if self.double { Scalar::F64 } else { Scalar::F32 };
        self.finish_as([precision; 3])
    }

    /// What was taken as vertices, if they are normals.
    pub(crate) fn into_normals(self, of_vertices: bool) -> Option<Directions> {
        let is_empty = self.starts.is_empty();
        (!is_empty).then(|| self.finish().into_normals(of_vertices))
    }

    /// The geometry, in declared types.
    pub(crate) fn finish_as(mut self, types: [Scalar; 3]) -> Geometry {
        self.placed.sort_by_key(|(vertices, _)| vertices.start);
        Geometry {
            names: Vec::new(),
            instances: Vec::new(),
            manifests: 0,
            positions: self.positions,
            triangles: self.triangles,
            slots: Slots::Text(TextSlots {
                starts: self.starts,
                placed: self.placed,
                types,
            }),
        }
    }
}
