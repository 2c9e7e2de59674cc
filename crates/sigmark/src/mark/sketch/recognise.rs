use std::cell::Cell;

use mesh::{BoundingBox, Closed, Edges, Similarity, TriMesh, Vec3, VertexStars};

use super::{Sketch, probes};
use crate::mark::traversal::Traversal;

/// An original that was recognised in another file.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Recognised {
    /// In the unit and the axes of the sketch, its vertices in the order of the traversal.
    pub mesh: TriMesh,
    /// Which vertex of the given mesh each of those is.
    pub vertex_of: Vec<u32>,
    /// Takes the given mesh there.
    pub transform: Similarity,
    /// Root mean square distance of the points that tell it, as a fraction of the diagonal.
    pub residual: f64,
}

/// How far a point may lie from its place, as a fraction of the diagonal: three times what rounding to 14 bits takes.
const TOLERANCE: f64 = 1e-4;

/// Root mean square distance up to which it is the same geometry. The subtlest named strength moves vertices by three times as much.
const SAME: f64 = 6e-5;

/// By how much the edges of bounding boxes may differ, as a fraction of the diagonal.
const SAME_BOX: f64 = 1e-3;

/// So many vertices are looked at for each that there is: few lie where a triangle is looked for, unless a file was made so.
const MOST_LOOKED_AT: usize = 256;

/// Units of length that models are written in, in metres.
const UNITS: [f64; 5] = [1.0, 0.01, 0.001, 0.0254, 0.3048];

impl Sketch {
    /// Whether a mesh is the geometry of this sketch, or holds it beside other parts, with its seams as the original has them or split; none if it has
    /// other triangles or lies elsewhere.
    pub fn recognise(&self, given: &TriMesh) -> Option<Recognised> {
        let places = Places::of(given);
        self.recognise_as_it_is(given, &places)
            .or_else(|| self.recognise_closed(&Closed::along_borders(given, &places.edges)?))
            .or_else(|| self.recognise_closed(&Closed::everywhere(given)?))
    }

    fn recognise_closed(&self, closed: &Closed) -> Option<Recognised> {
        let mut recognised = self.recognise_as_it_is(closed.mesh(), &Places::of(closed.mesh()))?;
        for vertex in &mut recognised.vertex_of {
            *vertex = closed.vertex_of()[*vertex as usize];
        }
        Some(recognised)
    }

    fn recognise_as_it_is(&self, given: &TriMesh, places: &Places) -> Option<Recognised> {
        if given.vertex_count() < self.labels.len() || given.triangle_count() < self.triangles {
            return None;
        }
        // Other parts may lie outside the box.
        let is_larger = given.triangle_count() > self.triangles;
        let in_units = is_larger.then(|| poses_in_units(&self.bounds));
        let walks = poses_of_boxes(&self.bounds, &given.bounding_box())
            .chain(in_units.into_iter().flatten())
            .filter(|pose| self.begins(given, places, pose))
            .filter_map(|pose| self.walk(given, places, &pose).map(|walk| (pose, walk)));
        let (pose, walk) = walks.min_by(|(_, a), (_, b)| a.residual.total_cmp(&b.residual))?;
        let mut rank = vec![0; given.vertex_count()];
        for (r, &v) in (0..).zip(&walk.order) {
            rank[v as usize] = r;
        }
        let transform = pose.then(&self.bounds.to_unit_frame().inverse());
        let positions = walk
            .order
            .iter()
            .map(|&v| transform.apply(given.positions()[v as usize]));
        let walked = given
            .triangles()
            .iter()
            .zip(&walk.walked)
            .filter(|&(_, &walked)| walked);
        let triangles = walked.map(|(t, _)| t.map(|v| rank[v as usize]));
        Some(Recognised {
            mesh: TriMesh::new(positions.collect(), triangles.collect()).ok()?,
            vertex_of: walk.order,
            transform,
            residual: walk.residual,
        })
    }

    /// Whether the first of the first triangles is found in a pose.
    fn begins(&self, given: &TriMesh, places: &Places, pose: &Similarity) -> bool {
        let mut first = self.first.iter().take(1);
        first.all(|&corners| places.triangle(given, pose, corners, |_| true).is_some())
    }

    /// The traversal of the mesh in a pose, to the unit frame, if all points are found in it.
    fn walk(&self, given: &TriMesh, places: &Places, pose: &Similarity) -> Option<Walk> {
        let mut traversal = Traversal::new(given, &places.edges);
        let mut squares = 0.0;
        for &corners in &self.first {
            let open = |triangle: usize| !traversal.walked()[triangle];
            let found = places.triangle(given, pose, corners, open)?;
            squares += found.squares;
            traversal.walk(found.triangle, found.corners);
        }
        let order = traversal.order();
        let triangles = traversal.walked().iter().filter(|&&walked| walked).count();
        if (order.len(), triangles) != (self.labels.len(), self.triangles) {
            return None;
        }
        for (rank, &place) in probes(order.len()).zip(&self.probes) {
            let at = pose.apply(given.point(order[rank] as usize));
            squares += (at - Vec3(place.map(f64::from))).squared();
        }
        let points = 3 * self.first.len() + self.probes.len();
        let residual = (squares / points as f64).sqrt();
        (residual <= SAME).then(|| Walk {
            order: order.to_vec(),
            walked: traversal.walked().to_vec(),
            residual,
        })
    }
}

struct Walk {
    order: Vec<u32>,
    /// Which triangles of the given mesh.
    walked: Vec<bool>,
    residual: f64,
}

const AXES: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

/// The eight ways to exchange axes so and turn them around. Programs write files in other units and with other axes upward, and do not turn models otherwise.
fn turns(axes: [usize; 3]) -> impl Iterator<Item = Similarity> {
    (0..8).map(move |signs| {
        let mut rotation = [[0.0; 3]; 3];
        for (i, row) in rotation.iter_mut().enumerate() {
            row[axes[i]] = if signs >> i & 1 == 0 { 1.0 } else { -1.0 };
        }
        Similarity {
            rotation,
            ..Similarity::IDENTITY
        }
    })
}

/// The transforms from the given mesh to the unit frame of the sketch by which one box becomes the other.
fn poses_of_boxes(sketched: &BoundingBox, given: &BoundingBox) -> impl Iterator<Item = Similarity> + use<> {
    let (to_unit, given_to_unit) = (sketched.to_unit_frame(), given.to_unit_frame());
    let edges = sketched.size().map(|edge| edge * to_unit.scale);
    let given_edges = given.size().map(|edge| edge * given_to_unit.scale);
    let fits = move |axes: &[usize; 3]| (0..3).all(|i| (edges[i] - given_edges[axes[i]]).abs() < SAME_BOX);
    let turns = AXES.into_iter().filter(fits).flat_map(turns);
    turns.map(move |turn| given_to_unit.then(&turn))
}

/// The transforms from a mesh about the same origin in whatever unit to the unit frame of the sketch.
fn poses_in_units(sketched: &BoundingBox) -> impl Iterator<Item = Similarity> + use<> {
    let to_unit = sketched.to_unit_frame();
    let mut scales: Vec<f64> = UNITS
        .iter()
        .flat_map(|from| UNITS.iter().map(move |to| from / to))
        .collect();
    scales.sort_unstable_by(f64::total_cmp);
    scales.dedup_by(|a, b| (*a - *b).abs() < 1e-9 * *a);
    let turns = AXES.into_iter().flat_map(turns);
    turns.flat_map(move |turn| {
        let scaled = scales
            .clone()
            .into_iter()
            .map(move |scale| Similarity { scale, ..turn });
        scaled.map(move |pose| pose.then(&to_unit))
    })
}

/// Where the vertices of a mesh are, and what is beside them.
struct Places {
    /// Along each axis, vertices with their coordinates, ascending.
    along: [Vec<(f64, u32)>; 3],
    triangles: VertexStars,
    edges: Edges,
    /// How many more vertices may be looked at.
    room: Cell<usize>,
}

/// A triangle whose corners were looked for.
struct FoundTriangle {
    triangle: usize,
    corners: [u32; 3],
    squares: f64,
}

impl Places {
    fn of(mesh: &TriMesh) -> Self {
        let sorted = |axis: usize| {
            let coordinates = mesh.positions().iter().map(|p| p[axis]);
            let mut sorted: Vec<(f64, u32)> = coordinates.zip(0..).collect();
            sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            sorted
        };
        Self {
            along: [0, 1, 2].map(sorted),
            triangles: mesh.vertex_triangles(),
            edges: Edges::of(mesh),
            room: Cell::new(MOST_LOOKED_AT * mesh.vertex_count()),
        }
    }

    /// The nearest open triangle whose corners lie at three places, each within the tolerance.
    fn triangle(
        &self,
        mesh: &TriMesh,
        pose: &Similarity,
        places: [[f32; 3]; 3],
        open: impl Fn(usize) -> bool,
    ) -> Option<FoundTriangle> {
        let places = places.map(|place| Vec3(place.map(f64::from)));
        let square = |v: u32, place: Vec3| (pose.apply(mesh.point(v as usize)) - place).squared();
        let mut best: Option<FoundTriangle> = None;
        for a in self.near(mesh, pose, places[0])? {
            for &triangle in self
                .triangles
                .of(a as usize)
                .iter()
                .filter(|&&t| open(t as usize))
            {
                let [x, y, z] = mesh.triangles()[triangle as usize];
                for corners in [[x, y, z], [y, z, x], [z, x, y], [x, z, y], [y, x, z], [z, y, x]] {
                    let each = [0, 1, 2].map(|i| square(corners[i], places[i]));
                    let squares = each.iter().sum();
                    let is_near = each.iter().all(|&square| square < TOLERANCE * TOLERANCE);
                    if is_near && best.as_ref().is_none_or(|best| squares < best.squares) {
                        best = Some(FoundTriangle {
                            triangle: triangle as usize,
                            corners,
                            squares,
                        });
                    }
                }
            }
        }
        best
    }

    /// The vertices that may lie within the tolerance of a place; none where too many were looked at.
    fn near(&self, mesh: &TriMesh, pose: &Similarity, place: Vec3) -> Option<impl Iterator<Item = u32>> {
        let back = pose.inverse();
        let (place, off) = (back.apply(place), TOLERANCE * back.scale);
        let slab = |axis: usize| {
            let sorted = &self.along[axis];
            let begin = sorted.partition_point(|&(own, _)| own < place[axis] - off);
            let end = sorted.partition_point(|&(own, _)| own <= place[axis] + off);
            &sorted[begin..end.max(begin)]
        };
        // Of the three, the thinnest: much may lie in one plane.
        let [x, y, z] = [0, 1, 2].map(slab);
        let found = [x, y, z].into_iter().min_by_key(|slab| slab.len())?;
        self.room.set(self.room.get().checked_sub(found.len())?);
        let is_near = move |&v: &u32| {
            let p = mesh.point(v as usize);
            (0..3).all(|axis| (p[axis] - place[axis]).abs() <= off)
        };
        Some(found.iter().map(|&(_, v)| v).filter(is_near))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mark::{Original, Pool, sketch::Sketcher};
    use job::Job;
    use mesh::shapes;
    use proptest::prelude::*;

    fn sketch_of(mesh: &TriMesh) -> (Original, Sketch) {
        let original = Original::pooled(mesh.clone(), 24, Pool::default(), &Job::default()).unwrap();
        let sketcher = Sketcher::new(&original);
        let opposite = original.map_bases(|_, patch, basis| sketcher.opposite(patch, basis), &Job::default());
        let sketch = sketcher.sketch(opposite.unwrap()).unwrap();
        (original, sketch)
    }

    /// x becomes z upward, in another unit, elsewhere.
    fn exported(mesh: &TriMesh, digits: f64) -> TriMesh {
        let positions = mesh.positions().iter();
        let moved = positions.map(|[x, y, z]| [25.4 * y - 3.0, 25.4 * z + 7.0, 25.4 * x]);
        let rounded = moved.map(|p| p.map(|x| (x * digits).round() / digits));
        mesh.with_positions(rounded.collect()).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn the_same_geometry_is_recognised_in_another_order_unit_and_precision(seed in 0u64..1000) {
            let mesh = shapes::disjoint_union(&[
                shapes::bumpy_sphere(3, seed),
                shapes::translated(&shapes::bumpy_sphere(3, seed + 1), [4.0, 1.0, 0.0]),
            ]);
            let (original, sketch) = sketch_of(&mesh);
            let found = sketch.recognise(&shapes::shuffled(&exported(&mesh, 1e4), seed)).unwrap();
            prop_assert!(found.residual < 1e-6);
            // Each vertex lies where one of the original does, in the same patch.
            let labels = original.patches().labels();
            for (place, &label) in found.mesh.positions().iter().zip(sketch.labels()) {
                let apart = |v: usize| (mesh.point(v) - Vec3(*place)).squared();
                let nearest = (0..mesh.vertex_count()).min_by(|&a, &b| apart(a).total_cmp(&apart(b))).unwrap();
                prop_assert!(apart(nearest) < 1e-8);
                prop_assert_eq!(labels[nearest], label);
            }
        }
    }

    #[test]
    fn another_geometry_is_not_recognised() {
        let mesh = shapes::bumpy_sphere(3, 1);
        let (_, sketch) = sketch_of(&mesh);
        assert!(sketch.recognise(&mesh).is_some());
        // Vertices moved by as little as a mark moves them; another surface with the same triangles; other triangles.
        let diagonal = mesh.bounding_box().diagonal();
        let waved = mesh.positions().iter().map(|&[x, y, z]| {
            let wave = 2e-4 * diagonal * std::f64::consts::SQRT_2;
            [x + wave * (9.0 * y).sin(), y, z]
        });
        assert!(
            sketch
                .recognise(&mesh.with_positions(waved.collect()).unwrap())
                .is_none()
        );
        for other in [
            shapes::bumpy_sphere(3, 2),
            shapes::bumpy_sphere(2, 1),
            shapes::icosphere(3),
        ] {
            assert!(sketch.recognise(&other).is_none());
        }
    }

    /// Tiles in one plane, each found among all others.
    #[test]
    fn pieces_that_lie_in_one_plane_are_recognised_in_no_time() {
        let upright = Similarity::from_quaternion([1.0, 0.0, 1.0, 0.0]);
        let tile = shapes::moved(&shapes::rectangle(3, 3, 0.01, 0.01), &upright);
        let tiles = (0..10_000).map(|i| {
            let [y, z] = [i % 100, i / 100].map(|i| 0.02 * f64::from(i));
            shapes::translated(&tile, [0.0, y, z])
        });
        let ball = shapes::translated(&shapes::bumpy_sphere(4, 1), [3.0, 0.0, 0.0]);
        let mesh = shapes::disjoint_union(&[vec![ball], tiles.collect()].concat());
        let (_, sketch) = sketch_of(&mesh);
        assert!(sketch.recognise(&shapes::shuffled(&mesh, 1)).is_some());
    }

    #[test]
    fn what_is_in_very_many_pieces_is_not_sketched() {
        let mesh = shapes::disjoint_union(&[shapes::icosphere(3), shapes::soup(50, 1)]);
        let original = Original::pooled(mesh, 24, Pool::default(), &Job::default()).unwrap();
        assert!(Sketcher::new(&original).sketch(Vec::new()).is_none());
    }
}
