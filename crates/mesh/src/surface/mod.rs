//! Nearest points, distances and line hits on a triangle mesh, by a bounding volume hierarchy.
//!
//! [`tree`] is binary, split by the surface area heuristic. [`bvh4`] holds the same boxes four to a node, for queries of single
//! points and lines; [`packet`] takes up to 64 neighbouring points through the binary tree as one. Boxes only reject:
//! [`triangle`] decides, in double precision.

mod bvh4;
mod packet;
mod stack;
mod tree;
mod triangle;

use job::{Job, JobError};

use crate::{BoundingBox, TriMesh, Vec3};
use bvh4::Bvh4;
use tree::Tree;
use triangle::{Line, nearest_on_triangle};

/// A mesh prepared for queries. Building takes O(n log n) time, about 170 bytes a triangle.
///
/// ```
/// use mesh::Surface;
/// let ball = Surface::new(&mesh::shapes::icosphere(4));
/// let nearest = ball.nearest([0.0, 0.0, 3.0]);
/// assert!((nearest.distance - 2.0).abs() < 1e-2);
/// let hit = ball.hit([0.0, 0.0, 0.9], [0.0, 0.0, 1.0], 0.5, |_| true).unwrap();
/// assert!((hit.t - 0.1).abs() < 1e-2);
/// ```
pub struct Surface {
    bvh4: Bvh4,
    tree: Tree,
    /// Corners of the triangles, in the order of the tree.
    corners: Vec<[Vec3; 3]>,
}

/// The point of a surface that is nearest to a query point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Where it is.
    pub point: [f64; 3],
    /// Its distance from the query point.
    pub distance: f64,
    /// The triangle that it lies on; of several equally near, any, but the same in every run.
    pub triangle: u32,
}

/// Where a line meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Position along the line: the point is origin + t · direction.
    pub t: f64,
    /// The triangle that is met.
    pub triangle: u32,
}

impl Surface {
    /// Builds the tree over the triangles of a mesh.
    pub fn new(mesh: &TriMesh) -> Self {
        Self::of(mesh, &(0..mesh.triangle_count() as u32).collect::<Vec<_>>())
    }

    /// Builds the tree over some triangles of a mesh, at least one; answers name them by their numbers in the mesh.
    ///
    /// ```
    /// let cube = mesh::shapes::cube(1.0);
    /// let face = mesh::Surface::of(&cube, &[4]);
    /// assert_eq!(face.nearest([0.0; 3]).triangle, 4);
    /// ```
    ///
    /// # Panics
    /// If there is none, or the mesh has not so many.
    pub fn of(mesh: &TriMesh, triangles: &[u32]) -> Self {
        assert!(!triangles.is_empty(), "a surface of no triangles");
        let corners = |&t: &u32| mesh.corners(t as usize);
        let mut tree = Tree::over(triangles.iter().map(|t| BoundingBox::of(&corners(t))).collect());
        for t in &mut tree.order {
            *t = triangles[*t as usize];
        }
        Self {
            bvh4: Bvh4::of(&tree.nodes),
            corners: tree.order.iter().map(corners).collect(),
            tree,
        }
    }

    /// The point of the surface nearest to `p`.
    pub fn nearest(&self, p: [f64; 3]) -> Nearest {
        self.search(p, f64::INFINITY).unwrap_or(Nearest {
            point: p,
            distance: f64::INFINITY,
            triangle: 0,
        })
    }

    /// The point of the surface nearest to `p`, if it is nearer than `limit`.
    pub fn nearest_within(&self, p: [f64; 3], limit: f64) -> Option<Nearest> {
        self.search(p, limit * limit)
    }

    /// [`nearest`](Self::nearest) of each point, with progress.
    ///
    /// # Errors
    /// [`JobError`]: cancelled, or no threads.
    pub fn nearest_of(&self, points: &[[f64; 3]], job: &Job) -> Result<Vec<Nearest>, JobError> {
        const CHUNK: usize = 1024;
        job.map_reported(points.len(), CHUNK, |i| self.nearest(points[i]))
    }

    fn search(&self, p: [f64; 3], limit_squared: f64) -> Option<Nearest> {
        let p = Vec3(p);
        let mut best = limit_squared;
        let mut found = None;
        self.bvh4.near(p, &mut best, |first, count, best| {
            for leaf in first..first + count {
                let point = nearest_on_triangle(&self.corners[leaf], p);
                let distance = (point - p).squared();
                if distance < *best {
                    *best = distance;
                    found = Some((point, leaf));
                }
            }
        });
        found.map(|(point, leaf)| Nearest {
            point: point.into(),
            distance: best.sqrt(),
            triangle: self.tree.order[leaf],
        })
    }

    /// The distance of each point from the surface. Quickest if points that follow each other lie close together.
    ///
    /// ```
    /// use mesh::Surface;
    /// let cube = Surface::new(&mesh::shapes::cube(1.0));
    /// let mut distances = [0.0; 2];
    /// cube.distances(&[[0.5, 0.5, 1.25], [2.0, 0.5, 0.5]], &mut distances);
    /// assert_eq!(distances, [0.25, 1.0]);
    /// ```
    ///
    /// # Panics
    /// If there is not one place in `distances` for each point.
    pub fn distances(&self, points: &[[f64; 3]], distances: &mut [f64]) {
        assert_eq!(points.len(), distances.len(), "one distance a point");
        packet::measure(&self.tree, &self.corners, points, distances);
    }

    /// Where the line origin + t · direction, −`limit` ≤ t ≤ `limit`, meets an accepted triangle at the least |t|.
    ///
    /// Triangles are met from both sides; one that contains the line is not met. `accept` is asked by triangle index.
    pub fn hit(
        &self,
        origin: [f64; 3],
        direction: [f64; 3],
        limit: f64,
        accept: impl Fn(u32) -> bool,
    ) -> Option<Hit> {
        let (origin, direction) = (Vec3(origin), Vec3(direction));
        let line = Line::new(origin, direction)?;
        let mut best = limit;
        let mut found = None;
        self.bvh4
            .along(origin, direction, &mut best, |first, count, best| {
                for leaf in first..first + count {
                    let triangle = self.tree.order[leaf];
                    if let Some(t) = line.meet(&self.corners[leaf])
                        && t.abs() <= *best
                        && accept(triangle)
                    {
                        *best = t.abs();
                        found = Some(Hit { t, triangle });
                    }
                }
            });
        found
    }
}

// As the vector instructions compare, one instruction each: without the care of `f64::min` for numbers that are none.
#[inline(always)]
fn lesser<T: PartialOrd>(x: T, y: T) -> T {
    if x < y { x } else { y }
}

#[inline(always)]
fn greater<T: PartialOrd>(x: T, y: T) -> T {
    if x > y { x } else { y }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;
    use proptest::prelude::*;

    fn soups() -> impl Strategy<Value = TriMesh> {
        (1..60_u32, any::<u64>(), 0..4_u8).prop_map(|(n, seed, kind)| match kind {
            0 => shapes::soup(n, seed),
            1 => shapes::book_of_slivers(n, 1e-7),
            2 => shapes::translated(&shapes::bumpy_sphere(1, seed), [1e5, 0.0, -1e5]),
            _ => shapes::disjoint_union(&vec![shapes::tetrahedron(); n as usize]),
        })
    }

    fn points(size: f64) -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-size..size).prop_map(Vec3)
    }

    proptest! {
        #[test]
        fn the_nearest_point_is_the_nearest_of_all_triangles(mesh in soups(), p in points(15.0), near in any::<bool>()) {
            let p = if near { 0.01 * p + mesh.point(0) } else { p };
            let nearest = Surface::new(&mesh).nearest(p.into());
            let all = (0..mesh.triangle_count()).map(|t| (nearest_on_triangle(&mesh.corners(t), p) - p).norm());
            prop_assert_eq!(nearest.distance, all.fold(f64::INFINITY, f64::min));
            let on_it = nearest_on_triangle(&mesh.corners(nearest.triangle as usize), p);
            prop_assert_eq!(on_it, Vec3(nearest.point));
            prop_assert!(Surface::new(&mesh).nearest_within(p.into(), nearest.distance * 0.999).is_none());
        }

        #[test]
        fn the_hit_is_the_nearest_of_all_triangles(mesh in soups(), origin in points(5.0), towards in points(5.0)) {
            let direction = towards - origin;
            let found = Surface::new(&mesh).hit(origin.into(), direction.into(), 3.0, |_| true);
            let line = Line::new(origin, direction).unwrap();
            let all = (0..mesh.triangle_count()).filter_map(|t| line.meet(&mesh.corners(t))).map(f64::abs);
            let least = all.fold(f64::INFINITY, f64::min);
            prop_assert_eq!(found.map(|hit| hit.t.abs()), (least <= 3.0).then_some(least));
        }

        #[test]
        fn a_line_from_inside_always_leaves_a_closed_surface(seed in 0..4_u64, direction in points(1.0), v in 0..162_usize, e in 0..480_usize) {
            let ball = shapes::bumpy_sphere(2, seed);
            let edges = crate::Edges::of(&ball);
            let [a, b] = edges.vertices()[e].map(|v| ball.point(v as usize));
            let surface = Surface::new(&ball);
            // Through vertices and the middles of edges, where triangles meet, and anywhere.
            for direction in [direction, ball.point(v), 0.5 * (a + b)] {
                prop_assert!(surface.hit([0.0; 3], direction.into(), 1e9, |_| true).is_some());
            }
        }
    }

    #[test]
    fn axis_parallel_lines_in_the_faces_of_boxes_hit() {
        let cube = Surface::new(&shapes::cube(1.0));
        let up_at = |x: f64| cube.hit([x, 0.25, -1.0], [0.0, 0.0, 1.0], 5.0, |_| true);
        for edge in [0.0, 0.5, 1.0] {
            assert_eq!(up_at(edge).unwrap().t, 1.0);
        }
        assert!(up_at(1.0 + 1e-12).is_none());
        assert!(cube.hit([0.5; 3], [0.0; 3], 5.0, |_| true).is_none());
    }

    #[test]
    fn a_filter_lets_the_line_go_on() {
        let cube = shapes::cube(1.0);
        let normals = cube.triangle_normals();
        let top = |t: u32| normals[t as usize][2] > 0.5;
        let hit = Surface::new(&cube).hit([0.3, 0.4, 0.1], [0.0, 0.0, 1.0], 5.0, top);
        assert!((hit.unwrap().t - 0.9).abs() < 1e-15);
    }

    #[test]
    fn many_points_are_sought_on_any_number_of_threads_until_the_observer_ends_it() {
        let ball = shapes::bumpy_sphere(4, 3);
        let surface = Surface::new(&shapes::icosphere(3));
        let alone: Vec<Nearest> = ball.positions().iter().map(|&p| surface.nearest(p)).collect();
        for threads in [1, 3] {
            assert_eq!(
                surface.nearest_of(ball.positions(), &Job::new(threads)).unwrap(),
                alone
            );
        }
        struct Stop;
        impl job::Observer for Stop {
            fn cancelled(&self) -> bool {
                true
            }
        }
        let stopped = Job::default().observed_by(Stop);
        assert_eq!(
            surface.nearest_of(ball.positions(), &stopped),
            Err(JobError::Cancelled)
        );
    }
}
