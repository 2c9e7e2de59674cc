//! Minimum fill elimination (Rothberg and Eisenstat 1998) of leaves, exact: the elimination graph is a bit matrix, so that
//! eliminating a vertex is an "or" of rows.
//!
//! A leaf's neighbours outside it are separator vertices, eliminated later. They are its halo: they take part in the fill
//! but are not ordered (Pellegrini, Roman and Amestoy 2000).

use crate::Graph;

/// The vertices of a leaf in the order in which they are eliminated: always one that causes least fill, of these one of
/// least degree, the first of equals. `leaf` is ascending. Meant for a hundred vertices; the matrix takes
/// n (n + halo) bits.
pub(crate) fn min_fill(graph: &Graph, leaf: &[u32]) -> Vec<u32> {
    let mut elimination = Elimination::new(graph, leaf);
    let mut cost: Vec<(u32, u32)> = (0..leaf.len()).map(|v| elimination.cost(v)).collect();
    let mut left: Vec<u32> = (0..leaf.len() as u32).collect();
    let mut order = Vec::with_capacity(leaf.len());
    while let Some(at) = (0..left.len()).min_by_key(|&i| (cost[left[i] as usize], left[i])) {
        let pivot = left.swap_remove(at) as usize;
        order.push(leaf[pivot]);
        elimination.eliminate(pivot);
        for v in elimination.changed() {
            cost[v] = elimination.cost(v);
        }
    }
    order
}

/// The graph that is left of a leaf and its halo.
struct Elimination {
    /// Vertices of the leaf; larger columns are the halo's.
    count: usize,
    /// 64-bit words of a row.
    words: usize,
    /// The neighbours of each vertex of the leaf.
    rows: Vec<u64>,
    /// The columns of the leaf.
    inside: Vec<u64>,
    /// The neighbours of the last pivot.
    pivot_row: Vec<u64>,
    /// These, and theirs.
    reached: Vec<u64>,
}

impl Elimination {
    fn new(graph: &Graph, leaf: &[u32]) -> Self {
        let count = leaf.len();
        let neighbours = leaf.iter().flat_map(|&v| graph.neighbours(v as usize));
        let mut halo: Vec<u32> = neighbours
            .copied()
            .filter(|u| leaf.binary_search(u).is_err())
            .collect();
        halo.sort_unstable();
        halo.dedup();
        let words = (count + halo.len()).div_ceil(64);
        let column = |u: u32| {
            let outside = || count + halo.partition_point(|&h| h < u);
            leaf.binary_search(&u).unwrap_or_else(|_| outside())
        };
        let mut rows = vec![0; count * words];
        for (i, &v) in leaf.iter().enumerate() {
            for &u in graph.neighbours(v as usize) {
                let u = column(u);
                rows[i * words + u / 64] |= 1 << (u % 64);
            }
        }
        let mut inside = vec![0; words];
        (0..count).for_each(|v| inside[v / 64] |= 1 << (v % 64));
        Self {
            count,
            words,
            rows,
            inside,
            pivot_row: vec![0; words],
            reached: vec![0; words],
        }
    }

    fn row(&self, vertex: usize) -> &[u64] {
        &self.rows[vertex * self.words..(vertex + 1) * self.words]
    }

    /// Twice the fill that eliminating the vertex would cause, and its degree. The halo counts as a clique, which it becomes.
    fn cost(&self, vertex: usize) -> (u32, u32) {
        let row = self.row(vertex);
        let mut fill = 0;
        for u in ones(row).take_while(|&u| u < self.count) {
            for ((a, b), inside) in row.iter().zip(self.row(u)).zip(&self.inside) {
                // Pairs inside the leaf are met from both ends.
                let missing = a & !b;
                fill += missing.count_ones() + (missing & !inside).count_ones();
            }
            // A row does not hold its own vertex.
            fill -= 1;
        }
        (fill, row.iter().map(|word| word.count_ones()).sum())
    }

    /// Joins the neighbours of the pivot, and takes it out.
    fn eliminate(&mut self, pivot: usize) {
        let words = self.words;
        self.pivot_row
            .copy_from_slice(&self.rows[pivot * words..(pivot + 1) * words]);
        self.reached.copy_from_slice(&self.pivot_row);
        for u in ones(&self.pivot_row).take_while(|&u| u < self.count) {
            let row = &mut self.rows[u * words..(u + 1) * words];
            row.iter_mut().zip(&self.pivot_row).for_each(|(a, b)| *a |= b);
            row[pivot / 64] &= !(1 << (pivot % 64));
            row[u / 64] &= !(1 << (u % 64));
            self.reached.iter_mut().zip(row).for_each(|(a, b)| *a |= *b);
        }
    }

    /// The vertices of the leaf whose cost the last elimination may have changed: the pivot's neighbours, and those that are
    /// neighbours of two of them.
    fn changed(&self) -> impl Iterator<Item = usize> + '_ {
        let touched = |&v: &usize| {
            let shared = self.row(v).iter().zip(&self.pivot_row);
            self.pivot_row[v / 64] >> (v % 64) & 1 == 1
                || shared.map(|(a, b)| (a & b).count_ones()).sum::<u32>() > 1
        };
        ones(&self.reached)
            .take_while(|&v| v < self.count)
            .filter(touched)
    }
}

/// Positions of the ones.
fn ones(words: &[u64]) -> impl Iterator<Item = usize> + '_ {
    words.iter().enumerate().flat_map(|(i, &word)| {
        let rest = |w: &u64| Some(w & (w - 1)).filter(|&w| w != 0);
        std::iter::successors(Some(word).filter(|&w| w != 0), rest)
            .map(move |w| i * 64 + w.trailing_zeros() as usize)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;
    use crate::{Ordering, column_counts};

    #[test]
    fn trees_are_eliminated_without_fill() {
        let edges: Vec<_> = (1..150u32).map(|v| ((v - 1) / 2, v, 1)).collect();
        let tree = Graph::from_edges(150, &edges).unwrap();
        let all: Vec<u32> = (0..150).collect();
        let ordering = Ordering::from_order(min_fill(&tree, &all)).unwrap();
        assert_eq!(column_counts(&tree, &ordering).iter().sum::<u64>(), 150 + 149);
    }

    #[test]
    fn the_vertex_that_shares_a_separator_waits_for_the_one_that_does_not() {
        // The leaf is the path 0 1 2; each of 3, 4 and 5 hangs on 0 and will be eliminated later.
        let graph = Graph::from_edges(6, &[(0, 1, 1), (1, 2, 1), (0, 3, 1), (0, 4, 1), (0, 5, 1)]).unwrap();
        assert_eq!(min_fill(&graph, &[0, 1, 2]), [2, 1, 0]);
    }

    /// Fill and degree, from sets of pairs.
    fn cost_by_definition(edges: &[(u32, u32)], leaf: u32, vertex: u32) -> (u32, u32) {
        let joined = |a, b| edges.contains(&(a, b)) || edges.contains(&(b, a));
        let near: Vec<u32> = (0..20).filter(|&u| joined(u, vertex)).collect();
        let missing = |&(a, b): &(u32, u32)| a < b && a < leaf && !joined(a, b);
        let pairs = near.iter().flat_map(|&a| near.iter().map(move |&b| (a, b)));
        (2 * pairs.filter(missing).count() as u32, near.len() as u32)
    }

    #[test]
    fn costs_are_the_fill_they_are_said_to_be_and_only_changed_vertices_change_theirs() {
        for seed in 0..20 {
            let mut rng = Rng::new(seed);
            let mut edges: Vec<(u32, u32)> = (0..20)
                .flat_map(|a| (a + 1..20).map(move |b| (a, b)))
                .filter(|_| rng.below(4) == 0)
                .collect();
            let weighted: Vec<_> = edges.iter().map(|&(a, b)| (a, b, 1)).collect();
            let graph = Graph::from_edges(20, &weighted).unwrap();
            let leaf: Vec<u32> = (0..14).collect();
            // The columns of the halo are its vertices in order, without those that touch no leaf vertex.
            let mut elimination = Elimination::new(&graph, &leaf);
            let mut cost: Vec<_> = (0..14).map(|v| elimination.cost(v)).collect();
            for pivot in 0..14 {
                for v in pivot..14 {
                    assert_eq!(cost[v as usize], cost_by_definition(&edges, 14, v), "seed {seed}");
                }
                let near: Vec<u32> = (0..20)
                    .filter(|&u| edges.contains(&(u, pivot)) || edges.contains(&(pivot, u)))
                    .collect();
                edges.retain(|&(a, b)| a != pivot && b != pivot);
                for (i, &a) in near.iter().enumerate() {
                    edges.extend(near[i + 1..].iter().map(|&b| (a, b)));
                }
                elimination.eliminate(pivot as usize);
                for v in elimination.changed() {
                    cost[v] = elimination.cost(v);
                }
            }
        }
    }
}
