//! Vertices that a cut suspect still shares with the original, found by what surrounds them.

use super::colours::Refinement;
use super::correspondence::Correspondence;
use super::graph::Graph;
use job::{Job, JobError};
use std::collections::VecDeque;

/// Colours describe what lies within this many edges: enough for an irregular net, few enough to spare most
/// of a cropped one.
const FARTHEST: usize = 8;

const NONE: u32 = u32::MAX;

/// Pairs the vertices whose surroundings, out to some distance, are unique in both meshes and alike, then
/// grows these pairs across shared edges for as long as vertices and their neighbours look alike, or are
/// beside a cut. So a growth from a chance likeness soon ends.
pub(super) fn correspondence(
    from: &Graph<'_>,
    onto: &Graph<'_>,
    job: &Job,
) -> Result<Correspondence, JobError> {
    let mut pairing = Pairing::new(from, onto);
    pairing.sow(&best_seeds(from, onto, job)?);
    pairing.grow();
    Ok(Correspondence {
        suspect_of: pairing.image.iter().map(|&w| (w != NONE).then_some(w)).collect(),
    })
}

/// The image of each vertex of the original, at the distance that gives the most neighbours with neighbouring
/// images.
fn best_seeds(from: &Graph<'_>, onto: &Graph<'_>, job: &Job) -> Result<Vec<u32>, JobError> {
    let (mut here, mut there) = (Refinement::start(from), Refinement::start(onto));
    let mut best = (0, vec![NONE; from.mesh.vertex_count()]);
    for _distance in 0..FARTHEST {
        job.go_on()?;
        here.refine(from);
        there.refine(onto);
        let seeds = consistent(from, onto, unique_pairs(from, onto, &here, &there));
        let count = seeds.iter().filter(|&&w| w != NONE).count();
        if count > best.0 {
            best = (count, seeds);
        } else if 2 * count < best.0 {
            break;
        }
    }
    Ok(best.1)
}

/// Pairs the vertices whose colour occurs once in each mesh.
fn unique_pairs(from: &Graph<'_>, onto: &Graph<'_>, here: &Refinement, there: &Refinement) -> Vec<u32> {
    let [here, there] = [here.sorted(from), there.sorted(onto)].map(|sorted| -> Vec<(u64, u32)> {
        let classes = sorted.chunk_by(|x, y| x.0 == y.0);
        classes
            .filter(|class| class.len() == 1)
            .map(|class| class[0])
            .collect()
    });
    let mut image = vec![NONE; from.mesh.vertex_count()];
    let mut other = there.iter().peekable();
    for &(colour, v) in &here {
        while other.next_if(|x| x.0 < colour).is_some() {}
        if let Some(&(_, w)) = other.next_if(|x| x.0 == colour) {
            image[v as usize] = w;
        }
    }
    image
}

/// Keeps the pairs that have a neighbouring pair: chance likeness has none.
fn consistent(from: &Graph<'_>, onto: &Graph<'_>, image: Vec<u32>) -> Vec<u32> {
    let mut kept = vec![NONE; image.len()];
    for &[a, b] in from.edges.vertices() {
        let (x, y) = (image[a as usize], image[b as usize]);
        if x != NONE && y != NONE && onto.edges.find(x, y).is_some() {
            kept[a as usize] = x;
            kept[b as usize] = y;
        }
    }
    kept
}

struct Pairing<'a> {
    from: &'a Graph<'a>,
    onto: &'a Graph<'a>,
    image: Vec<u32>,
    source: Vec<u32>,
    triangle_image: Vec<u32>,
    open: VecDeque<u32>,
    looks: [Looks; 2],
}

/// What tells vertices apart at a glance.
struct Looks {
    /// How many triangles each edge of the vertex and of its neighbours has.
    colours: Refinement,
    /// Whether the vertex or a neighbour is at the end of an edge with one triangle: a cut changes the colours
    /// there.
    by_border: Vec<bool>,
}

impl Looks {
    fn of(graph: &Graph<'_>) -> Self {
        let mut colours = Refinement::start(graph);
        colours.refine(graph);
        let at_border = graph.edges.at_border();
        let mut by_border = at_border.clone();
        for &[a, b] in graph.edges.vertices() {
            by_border[a as usize] |= at_border[b as usize];
            by_border[b as usize] |= at_border[a as usize];
        }
        Self { colours, by_border }
    }
}

impl<'a> Pairing<'a> {
    fn new(from: &'a Graph<'a>, onto: &'a Graph<'a>) -> Self {
        Self {
            from,
            onto,
            looks: [from, onto].map(Looks::of),
            image: vec![NONE; from.mesh.vertex_count()],
            source: vec![NONE; onto.mesh.vertex_count()],
            triangle_image: vec![NONE; from.mesh.triangle_count()],
            open: VecDeque::new(),
        }
    }

    /// Starts from the triangles whose corners' images are the corners of a triangle.
    fn sow(&mut self, seeds: &[u32]) {
        for t in 0..self.from.mesh.triangle_count() as u32 {
            let corners = self.from.triangle(t);
            let images = corners.map(|v| seeds[v as usize]);
            if images.contains(&NONE) {
                continue;
            }
            let has_all = |u: &u32| images.iter().all(|w| self.onto.triangle(*u).contains(w));
            if let Some(u) = self.onto.fan(images[0]).iter().copied().find(has_all) {
                self.pair(t, u, corners.into_iter().zip(images));
            }
        }
    }

    /// Pairs two triangles and their corners, unless a corner is paired otherwise or looks different.
    fn pair(&mut self, t: u32, u: u32, corners: impl Iterator<Item = (u32, u32)> + Clone) {
        let [here, there] = &self.looks;
        let alike = |v: u32, w: u32| {
            here.colours.of(v) == there.colours.of(w)
                || here.by_border[v as usize]
                || there.by_border[w as usize]
        };
        let agrees = |(v, w): (u32, u32)| {
            let (image, source) = (self.image[v as usize], self.source[w as usize]);
            (image == w && source == v) || (image == NONE && source == NONE && alike(v, w))
        };
        if self.triangle_image[t as usize] != NONE || !corners.clone().all(agrees) {
            return;
        }
        self.triangle_image[t as usize] = u;
        for (v, w) in corners {
            self.image[v as usize] = w;
            self.source[w as usize] = v;
        }
        self.open.push_back(t);
    }

    fn grow(&mut self) {
        while let Some(t) = self.open.pop_front() {
            let u = self.triangle_image[t as usize];
            let corners = self.from.triangle(t);
            for side in 0..3 {
                let ends = [corners[side], corners[(side + 1) % 3]];
                let images = ends.map(|v| self.image[v as usize]);
                let Ok((next, third)) = self.from.across_side(t, side, ends) else {
                    continue;
                };
                let Ok((its_image, third_image)) = self.onto.across(u, images) else {
                    continue;
                };
                let corners = [(ends[0], images[0]), (ends[1], images[1]), (third, third_image)];
                self.pair(next, its_image, corners.into_iter());
            }
        }
    }
}
