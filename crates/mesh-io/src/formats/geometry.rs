use crate::slots::Slots;

/// What the reader of one format finds in a file.
pub(crate) struct Geometry {
    pub(crate) positions: Vec<[f64; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) slots: Slots,
    /// How many manifests say whose the file is by a digest of all of it (C2PA).
    pub(crate) manifests: usize,
}

/// Cuts a polygon into triangles around its first corner.
pub(crate) fn fan(corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    if let [first, rest @ ..] = corners {
        triangles.extend(rest.windows(2).map(|edge| [*first, edge[0], edge[1]]));
    }
}
