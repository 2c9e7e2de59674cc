//! Chooses between the isomorphisms of symmetric parts and of equal parts by geometry.
//!
//! Parts that can be mapped in one way only fix a similarity of suspect to original. Without such a part, every image of
//! the seed flag of one part, the anchor, is a hypothesis. Under the similarity of a hypothesis every other part takes the free image that
//! lies nearest. Hypotheses are ranked by the residual of all pairs together.
//!
//! Work is bounded: images of the anchor are compared on growing neighbourhoods of its seed (successive halving), so that every stage
//! visits at most [`BUDGET`] vertices, and at most that many are visited to place the other parts.

use super::Correspondence;
use super::colours::Colours;
use super::graph::Graph;
use super::propagation::{Flag, Propagation, fit};
use crate::vector::{add, scaled, squared, sub};
use mesh::Similarity;
use std::collections::HashMap;

/// Vertices visited in each stage of the choice.
const BUDGET: usize = 20_000_000;

/// The fewest vertices on which images of the anchor are compared.
const SMALLEST_NEIGHBOURHOOD: usize = 64;

/// Of the images of a part, this many that lie nearest by centroid and seed are tried in full.
const NEAREST_IMAGES: usize = 12;

/// A map is kept beside the best one when its residual is at most so many times larger.
const INDISTINGUISHABLE: f64 = 2.0;

type Pairs = Vec<(u32, u32)>;

/// Maps of as many parts as possible, the best first, at most `limit`; none when no part can be mapped.
pub(super) fn candidates(
    from: &Graph<'_>,
    onto: &Graph<'_>,
    colours: &Colours,
    limit: usize,
) -> Vec<Correspondence> {
    let parts = parts(from, onto, colours);
    let mut search = Search {
        from,
        onto,
        propagation: Propagation::new(from, onto, colours),
        parts,
    };
    let most = (BUDGET / from.used_vertices.max(1)).max(1);
    let mut maps: Vec<Placed> = Vec::new();
    for start in search.hypotheses(most) {
        maps.push(search.complete(start));
    }
    maps.sort_by(|x, y| {
        y.pairs
            .len()
            .cmp(&x.pairs.len())
            .then(x.residual.total_cmp(&y.residual))
    });
    let rounding = 1e-9 * from.mesh.bounding_box().diagonal();
    let bound = maps
        .first()
        .map_or(0.0, |best| INDISTINGUISHABLE * best.residual + rounding);
    maps.retain(|map| map.residual <= bound);
    maps.truncate(limit);
    maps.iter().map(|map| correspondence(from, &map.pairs)).collect()
}

fn correspondence(from: &Graph<'_>, pairs: &Pairs) -> Correspondence {
    let mut suspect_of = vec![None; from.mesh.vertex_count()];
    for &(v, w) in pairs {
        suspect_of[v as usize] = Some(w);
    }
    Correspondence { suspect_of }
}

/// A connected part of the original with the images that its seed may have.
struct Part {
    seed: Flag,
    images: Vec<Flag>,
    /// No other part of the original looks like it, and it has one image.
    is_certain: bool,
    vertices: usize,
    centroid: [f64; 3],
}

/// A map of some parts.
struct Placed {
    pairs: Pairs,
    taken: Vec<bool>,
    done: Vec<bool>,
    residual: f64,
}

struct Search<'a> {
    from: &'a Graph<'a>,
    onto: &'a Graph<'a>,
    propagation: Propagation<'a>,
    parts: Vec<Part>,
}

impl Search<'_> {
    /// First steps: all certain parts at once if there are any, else each image of the anchor that is not clearly worse than others.
    fn hypotheses(&mut self, most: usize) -> Vec<Placed> {
        let mut certain = self.nothing();
        for index in 0..self.parts.len() {
            if self.parts[index].is_certain {
                let image = self.parts[index].images[0];
                self.place(&mut certain, index, image);
            }
        }
        if fit(self.from, self.onto, &certain.pairs).is_some() {
            return vec![certain];
        }
        let anchors = (0..self.parts.len()).filter(|&i| !certain.done[i] && !self.parts[i].images.is_empty());
        let anchor =
            anchors.min_by_key(|&i| (self.parts[i].images.len(), usize::MAX - self.parts[i].vertices));
        let Some(anchor) = anchor else {
            return vec![certain];
        };
        let mut starts = Vec::new();
        for image in self.promising(anchor, most) {
            let mut start = self.nothing();
            self.place(&mut start, anchor, image);
            starts.push(start);
        }
        starts
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
    fn place(&mut self, placed: &mut Placed, part: usize, image: Flag) {
        let target = self.onto.part_of(image.corners[0]);
        if !placed.taken[target] && self.propagation.run(self.parts[part].seed, image, usize::MAX) {
            placed.pairs.extend(&self.propagation.pairs);
            placed.taken[target] = true;
            placed.done[part] = true;
        }
    }

    /// The images of a part's seed that lead to a map, at most `most`, the best first.
    fn promising(&mut self, part: usize, most: usize) -> Vec<Flag> {
        let Part { seed, vertices, .. } = self.parts[part];
        let mut images = self.parts[part].images.clone();
        images.truncate(BUDGET / SMALLEST_NEIGHBOURHOOD);
        loop {
            let size = (BUDGET / images.len().max(1)).max(SMALLEST_NEIGHBOURHOOD);
            let mut ranked: Vec<(f64, Flag)> = Vec::new();
            for &image in &images {
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
                return images;
            }
        }
    }

    /// Places all other parts under the similarity of those already placed.
    fn complete(&mut self, mut placed: Placed) -> Placed {
        let mut order: Vec<usize> = (0..self.parts.len()).filter(|&i| !placed.done[i]).collect();
        order.sort_by_key(|&i| usize::MAX - self.parts[i].vertices);
        let centroids = if order.is_empty() {
            Vec::new()
        } else {
            centroids(self.onto)
        };
        let mut fitted = 0;
        let mut transform = Similarity::IDENTITY;
        for part in order {
            if placed.pairs.len() >= 2 * fitted {
                fitted = placed.pairs.len();
                transform = fit(self.from, self.onto, &placed.pairs).map_or(transform, |fit| fit.transform);
            }
            self.place_nearest(&mut placed, part, &transform, &centroids);
        }
        placed.residual = fit(self.from, self.onto, &placed.pairs).map_or(f64::INFINITY, |fit| fit.residual);
        placed
    }

    /// Maps a part by the free image that lies nearest under `transform`.
    fn place_nearest(
        &mut self,
        placed: &mut Placed,
        part: usize,
        transform: &Similarity,
        centroids: &[[f64; 3]],
    ) {
        let Part { seed, centroid, .. } = self.parts[part];
        let mut images: Vec<(f64, Flag)> = Vec::new();
        for &image in &self.parts[part].images {
            let target = self.onto.part_of(image.corners[0]);
            if !placed.taken[target] {
                let apart = squared(sub(transform.apply(centroids[target]), centroid));
                let corners = seed.corners.into_iter().zip(image.corners);
                images.push((apart + self.distance(corners, transform) / 3.0, image));
            }
        }
        images.sort_by(|x, y| x.0.total_cmp(&y.0));
        let mut best: Option<(f64, Pairs)> = None;
        for (_, image) in images.into_iter().take(NEAREST_IMAGES) {
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

    /// Σ |v − T(w)|² over pairs.
    fn distance(&self, pairs: impl Iterator<Item = (u32, u32)>, transform: &Similarity) -> f64 {
        pairs
            .map(|(v, w)| squared(sub(transform.apply(self.onto.position(w)), self.from.position(v))))
            .sum()
    }
}

/// The connected parts of the original that have triangles, each with a seed of the rarest kind and all its possible images.
fn parts(from: &Graph<'_>, onto: &Graph<'_>, colours: &Colours) -> Vec<Part> {
    let mut alike: HashMap<u64, usize> = HashMap::new();
    for &kind in &colours.original.of_part {
        *alike.entry(kind).or_default() += 1;
    }
    let centroids = centroids(from);
    let mut parts = Vec::new();
    for (part, rarest) in colours.original.rarest(from).into_iter().enumerate() {
        let Some(rarest) = rarest else { continue };
        let kind = colours.original.of_part[part];
        let seed = seed_at(from, &colours.original.of_vertex, rarest);
        let images = images(onto, colours, seed, kind);
        parts.push(Part {
            seed,
            is_certain: images.len() == 1 && alike[&kind] == 1,
            images,
            vertices: from.parts.sizes[part],
            centroid: centroids[part],
        });
    }
    parts
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

/// The suspect's flags with the seed's colours, in parts of its kind.
fn images(onto: &Graph<'_>, colours: &Colours, seed: Flag, kind: u64) -> Vec<Flag> {
    let [first, second, third] = seed.corners.map(|v| colours.original.of_vertex[v as usize]);
    let colour = |v: u32| colours.suspect.of_vertex[v as usize];
    let vertices = colours.suspect.class(first).iter().map(|&(_, v)| v);
    let vertices = vertices.filter(|&v| colours.suspect.of_part[onto.part_of(v)] == kind);
    vertices
        .flat_map(|v| flags_at(onto, v))
        .filter(|flag| colour(flag.corners[1]) == second && colour(flag.corners[2]) == third)
        .collect()
}

fn centroids(graph: &Graph<'_>) -> Vec<[f64; 3]> {
    let mut sums = vec![[0.0; 3]; graph.parts.count];
    for (v, &p) in graph.mesh.positions().iter().enumerate() {
        let sum = &mut sums[graph.part_of(v as u32)];
        *sum = add(*sum, p);
    }
    sums.iter()
        .zip(&graph.parts.sizes)
        .map(|(&sum, &size)| scaled(sum, 1.0 / size as f64))
        .collect()
}
