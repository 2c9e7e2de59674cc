//! Minimum degree elimination (Tinney and Walker 1967) of small graphs, exact: the elimination graph is a bit matrix, so
//! that eliminating a vertex is an "or" of rows. O(n² d / 64) for n vertices whose degree stays about d.

use crate::Graph;

/// The vertices in the order in which they are eliminated: always one of least degree in the graph left, the first of
/// equals. Meant for a few hundred vertices; the matrix takes n² bits.
pub(crate) fn min_degree(whole: &Graph, leaf: &[u32]) -> Vec<u32> {
    let count = leaf.len();
    let mut halo: Vec<u32> = leaf
        .iter()
        .flat_map(|&v| whole.neighbours(v as usize))
        .copied()
        .filter(|u| leaf.binary_search(u).is_err())
        .collect();
    halo.sort_unstable();
    halo.dedup();
    let words = (count + halo.len()).div_ceil(64);
    let column = |u: u32| {
        leaf.binary_search(&u)
            .unwrap_or_else(|_| count + halo.binary_search(&u).unwrap_or_default())
    };
    let mut rows = vec![0u64; count * words];
    for (row, &v) in rows.chunks_exact_mut(words).zip(leaf) {
        for &u in whole.neighbours(v as usize) {
            let u = column(u);
            row[u / 64] |= 1 << (u % 64);
        }
    }
    let mut degree: Vec<u32> = leaf.iter().map(|&v| whole.degree(v as usize) as u32).collect();
    let mut left: Vec<u32> = (0..count as u32).collect();
    let mut order = Vec::with_capacity(count);
    let mut pivot_row = vec![0u64; words];
    while let Some(at) = (0..left.len()).min_by_key(|&i| (degree[left[i] as usize], left[i])) {
        let pivot = left.swap_remove(at) as usize;
        order.push(leaf[pivot]);
        pivot_row.copy_from_slice(&rows[pivot * words..(pivot + 1) * words]);
        for u in ones(&pivot_row).take_while(|&u| u < count) {
            let row = &mut rows[u * words..(u + 1) * words];
            row.iter_mut().zip(&pivot_row).for_each(|(a, b)| *a |= b);
            row[pivot / 64] &= !(1 << (pivot % 64));
            row[u / 64] &= !(1 << (u % 64));
            degree[u] = row.iter().map(|word| word.count_ones()).sum();
        }
    }
    order
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
    use crate::{Ordering, column_counts};

    #[test]
    fn trees_are_eliminated_without_fill() {
        let edges: Vec<_> = (1..150u32).map(|v| ((v - 1) / 2, v, 1)).collect();
        let tree = Graph::from_edges(150, &edges).unwrap();
        let ordering = Ordering::from_order(min_degree(&tree, &(0..150).collect::<Vec<u32>>())).unwrap();
        assert_eq!(column_counts(&tree, &ordering).iter().sum::<u64>(), 150 + 149);
    }
}
