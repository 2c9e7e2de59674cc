use super::error::Place;
use super::scalar::{Endian, Scalar};
use super::{number, text};
use crate::asset::error::Fault;

/// Where in a file's bytes the coordinates of its vertices lie, and how they are written.
#[derive(Clone, Debug)]
pub(super) struct Slots {
    /// First bytes of x, y and z of each file vertex; vertices ascend, axes may stand in any order.
    starts: Vec<[usize; 3]>,
    encoding: Encoding,
}

#[derive(Clone, Copy, Debug)]
enum Encoding {
    Text { single: bool },
    Binary { types: [Scalar; 3], endian: Endian },
}

/// A coordinate that a file cannot hold.
pub(super) struct Refusal {
    pub(super) file_vertex: usize,
    pub(super) value: f64,
    pub(super) problem: &'static str,
}

const OVERFLOW: &str = "the file holds 32-bit floating point numbers, up to 3.4e38: scale the model down";
const INTEGERS: &str = "the file holds its coordinates as integers: convert them to float or double first";

impl Slots {
    pub(super) fn text(starts: Vec<[usize; 3]>, single: bool) -> Self {
        Self {
            starts,
            encoding: Encoding::Text { single },
        }
    }

    pub(super) fn binary(starts: Vec<[usize; 3]>, types: [Scalar; 3], endian: Endian) -> Self {
        Self {
            starts,
            encoding: Encoding::Binary { types, endian },
        }
    }

    /// How many vertices the file has.
    pub(super) fn len(&self) -> usize {
        self.starts.len()
    }

    /// The coordinates that the bytes hold.
    pub(super) fn position(&self, bytes: &[u8], vertex: usize) -> [f64; 3] {
        std::array::from_fn(|axis| self.coordinate(bytes, vertex, axis))
    }

    fn coordinate(&self, bytes: &[u8], vertex: usize, axis: usize) -> f64 {
        let start = self.starts[vertex][axis];
        let read = match self.encoding {
            Encoding::Text { .. } => number::parse(text::number_at(bytes, start)),
            Encoding::Binary { types, endian } => types[axis].read(bytes, start, endian),
        };
        read.expect("slots point at numbers that were read before")
    }

    /// Where a coordinate lies, for messages.
    pub(super) fn place(&self, bytes: &[u8], vertex: usize, axis: usize) -> Place {
        let start = self.starts[vertex][axis];
        match self.encoding {
            Encoding::Text { .. } => Fault::at_line(bytes, start, "").place,
            Encoding::Binary { .. } => {
                Fault::at_byte(start, format!("vertex {vertex}, {}", ["x", "y", "z"][axis]), "").place
            }
        }
    }

    /// The bytes with new coordinates where `target` gives some, and where they lie then; `None` if no byte changes.
    pub(super) fn rewrite(
        &self,
        bytes: &[u8],
        target: impl Fn(usize) -> Option<[f64; 3]>,
    ) -> Result<Option<(Vec<u8>, Self)>, Refusal> {
        let mut splice = Splice {
            old: bytes,
            copied: 0,
            new: Vec::new(),
            changed: false,
        };
        splice.new.reserve(bytes.len() + bytes.len() / 16);
        let mut starts = self.starts.clone();
        for (vertex, starts) in starts.iter_mut().enumerate() {
            let target = target(vertex);
            for axis in axes_in_order(*starts) {
                let start = starts[axis];
                starts[axis] = splice.copy_to(start);
                let Some(value) = target.map(|position| position[axis]) else {
                    continue;
                };
                let old = self.coordinate(bytes, vertex, axis);
                let refused = |problem| Refusal {
                    file_vertex: vertex,
                    value,
                    problem,
                };
                match self.encoding {
                    Encoding::Text { single } => splice.text(old, value, single),
                    Encoding::Binary { types, endian } => splice.binary(old, value, types[axis], endian),
                }
                .map_err(refused)?;
            }
        }
        splice.copy_to(bytes.len());
        Ok(splice.changed.then_some((
            splice.new,
            Self {
                starts,
                encoding: self.encoding,
            },
        )))
    }
}

fn axes_in_order(starts: [usize; 3]) -> [usize; 3] {
    let mut axes = [0, 1, 2];
    axes.sort_by_key(|&axis| starts[axis]);
    axes
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

    fn text(&mut self, old: f64, value: f64, single: bool) -> Result<(), &'static str> {
        let same = if single {
            old as f32 == value as f32
        } else {
            old == value
        };
        if same {
            return Ok(());
        }
        if single && !(value as f32).is_finite() {
            return Err(OVERFLOW);
        }
        let token = text::number_at(self.old, self.copied);
        if single {
            number::write_single(value as f32, &mut self.new);
        } else {
            number::write_double(value, &mut self.new);
        }
        self.copied += token.len();
        self.changed = true;
        Ok(())
    }

    fn binary(&mut self, old: f64, value: f64, kind: Scalar, endian: Endian) -> Result<(), &'static str> {
        let rounded = if kind == Scalar::F64 {
            value
        } else {
            f64::from(value as f32)
        };
        if (if kind.is_integer() { value } else { rounded }) == old {
            return Ok(());
        }
        if kind.is_integer() {
            return Err(INTEGERS);
        }
        if !rounded.is_finite() {
            return Err(OVERFLOW);
        }
        match (kind, endian) {
            (Scalar::F64, Endian::Little) => self.new.extend(value.to_le_bytes()),
            (Scalar::F64, Endian::Big) => self.new.extend(value.to_be_bytes()),
            (_, Endian::Little) => self.new.extend((value as f32).to_le_bytes()),
            (_, Endian::Big) => self.new.extend((value as f32).to_be_bytes()),
        }
        self.copied += kind.size();
        self.changed = true;
        Ok(())
    }
}
