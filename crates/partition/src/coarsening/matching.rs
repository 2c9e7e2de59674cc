//! Sorted heavy-edge matching with a two-hop step (Karypis and Kumar 1998; two-hop: LaSalle et al. 2015).
//!
//! Vertices are visited in random order, those of small degree first, for they have the fewest partners to lose. Each
//! takes the free neighbour of greatest w²/c (edge weight w, partner's vertex weight c), which keeps coarse vertices
//! of similar weight. The order is random only inside windows of consecutive vertices: as good, and kind to the cache.

use job::{Job, JobError};

use crate::Graph;
use crate::rng::Rng;

/// Vertices that one thread matches at a time: about 1 MB of a mesh's rows. With four times as many
/// cuts are 0.3 % longer.
const BLOCK: usize = 1 << 14;
/// Vertices of one window of the random order: about 250 kB of a mesh's rows, which stay in a core's cache. With 1024 cuts
/// are 0.8 % longer, with 65 536 they are 1.2 %.
const WINDOW: usize = 4096;
/// Two-hop matching starts when more than one in `STALL` vertices stays alone (METIS, `coarsen.c`).
const STALL: usize = 10;
const NONE: u32 = u32::MAX;

/// Partner of each vertex (itself when alone). No pair weighs more than `max_weight`, and none lies across a border
/// of one of the partitions `kept`.
///
/// Large graphs are matched inside blocks of consecutive vertices first, in parallel; the blocks do not depend on the
/// number of threads. What is left over is matched freely then.
pub(crate) fn heavy_edge_matching(
    graph: &Graph,
    max_weight: i64,
    kept: &[Vec<u32>],
    job: &Job,
    rng: &mut Rng,
) -> Result<Vec<u32>, JobError> {
    let count = graph.vertex_count();
    let mut partner = vec![NONE; count];
    let uniform = is_uniform(graph);
    let fits = |v: usize, u: usize| {
        i64::from(graph.vertex_weights[v]) + i64::from(graph.vertex_weights[u]) <= max_weight
            && kept.iter().all(|part| part[v] == part[u])
    };
    if count > BLOCK {
        let source = rng.fork(0);
        job.for_chunks(&mut partner, BLOCK, |i, block| {
            if job.is_cancelled() {
                return;
            }
            let first = i * BLOCK;
            let vertices = (first as u32..(first + block.len()) as u32).collect();
            let order = visiting_order(graph, vertices, &mut source.fork(i as u64));
            match_heaviest(graph, &order, first, block, uniform, &fits);
        })?;
        job.go_on()?;
    }
    let left = (0..count as u32)
        .filter(|&v| partner[v as usize] == NONE)
        .collect();
    let order = visiting_order(graph, left, rng);
    match_heaviest(graph, &order, 0, &mut partner, uniform, &fits);
    let alone: Vec<u32> = (0..count as u32)
        .filter(|&v| partner[v as usize] == NONE)
        .collect();
    if alone.len() > count / STALL {
        match_two_hop(graph, &alone, &fits, &mut partner);
    } else {
        match_isolated(graph, &alone, &fits, &mut partner);
    }
    for v in alone {
        if partner[v as usize] == NONE {
            partner[v as usize] = v;
        }
    }
    Ok(partner)
}

/// Whether any free neighbour is as good as any other.
fn is_uniform(graph: &Graph) -> bool {
    let all_equal = |weights: &[i32]| {
        weights
            .first()
            .is_none_or(|first| weights.iter().all(|w| w == first))
    };
    all_equal(&graph.edge_weights) && all_equal(&graph.vertex_weights)
}

/// Gives each vertex of `order` the best free neighbour among the vertices `first..` that `partner` covers, or the first
/// when the graph is `uniform`.
fn match_heaviest(
    graph: &Graph,
    order: &[u32],
    first: usize,
    partner: &mut [u32],
    uniform: bool,
    fits: &impl Fn(usize, usize) -> bool,
) {
    for &v in order {
        let v = v as usize;
        if partner[v - first] != NONE {
            continue;
        }
        // The rating of the best so far is squared weight over vertex weight, kept as a fraction.
        let (mut best, mut best_squared, mut best_weight) = (NONE, 0.0f32, 1.0f32);
        for (u, weight) in graph.edges(v) {
            if partner.get(u.wrapping_sub(first)) == Some(&NONE) && fits(v, u) {
                let squared = weight as f32 * weight as f32;
                let partner_weight = graph.vertex_weights[u].max(1) as f32;
                if squared * best_weight > best_squared * partner_weight {
                    (best, best_squared, best_weight) = (u as u32, squared, partner_weight);
                    if uniform {
                        break;
                    }
                }
            }
        }
        if best != NONE {
            partner[v - first] = best;
            partner[best as usize - first] = v as u32;
        }
    }
}

/// Pairs lone vertices whose heaviest edges lead to the same neighbour, and isolated vertices with each other.
fn match_two_hop(graph: &Graph, alone: &[u32], fits: &impl Fn(usize, usize) -> bool, partner: &mut [u32]) {
    let mut waiting = vec![NONE; graph.vertex_count() + 1];
    for &v in alone {
        let v = v as usize;
        let anchor = graph.edges(v).max_by_key(|&(u, w)| (w, std::cmp::Reverse(u)));
        let place = anchor.map_or(graph.vertex_count(), |(u, _)| u);
        let other = waiting[place];
        if other != NONE && fits(v, other as usize) {
            partner[v] = other;
            partner[other as usize] = v as u32;
            waiting[place] = NONE;
        } else {
            waiting[place] = v as u32;
        }
    }
}

/// Pairs vertices without neighbours, such as components that were contracted whole, with each other.
fn match_isolated(graph: &Graph, alone: &[u32], fits: &impl Fn(usize, usize) -> bool, partner: &mut [u32]) {
    let mut waiting = NONE;
    for &v in alone.iter().filter(|&&v| graph.degree(v as usize) == 0) {
        if waiting != NONE && fits(v as usize, waiting as usize) {
            partner[v as usize] = waiting;
            partner[waiting as usize] = v;
            waiting = NONE;
        } else {
            waiting = v;
        }
    }
}

/// The vertices, sorted by degree up to the average degree, random within windows.
fn visiting_order(graph: &Graph, mut vertices: Vec<u32>, rng: &mut Rng) -> Vec<u32> {
    for window in vertices.chunks_mut(WINDOW) {
        rng.shuffle(window);
    }
    let average = graph.neighbours.len() / graph.vertex_count().max(1) + 1;
    let key = |v: u32| graph.degree(v as usize).min(average);
    let mut start = vec![0usize; average + 2];
    for &v in &vertices {
        start[key(v) + 1] += 1;
    }
    for d in 0..=average {
        start[d + 1] += start[d];
    }
    let mut order = vec![0; vertices.len()];
    for &v in &vertices {
        let at = &mut start[key(v)];
        order[*at] = v;
        *at += 1;
    }
    order
}
