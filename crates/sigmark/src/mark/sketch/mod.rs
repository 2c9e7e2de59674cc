//! What is kept of an original so that its geometry is recognised in another file: in another order, at another precision, in another unit or
//! with another axis upward; with seams split, and among other parts, as where every copy of an instanced part was written out.

mod packed;
mod recognise;

pub use recognise::Recognised;

use mesh::{BoundingBox, Edges};

use super::{Borders, Original, Patch, PatchBasis, traversal::Traversal};

/// Points that tell an original, and the patch of every vertex in an order that the triangles determine.
///
/// It is a help to an owner who has the original in another format only, and proves nothing: a claim needs the very file.
#[derive(Clone, Debug, PartialEq)]
pub struct Sketch {
    bounds: BoundingBox,
    /// How many there are.
    triangles: usize,
    /// Corners of the triangles from which a [`Traversal`] sets out, in the unit frame of the bounds.
    first: Vec<[[f32; 3]; 3]>,
    /// Vertices at equal distances in the order of the traversal, there as well.
    probes: Vec<[f32; 3]>,
    /// Of each vertex in that order.
    labels: Vec<u32>,
    /// For each patch, which of its eigenfunctions are the opposite ones if its vertices are in that order.
    opposite: Vec<Vec<bool>>,
}

/// Vertices that are compared, besides the corners of first triangles.
const PROBES: usize = 256;

/// A mesh that falls apart into more walks than one for so many vertices is not sketched: the points would be many and tell little.
const VERTICES_PER_WALK: usize = 16;

/// Draws a [`Sketch`] while a mark is written.
pub(crate) struct Sketcher<'a> {
    original: &'a Original,
    order: Vec<u32>,
    ranks: Vec<u32>,
    first: Vec<[u32; 3]>,
}

impl<'a> Sketcher<'a> {
    pub(crate) fn new(original: &'a Original) -> Self {
        let edges = Edges::of(original.mesh());
        let (traversal, first) = Traversal::whole(original.mesh(), &edges);
        Self {
            original,
            order: traversal.order().to_vec(),
            ranks: traversal.ranks().to_vec(),
            first,
        }
    }

    /// Which eigenfunctions of a patch are the opposite ones in the order of the traversal.
    pub(crate) fn opposite(&self, patch: &Patch, basis: &PatchBasis) -> Vec<bool> {
        let is_fixed = |local: u32| match self.original.borders() {
            Borders::Fixed => patch.at_border()[local as usize],
            Borders::Free | Borders::Windowed => false,
        };
        let vertices = 0..patch.vertices().len() as u32;
        let mut order: Vec<u32> = vertices.filter(|&local| !is_fixed(local)).collect();
        order.sort_unstable_by_key(|&local| self.ranks[patch.vertices()[local as usize] as usize]);
        basis.spectrum().opposite_in(&order)
    }

    /// The sketch, given the [opposites](Self::opposite) of every patch; none of a mesh in too many pieces.
    pub(crate) fn sketch(self, opposite: Vec<Vec<bool>>) -> Option<Sketch> {
        let (mesh, order) = (self.original.mesh(), self.order);
        let is_met = order.len() == mesh.vertex_count();
        if !is_met || self.first.len() > 1 + order.len() / VERTICES_PER_WALK {
            return None;
        }
        let bounds = mesh.bounding_box();
        let to_unit = bounds.to_unit_frame();
        let point = |v: u32| to_unit.apply(mesh.positions()[v as usize]).map(|x| x as f32);
        let labels = self.original.patches().labels();
        Some(Sketch {
            first: self.first.iter().map(|corners| corners.map(point)).collect(),
            probes: probes(order.len()).map(|rank| point(order[rank])).collect(),
            labels: order.iter().map(|&v| labels[v as usize]).collect(),
            bounds,
            triangles: mesh.triangle_count(),
            opposite,
        })
    }
}

impl Sketch {
    /// The patch of every vertex, in the order of the traversal: 0 for an unmarked one.
    pub(crate) fn labels(&self) -> &[u32] {
        &self.labels
    }

    /// For each patch, which eigenfunctions are the opposite ones.
    pub(crate) fn opposite(&self) -> &[Vec<bool>] {
        &self.opposite
    }
}

/// The ranks of the vertices that are compared.
fn probes(vertices: usize) -> impl Iterator<Item = usize> {
    let count = vertices.min(PROBES);
    (0..count).map(move |i| i * vertices / count)
}
