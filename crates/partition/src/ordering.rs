//! Nested dissection (George 1973): separators last, halves before them, and so on in the halves; small leaves by minimum
//! degree.

use crate::bisect::induced;
use crate::min_degree::min_degree;
use crate::rng::Rng;
use crate::separator::{SEPARATOR, separate};
use crate::team::Team;
use crate::{Graph, PartitionError};

/// How a graph is ordered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OrderingOptions {
    /// Equal seeds give equal orderings, on any number of threads.
    pub seed: u64,
    /// Graphs of at most this many vertices are ordered by minimum degree; at most 1000 is sensible.
    pub leaf_size: usize,
    /// Separators tried in each step (half as many on small graphs); the lightest is kept.
    pub tries: usize,
    /// Threads to use, at least 1.
    pub threads: usize,
}

impl Default for OrderingOptions {
    fn default() -> Self {
        Self {
            seed: 0,
            leaf_size: 120,
            tries: 4,
            threads: 1,
        }
    }
}

/// An elimination order and its inverse.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ordering {
    /// The vertex that is eliminated at each position.
    pub order: Vec<u32>,
    /// The position at which each vertex is eliminated.
    pub position: Vec<u32>,
}

impl Ordering {
    /// The ordering with this `order`; none when it is no permutation.
    pub fn from_order(order: Vec<u32>) -> Option<Self> {
        let mut position = vec![u32::MAX; order.len()];
        for (i, &v) in order.iter().enumerate() {
            let place = position.get_mut(v as usize)?;
            if *place != u32::MAX {
                return None;
            }
            *place = i as u32;
        }
        Some(Self { order, position })
    }
}

/// A fill-reducing order for the Cholesky factorisation of symmetric matrices with this graph. Edge weights do not
/// matter; vertices of weight 0 count as 1.
///
/// ```
/// # use partition::{Graph, OrderingOptions, column_counts, nested_dissection};
/// let path = Graph::from_edges(1000, &(0..999).map(|i| (i, i + 1, 1)).collect::<Vec<_>>())?;
/// let ordering = nested_dissection(&path, &OrderingOptions::default())?;
/// assert!(column_counts(&path, &ordering).iter().sum::<u64>() < 3000);
/// # Ok::<(), partition::PartitionError>(())
/// ```
///
/// # Errors
/// When the threads cannot be started.
pub fn nested_dissection(graph: &Graph, options: &OrderingOptions) -> Result<Ordering, PartitionError> {
    let team = Team::new(options.threads)?;
    let mut unit = graph.clone();
    unit.vertex_weights.fill(1);
    unit.edge_weights.fill(1);
    let order = Dissection {
        options,
        team: &team,
        whole: &unit,
    }
    .order(
        &unit,
        &(0..unit.vertex_count() as u32).collect::<Vec<_>>(),
        &Rng::new(options.seed),
    );
    let mut position = vec![0; order.len()];
    order
        .iter()
        .enumerate()
        .for_each(|(i, &v)| position[v as usize] = i as u32);
    Ok(Ordering { order, position })
}

/// Smaller graphs get half of the tries: they are many, and their separators fill in little.
const SMALL: usize = 1000;

struct Dissection<'a> {
    options: &'a OrderingOptions,
    team: &'a Team,
    whole: &'a Graph,
}

impl Dissection<'_> {
    /// The vertices of a graph in order of elimination.
    fn order(&self, graph: &Graph, names: &[u32], rng: &Rng) -> Vec<u32> {
        if graph.vertex_count() <= self.options.leaf_size.max(1) {
            return min_degree(self.whole, names);
        }
        if graph.neighbours.is_empty() {
            return names.to_vec();
        }
        let tries = self
            .options
            .tries
            .div_ceil(if graph.vertex_count() < SMALL { 2 } else { 1 });
        let separation = separate(graph, tries, self.team, &mut rng.fork(0));
        if separation.weight[0] == 0 || separation.weight[1] == 0 {
            return by_degree(graph).into_iter().map(|v| names[v as usize]).collect();
        }
        let half = |side: u8| {
            let (subgraph, vertices) = induced(graph, &separation.side, side);
            let names: Vec<u32> = vertices.iter().map(|&v| names[v as usize]).collect();
            self.order(&subgraph, &names, &rng.fork(1 + u64::from(side)))
        };
        let (mut order, second) = self.team.join(|| half(0), || half(1));
        order.extend(second);
        order.extend(
            (0..graph.vertex_count())
                .filter(|&v| separation.side[v] == SEPARATOR)
                .map(|v| names[v]),
        );
        order
    }
}

/// For graphs that have no separator worth the name, such as cliques.
fn by_degree(graph: &Graph) -> Vec<u32> {
    let mut order: Vec<u32> = (0..graph.vertex_count() as u32).collect();
    order.sort_by_key(|&v| graph.degree(v as usize));
    order
}
