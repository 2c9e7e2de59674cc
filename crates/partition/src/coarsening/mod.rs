//! The ever smaller graphs that a graph is coarsened to, which all multilevel algorithms here share.

mod contract;
mod matching;

use job::{Job, JobError};

use crate::Graph;
use crate::rng::Rng;
use contract::{contract, number_pairs};
use matching::heavy_edge_matching;

/// A level that keeps more than this share of its vertices is the last. METIS stops at 0.85, with which cuts are 0.2 %
/// longer here.
const MIN_SHRINK: f64 = 0.95;

/// No coarse vertex weighs more than this many times the average of the coarsest graph (METIS, `coarsen.c`).
const MAX_WEIGHT: f64 = 1.5;

/// One step of coarsening.
struct Level {
    /// The coarse graph.
    graph: Graph,
    /// Coarse vertex of each vertex of the graph above.
    coarse_of: Vec<u32>,
}

/// A graph (depth 0) and the graphs that it was coarsened to (depth 1, 2, …).
pub(crate) struct Hierarchy<'a> {
    finest: &'a Graph,
    levels: Vec<Level>,
}

impl<'a> Hierarchy<'a> {
    /// Coarsens until at most `size` vertices are left or nothing shrinks any more. Edges that one of the partitions
    /// `kept` cuts are never contracted, so that each of them is a partition of the coarsest graph too.
    pub(crate) fn of(
        finest: &'a Graph,
        size: usize,
        kept: &[&[u32]],
        job: &Job,
        rng: &mut Rng,
    ) -> Result<Self, JobError> {
        let average = finest.total_vertex_weight() as f64 / size.max(1) as f64;
        let max_weight = (MAX_WEIGHT * average).ceil() as i64;
        let mut hierarchy = Self::single(finest);
        let mut kept: Vec<Vec<u32>> = kept.iter().map(|part| part.to_vec()).collect();
        loop {
            let fine = hierarchy.coarsest();
            // A level costs as much as it has vertices.
            job.progress(1.0 - fine.vertex_count() as f64 / finest.vertex_count().max(1) as f64)?;
            if fine.vertex_count() <= size {
                return Ok(hierarchy);
            }
            let partner = heavy_edge_matching(fine, max_weight, &kept, job, rng)?;
            let (coarse_of, count) = number_pairs(&partner);
            if count as f64 > MIN_SHRINK * fine.vertex_count() as f64 {
                return Ok(hierarchy);
            }
            for part in &mut kept {
                *part = restrict(part, &coarse_of, count);
            }
            let graph = contract(fine, &partner, &coarse_of, count, job)?;
            hierarchy.levels.push(Level { graph, coarse_of });
        }
    }

    /// A graph alone.
    pub(crate) fn single(finest: &'a Graph) -> Self {
        Self {
            finest,
            levels: Vec::new(),
        }
    }

    /// Depth of the coarsest graph.
    pub(crate) fn depth(&self) -> usize {
        self.levels.len()
    }

    pub(crate) fn graph(&self, depth: usize) -> &Graph {
        match depth {
            0 => self.finest,
            _ => &self.levels[depth - 1].graph,
        }
    }

    pub(crate) fn coarsest(&self) -> &Graph {
        self.graph(self.depth())
    }

    /// Values of the vertices at a depth, carried up from the coarse vertices below it.
    pub(crate) fn prolong<T: Copy>(&self, coarse: &[T], depth: usize) -> Vec<T> {
        let coarse_of = self.levels[depth].coarse_of.iter();
        coarse_of.map(|&c| coarse[c as usize]).collect()
    }

    /// The vertices at a depth that were merged into one of the given coarse vertices below it.
    pub(crate) fn children(&self, coarse: &[u32], depth: usize) -> Vec<u32> {
        let Level { graph, coarse_of } = &self.levels[depth];
        let mut wanted = vec![false; graph.vertex_count()];
        coarse.iter().for_each(|&c| wanted[c as usize] = true);
        (0..coarse_of.len() as u32)
            .filter(|&v| wanted[coarse_of[v as usize] as usize])
            .collect()
    }

    /// One of the partitions `kept`, of the coarsest graph.
    pub(crate) fn carry_down(&self, kept: &[u32]) -> Vec<u32> {
        self.levels.iter().fold(kept.to_vec(), |fine, level| {
            restrict(&fine, &level.coarse_of, level.graph.vertex_count())
        })
    }
}

/// Values that are constant on every coarse vertex, carried down.
fn restrict(fine: &[u32], coarse_of: &[u32], count: usize) -> Vec<u32> {
    let mut coarse = vec![0; count];
    for (&c, &value) in coarse_of.iter().zip(fine) {
        coarse[c as usize] = value;
    }
    coarse
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refinement::cut;

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
        let mut rng = Rng::new(1);
        let hierarchy = Hierarchy::of(&graph, 50, &[], &Job::default(), &mut rng).unwrap();
        assert!(hierarchy.depth() >= 4 && hierarchy.coarsest().vertex_count() <= 60);
        for depth in 0..hierarchy.depth() {
            let (fine, coarse) = (hierarchy.graph(depth), hierarchy.graph(depth + 1));
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
            assert_eq!(cut(coarse, &part), cut(fine, &hierarchy.prolong(&part, depth)));
        }
    }

    #[test]
    fn cut_edges_of_kept_partitions_are_never_contracted() {
        let graph = torus(30);
        let stripes: Vec<u32> = (0..900).map(|v| v % 30 / 10).collect();
        let layers: Vec<u32> = (0..900).map(|v| v / 450).collect();
        let kept: [&[u32]; 2] = [&stripes, &layers];
        let hierarchy = Hierarchy::of(&graph, 20, &kept, &Job::default(), &mut Rng::new(2)).unwrap();
        assert!(hierarchy.depth() > 0);
        for part in kept {
            let raised = (0..hierarchy.depth())
                .rev()
                .fold(hierarchy.carry_down(part), |coarse, depth| {
                    hierarchy.prolong(&coarse, depth)
                });
            assert_eq!(raised, part);
        }
    }

    #[test]
    fn stars_coarsen_by_two_hops() {
        let edges: Vec<_> = (1..=4000).map(|leaf| (0, leaf, 1)).collect();
        let star = Graph::from_edges(4001, &edges).unwrap();
        let hierarchy = Hierarchy::of(&star, 100, &[], &Job::default(), &mut Rng::new(0)).unwrap();
        assert!(hierarchy.depth() > 0 && hierarchy.coarsest().vertex_count() <= 200);
    }
}
