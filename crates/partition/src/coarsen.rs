//! The hierarchy of ever smaller graphs that all multilevel algorithms here share.

use crate::Graph;
use crate::contract::{contract, number_pairs};
use crate::matching::heavy_edge_matching;
use crate::rng::Rng;

/// A level that keeps more than this share of its vertices is the last.
const MIN_SHRINK: f64 = 0.95;

/// One step of coarsening.
pub(crate) struct Level {
    /// The coarse graph.
    pub(crate) graph: Graph,
    /// Coarse vertex of each vertex of the graph above.
    pub(crate) coarse_of: Vec<u32>,
}

/// Coarsens until at most `size` vertices are left or nothing shrinks any more. Edges that one of the partitions `kept`
/// cuts are never contracted, so that each of them is a partition of the coarsest graph too. The first level stands
/// below `graph` itself.
pub(crate) fn coarsen(graph: &Graph, size: usize, kept: &[&[u32]], rng: &mut Rng) -> Vec<Level> {
    let max_weight = (1.5 * graph.total_vertex_weight() as f64 / size.max(1) as f64).ceil() as i64;
    let mut levels: Vec<Level> = Vec::new();
    let mut kept: Vec<Vec<u32>> = kept.iter().map(|part| part.to_vec()).collect();
    loop {
        let fine = levels.last().map_or(graph, |level| &level.graph);
        if fine.vertex_count() <= size {
            return levels;
        }
        let partner = heavy_edge_matching(fine, max_weight, &kept, rng);
        let (coarse_of, count) = number_pairs(&partner);
        if count as f64 > MIN_SHRINK * fine.vertex_count() as f64 {
            return levels;
        }
        for part in &mut kept {
            *part = restrict(part, &coarse_of, count);
        }
        let graph = contract(fine, &partner, &coarse_of, count);
        levels.push(Level { graph, coarse_of });
    }
}

/// Values that are constant on every coarse vertex, carried down.
pub(crate) fn restrict(fine: &[u32], coarse_of: &[u32], count: usize) -> Vec<u32> {
    let mut coarse = vec![0; count];
    for (&c, &value) in coarse_of.iter().zip(fine) {
        coarse[c as usize] = value;
    }
    coarse
}

/// Values of coarse vertices, carried up.
pub(crate) fn prolong<T: Copy>(coarse: &[T], coarse_of: &[u32]) -> Vec<T> {
    coarse_of.iter().map(|&c| coarse[c as usize]).collect()
}
