//! Localised k-way Fiduccia–Mattheyses search (Sanders and Schulz, "Engineering multilevel graph partitioning
//! algorithms", 2011).
//!
//! From every few boundary vertices, in random order, a small search of its own starts: it moves the best vertex near by, also
//! at a loss, and is rolled back to its best prefix. Local searches climb out of hills from which one search over the
//! whole boundary would run away to easier places. A vertex moves at most once a round, which bounds the time.
//!
//! Two threads search at the same time where that pays, each in half of the parts; recursive bisection numbers them so that
//! the halves have a short border with each other. The work is divided so on any number of threads.

use job::{Job, JobError};

use super::gain_cache::{GainCache, NONE};
use super::kway::{KWay, Move};
use crate::Graph;
use crate::buckets::GainBuckets;
use crate::rng::Rng;

/// Vertices with more neighbours, as in stars, are no use to a local search: each is looked at anew whenever one of its
/// neighbours moves, which costs time of the order of its degree squared. No mesh has such vertices. On graphs of 20 000
/// vertices grown by preferential attachment, 100 or 400 change cuts by less than 0.1 %, and time to 0.8 and 1.1 times.
const MAX_DEGREE: usize = 200;

/// Bounds of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalSearch {
    /// Rounds over the boundary; a round that gains nothing is the last.
    pub(crate) rounds: usize,
    /// Moves without success after which one search gives up.
    pub(crate) patience: usize,
    /// Boundary vertices from which one search starts.
    pub(crate) seeds: usize,
    /// A search gives up before it loses so many times the average edge weight since its best state: few of those that do
    /// come back.
    pub(crate) max_loss: f64,
    /// No search starts from a vertex whose edges weigh more than so many times as much to its own part as to another.
    pub(crate) max_internal: f64,
}

/// Workspaces for the searches on a graph and all that it was coarsened to.
pub(crate) struct Searches<'a> {
    first: Workspace,
    /// Of the other thread, once there is work for it.
    second: Option<Workspace>,
    job: &'a Job,
}

impl<'a> Searches<'a> {
    /// For graphs of at most `count` vertices.
    pub(crate) fn new(count: usize, job: &'a Job) -> Self {
        Self {
            first: Workspace::new(count),
            second: None,
            job,
        }
    }

    /// Lowers the cut; no part gets above its limit that was below it. `boundary` must hold all boundary vertices, and
    /// does so again afterwards.
    pub(crate) fn refine(
        &mut self,
        state: &mut KWay<'_>,
        boundary: &mut Vec<u32>,
        search: LocalSearch,
        rng: &mut Rng,
    ) -> Result<(), JobError> {
        let bounds = Bounds::of(state.graph, &search);
        let mut seeds = boundary.clone();
        for _ in 0..search.rounds {
            rng.shuffle(&mut seeds);
            // Where nothing changed the next round would find nothing either.
            seeds = if state.limits.len() < MANY_PARTS || seeds.len() < MANY_SEEDS {
                self.first.search_all(state, &seeds, &bounds, self.job)?
            } else {
                self.round_by_halves(state, &seeds, &bounds, rng)?
            };
            boundary.extend_from_slice(&seeds);
            seeds.retain(|&v| state.on_boundary(v as usize));
            if seeds.is_empty() {
                break;
            }
        }
        state.update_boundary(boundary, &[]);
        Ok(())
    }

    /// First the moves inside of either half of the parts, at the same time and without regard to the other half; then
    /// those of the vertices between the halves.
    fn round_by_halves(
        &mut self,
        state: &mut KWay<'_>,
        seeds: &[u32],
        bounds: &Bounds,
        rng: &mut Rng,
    ) -> Result<Vec<u32>, JobError> {
        let Self { first, second, job } = self;
        let second = second.get_or_insert_with(|| Workspace::new(first.mark.len()));
        let parts = state.limits.len() as u32;
        let half = parts / 2;
        let is_low = |state: &KWay<'_>, v: u32| state.part[v as usize] < half;
        let (low, high): (Vec<u32>, Vec<u32>) = seeds.iter().partition(|&&v| is_low(state, v));
        let mut above = state.among(half..parts);
        state.movable = 0..half;
        let (changed, changed_above) = job.join(
            || first.search_all(state, &low, bounds, job),
            || second.search_all(&mut above, &high, bounds, job),
        )?;
        let (mut changed, changed_above) = (changed?, changed_above?);
        state.movable = 0..parts;
        for v in changed_above.iter().map(|&v| v as usize) {
            if above.may_move(v) && above.part[v] != state.part[v] {
                state.apply(v, above.part[v]);
            }
        }
        changed.extend(changed_above);
        let between = |v: &&u32| {
            let mut neighbours = state.graph.neighbours(**v as usize).iter();
            neighbours.any(|&u| is_low(state, u) != is_low(state, **v))
        };
        let mut seeds: Vec<u32> = seeds.iter().chain(&changed).filter(between).copied().collect();
        tidy(&mut seeds);
        rng.shuffle(&mut seeds);
        changed.extend(first.search_all(state, &seeds, bounds, job)?);
        tidy(&mut changed);
        Ok(changed)
    }
}

/// From so many seeds and parts on, the halves are searched by themselves. Fewer seeds are done before another thread
/// has begun, and of two or three parts nearly all borders lie between the halves. From 100 or 1000 seeds on, cuts differ by
/// 0.1 %.
const MANY_SEEDS: usize = 300;
const MANY_PARTS: usize = 4;

fn tidy(vertices: &mut Vec<u32>) {
    vertices.sort_unstable();
    vertices.dedup();
}

/// Workspace for the searches of one thread.
struct Workspace {
    queue: GainBuckets,
    cache: GainCache,
    /// Number of the run in which a vertex was moved for good, or is being moved.
    mark: Vec<u32>,
    run: u32,
    /// Moves of the current search.
    moves: Vec<Step>,
    /// Vertices moved for good and their neighbours.
    changed: Vec<u32>,
}

/// A move that may have to be taken back.
struct Step {
    vertex: u32,
    from: u32,
    /// Time of the cache before it.
    time: usize,
}

/// Degree for which patience is given, a mesh's. With 3 cuts are 1.0 % longer; with 12, which is four times the patience, they
/// are 0.5 % shorter.
const MESH_DEGREE: f64 = 6.0;
/// The degree below which patience does not rise any more. With 2 or 6 cuts differ by 0.04 % at most.
const LEAST_DEGREE: f64 = 4.0;
/// Dense graphs have at least this patience. With 1 cuts of random geometric graphs of 15 and 60 neighbours a vertex are 0.1 %
/// longer, with 6 they are 0.5 % shorter.
const LEAST_PATIENCE: usize = 3;

/// A search's bounds on one graph.
struct Bounds {
    seeds: usize,
    patience: usize,
    max_loss: i64,
    max_internal: f64,
    max_gain: i32,
}

impl Bounds {
    /// The nominal patience is for the six neighbours of a mesh's vertex; dense graphs, whose moves cost more, get less.
    fn of(graph: &Graph, search: &LocalSearch) -> Self {
        let entries = graph.neighbours.len().max(1) as f64;
        let degree = entries / graph.vertex_count().max(1) as f64;
        let ratio = MESH_DEGREE / degree.max(LEAST_DEGREE);
        let average = 2.0 * graph.total_edge_weight() as f64 / entries;
        Self {
            seeds: search.seeds,
            patience: ((search.patience as f64 * ratio * ratio).ceil() as usize).max(LEAST_PATIENCE),
            max_loss: (search.max_loss * average).round() as i64,
            max_internal: search.max_internal,
            max_gain: graph.max_weighted_degree(),
        }
    }
}

impl Workspace {
    fn new(count: usize) -> Self {
        Self {
            queue: GainBuckets::new(count, 0),
            cache: GainCache::new(count),
            mark: vec![0; count],
            run: 0,
            moves: Vec::new(),
            changed: Vec::new(),
        }
    }

    /// A search from every few seeds, in their order; answers with the vertices that moved and their neighbours, ascending.
    fn search_all(
        &mut self,
        state: &mut KWay<'_>,
        seeds: &[u32],
        bounds: &Bounds,
        job: &Job,
    ) -> Result<Vec<u32>, JobError> {
        self.run += 1;
        self.cache.forget();
        self.queue.set_max_gain(bounds.max_gain);
        for group in seeds.chunks(bounds.seeds) {
            job.go_on()?;
            for &v in group {
                self.enqueue_seed(state, v as usize, bounds);
            }
            self.search(state, bounds);
        }
        let mut changed = std::mem::take(&mut self.changed);
        tidy(&mut changed);
        Ok(changed)
    }

    /// Queues a seed unless so much of its edges' weight leads into its own part that a search from it is hopeless.
    fn enqueue_seed(&mut self, state: &mut KWay<'_>, vertex: usize, bounds: &Bounds) {
        let entry = self.cache.entry(state, vertex);
        if f64::from(entry.internal) <= bounds.max_internal * f64::from(entry.external) {
            self.enqueue(state, vertex);
        }
    }

    fn search(&mut self, state: &mut KWay<'_>, bounds: &Bounds) {
        let (mut gained, mut best, mut best_len) = (0i64, 0i64, 0usize);
        while let Some(v) = self.queue.pop() {
            let Some(step) = self.best_move(state, v) else {
                continue;
            };
            gained += i64::from(step.gain);
            if best - gained > bounds.max_loss {
                break;
            }
            self.moves.push(Step {
                vertex: v as u32,
                from: state.part[v],
                time: self.cache.now(),
            });
            self.cache.apply(state, v, step.to);
            self.mark[v] = self.run;
            if gained > best {
                best = gained;
                best_len = self.moves.len();
            } else if self.moves.len() - best_len > bounds.patience {
                break;
            }
            let graph = state.graph;
            for &u in graph.neighbours(v) {
                self.enqueue(state, u as usize);
            }
        }
        self.queue.clear();
        self.finish(state, best_len);
    }

    /// Keeps the first moves and takes the others back.
    fn finish(&mut self, state: &mut KWay<'_>, keep: usize) {
        if let Some(step) = self.moves.get(keep) {
            self.cache.restore(step.time);
        }
        for step in self.moves.drain(keep..).rev() {
            state.apply(step.vertex as usize, step.from);
            self.mark[step.vertex as usize] = 0;
        }
        self.cache.commit();
        for step in self.moves.drain(..) {
            self.changed.push(step.vertex);
            self.changed.extend(state.graph.neighbours(step.vertex as usize));
        }
    }

    /// Queues a vertex at its present gain unless it may not move.
    fn enqueue(&mut self, state: &mut KWay<'_>, vertex: usize) {
        if self.mark[vertex] == self.run || !state.may_move(vertex) || state.graph.degree(vertex) > MAX_DEGREE
        {
            return;
        }
        match self.best_move(state, vertex) {
            Some(step) => self.queue.set(vertex, step.gain),
            None => self.queue.remove(vertex),
        }
    }

    /// The best move into a part with room.
    fn best_move(&mut self, state: &mut KWay<'_>, vertex: usize) -> Option<Move> {
        let entry = self.cache.entry(state, vertex);
        if entry.to == NONE {
            None
        } else if state.has_room(entry.to, vertex) {
            Some(Move {
                gain: entry.gain(),
                to: entry.to,
            })
        } else {
            state.best_move(vertex)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refinement::kway::cut;

    /// A square grid in four quarters with frayed borders.
    fn ragged_quarters(side: usize, rng: &mut Rng) -> (Graph, Vec<u32>) {
        let mut edges = Vec::new();
        let mut part = Vec::new();
        for v in 0..side * side {
            let (x, y) = (v % side, v / side);
            if x + 1 < side {
                edges.push((v as u32, v as u32 + 1, 1));
            }
            if y + 1 < side {
                edges.push((v as u32, (v + side) as u32, 1));
            }
            let mut beyond = |z: usize| u32::from(z + rng.below(4) > side / 2 + 1);
            part.push(2 * beyond(y) + beyond(x));
        }
        (Graph::from_edges(side * side, &edges).unwrap(), part)
    }

    #[test]
    fn halves_searched_at_the_same_time_shorten_the_border_within_the_limits() {
        let mut rng = Rng::new(5);
        let (graph, part) = ragged_quarters(120, &mut rng);
        let limits = [3900; 4];
        let search = LocalSearch {
            rounds: 3,
            patience: 15,
            seeds: 3,
            max_loss: 3.0,
            max_internal: 1.5,
        };
        let mut results = Vec::new();
        for threads in [1, 2, 3] {
            let job = Job::new(threads);
            let mut state = KWay::new(&graph, part.clone(), &limits);
            assert_eq!(state.excess(), 0);
            let mut boundary = state.boundary();
            assert!(boundary.len() > MANY_SEEDS);
            let searched =
                Searches::new(14400, &job).refine(&mut state, &mut boundary, search, &mut Rng::new(1));
            assert_eq!(searched, Ok(()));
            assert_eq!(state.excess(), 0);
            let fresh = KWay::new(&graph, state.part.clone(), &limits);
            assert_eq!(state.weight, fresh.weight);
            assert_eq!(boundary, fresh.boundary());
            assert!(cut(&graph, &state.part) < cut(&graph, &part) * 3 / 4);
            results.push(state.part);
        }
        assert!(results.iter().all(|part| *part == results[0]));
    }

    #[test]
    fn vertices_outside_of_the_movable_parts_stand_still() {
        let mut rng = Rng::new(6);
        let (graph, part) = ragged_quarters(60, &mut rng);
        let limits = [2000; 4];
        let mut state = KWay::new(&graph, part.clone(), &limits).among(0..2);
        let bounds = Bounds {
            seeds: 3,
            patience: 15,
            max_loss: 3,
            max_internal: 1.5,
            max_gain: graph.max_weighted_degree(),
        };
        let seeds: Vec<u32> = (0..3600).filter(|&v| part[v as usize] < 2).collect();
        Workspace::new(3600)
            .search_all(&mut state, &seeds, &bounds, &Job::default())
            .unwrap();
        assert_ne!(state.part, part);
        for (before, after) in part.iter().zip(&state.part) {
            assert!(before == after || (*before < 2 && *after < 2));
        }
    }
}
