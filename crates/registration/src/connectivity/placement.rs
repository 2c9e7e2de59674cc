//! Chooses between the isomorphisms of symmetric parts and of equal parts by geometry.
//!
//! Parts that can be mapped in one way only fix a similarity of suspect to original. Without such a part,
//! every image of the seed flag of one part, the anchor, is a hypothesis. Under the similarity of a
//! hypothesis every other part takes the free image that lies nearest. Hypotheses are ranked by the residual
//! of all pairs together. What was bent or posed lies where no similarity has it: there a part is better placed
//! by the parts around it, and that makes another map.
//!
//! Work is bounded by [`BUDGET`] in each of three stages. Images of the anchor are compared on growing
//! neighbourhoods of its seed (successive halving); those that remain by how near they bring the centroids of
//! a sample of the other parts; the best of these by placing all parts.

use super::colours::{Colouring, Colours};
use super::correspondence::Correspondence;
use super::graph::Graph;
use super::propagation::{Flag, Propagation, fit};
use job::{Job, JobError};
use mesh::{Similarity, Vec3};
use std::{cmp::Ordering, collections::HashMap, ops::Range};

/// Vertices visited in each stage of the choice.
const BUDGET: usize = 20_000_000;

/// Images looked at to place parts, after which the rest is left: only thousands of equal parts far from their
/// places need so many.
const MOST_VISITS: usize = 20 * BUDGET;

/// The fewest vertices on which images of the anchor are compared.
const SMALLEST_NEIGHBOURHOOD: usize = 64;

/// Of the images of a part, this many that lie nearest by centroid and seed are tried in full.
const NEAREST_IMAGES: usize = 12;

/// So many other parts say how well an image of the anchor places the rest.
const SAMPLED_PARTS: usize = 32;

/// A map is kept beside the best one when its residual is at most so many times larger.
const INDISTINGUISHABLE: f64 = 2.0;

/// A similarity that leaves no more than this share of the diagonal, root mean square, has all parts where they belong.
const IN_PLACE: f64 = 3e-3;

/// More parts than this are not placed by those around them.
const MOST_GROWN: usize = 1000;

/// Vertices of parts around another by which that is placed.
const SURROUNDING: usize = 64;

type Pairs = Vec<(u32, u32)>;

/// Maps of as many parts as possible, the best first, at most `limit`; none when no part can be mapped.
pub(super) fn candidates(
    from: &Graph<'_>,
    onto: &Graph<'_>,
    colours: &Colours,
    limit: usize,
    job: &Job,
) -> Result<Vec<Correspondence>, JobError> {
    let mut search = Search::new(from, onto, colours, job);
    let starts = search.hypotheses()?;
    let mut maps = starts
        .iter()
        .map(|start| search.complete(start.clone()))
        .collect::<Result<Vec<Placed>, JobError>>()?;
    let diagonal = from.mesh.bounding_box().diagonal();
    let best = (0..maps.len()).min_by(|&x, &y| maps[x].order(&maps[y]));
    if let Some(best) = best
        && maps[best].residual > IN_PLACE * diagonal
        && let Some(grown) = search.grown(starts[best].clone())?
        && correspondence(from, &grown.pairs) != correspondence(from, &maps[best].pairs)
    {
        maps.push(grown);
    }
    maps.sort_by(Placed::order);
    let rounding = 1e-9 * diagonal;
    let bound = maps
        .first()
        .map_or(0.0, |best| INDISTINGUISHABLE * best.residual + rounding);
    maps.retain(|map| map.residual <= bound);
    maps.truncate(limit);
    Ok(maps.iter().map(|map| correspondence(from, &map.pairs)).collect())
}

fn correspondence(from: &Graph<'_>, pairs: &Pairs) -> Correspondence {
    let mut suspect_of = vec![None; from.mesh.vertex_count()];
    for &(v, w) in pairs {
        suspect_of[v as usize] = Some(w);
    }
    Correspondence { suspect_of }
}

/// A connected part of the original.
#[derive(Clone, Copy)]
struct Part {
    seed: Flag,
    /// Index of the set of images that the seed may have.
    images: usize,
    /// No other part of the original looks like it, and it has one image.
    is_certain: bool,
    vertices: usize,
    centroid: Vec3,
}

/// A map of some parts.
#[derive(Clone)]
struct Placed {
    /// Those of one part after those of another.
    pairs: Pairs,
    taken: Vec<bool>,
    done: Vec<bool>,
    residual: f64,
}

impl Placed {
    /// Maps of more vertices come first, and among those of as many the one with the smallest residual.
    fn order(&self, other: &Self) -> Ordering {
        let longer = other.pairs.len().cmp(&self.pairs.len());
        longer.then(self.residual.total_cmp(&other.residual))
    }
}

struct Search<'a> {
    from: &'a Graph<'a>,
    onto: &'a Graph<'a>,
    propagation: Propagation<'a>,
    parts: Vec<Part>,
    /// Sets of flags of the suspect, each with the colours of a seed, sorted by the x of their parts' centroids.
    images: Vec<Vec<Flag>>,
    /// Centroids of the suspect's parts.
    centroids: Vec<Vec3>,
    /// Images that were looked at to place parts.
    visits: usize,
    job: &'a Job,
}

impl<'a> Search<'a> {
    fn new(from: &'a Graph<'a>, onto: &'a Graph<'a>, colours: &'a Colours, job: &'a Job) -> Self {
        let (parts, mut images) = parts(from, onto, colours);
        let propagation = Propagation::new(from, onto, colours);
        let centroids = centroids(onto);
        for set in &mut images {
            let x = |flag: &Flag| centroids[onto.part_of(flag.corners[0])][0];
            set.sort_by(|a, b| x(a).total_cmp(&x(b)));
        }
        Self {
            from,
            onto,
            propagation,
            parts,
            images,
            centroids,
            visits: 0,
            job,
        }
    }

    /// First steps: all certain parts at once if they fix a similarity, else the most promising images of the
    /// anchor.
    fn hypotheses(&mut self) -> Result<Vec<Placed>, JobError> {
        let mut certain = self.nothing();
        for index in 0..self.parts.len() {
            if self.parts[index].is_certain {
                let image = self.images[self.parts[index].images][0];
                self.place(&mut certain, index, image)?;
            }
        }
        if fit(self.from, self.onto, &certain.pairs).is_some() {
            return Ok(vec![certain]);
        }
        let image_count = |i: usize| self.images[self.parts[i].images].len();
        let anchors = (0..self.parts.len()).filter(|&i| !certain.done[i] && image_count(i) > 0);
        let anchor = anchors.min_by_key(|&i| (image_count(i), usize::MAX - self.parts[i].vertices));
        let Some(anchor) = anchor else {
            return Ok(vec![certain]);
        };
        let images = self.promising(anchor)?;
        let mut starts: Vec<(f64, Placed)> = Vec::new();
        for image in images {
            let mut start = self.nothing();
            self.place(&mut start, anchor, image)?;
            starts.push((self.scatter(&start), start));
        }
        starts.sort_by(|x, y| x.0.total_cmp(&y.0));
        starts.truncate((BUDGET / self.cost_of_completion()).max(1));
        Ok(starts.into_iter().map(|(_, start)| start).collect())
    }

    /// Images and vertices that are looked at to place all parts.
    fn cost_of_completion(&self) -> usize {
        let images: usize = self.parts.iter().map(|part| self.images[part.images].len()).sum();
        self.from.used_vertices + if self.parts.len() > 1 { images } else { 0 }
    }

    /// How far a sample of the other parts lies from the nearest of their images, squared, under the
    /// similarity of a hypothesis.
    fn scatter(&self, start: &Placed) -> f64 {
        let Some(fit) = fit(self.from, self.onto, &start.pairs) else {
            return f64::INFINITY;
        };
        let apart = |part: &Part| {
            let images = self.images[part.images].iter();
            let centroids = images.map(|image| self.centroids[self.onto.part_of(image.corners[0])]);
            let apart = centroids.map(|c| (fit.transform.apply(c) - part.centroid).squared());
            apart.fold(f64::INFINITY, f64::min)
        };
        let sample = self
            .parts
            .iter()
            .step_by(self.parts.len().div_ceil(SAMPLED_PARTS));
        sample.map(apart).filter(|x| x.is_finite()).sum::<f64>() + fit.residual * fit.residual
    }

    fn nothing(&self) -> Placed {
        let (taken, done) = (vec![false; self.onto.parts.count], vec![false; self.parts.len()]);
        Placed {
            pairs: Vec::new(),
            taken,
            done,
            residual: f64::INFINITY,
        }
    }

    /// Maps a part by the image of its seed, if that leads to a map.
    fn place(&mut self, placed: &mut Placed, part: usize, image: Flag) -> Result<(), JobError> {
        self.job.go_on()?;
        let target = self.onto.part_of(image.corners[0]);
        if !placed.taken[target] && self.propagation.run(self.parts[part].seed, image, usize::MAX) {
            placed.pairs.extend(&self.propagation.pairs);
            placed.taken[target] = true;
            placed.done[part] = true;
        }
        Ok(())
    }

    /// The images of a part's seed that lead to a map, the best first, as many as can be looked at further.
    fn promising(&mut self, part: usize) -> Result<Vec<Flag>, JobError> {
        let Part {
            seed,
            vertices,
            images,
            ..
        } = self.parts[part];
        let mut images = self.images[images].clone();
        let sampled = if self.parts.len() > 1 {
            SAMPLED_PARTS * images.len()
        } else {
            0
        };
        let most = (BUDGET / (vertices + sampled)).max(1);
        images.truncate(BUDGET / SMALLEST_NEIGHBOURHOOD);
        loop {
            let size = (BUDGET / images.len().max(1)).max(SMALLEST_NEIGHBOURHOOD);
            let mut ranked: Vec<(f64, Flag)> = Vec::new();
            for &image in &images {
                self.job.go_on()?;
                if self.propagation.run(seed, image, size) {
                    let fit = fit(self.from, self.onto, &self.propagation.pairs);
                    ranked.push((fit.map_or(f64::INFINITY, |fit| fit.residual), image));
                }
            }
            ranked.sort_by(|x, y| x.0.total_cmp(&y.0));
            let complete = size >= vertices;
            ranked.truncate(if complete { most } else { images.len().div_ceil(4) });
            images = ranked.into_iter().map(|(_, image)| image).collect();
            if complete || images.is_empty() {
                return Ok(images);
            }
        }
    }

    /// Places all other parts under the similarity of those already placed.
    fn complete(&mut self, mut placed: Placed) -> Result<Placed, JobError> {
        let mut order: Vec<usize> = (0..self.parts.len()).filter(|&i| !placed.done[i]).collect();
        order.sort_by_key(|&i| usize::MAX - self.parts[i].vertices);
        let mut fitted = 0;
        let mut transform = Similarity::IDENTITY;
        for part in order {
            self.job.go_on()?;
            if self.visits > MOST_VISITS {
                break;
            }
            if placed.pairs.len() >= 2 * fitted {
                fitted = placed.pairs.len();
                transform = fit(self.from, self.onto, &placed.pairs).map_or(transform, |fit| fit.transform);
            }
            self.place_nearest(&mut placed, part, &transform);
        }
        placed.residual = fit(self.from, self.onto, &placed.pairs).map_or(f64::INFINITY, |fit| fit.residual);
        Ok(placed)
    }

    /// Places all other parts, each under the similarity of those around it that were placed before, the nearest first; none where all is placed, nothing is, there are too many, or too many images were looked at.
    fn grown(&mut self, mut placed: Placed) -> Result<Option<Placed>, JobError> {
        let mut left: Vec<usize> = (0..self.parts.len()).filter(|&i| !placed.done[i]).collect();
        if left.is_empty() || placed.pairs.is_empty() || self.parts.len() > MOST_GROWN {
            return Ok(None);
        }
        let middle = |pairs: &[(u32, u32)]| {
            let places = pairs.iter().map(|&(v, _)| self.from.position(v));
            places.sum::<Vec3>() / pairs.len() as f64
        };
        let mut known: Vec<(Vec3, Range<usize>)> = Vec::new();
        for of_part in placed
            .pairs
            .chunk_by(|a, b| self.from.part_of(a.0) == self.from.part_of(b.0))
        {
            let start = known.last().map_or(0, |(_, last)| last.end);
            known.push((middle(of_part), start..start + of_part.len()));
        }
        let apart = |known: &(Vec3, Range<usize>), part: &Part| (known.0 - part.centroid).squared();
        let mut nearest: Vec<f64> = left
            .iter()
            .map(|&part| {
                let apart = known.iter().map(|known| apart(known, &self.parts[part]));
                apart.fold(f64::INFINITY, f64::min)
            })
            .collect();
        while let Some(next) = (0..left.len()).min_by(|&a, &b| nearest[a].total_cmp(&nearest[b])) {
            self.job.go_on()?;
            if self.visits > MOST_VISITS {
                return Ok(None);
            }
            let part = left.swap_remove(next);
            nearest.swap_remove(next);
            known.sort_by(|a, b| apart(a, &self.parts[part]).total_cmp(&apart(b, &self.parts[part])));
            let mut around = Pairs::new();
            for (_, of_part) in &known {
                if around.len() >= SURROUNDING {
                    break;
                }
                around.extend(&placed.pairs[of_part.clone()]);
            }
            let Some(fit) = fit(self.from, self.onto, &around) else {
                continue;
            };
            let start = placed.pairs.len();
            self.place_nearest(&mut placed, part, &fit.transform);
            if placed.pairs.len() > start {
                let new = (self.parts[part].centroid, start..placed.pairs.len());
                for (nearest, &other) in nearest.iter_mut().zip(&left) {
                    *nearest = nearest.min(apart(&new, &self.parts[other]));
                }
                known.push(new);
            }
        }
        placed.residual = fit(self.from, self.onto, &placed.pairs).map_or(f64::INFINITY, |fit| fit.residual);
        Ok(Some(placed))
    }

    /// Maps a part by the free image that lies nearest under `transform`.
    fn place_nearest(&mut self, placed: &mut Placed, part: usize, transform: &Similarity) {
        let seed = self.parts[part].seed;
        let images = self.nearest_images(placed, part, transform);
        let mut best: Option<(f64, Pairs)> = None;
        for image in images {
            if self.propagation.run(seed, image, usize::MAX) {
                let distance = self.distance(self.propagation.pairs.iter().copied(), transform);
                if best.as_ref().is_none_or(|(least, _)| distance < *least) {
                    best = Some((distance, self.propagation.pairs.clone()));
                }
            }
        }
        if let Some((_, pairs)) = best {
            placed.taken[self.onto.part_of(pairs[0].1)] = true;
            placed.done[part] = true;
            placed.pairs.extend(pairs);
        }
    }

    /// The [`NEAREST_IMAGES`] free images of a part's seed that lie nearest by centroid and seed.
    ///
    /// Looks outward from the part's own x in the suspect's frame, until all that is left is farther off in x alone.
    fn nearest_images(&mut self, placed: &Placed, part: usize, transform: &Similarity) -> Vec<Flag> {
        let Part {
            seed,
            images,
            centroid,
            ..
        } = self.parts[part];
        let images = &self.images[images];
        // Distances of centroids are compared in the suspect's frame, where they need no transform.
        let (here, unit) = (transform.inverse().apply(centroid), transform.scale);
        let target = |flag: &Flag| self.onto.part_of(flag.corners[0]);
        let offset = |flag: &Flag| (self.centroids[target(flag)][0] - here[0]).abs();
        let middle = images.partition_point(|flag| self.centroids[target(flag)][0] < here[0]);
        let mut left = images[..middle].iter().rev().peekable();
        let mut right = images[middle..].iter().peekable();
        let mut nearest: Vec<(f64, Flag)> = Vec::with_capacity(NEAREST_IMAGES + 1);
        let mut visits = 0;
        loop {
            let leftward = match (left.peek(), right.peek()) {
                (Some(l), Some(r)) => offset(l) < offset(r),
                (l, _) => l.is_some(),
            };
            let Some(image) = (if leftward { left.next() } else { right.next() }) else {
                break;
            };
            let bound = nearest
                .get(NEAREST_IMAGES - 1)
                .map_or(f64::INFINITY, |(worst, _)| *worst);
            if (unit * offset(image)).powi(2) > bound {
                break;
            }
            visits += 1;
            let apart = unit * unit * (self.centroids[target(image)] - here).squared();
            if apart >= bound || placed.taken[target(image)] {
                continue;
            }
            let corners = seed.corners.into_iter().zip(image.corners);
            let score = apart + self.distance(corners, transform) / 3.0;
            if score < bound {
                nearest.insert(nearest.partition_point(|(s, _)| *s <= score), (score, *image));
                nearest.truncate(NEAREST_IMAGES);
            }
        }
        self.visits += visits;
        nearest.into_iter().map(|(_, image)| image).collect()
    }

    /// Σ |v − T(w)|² over pairs.
    fn distance(&self, pairs: impl Iterator<Item = (u32, u32)>, transform: &Similarity) -> f64 {
        pairs
            .map(|(v, w)| (transform.apply(self.onto.position(w)) - self.from.position(v)).squared())
            .sum()
    }
}

/// The connected parts of the original that have triangles, each with a seed of the rarest kind, and the sets
/// of images of seeds.
fn parts(from: &Graph<'_>, onto: &Graph<'_>, colours: &Colours) -> (Vec<Part>, Vec<Vec<Flag>>) {
    let mut alike: HashMap<u64, usize> = HashMap::new();
    for &kind in &colours.original.of_part {
        *alike.entry(kind).or_default() += 1;
    }
    let centroids = centroids(from);
    let mut sets: HashMap<(u64, [u64; 3]), usize> = HashMap::new();
    let mut images = Vec::new();
    let mut parts = Vec::new();
    for (part, rarest) in colours.original.rarest(from).into_iter().enumerate() {
        let Some(rarest) = rarest else { continue };
        let kind = colours.original.of_part[part];
        let seed = seed_at(from, &colours.original.of_vertex, rarest);
        let look = seed.corners.map(|v| colours.original.of_vertex[v as usize]);
        let set = *sets.entry((kind, look)).or_insert_with(|| {
            images.push(images_of(onto, &colours.suspect, look, kind));
            images.len() - 1
        });
        parts.push(Part {
            seed,
            images: set,
            is_certain: images[set].len() == 1 && alike[&kind] == 1,
            vertices: from.parts.sizes[part],
            centroid: centroids[part],
        });
    }
    (parts, images)
}

/// The flag at a vertex whose colours are rarest among the flags there.
fn seed_at(graph: &Graph<'_>, colours: &[u64], vertex: u32) -> Flag {
    let flags: Vec<Flag> = flags_at(graph, vertex).collect();
    let key = |flag: &Flag| flag.corners.map(|v| colours[v as usize]);
    let mut keys: Vec<_> = flags.iter().map(key).collect();
    keys.sort_unstable();
    let count = |flag: &Flag| {
        let key = key(flag);
        keys.partition_point(|k| *k <= key) - keys.partition_point(|k| *k < key)
    };
    let rarest = flags.iter().copied().min_by_key(count);
    rarest.unwrap_or(Flag {
        triangle: 0,
        corners: graph.triangle(0),
    })
}

/// All triangles at a vertex with that vertex first and the others in both orders.
fn flags_at<'a>(graph: &'a Graph<'_>, vertex: u32) -> impl Iterator<Item = Flag> + 'a {
    graph.fan(vertex).iter().flat_map(move |&triangle| {
        let [a, b, c] = graph.triangle(triangle);
        let (second, third) = if a == vertex {
            (b, c)
        } else if b == vertex {
            (c, a)
        } else {
            (a, b)
        };
        [[vertex, second, third], [vertex, third, second]].map(|corners| Flag { triangle, corners })
    })
}

/// The suspect's flags of three given colours, in parts of one kind.
fn images_of(
    onto: &Graph<'_>,
    suspect: &Colouring,
    [first, second, third]: [u64; 3],
    kind: u64,
) -> Vec<Flag> {
    let colour = |v: u32| suspect.of_vertex[v as usize];
    let vertices = suspect.class(first).iter().map(|&(_, v)| v);
    vertices
        .filter(|&v| suspect.of_part[onto.part_of(v)] == kind)
        .flat_map(|v| flags_at(onto, v))
        .filter(|flag| colour(flag.corners[1]) == second && colour(flag.corners[2]) == third)
        .collect()
}

fn centroids(graph: &Graph<'_>) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; graph.parts.count];
    for v in 0..graph.mesh.vertex_count() as u32 {
        sums[graph.part_of(v)] += graph.position(v);
    }
    let sizes = graph.parts.sizes.iter();
    sums.iter()
        .zip(sizes)
        .map(|(&sum, &size)| sum * (1.0 / size as f64))
        .collect()
}
