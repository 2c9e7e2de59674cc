//! A mesh whose edges are being collapsed.

use std::ops::Range;

use mesh::{TriMesh, Vec3, VertexStars};

/// What is left of a mesh. Vertices and triangles keep their numbers to the end.
pub(crate) struct Collapsing {
    /// The middle of the original's box, which is the origin here: differences of squares are exact to more digits.
    centre: Vec3,
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// Where the triangles at each vertex stand in `starred`, with some that went.
    stars: Vec<Range<usize>>,
    /// Stars, one after another. That of a vertex that others became part of stands anew at the end, until there are twice as many entries as at
    /// the start.
    starred: Vec<u32>,
    most_starred: usize,
    left: usize,
    labels: Option<Labels>,
}

/// To which label vertices belong, where those of different ones must not meet.
struct Labels {
    /// Of each vertex that is left.
    of: Vec<Option<u32>>,
    /// The vertex that each became part of, or itself.
    into: Vec<u32>,
    /// How many vertices are left without a label.
    without: usize,
}

/// In place of a triangle that went.
const GONE: [u32; 3] = [u32::MAX; 3];

impl Collapsing {
    /// `stars` are the triangles at each vertex.
    pub(crate) fn of(mesh: &TriMesh, stars: &VertexStars) -> Self {
        let centre = Vec3(mesh.bounding_box().centre());
        Self {
            centre,
            points: mesh.positions().iter().map(|&p| Vec3(p) - centre).collect(),
            triangles: mesh.triangles().to_vec(),
            stars: stars.offsets().windows(2).map(|ends| ends[0]..ends[1]).collect(),
            starred: stars.entries().to_vec(),
            most_starred: 2 * stars.entries().len(),
            left: mesh.triangle_count(),
            labels: None,
        }
    }

    /// The same where vertices have labels (#V).
    pub(crate) fn labelled(mut self, labels: &[Option<u32>]) -> Self {
        let of: Vec<Option<u32>> = (0..self.points.len())
            .map(|v| labels.get(v).copied().flatten())
            .collect();
        self.labels = Some(Labels {
            into: (0..of.len() as u32).collect(),
            without: of.iter().filter(|label| label.is_none()).count(),
            of,
        });
        self
    }

    /// Whether two vertices may become one.
    pub(crate) fn may_meet(&self, v: u32, w: u32) -> bool {
        self.labels.as_ref().is_none_or(|labels| {
            let [a, b] = [v, w].map(|v| labels.of[v as usize]);
            a.is_none() || b.is_none() || a == b
        })
    }

    /// Whether every vertex that is left has a label; no where there are none.
    pub(crate) fn all_have_labels(&self) -> bool {
        self.labels.as_ref().is_some_and(|labels| labels.without == 0)
    }

    /// Each vertex's last one, of which it became part, and the label of that (#V); none where there are no labels.
    pub(crate) fn into_labels(self) -> Vec<(u32, Option<u32>)> {
        let Some(Labels { of, mut into, .. }) = self.labels else {
            return Vec::new();
        };
        for v in 0..into.len() {
            // Ways are shortened as they are gone.
            let mut end = v as u32;
            while into[end as usize] != end {
                end = into[end as usize];
            }
            let mut here = v as u32;
            while here != end {
                here = std::mem::replace(&mut into[here as usize], end);
            }
        }
        into.into_iter().map(|end| (end, of[end as usize])).collect()
    }

    /// How many triangles are left.
    pub(crate) fn left(&self) -> usize {
        self.left
    }

    /// The corners of a triangle; none if it went.
    #[inline]
    pub(crate) fn triangle(&self, t: usize) -> Option<[u32; 3]> {
        let corners = self.triangles[t];
        (corners != GONE).then_some(corners)
    }

    #[inline]
    pub(crate) fn point(&self, v: u32) -> Vec3 {
        self.points[v as usize]
    }

    /// The triangles at a vertex: the number of each, and its corners with the vertex first, turned.
    #[inline]
    pub(crate) fn star(&self, v: u32) -> impl Iterator<Item = (u32, [u32; 3])> + '_ {
        self.starred[self.stars[v as usize].clone()]
            .iter()
            .filter_map(move |&t| {
                let [a, b, c] = self.triangles[t as usize];
                if a == v {
                    Some((t, [a, b, c]))
                } else if b == v {
                    Some((t, [b, c, a]))
                } else if c == v {
                    Some((t, [c, a, b]))
                } else {
                    None
                }
            })
    }

    /// The triangles at v but not at w, which stay when the two become one.
    #[inline]
    pub(crate) fn staying(&self, v: u32, w: u32) -> impl Iterator<Item = (u32, [u32; 3])> + '_ {
        self.star(v)
            .filter(move |(_, [_, next, last])| *next != w && *last != w)
    }

    /// Whether triangles are left when v and w become one.
    pub(crate) fn leaves_some(&self, v: u32, w: u32) -> bool {
        // Most often no star is as large.
        self.left > self.stars[v as usize].len()
            || self.left > self.star(v).count() - self.staying(v, w).count()
    }

    /// Makes w part of v, which goes to a point; triangles with both go.
    pub(crate) fn collapse(&mut self, v: u32, w: u32, to: Vec3) {
        if let Some(labels) = &mut self.labels {
            let [a, b] = [v, w].map(|v| labels.of[v as usize]);
            labels.without -= usize::from(a.is_none() || b.is_none());
            labels.of[v as usize] = a.or(b);
            labels.into[w as usize] = v;
        }
        let first = self.starred.len();
        for i in self.stars[v as usize].clone() {
            let t = self.starred[i];
            let corners = &mut self.triangles[t as usize];
            if corners.contains(&w) {
                *corners = GONE;
                self.left -= 1;
            } else if *corners != GONE {
                self.starred.push(t);
            }
        }
        for i in std::mem::take(&mut self.stars[w as usize]) {
            let t = self.starred[i];
            let corners = &mut self.triangles[t as usize];
            if *corners != GONE {
                corners
                    .iter_mut()
                    .filter(|corner| **corner == w)
                    .for_each(|corner| *corner = v);
                self.starred.push(t);
            }
        }
        self.stars[v as usize] = first..self.starred.len();
        if self.starred.len() > self.most_starred {
            self.gather_stars();
        }
        self.points[v as usize] = to;
    }

    /// Leaves out what stands in `starred` and is no star's any more.
    fn gather_stars(&mut self) {
        let mut starred = Vec::with_capacity(self.most_starred);
        for star in &mut self.stars {
            let first = starred.len();
            starred.extend_from_slice(&self.starred[star.clone()]);
            *star = first..starred.len();
        }
        self.starred = starred;
    }

    /// The mesh that is left; `original` if nothing changed.
    pub(crate) fn into_mesh(self, original: &TriMesh) -> TriMesh {
        if self.left == original.triangle_count() {
            return original.clone();
        }
        let mut triangles: Vec<[u32; 3]> = self.triangles;
        triangles.retain(|corners| *corners != GONE);
        let mut numbers = vec![u32::MAX; self.points.len()];
        for &v in triangles.as_flattened() {
            numbers[v as usize] = 0;
        }
        let mut positions = Vec::new();
        for (number, &point) in numbers.iter_mut().zip(&self.points) {
            if *number == 0 {
                *number = positions.len() as u32;
                positions.push((point + self.centre).0);
            }
        }
        for corner in triangles.as_flattened_mut() {
            *corner = numbers[*corner as usize];
        }
        // Points are finite, and no collapse leaves a corner twice in a triangle or takes the last one.
        TriMesh::new(positions, triangles).unwrap_or_else(|_| original.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    #[test]
    fn a_collapse_takes_the_triangles_of_its_edge_and_moves_the_others() {
        let square = shapes::rectangle(2, 2, 2.0, 2.0);
        let mut left = Collapsing::of(&square, &square.vertex_triangles());
        let before: Vec<_> = left.star(4).collect();
        assert_eq!(before.len(), 6);
        left.collapse(4, 0, Vec3::ZERO);
        assert_eq!(left.left(), 6);
        assert!(left.star(0).next().is_none());
        assert!(left.star(4).all(|(_, [v, ..])| v == 4));
        let mesh = left.into_mesh(&square);
        assert_eq!((mesh.vertex_count(), mesh.triangle_count()), (8, 6));
        assert_eq!(mesh.area(), 3.5 - 0.5);
    }

    #[test]
    fn a_vertex_that_all_others_become_part_of_does_not_fill_the_memory() {
        let ring = |i: u32| {
            let turn = f64::from(i) * 0.01;
            [turn.cos(), turn.sin(), 0.0]
        };
        let positions = [[0.0; 3]].into_iter().chain((0..600).map(ring)).collect();
        let fan = TriMesh::new(positions, (1..600).map(|i| [0, i, i + 1]).collect()).unwrap();
        let mut left = Collapsing::of(&fan, &fan.vertex_triangles());
        let room = 2 * 3 * fan.triangle_count();
        for w in 1..=300 {
            left.collapse(0, w, Vec3::ZERO);
            assert!(left.starred.len() <= room);
            assert_eq!(left.star(0).count(), 599 - w as usize);
        }
        let [next, last] = [left.star(301).count(), left.star(600).count()];
        assert_eq!((left.left(), next, last), (299, 1, 1));
    }

    #[test]
    fn the_last_triangles_are_not_left_out() {
        let square = shapes::rectangle(1, 1, 1.0, 1.0);
        let left = Collapsing::of(&square, &square.vertex_triangles());
        assert!(!left.leaves_some(0, 3));
        assert!(left.leaves_some(0, 1));
    }
}
