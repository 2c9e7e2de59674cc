use std::ops::Range;
use std::sync::Arc;

use super::placement::Placement;
use super::replacement::{Refusal, axes_in_order, replacement};
use crate::error::{Fault, Place};
use crate::scalar::Scalar;
use crate::{number, words};

/// Coordinates that are written as decimals.
#[derive(Clone, Debug)]
pub(crate) struct TextSlots {
    /// First bytes of x, y and z of each vertex; vertices ascend, axes may stand in any order.
    pub(crate) starts: Vec<[usize; 3]>,
    /// Vertices that are shown elsewhere than where their numbers say; ranges ascend.
    pub(crate) placed: Vec<(Range<usize>, Placement)>,
    /// What x, y and z are rounded to: decimals have a type, too.
    pub(crate) types: [Scalar; 3],
}

impl TextSlots {
    pub(super) fn positions(&self, bytes: &[u8]) -> impl Iterator<Item = [f64; 3]> {
        self.starts.iter().enumerate().map(move |(vertex, starts)| {
            let own = starts.map(|start| number_at(bytes, start));
            self.placement(vertex)
                .map_or(own, |placement| placement.apply(own))
        })
    }

    fn placement(&self, vertex: usize) -> Option<&Placement> {
        let at = self
            .placed
            .partition_point(|(vertices, _)| vertices.end <= vertex);
        let (vertices, placement) = self.placed.get(at)?;
        vertices.contains(&vertex).then_some(placement)
    }

    /// What a vertex's own numbers have to be so that it is shown at `position`; `None` if it is.
    fn own(&self, bytes: &[u8], vertex: usize, position: [f64; 3]) -> Option<[f64; 3]> {
        let Some(placement) = self.placement(vertex) else {
            return Some(position);
        };
        let held = placement.apply(self.starts[vertex].map(|start| number_at(bytes, start)));
        (held != position).then(|| placement.undo(position))
    }

    pub(super) fn place(&self, bytes: &[u8], vertex: usize, axis: usize) -> Place {
        Fault::at_line(bytes, self.starts[vertex][axis], "").place
    }

    /// Splices new decimals into the text; returns where all stand then.
    pub(super) fn rewrite(
        &self,
        bytes: &mut Arc<Vec<u8>>,
        target: impl Fn(usize) -> Option<[f64; 3]>,
    ) -> Result<Self, Refusal> {
        let mut splice = Splice {
            old: bytes,
            copied: 0,
            new: Vec::with_capacity(bytes.len() + bytes.len() / 16),
            changed: false,
        };
        let mut starts = self.starts.clone();
        for (vertex, starts) in starts.iter_mut().enumerate() {
            let target = target(vertex).and_then(|position| self.own(bytes, vertex, position));
            for axis in axes_in_order(*starts) {
                let start = starts[axis];
                starts[axis] = splice.copy_to(start);
                let Some(value) = target.map(|position| position[axis]) else {
                    continue;
                };
                let number = replacement(number_at(bytes, start), value, self.types[axis]);
                let number = number.map_err(|problem| Refusal {
                    file_vertex: vertex,
                    value,
                    problem,
                })?;
                if let Some(number) = number {
                    splice.replace(number, self.types[axis]);
                }
            }
        }
        splice.copy_to(bytes.len());
        if splice.changed {
            *bytes = Arc::new(splice.new);
        }
        Ok(Self {
            starts,
            ..self.clone()
        })
    }
}

fn number_at(bytes: &[u8], start: usize) -> f64 {
    number::parse(words::number_at(bytes, start)).expect("slots point at numbers that were read before")
}

/// New bytes that follow the old ones but for some numbers.
struct Splice<'a> {
    old: &'a [u8],
    copied: usize,
    new: Vec<u8>,
    changed: bool,
}

impl Splice<'_> {
    /// Copies the old bytes before `at`; returns where `at` has come to lie.
    fn copy_to(&mut self, at: usize) -> usize {
        self.new.extend_from_slice(&self.old[self.copied..at]);
        self.copied = at;
        self.new.len()
    }

    /// Writes a number in the place of the one that comes next.
    fn replace(&mut self, number: f64, kind: Scalar) {
        match kind {
            Scalar::F32 => number::write_single(number as f32, &mut self.new),
            _ => number::write_double(number, &mut self.new),
        }
        self.copied += words::number_at(self.old, self.copied).len();
        self.changed = true;
    }
}
