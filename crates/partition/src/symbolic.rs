//! Symbolic Cholesky factorisation: what an ordering costs, without numbers.

use crate::{Graph, Ordering};

const NONE: u32 = u32::MAX;

/// The elimination tree (Liu 1990) of a symmetric matrix with this graph: for each position of the ordering the
/// position of its parent, the first row below the diagonal in its column of L; none for roots.
pub fn elimination_tree(graph: &Graph, ordering: &Ordering) -> Vec<Option<u32>> {
    parents(graph, ordering)
        .into_iter()
        .map(|parent| (parent != NONE).then_some(parent))
        .collect()
}

/// Entries of each column of the Cholesky factor L, diagonal included, by position. Their sum is nnz(L), the sum of
/// their squares the number of multiplications of the factorisation, nearly. O(nnz(L)) time, O(n) memory.
///
/// ```
/// # use partition::{Graph, Ordering, column_counts};
/// let star = Graph::from_edges(4, &[(0, 1, 1), (0, 2, 1), (0, 3, 1)])?;
/// let natural = Ordering::from_order(vec![0, 1, 2, 3]);
/// let hub_last = Ordering::from_order(vec![1, 2, 3, 0]);
/// assert_eq!(natural.map(|o| column_counts(&star, &o)), Some(vec![4, 3, 2, 1]));
/// assert_eq!(hub_last.map(|o| column_counts(&star, &o)), Some(vec![2, 2, 2, 1]));
/// # Ok::<(), partition::PartitionError>(())
/// ```
pub fn column_counts(graph: &Graph, ordering: &Ordering) -> Vec<u64> {
    let parent = parents(graph, ordering);
    let mut counts = vec![1u64; parent.len()];
    let mut row_seen = vec![NONE; parent.len()];
    for row in 0..parent.len() as u32 {
        row_seen[row as usize] = row;
        for &u in graph.neighbours(ordering.order[row as usize] as usize) {
            // The entries of a row of L lie on the tree paths from the entries of A up to the diagonal.
            let mut column = ordering.position[u as usize];
            while column < row && row_seen[column as usize] != row {
                row_seen[column as usize] = row;
                counts[column as usize] += 1;
                column = parent[column as usize];
            }
        }
    }
    counts
}

/// Liu's algorithm with path compression.
fn parents(graph: &Graph, ordering: &Ordering) -> Vec<u32> {
    let count = graph.vertex_count();
    let mut parent = vec![NONE; count];
    let mut ancestor = vec![NONE; count];
    for row in 0..count as u32 {
        for &u in graph.neighbours(ordering.order[row as usize] as usize) {
            let mut column = ordering.position[u as usize];
            while column < row {
                let next = std::mem::replace(&mut ancestor[column as usize], row);
                if next == NONE {
                    parent[column as usize] = row;
                    break;
                }
                column = next;
            }
        }
    }
    parent
}
