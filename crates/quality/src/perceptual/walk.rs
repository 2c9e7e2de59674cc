//! What lies around a vertex within a radius.

use mesh::{Edges, TriMesh, Vec3, VertexStars};

/// An edge that leads away from a centre, from a vertex in the ball around it.
pub(crate) struct Step {
    pub(crate) edge: u32,
    pub(crate) from: u32,
    pub(crate) to: u32,
    /// The part of the edge that lies in the ball: 1 if its end does too.
    pub(crate) inside: f64,
    /// Whether it is the first that leads to its end, which lies in the ball.
    pub(crate) discovers: bool,
}

/// Walks outward from vertices, one after the other, with the same memory.
pub(crate) struct Walker<'a> {
    mesh: &'a TriMesh,
    edges: &'a Edges,
    star: &'a VertexStars,
    /// The number of the last walk that came to a vertex.
    last: Vec<u32>,
    walk: u32,
    reached: Vec<u32>,
}

impl<'a> Walker<'a> {
    pub(crate) fn new(mesh: &'a TriMesh, edges: &'a Edges, star: &'a VertexStars) -> Self {
        Self {
            mesh,
            edges,
            star,
            last: vec![0; mesh.vertex_count()],
            walk: 0,
            reached: Vec::new(),
        }
    }

    /// Takes all edges that lead away from the centre, from it and from every vertex that such edges inside the ball reach.
    ///
    /// An edge leads away if it does so where it begins. Edges that come nearest to the centre between their ends lead away from
    /// neither, and are not taken: so does the walk of Lavoué's program.
    pub(crate) fn outward(&mut self, centre: u32, radius: f64, mut take: impl FnMut(Step)) {
        self.walk += 1;
        self.reached.clear();
        self.reached.push(centre);
        self.last[centre as usize] = self.walk;
        let point = |v: u32| self.mesh.point(v as usize);
        let middle = point(centre);
        let mut next = 0;
        while let Some(&from) = self.reached.get(next) {
            next += 1;
            let start = point(from) - middle;
            for &edge in self.star.of(from as usize) {
                let to = self.edges.other_end(edge as usize, from);
                let along = point(to) - point(from);
                if from != centre && along.dot(start) <= 0.0 {
                    continue;
                }
                let inside = part_inside(start, along, radius);
                let discovers = inside == 1.0 && self.last[to as usize] != self.walk;
                if discovers {
                    self.last[to as usize] = self.walk;
                    self.reached.push(to);
                }
                take(Step {
                    edge,
                    from,
                    to,
                    inside,
                    discovers,
                });
            }
        }
    }
}

/// The part of a segment that lies in the ball around 0; its start does.
fn part_inside(start: Vec3, along: Vec3, radius: f64) -> f64 {
    let (a, b, c) = (
        along.squared(),
        start.dot(along),
        start.squared() - radius * radius,
    );
    if a == 0.0 {
        return 1.0;
    }
    ((-b + (b * b - a * c).max(0.0).sqrt()) / a).clamp(0.0, 1.0)
}
