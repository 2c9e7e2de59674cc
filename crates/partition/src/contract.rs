//! Contraction of a matching: pairs become vertices, parallel edges become one with the sum of their weights.

use crate::Graph;

const NONE: u32 = u32::MAX;

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
/// edge costs one look-up.
pub(crate) fn contract(graph: &Graph, partner: &[u32], coarse_of: &[u32], count: usize) -> Graph {
    let mut offsets = Vec::with_capacity(count + 1);
    let mut vertex_weights = Vec::with_capacity(count);
    let expected = graph.neighbours.len() * 5 / 8;
    let mut neighbours: Vec<u32> = Vec::with_capacity(expected);
    let mut edge_weights: Vec<i32> = Vec::with_capacity(expected);
    let mut place = vec![NONE; count];
    offsets.push(0);
    for v in 0..graph.vertex_count() {
        let other = partner[v] as usize;
        if other < v {
            continue;
        }
        let (start, own) = (neighbours.len(), coarse_of[v]);
        let mut add_row = |fine: usize| {
            for (u, weight) in graph.edges(fine) {
                let coarse = coarse_of[u];
                let at = place[coarse as usize];
                if at != NONE && at as usize >= start {
                    edge_weights[at as usize] += weight;
                } else if coarse != own {
                    place[coarse as usize] = neighbours.len() as u32;
                    neighbours.push(coarse);
                    edge_weights.push(weight);
                }
            }
        };
        add_row(v);
        if other != v {
            add_row(other);
        }
        let alone = if other == v { 0 } else { graph.vertex_weights[other] };
        vertex_weights.push(graph.vertex_weights[v] + alone);
        offsets.push(neighbours.len());
    }
    Graph { offsets, neighbours, vertex_weights, edge_weights }
}
