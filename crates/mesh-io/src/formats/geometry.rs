use std::ops::Range;

use crate::slots::Slots;
use crate::slots::directions::{Directions, Role};
use crate::slots::placement::Placement;

/// What the reader of one format finds in a file.
pub(crate) struct Geometry {
    pub(crate) positions: Vec<[f64; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) slots: Slots,
    /// What the file calls its vertices: the node, mesh or object that they belong to, in ascending ranges.
    pub(crate) names: Vec<(Range<usize>, String)>,
    /// Triangles that are shown more than once, each time but the first.
    pub(crate) instances: Vec<Instance>,
    /// How many manifests say whose the file is by a digest of all of it (C2PA).
    pub(crate) manifests: usize,
}

impl Geometry {
    /// The vertices, if they are no vertices but normals that a reader took for such.
    pub(crate) fn into_normals(self, of_vertices: bool) -> Directions {
        Directions {
            slots: self.slots,
            role: Role::Normal,
            placement: None,
            of_vertices,
            what: "the normals".into(),
        }
    }
}

/// Triangles that a scene shows again in another place.
#[derive(Clone, Debug)]
pub(crate) struct Instance {
    /// By file vertices.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// How they were placed the first time.
    pub(crate) from: Option<Placement>,
    /// How they are placed now.
    pub(crate) to: Option<Placement>,
}

impl Instance {
    /// Where a point of the first lies in this one.
    pub(crate) fn carry(&self, point: [f64; 3]) -> [f64; 3] {
        let own = self.from.map_or(point, |from| from.undo(point));
        self.to.map_or(own, |to| to.apply(own))
    }

    /// Whether it is a mirror image of the first.
    pub(crate) fn mirrors(&self) -> bool {
        let mirrors = |placement: Option<Placement>| placement.is_some_and(|placement| placement.mirrors());
        mirrors(self.from) != mirrors(self.to)
    }
}

/// Cuts a polygon into triangles around its first corner.
pub(crate) fn fan(corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    if let [first, rest @ ..] = corners {
        triangles.extend(rest.windows(2).map(|edge| [*first, edge[0], edge[1]]));
    }
}
