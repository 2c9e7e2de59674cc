//! Contraction of a matching: pairs become vertices, parallel edges become one with the sum of their weights.

use crate::Graph;

/// Coarse vertex of each vertex, numbered in the order of the first of each pair: neighbours stay close in memory.
pub(crate) fn number_pairs(partner: &[u32]) -> (Vec<u32>, usize) {
    let mut coarse_of = vec![0; partner.len()];
    let mut count = 0;
    for v in 0..partner.len() {
        let other = partner[v] as usize;
        if other < v {
            coarse_of[v] = coarse_of[other];
        } else {
            coarse_of[v] = count;
            count += 1;
        }
    }
    (coarse_of, count as usize)
}

/// The coarse graph. A marker per coarse vertex says where its entry stands in the row being written, so that every
/// edge costs one look-up; edges inside a pair gather in the row's first entry, which is dropped in the end.
pub(crate) fn contract(graph: &Graph, partner: &[u32], coarse_of: &[u32], count: usize) -> Graph {
    let mut offsets = Vec::with_capacity(count + 1);
    let mut vertex_weights = Vec::with_capacity(count);
    let mut neighbours: Vec<u32> = Vec::with_capacity(graph.neighbours.len() + 1);
    let mut edge_weights: Vec<i32> = Vec::with_capacity(graph.neighbours.len() + 1);
    // One past the entry's position, so that 0 means "not met".
    let mut place = vec![0u32; count];
    offsets.push(0);
    for v in 0..graph.vertex_count() {
        let other = partner[v] as usize;
        if other < v {
            continue;
        }
        let start = neighbours.len();
        let mut add = |coarse: u32, weight: i32| {
            let at = place[coarse as usize] as usize;
            if at > start {
                edge_weights[at - 1] += weight;
            } else {
                neighbours.push(coarse);
                edge_weights.push(weight);
                place[coarse as usize] = neighbours.len() as u32;
            }
        };
        add(coarse_of[v], 0);
        graph.edges(v).for_each(|(u, weight)| add(coarse_of[u], weight));
        if other != v {
            graph
                .edges(other)
                .for_each(|(u, weight)| add(coarse_of[u], weight));
        }
        neighbours.swap_remove(start);
        edge_weights.swap_remove(start);
        place[coarse_of[v] as usize] = 0;
        if let Some(&moved) = neighbours.get(start) {
            place[moved as usize] = start as u32 + 1;
        }
        let alone = if other == v {
            0
        } else {
            graph.vertex_weights[other]
        };
        vertex_weights.push(graph.vertex_weights[v] + alone);
        offsets.push(neighbours.len());
    }
    Graph {
        offsets,
        neighbours,
        vertex_weights,
        edge_weights,
    }
}
