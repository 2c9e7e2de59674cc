use std::ops::Range;

use super::binary::BinaryRun;

/// Coordinates in the buffers of a scene description.
#[derive(Clone, Debug)]
pub(crate) struct SceneSlots {
    /// Together all vertices, in their order.
    pub(crate) runs: Vec<BinaryRun>,
    /// For each buffer that the description names, which of the asset's holds its bytes, and where in it.
    pub(crate) places: Vec<(usize, Range<usize>)>,
}
