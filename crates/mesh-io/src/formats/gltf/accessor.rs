//! Accessors: where the numbers lie that they speak of.

use gltf::json::validation::Checked;

use super::buffers::Store;
use super::document::{Document, accessor_fault, scalar};
use crate::error::Fault;
use crate::scalar::{Endian, Scalar};

/// How many elements of how many numbers of which type.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) count: usize,
    pub(super) components: usize,
    pub(super) scalar: Scalar,
}

/// Elements at equal distances in one buffer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Elements {
    /// Which of the asset's buffers.
    pub(super) buffer: usize,
    /// First byte of the first element.
    pub(super) start: usize,
    /// Bytes from one element to the next.
    pub(super) stride: usize,
    pub(super) shape: Shape,
}

impl Elements {
    /// Elements from byte `offset` of a buffer view on; `None` if the view does not hold them all.
    fn in_view(
        document: &Document,
        store: &Store,
        view: usize,
        offset: u64,
        shape: Shape,
    ) -> Result<Option<Self>, Fault> {
        let (buffer, bytes, stride) = store.view(document, view)?;
        let size = shape.components * shape.scalar.size();
        let stride = stride.unwrap_or(size);
        let last = (shape.count as u64).saturating_sub(1).checked_mul(stride as u64);
        let needed = if shape.count == 0 { 0 } else { size as u64 };
        let end = last.and_then(|last| last.checked_add(offset)?.checked_add(needed));
        let fits = stride >= size && end.is_some_and(|end| end <= bytes.len() as u64);
        Ok(fits.then(|| Self {
            buffer,
            start: bytes.start + offset as usize,
            stride,
            shape,
        }))
    }

    /// The bytes of an element.
    pub(super) fn bytes(&self, element: usize) -> std::ops::Range<usize> {
        let start = self.start + element * self.stride;
        start..start + self.shape.components * self.shape.scalar.size()
    }

    /// The first numbers of an element, as they stand there.
    fn numbers<const N: usize>(&self, store: &Store, element: usize) -> [f64; N] {
        let (start, kind) = (self.bytes(element).start, self.shape.scalar);
        std::array::from_fn(|i| {
            let number = kind.read(
                &store.buffers[self.buffer].bytes,
                start + i * kind.size(),
                Endian::Little,
            );
            number.expect("elements lie within their buffer")
        })
    }
}

/// What an accessor speaks of: a list of elements, some of which another list replaces.
#[derive(Debug)]
pub(super) struct Accessor {
    pub(super) shape: Shape,
    pub(super) normalised: bool,
    /// `None` where all is zero that is not replaced.
    pub(super) base: Option<Elements>,
    /// Numbers of replaced elements, and what stands for them, in their order.
    pub(super) sparse: Option<(Vec<usize>, Elements)>,
    /// Where those numbers stand.
    pub(super) replaced: Option<Elements>,
}

impl Accessor {
    pub(super) fn of(document: &Document, store: &Store, index: usize) -> Result<Self, Fault> {
        let accessor = document.accessor(index)?;
        let fault = |problem: &str| accessor_fault(index, problem);
        let (Checked::Valid(kind), Checked::Valid(element)) = (accessor.component_type, accessor.type_)
        else {
            return Err(fault("has numbers or elements of no known type"));
        };
        let count = |count: u64| usize::try_from(count).map_err(|_| fault("has too many elements"));
        let shape = Shape {
            count: count(accessor.count.0)?,
            components: element.multiplicity(),
            scalar: scalar(kind.0),
        };
        let place = |view: usize, offset: u64, shape: Shape| {
            let elements = Elements::in_view(document, store, view, offset, shape)?;
            elements.ok_or_else(|| fault("goes beyond its buffer view"))
        };
        let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
        let base = match accessor.buffer_view {
            Some(view) => Some(place(view.value(), offset, shape)?),
            None => None,
        };
        if base.is_none() && shape.count > store.bytes() {
            return Err(fault("has more elements than the file has bytes"));
        }
        let (sparse, replaced) = match &accessor.sparse {
            None => (None, None),
            Some(sparse) => {
                let replaced = count(sparse.count.0)?;
                let Checked::Valid(kind) = sparse.indices.component_type else {
                    return Err(fault("has indices of no known type"));
                };
                let indices = Shape {
                    count: replaced,
                    components: 1,
                    scalar: scalar(kind.0),
                };
                let values = Shape {
                    count: replaced,
                    ..shape
                };
                let view = sparse.indices.buffer_view.value();
                let indices = place(view, sparse.indices.byte_offset.0, indices)?;
                let view = sparse.values.buffer_view.value();
                let values = place(view, sparse.values.byte_offset.0, values)?;
                let number = |i| indices.numbers::<1>(store, i)[0] as usize;
                let numbers: Vec<usize> = (0..replaced).map(number).collect();
                if numbers.iter().any(|&number| number >= shape.count) {
                    return Err(fault("replaces an element that it does not have"));
                }
                (Some((numbers, values)), Some(indices))
            }
        };
        Ok(Self {
            shape,
            normalised: accessor.normalized,
            base,
            sparse,
            replaced,
        })
    }

    /// The first numbers of all elements, as they stand there.
    ///
    /// # Panics
    /// If elements have fewer.
    pub(super) fn numbers<const N: usize>(&self, store: &Store) -> Vec<[f64; N]> {
        let mut numbers = match &self.base {
            Some(base) => (0..self.shape.count).map(|i| base.numbers(store, i)).collect(),
            None => vec![[0.0; N]; self.shape.count],
        };
        if let Some((replaced, values)) = &self.sparse {
            for (i, &element) in replaced.iter().enumerate() {
                numbers[element] = values.numbers(store, i);
            }
        }
        numbers
    }

    /// The elements that stand in buffers, by their numbers; all others are zero.
    pub(super) fn written<const N: usize>(&self, store: &Store) -> Vec<(usize, [f64; N])> {
        match (&self.base, &self.sparse) {
            (None, Some((replaced, values))) => {
                let numbers = replaced.iter().enumerate();
                numbers
                    .map(|(i, &element)| (element, values.numbers(store, i)))
                    .collect()
            }
            (None, None) => Vec::new(),
            _ => self.numbers(store).into_iter().enumerate().collect(),
        }
    }

    /// How many elements [`written`](Self::written) gives, beside those that are replaced twice.
    pub(super) fn written_count(&self) -> usize {
        let replaced = self.sparse.as_ref().map_or(0, |(replaced, _)| replaced.len());
        replaced + self.base.map_or(0, |base| base.shape.count)
    }

    /// The lists of elements in buffers.
    pub(super) fn lists(&self) -> impl Iterator<Item = &Elements> {
        self.base
            .iter()
            .chain(self.sparse.iter().map(|(_, values)| values))
    }
}
