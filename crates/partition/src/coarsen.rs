//! The hierarchy of ever smaller graphs that all multilevel algorithms here share.

use crate::Graph;
use crate::contract::{contract, number_pairs};
use crate::matching::heavy_edge_matching;
use crate::rng::Rng;
use crate::team::Team;

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
pub(crate) fn coarsen(graph: &Graph, size: usize, kept: &[&[u32]], team: &Team, rng: &mut Rng) -> Vec<Level> {
    let max_weight = (1.5 * graph.total_vertex_weight() as f64 / size.max(1) as f64).ceil() as i64;
    let mut levels: Vec<Level> = Vec::new();
    let mut kept: Vec<Vec<u32>> = kept.iter().map(|part| part.to_vec()).collect();
    loop {
        let fine = levels.last().map_or(graph, |level| &level.graph);
        if fine.vertex_count() <= size {
            return levels;
        }
        let partner = heavy_edge_matching(fine, max_weight, &kept, team, rng);
        let (coarse_of, count) = number_pairs(&partner);
        if count as f64 > MIN_SHRINK * fine.vertex_count() as f64 {
            return levels;
        }
        for part in &mut kept {
            *part = restrict(part, &coarse_of, count);
        }
        let graph = contract(fine, &partner, &coarse_of, count, team);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kway::cut;

    fn torus(side: u32) -> Graph {
        let at = |x: u32, y: u32| (y % side) * side + x % side;
        let edges: Vec<_> = (0..side * side)
            .flat_map(|v| {
                let (x, y) = (v % side, v / side);
                [
                    (v, at(x + 1, y), 1),
                    (v, at(x, y + 1), 2),
                    (v, at(x + 1, y + 1), 1),
                ]
            })
            .collect();
        Graph::from_edges((side * side) as usize, &edges).unwrap()
    }

    #[test]
    fn every_level_is_a_valid_graph_of_the_same_weight_on_which_cuts_keep_their_size() {
        let graph = torus(40);
        let team = Team::new(1).unwrap();
        let mut rng = Rng::new(1);
        let levels = coarsen(&graph, 50, &[], &team, &mut rng);
        assert!(levels.len() >= 4 && levels[levels.len() - 1].graph.vertex_count() <= 60);
        for depth in 0..levels.len() {
            let fine = if depth == 0 {
                &graph
            } else {
                &levels[depth - 1].graph
            };
            let Level {
                graph: coarse,
                coarse_of,
            } = &levels[depth];
            let copy = coarse.clone();
            let rows = (
                copy.offsets,
                copy.neighbours,
                copy.vertex_weights,
                copy.edge_weights,
            );
            assert!(Graph::new(rows.0, rows.1, Some(rows.2), Some(rows.3)).is_ok());
            assert_eq!(coarse.total_vertex_weight(), graph.total_vertex_weight());
            let part: Vec<u32> = (0..coarse.vertex_count()).map(|_| rng.below(3) as u32).collect();
            assert_eq!(cut(coarse, &part), cut(fine, &prolong(&part, coarse_of)));
        }
    }

    #[test]
    fn cut_edges_of_kept_partitions_are_never_contracted() {
        let graph = torus(30);
        let team = Team::new(1).unwrap();
        let stripes: Vec<u32> = (0..900).map(|v| v % 30 / 10).collect();
        let layers: Vec<u32> = (0..900).map(|v| v / 450).collect();
        let levels = coarsen(&graph, 20, &[&stripes, &layers], &team, &mut Rng::new(2));
        for part in [stripes, layers] {
            let mut carried = part.clone();
            for level in &levels {
                carried = restrict(&carried, &level.coarse_of, level.graph.vertex_count());
            }
            let raised = levels
                .iter()
                .rev()
                .fold(carried, |coarse, level| prolong(&coarse, &level.coarse_of));
            assert_eq!(raised, part);
        }
    }

    #[test]
    fn stars_coarsen_by_two_hops() {
        let edges: Vec<_> = (1..=4000).map(|leaf| (0, leaf, 1)).collect();
        let team = Team::new(1).unwrap();
        let star = Graph::from_edges(4001, &edges).unwrap();
        let levels = coarsen(&star, 100, &[], &team, &mut Rng::new(0));
        assert!(
            levels
                .last()
                .is_some_and(|level| level.graph.vertex_count() <= 200)
        );
    }
}
