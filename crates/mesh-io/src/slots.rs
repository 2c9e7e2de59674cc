use crate::error::{Fault, Place};
use crate::scalar::{Endian, Scalar};
use crate::{number, text};

/// Where in a file's bytes the coordinates of its vertices lie, and how they are written.
#[derive(Clone, Debug)]
pub(crate) struct Slots {
    /// First bytes of x, y and z of each file vertex; vertices ascend, axes may stand in any order.
    starts: Vec<[usize; 3]>,
    /// The precision of x, y and z: in text too, numbers have a type that they are rounded to.
    types: [Scalar; 3],
    encoding: Encoding,
}

#[derive(Clone, Copy, Debug)]
enum Encoding {
    Text,
    Binary(Endian),
}

/// A coordinate that a file cannot hold.
pub(crate) struct Refusal {
    pub(crate) file_vertex: usize,
    pub(crate) value: f64,
    pub(crate) problem: &'static str,
}

const OVERFLOW: &str = "the file holds 32-bit floating point numbers, up to 3.4e38: scale the model down";
const INTEGERS: &str = "the file holds its coordinates as integers: convert them to float or double first";

impl Slots {
    pub(crate) fn text(starts: Vec<[usize; 3]>, types: [Scalar; 3]) -> Self {
        Self {
            starts,
            types,
            encoding: Encoding::Text,
        }
    }

    pub(crate) fn binary(starts: Vec<[usize; 3]>, types: [Scalar; 3], endian: Endian) -> Self {
        Self {
            starts,
            types,
            encoding: Encoding::Binary(endian),
        }
    }

    /// How many vertices the file has.
    pub(crate) fn len(&self) -> usize {
        self.starts.len()
    }

    /// The coordinates that the bytes hold.
    pub(crate) fn position(&self, bytes: &[u8], vertex: usize) -> [f64; 3] {
        std::array::from_fn(|axis| self.coordinate(bytes, vertex, axis))
    }

    fn coordinate(&self, bytes: &[u8], vertex: usize, axis: usize) -> f64 {
        let start = self.starts[vertex][axis];
        let read = match self.encoding {
            Encoding::Text => number::parse(text::number_at(bytes, start)),
            Encoding::Binary(endian) => self.types[axis].read(bytes, start, endian),
        };
        read.expect("slots point at numbers that were read before")
    }

    /// Where a coordinate lies, for messages.
    pub(crate) fn place(&self, bytes: &[u8], vertex: usize, axis: usize) -> Place {
        let start = self.starts[vertex][axis];
        match self.encoding {
            Encoding::Text => Fault::at_line(bytes, start, "").place,
            Encoding::Binary(_) => {
                Fault::at_byte(start, format!("vertex {vertex}, {}", ["x", "y", "z"][axis]), "").place
            }
        }
    }

    /// The bytes with new coordinates where `target` gives some, and where they lie then; `None` if no byte changes.
    pub(crate) fn rewrite(
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
                if let Some(number) = replacement(old, value, self.types[axis]).map_err(refused)? {
                    splice.replace(number, self.encoding);
                }
            }
        }
        splice.copy_to(bytes.len());
        Ok(splice.changed.then_some((splice.new, Self { starts, ..*self })))
    }
}

fn axes_in_order(starts: [usize; 3]) -> [usize; 3] {
    let mut axes = [0, 1, 2];
    axes.sort_by_key(|&axis| starts[axis]);
    axes
}

/// A number as a file holds it.
#[derive(Clone, Copy)]
enum Number {
    Single(f32),
    Double(f64),
}

/// What to write where `old` stands so that it becomes `value`, rounded to `kind`; `None` where it is that already.
fn replacement(old: f64, value: f64, kind: Scalar) -> Result<Option<Number>, &'static str> {
    match kind {
        Scalar::F32 if value as f32 == old as f32 => Ok(None),
        Scalar::F32 if (value as f32).is_infinite() => Err(OVERFLOW),
        Scalar::F32 => Ok(Some(Number::Single(value as f32))),
        _ if value == old => Ok(None),
        Scalar::F64 => Ok(Some(Number::Double(value))),
        _ => Err(INTEGERS),
    }
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
    fn replace(&mut self, number: Number, encoding: Encoding) {
        let start = self.new.len();
        match (encoding, number) {
            (Encoding::Text, Number::Single(x)) => number::write_single(x, &mut self.new),
            (Encoding::Text, Number::Double(x)) => number::write_double(x, &mut self.new),
            (Encoding::Binary(Endian::Little), Number::Single(x)) => self.new.extend(x.to_le_bytes()),
            (Encoding::Binary(Endian::Little), Number::Double(x)) => self.new.extend(x.to_le_bytes()),
            (Encoding::Binary(Endian::Big), Number::Single(x)) => self.new.extend(x.to_be_bytes()),
            (Encoding::Binary(Endian::Big), Number::Double(x)) => self.new.extend(x.to_be_bytes()),
        }
        self.copied += match encoding {
            Encoding::Text => text::number_at(self.old, self.copied).len(),
            Encoding::Binary(_) => self.new.len() - start,
        };
        self.changed = true;
    }
}
