use std::sync::Arc;

use super::placement::Placement;
use super::replacement::{Refusal, axes_in_order, replacement};
use crate::scalar::{Endian, Scalar};

/// Vertices whose coordinates are binary numbers of one kind, in records of equal size: one vertex a record in most formats,
/// three in STL. Where records differ in size, all vertices are one record.
#[derive(Clone, Debug)]
pub(crate) struct BinaryRun {
    /// Which buffer.
    pub(crate) buffer: usize,
    /// First byte of the first record.
    pub(crate) start: usize,
    /// Bytes from one record to the next.
    pub(crate) stride: usize,
    /// First bytes of x, y and z within a record, for each of its vertices.
    pub(crate) vertices: Vec<[usize; 3]>,
    /// How many vertices there are in all.
    pub(crate) count: usize,
    /// The types of x, y and z.
    pub(crate) types: [Scalar; 3],
    pub(crate) endian: Endian,
    /// How integers stand for coordinates that are none.
    pub(crate) quantisation: Option<Quantisation>,
    /// Where the scene puts these vertices, if not where the numbers say.
    pub(crate) placement: Option<Placement>,
    /// Why these numbers can't be changed, if they can't.
    pub(crate) locked: Option<&'static str>,
}

/// A coordinate is offset + scale · q for the integer q that the file holds; q is divided by the greatest number of its type if
/// it is `normalised`, and is then at least −1 (glTF's `KHR_mesh_quantization`).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quantisation {
    pub(crate) scale: [f64; 3],
    pub(crate) offset: [f64; 3],
    pub(crate) normalised: bool,
}

/// A number that is to be written.
#[derive(Clone, Copy)]
struct Change {
    axis: usize,
    /// Its first byte.
    at: usize,
    number: f64,
}

/// Quantised models fill their box: what would leave it by less than this share of its size stays on its face.
const ON_THE_BOX: f64 = 0.01;

const BEYOND: &str = "the file holds quantised coordinates, and this one lies beyond the largest: quantise the model anew, with a box that has room for it";

impl BinaryRun {
    /// First bytes of x, y and z of a vertex of this run.
    pub(super) fn place(&self, vertex: usize) -> [usize; 3] {
        let (record, within) = (vertex / self.vertices.len(), vertex % self.vertices.len());
        self.vertices[within].map(|offset| self.start + record * self.stride + offset)
    }

    pub(super) fn positions(&self, bytes: &[u8]) -> impl Iterator<Item = [f64; 3]> {
        (0..self.count).map(move |vertex| self.position(bytes, vertex))
    }

    fn position(&self, bytes: &[u8], vertex: usize) -> [f64; 3] {
        let place = self.place(vertex);
        let own = std::array::from_fn(|axis| self.value(self.number_at(bytes, place[axis], axis), axis));
        self.placement.map_or(own, |placement| placement.apply(own))
    }

    /// Overwrites the numbers for which `target` gives others. `first` is the number of this run's first vertex in the file.
    pub(super) fn rewrite(
        &self,
        bytes: &mut Arc<Vec<u8>>,
        first: usize,
        target: &impl Fn(usize) -> Option<[f64; 3]>,
    ) -> Result<(), Refusal> {
        for vertex in 0..self.count {
            let Some(position) = target(first + vertex) else {
                continue;
            };
            let changes = self.changes(bytes, vertex, position);
            let changes = changes.map_err(|(axis, problem)| Refusal {
                file_vertex: first + vertex,
                value: position[axis],
                problem,
            })?;
            for Change { axis, at, number } in changes.into_iter().flatten() {
                // Copied at the first change; from then on the bytes are ours alone.
                let bytes: &mut Vec<u8> = Arc::make_mut(bytes);
                self.types[axis].write(number, bytes, at, self.endian);
            }
        }
        Ok(())
    }

    /// Whether [`Self::rewrite`] would succeed; if not, why.
    pub(super) fn check(
        &self,
        bytes: &[u8],
        target: &impl Fn(usize) -> Option<[f64; 3]>,
    ) -> Result<(), &'static str> {
        let targets = (0..self.count).filter_map(|vertex| Some((vertex, target(vertex)?)));
        for (vertex, position) in targets {
            self.changes(bytes, vertex, position)
                .map_err(|(_, problem)| problem)?;
        }
        Ok(())
    }

    /// What to write so that a vertex lies at `position`; or the axis that can't be changed, and why.
    fn changes(
        &self,
        bytes: &[u8],
        vertex: usize,
        position: [f64; 3],
    ) -> Result<[Option<Change>; 3], (usize, &'static str)> {
        let mut changes = [None; 3];
        let held = self.position(bytes, vertex);
        if held == position {
            return Ok(changes);
        }
        if let Some(problem) = self.locked {
            let axis = (0..3).find(|&axis| held[axis] != position[axis]);
            return Err((axis.unwrap_or(0), problem));
        }
        let own = self
            .placement
            .map_or(position, |placement| placement.undo(position));
        let place = self.place(vertex);
        for axis in axes_in_order(place) {
            let old = self.number_at(bytes, place[axis], axis);
            let new = self.replacement(old, own[axis], axis);
            let new = new.map_err(|problem| (axis, problem))?;
            let at = place[axis];
            changes[axis] = new.map(|number| Change { axis, at, number });
        }
        Ok(changes)
    }

    /// The number as it stands there.
    fn number_at(&self, bytes: &[u8], at: usize, axis: usize) -> f64 {
        let number = self.types[axis].read(bytes, at, self.endian);
        number.expect("slots point at numbers that were read before")
    }

    /// The coordinate for which a number stands.
    fn value(&self, number: f64, axis: usize) -> f64 {
        self.quantisation.map_or(number, |quantisation| {
            let q = match quantisation.normalised {
                true => (number / self.types[axis].greatest()).max(-1.0),
                false => number,
            };
            quantisation.offset[axis] + quantisation.scale[axis] * q
        })
    }

    /// The number that stands for a coordinate as nearly as it can; `None` if that is `old`.
    fn replacement(&self, old: f64, value: f64, axis: usize) -> Result<Option<f64>, &'static str> {
        let kind = self.types[axis];
        let Some(quantisation) = self.quantisation else {
            return replacement(old, value, kind);
        };
        let q = (value - quantisation.offset[axis]) / quantisation.scale[axis];
        let (unit, least) = match quantisation.normalised {
            true if kind.least() < 0.0 => (kind.greatest(), -kind.greatest()),
            true => (kind.greatest(), 0.0),
            false => (1.0, kind.least()),
        };
        let (number, greatest) = ((q * unit).round(), kind.greatest());
        let slack = ON_THE_BOX * (greatest - least);
        if !(least - slack..=greatest + slack).contains(&number) {
            return Err(BEYOND);
        }
        let number = number.clamp(least, greatest);
        Ok((number != old).then_some(number))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::buffer::Buffer;
    use crate::slots::Slots;

    /// As glTF may hold a model: three vertices interleaved with normals, in single precision, and two quantised ones of which
    /// each has a fourth number, in another buffer.
    fn two_buffers() -> (Vec<Buffer>, Slots) {
        let interleaved = [1.0_f32, 2.0, 3.0, 0.0, 0.0, 1.0];
        let first = (0..18).map(|i| interleaved[i % 6] + (i / 6) as f32);
        let first = first.flat_map(f32::to_le_bytes).collect();
        let quantised = [0_u16, 32_768, 65_535, 7, 65_535, 0, 1, 7];
        let second = [
            vec![0xAB; 2],
            quantised.iter().flat_map(|q| q.to_le_bytes()).collect(),
        ]
        .concat();
        let interleaved = BinaryRun {
            buffer: 0,
            start: 0,
            stride: 24,
            vertices: vec![[0, 4, 8]],
            count: 3,
            types: [Scalar::F32; 3],
            endian: Endian::Little,
            quantisation: None,
            placement: None,
            locked: None,
        };
        let quantised = BinaryRun {
            buffer: 1,
            start: 2,
            stride: 8,
            vertices: vec![[0, 2, 4]],
            count: 2,
            types: [Scalar::U16; 3],
            quantisation: Some(Quantisation {
                scale: [10.0, 20.0, 40.0],
                offset: [-5.0, 0.0, 1.0],
                normalised: true,
            }),
            ..interleaved.clone()
        };
        let buffers = vec![
            Buffer::file(first),
            Buffer {
                name: "model.bin".into(),
                bytes: Arc::new(second),
            },
        ];
        (buffers, Slots::Binary(vec![interleaved, quantised]))
    }

    #[test]
    fn coordinates_in_two_buffers_are_read_and_overwritten_and_nothing_else_changes() {
        let (buffers, slots) = two_buffers();
        let positions = slots.positions(&buffers);
        assert_eq!(
            positions[..3],
            [[1.0, 2.0, 3.0], [2.0, 3.0, 4.0], [3.0, 4.0, 5.0]]
        );
        assert_eq!(positions[3], [-5.0, 20.0 * (32_768.0 / 65_535.0), 41.0]);
        assert_eq!(slots.len(), 5);

        let wanted = [
            [0.1, 2.0, 3.0],
            [2.0, 3.0, 4.0],
            [3.0, 4.0, -5.5],
            [0.0; 3],
            [5.0, 10.0, 20.5],
        ];
        let keep = 3;
        let target = |v: usize| (v != keep).then_some(wanted[v]);
        let (moved, slots) = slots.rewrite(&buffers, target).unwrap();
        let held = slots.positions(&moved);
        assert_eq!(held[0], [f64::from(0.1_f32), 2.0, 3.0]);
        assert_eq!(
            (held[1], held[2], held[keep]),
            (positions[1], [3.0, 4.0, -5.5], positions[keep])
        );
        for axis in 0..3 {
            let half_a_step = 0.5 * [10.0, 20.0, 40.0][axis] / 65_535.0;
            assert!((held[4][axis] - wanted[4][axis]).abs() <= half_a_step * (1.0 + 1e-9));
        }
        // Four bytes of x, four of z; y and z of the last vertex. Its x was 5 already.
        let changed = |i: usize| {
            let pairs = buffers[i].bytes.iter().zip(moved[i].bytes.iter()).enumerate();
            pairs
                .filter(|(_, (a, b))| a != b)
                .map(|(at, _)| at)
                .collect::<Vec<_>>()
        };
        assert!(
            changed(0)
                .iter()
                .all(|at| (0..4).contains(at) || (56..60).contains(at))
        );
        assert!(changed(1).iter().all(|at| (12..16).contains(at)));
        assert!(!changed(0).is_empty() && !changed(1).is_empty());
    }

    #[test]
    fn a_buffer_of_which_no_number_changes_is_not_copied() {
        let (buffers, slots) = two_buffers();
        let positions = slots.positions(&buffers);
        let (same, _) = slots.rewrite(&buffers, |v| Some(positions[v])).unwrap();
        assert!(same[0].is_same(&buffers[0]) && same[1].is_same(&buffers[1]));
        let third = |v: usize| (v == 4).then_some([0.0; 3]);
        let refused = slots.rewrite(&buffers, third).unwrap_err();
        assert_eq!(
            (refused.file_vertex, refused.value, refused.problem),
            (4, 0.0, BEYOND)
        );
        let (moved, _) = slots
            .rewrite(&buffers, |v| (v == 4).then_some([0.0, 0.0, 1.0]))
            .unwrap();
        assert!(moved[0].is_same(&buffers[0]) && !moved[1].is_same(&buffers[1]));
    }

    #[test]
    fn signed_integers_reach_from_minus_one_to_one_and_plain_ones_stand_for_themselves() {
        let run = |types, normalised| BinaryRun {
            buffer: 0,
            start: 0,
            stride: 3,
            vertices: vec![[0, 1, 2]],
            count: 1,
            types,
            endian: Endian::Big,
            quantisation: Some(Quantisation {
                scale: [1.0; 3],
                offset: [0.0; 3],
                normalised,
            }),
            placement: None,
            locked: None,
        };
        let read = |run: &BinaryRun, bytes: &[u8]| run.positions(bytes).next().unwrap();
        let bytes = [i8::MIN as u8, -127_i8 as u8, 127];
        assert_eq!(read(&run([Scalar::I8; 3], true), &bytes), [-1.0, -1.0, 1.0]);
        assert_eq!(
            read(&run([Scalar::I8; 3], false), &bytes),
            [-128.0, -127.0, 127.0]
        );
        let mut rounded = Arc::new(bytes.to_vec());
        let target = |_: usize| Some([3.4, -128.0, 127.4]);
        run([Scalar::I8; 3], false)
            .rewrite(&mut rounded, 0, &target)
            .unwrap();
        assert_eq!(read(&run([Scalar::I8; 3], false), &rounded), [3.0, -128.0, 127.0]);
        let beyond = run([Scalar::I8; 3], true).rewrite(&mut rounded, 0, &|_| Some([0.0, 0.0, 1.03]));
        assert_eq!(beyond.unwrap_err().problem, BEYOND);
        let nearly = run([Scalar::I8; 3], true).rewrite(&mut rounded, 0, &|_| Some([0.0, -1.015, 1.015]));
        assert!(nearly.is_ok());
        assert_eq!(read(&run([Scalar::I8; 3], true), &rounded), [0.0, -1.0, 1.0]);
    }
}
