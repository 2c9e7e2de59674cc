//! Extends the image of one triangle to an isomorphism of its connected part.
//!
//! Where edges have one or two triangles, the image of a triangle fixes the images of its neighbours, so
//! nothing is left to choose. At non-manifold places the neighbour is the one that colours and images so far
//! allow; if they allow several, the one nearest under the similarity fitted to the pairs found so far.

use super::colours::Colours;
use super::graph::Graph;
use crate::{Handedness, fit_similarity};
use mesh::Similarity;

/// A triangle and an order of its corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flag {
    pub(super) triangle: u32,
    pub(super) corners: [u32; 3],
}

/// Images found so far. One allocation serves many attempts: [`Self::clear`] costs what the last attempt
/// touched.
pub(super) struct Propagation<'a> {
    from: &'a Graph<'a>,
    onto: &'a Graph<'a>,
    colours: &'a Colours,
    vertex_image: Vec<u32>,
    vertex_source: Vec<u32>,
    triangle_image: Vec<u32>,
    triangle_taken: Vec<bool>,
    /// Pairs of vertices, and triangles of the original, in the order in which they were mapped.
    pub(super) pairs: Vec<(u32, u32)>,
    mapped: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl<'a> Propagation<'a> {
    pub(super) fn new(from: &'a Graph<'a>, onto: &'a Graph<'a>, colours: &'a Colours) -> Self {
        Self {
            from,
            onto,
            colours,
            vertex_image: vec![NONE; from.mesh.vertex_count()],
            vertex_source: vec![NONE; onto.mesh.vertex_count()],
            triangle_image: vec![NONE; from.mesh.triangle_count()],
            triangle_taken: vec![false; onto.mesh.triangle_count()],
            pairs: Vec::new(),
            mapped: Vec::new(),
        }
    }

    fn clear(&mut self) {
        for (v, image) in self.pairs.drain(..) {
            self.vertex_image[v as usize] = NONE;
            self.vertex_source[image as usize] = NONE;
        }
        for t in self.mapped.drain(..) {
            self.triangle_taken[self.triangle_image[t as usize] as usize] = false;
            self.triangle_image[t as usize] = NONE;
        }
    }

    /// Maps `seed` to `image` and goes on until the part is mapped, `limit` vertices are, or a contradiction
    /// shows.
    ///
    /// Returns whether there was none; the pairs found are in [`Self::pairs`]. A part that is mapped whole is
    /// mapped one to one onto a part of the suspect, triangles to triangles.
    pub(super) fn run(&mut self, seed: Flag, image: Flag, limit: usize) -> bool {
        self.clear();
        let part = self.from.part_of(seed.corners[0]);
        let whole = self.from.part_triangles[part];
        if whole != self.onto.part_triangles[self.onto.part_of(image.corners[0])] || !self.assign(seed, image)
        {
            return false;
        }
        let mut next = 0;
        let mut stall = Stall::default();
        while self.pairs.len() < limit && self.mapped.len() < whole {
            if let Some(&t) = self.mapped.get(next) {
                next += 1;
                if !self.cross_edges(t) {
                    return false;
                }
            } else if !self.resolve(&mut stall) {
                return false;
            }
        }
        true
    }

    /// Maps the neighbours of triangle `t` across its manifold edges.
    fn cross_edges(&mut self, t: u32) -> bool {
        let image = self.triangle_image[t as usize];
        let corners = self.from.triangle(t);
        for side in 0..3 {
            let ends = [corners[side], corners[(side + 1) % 3]];
            let images = ends.map(|v| self.vertex_image[v as usize]);
            let here = self.from.across_side(t, side, ends);
            let there = self.onto.across(image, images);
            if let (Ok((next, third)), Ok((its_image, third_image))) = (here, there) {
                let source = Flag {
                    triangle: next,
                    corners: [ends[0], ends[1], third],
                };
                let image = Flag {
                    triangle: its_image,
                    corners: [images[0], images[1], third_image],
                };
                if !self.assign(source, image) {
                    return false;
                }
            } else if here.map(drop) != there.map(drop) {
                return false;
            }
        }
        true
    }

    /// Records that a triangle becomes another, corner by corner; says whether that agrees with all that is
    /// known.
    fn assign(&mut self, source: Flag, image: Flag) -> bool {
        let known = self.triangle_image[source.triangle as usize];
        if known != NONE {
            return known == image.triangle
                && (0..3).all(|i| self.vertex_image[source.corners[i] as usize] == image.corners[i]);
        }
        if self.triangle_taken[image.triangle as usize] || !self.agrees(source, image) {
            return false;
        }
        self.triangle_image[source.triangle as usize] = image.triangle;
        self.triangle_taken[image.triangle as usize] = true;
        self.mapped.push(source.triangle);
        for (&v, &w) in source.corners.iter().zip(&image.corners) {
            if self.vertex_image[v as usize] == NONE {
                self.vertex_image[v as usize] = w;
                self.vertex_source[w as usize] = v;
                self.pairs.push((v, w));
            }
        }
        true
    }

    /// Whether corners may become corners: equal colours, and no other images or sources.
    fn agrees(&self, source: Flag, image: Flag) -> bool {
        source.corners.iter().zip(&image.corners).all(|(&v, &w)| {
            let (known, source) = (self.vertex_image[v as usize], self.vertex_source[w as usize]);
            let free = known == NONE && source == NONE;
            (known == w && source == v)
                || (free
                    && self.colours.original.of_vertex[v as usize]
                        == self.colours.suspect.of_vertex[w as usize])
        })
    }

    /// Maps one more triangle at a mapped vertex, where no manifold edge leads on.
    fn resolve(&mut self, stall: &mut Stall) -> bool {
        for &(v, _) in &self.pairs[stall.seen..] {
            stall.waiting.push(v);
        }
        stall.seen = self.pairs.len();
        let open = |t: &u32| self.triangle_image[*t as usize] == NONE;
        stall.waiting.retain(|&v| self.from.fan(v).iter().any(open));

        let mut undecided: Option<(Flag, Vec<Flag>)> = None;
        for &v in &stall.waiting {
            for &t in self.from.fan(v).iter().filter(|t| open(t)) {
                let source = Flag {
                    triangle: t,
                    corners: self.from.triangle(t),
                };
                let options = self.options(source, self.vertex_image[v as usize]);
                stall.work += self.onto.fan(self.vertex_image[v as usize]).len();
                match options.as_slice() {
                    [] => return false,
                    [only] => return self.assign(source, *only),
                    _ if undecided.is_none() => undecided = Some((source, options)),
                    _ => {}
                }
                if stall.work > STALL_WORK {
                    return false;
                }
            }
        }
        let Some((source, options)) = undecided else {
            return false;
        };
        self.refit(stall);
        let distance = |option: &Flag| -> f64 {
            let Some(fit) = stall.fit else { return 0.0 };
            let pairs = source.corners.iter().zip(&option.corners);
            pairs
                .map(|(&v, &w)| (fit.apply(self.onto.position(w)) - self.from.position(v)).squared())
                .sum()
        };
        let nearest = options.iter().min_by(|x, y| distance(x).total_cmp(&distance(y)));
        nearest.is_some_and(|&nearest| self.assign(source, nearest))
    }

    /// The flags at the suspect vertex `at` that an unmapped triangle may become; equal corners are listed
    /// once.
    fn options(&self, source: Flag, at: u32) -> Vec<Flag> {
        let mut options: Vec<Flag> = Vec::new();
        for &t in self
            .onto
            .fan(at)
            .iter()
            .filter(|&&t| !self.triangle_taken[t as usize])
        {
            let [a, b, c] = self.onto.triangle(t);
            for corners in [[a, b, c], [b, c, a], [c, a, b], [a, c, b], [c, b, a], [b, a, c]] {
                let option = Flag { triangle: t, corners };
                if self.agrees(source, option) && options.iter().all(|o| o.corners != corners) {
                    options.push(option);
                }
            }
            if options.len() >= MOST_OPTIONS {
                break;
            }
        }
        options
    }

    /// Fits the similarity that decides between options anew whenever the pairs have doubled.
    fn refit(&self, stall: &mut Stall) {
        if self.pairs.len() < 2 * stall.fitted {
            return;
        }
        stall.fitted = self.pairs.len();
        stall.fit = fit(self.from, self.onto, &self.pairs).map(|fit| fit.transform);
    }
}

/// Comparisons of triangles at stalls after which a part is given up: only a mesh made to be hard needs so
/// many.
const STALL_WORK: usize = 10_000_000;

/// Options between which geometry decides.
const MOST_OPTIONS: usize = 64;

/// What is remembered between stalls at non-manifold places.
#[derive(Default)]
struct Stall {
    /// Mapped vertices that may have unmapped triangles.
    waiting: Vec<u32>,
    /// How many pairs have entered `waiting`.
    seen: usize,
    work: usize,
    fitted: usize,
    fit: Option<Similarity>,
}

/// The similarity of either hand that takes the suspect's vertices to the original's; none if they do not
/// determine it.
pub(super) fn fit(from: &Graph<'_>, onto: &Graph<'_>, pairs: &[(u32, u32)]) -> Option<crate::Fit> {
    let (target, source): (Vec<_>, Vec<_>) = pairs
        .iter()
        .map(|&(v, w)| (from.position(v).0, onto.position(w).0))
        .unzip();
    fit_similarity(&source, &target, None, Handedness::Either).ok()
}
