//! How thick a model is, and how much of a mark it takes for that: a wire that waves is seen long before a highlight tells anything.

use std::ops::RangeInclusive;

use mesh::{BoundingBox, Surface, TriMesh, Vec3};

use super::{Original, Patch};

/// The root mean square displacement of a patch is at most this part of its thickness. A frame of glasses waves visibly with a twelfth.
const SHARE: f64 = 0.03;

/// However thin it is, a patch keeps this part of its strength: walls without thickness, drawn from both sides, carry a mark, too.
const LEAST: f64 = 0.125;

/// Walls thicker than this part of the model's diagonal are not looked for: no mark that one would write is held back by them.
const THICKEST: f64 = 0.05;

/// How many places of a patch are looked at.
const PLACES: usize = 64;

/// The other side of a wall faces away, by more than a right angle: the cosine between the normals is below this.
const FACING: f64 = -0.3;

/// Triangles are told to be near a line by cells of this part of its length.
const CELL: f64 = 1.0 / 32.0;

/// A triangle that reaches into more cells is looked at, whether a line goes through them or not.
const MANY_CELLS: usize = 64;

/// A place of a patch, and the direction out of it.
struct Place {
    point: Vec3,
    normal: Vec3,
}

/// By how much the strength of each patch is taken back, given its root mean square displacement: 1 where nothing is.
pub(super) fn factors(original: &Original, displacements: &[f64]) -> Vec<f64> {
    let mesh = original.mesh();
    let reach = THICKEST * mesh.bounding_box().diagonal();
    let places: Vec<Vec<Place>> = original.patches().iter().map(places).collect();
    // A tree over all triangles would take a sixth of the time in which a large model is signed.
    let surface = Surface::of(mesh, &triangles_near(mesh, places.iter().flatten(), reach));
    let wall = |Place { point, normal }: &Place| {
        let is_other_side = |t: u32| mesh.triangle_normal(t as usize).dot(*normal) < FACING;
        let hit = surface.hit((*point).into(), (*normal).into(), reach, is_other_side);
        hit.filter(|hit| hit.t < 0.0).map_or(reach, |hit| -hit.t)
    };
    let patches = places.iter().zip(displacements);
    patches
        .map(|(places, displacement)| {
            let mut walls: Vec<f64> = places.iter().map(wall).collect();
            walls.sort_by(f64::total_cmp);
            // The thinner quarter of a patch counts.
            let wall = walls.get(walls.len() / 4).copied().unwrap_or(reach);
            match wall < reach {
                true => (SHARE * wall / displacement).clamp(LEAST, 1.0),
                false => 1.0,
            }
        })
        .collect()
}

fn places(patch: &Patch) -> Vec<Place> {
    let normals = patch.mesh().vertex_normals();
    let step = normals.len().div_ceil(PLACES).max(1);
    let place = |v: usize| Place {
        point: patch.mesh().point(v),
        normal: Vec3(normals[v]),
    };
    (0..normals.len()).step_by(step).map(place).collect()
}

/// All triangles that a line through a place, along its normal and `reach` to both sides, could meet, and some more: those whose bounding boxes reach into a cell that
/// one goes through.
fn triangles_near<'a>(mesh: &TriMesh, places: impl IntoIterator<Item = &'a Place>, reach: f64) -> Vec<u32> {
    let mut cells = Cells::over(mesh.bounding_box(), CELL * reach);
    for Place { point, normal } in places {
        let pieces = (2.0 / CELL) as i32;
        let at = |piece: i32| *point + (f64::from(piece) * CELL - 1.0) * reach * *normal;
        for piece in 0..pieces {
            cells.mark(&[at(piece), at(piece + 1)]);
        }
    }
    let is_near = |&t: &u32| cells.is_marked(&mesh.corners(t as usize));
    (0..mesh.triangle_count() as u32).filter(is_near).collect()
}

/// A box that is cut into cubes, of which some are marked.
struct Cells {
    corner: Vec3,
    side: f64,
    /// How many there are along each axis.
    counts: [usize; 3],
    is_marked: Vec<bool>,
}

impl Cells {
    fn over(bounds: BoundingBox, side: f64) -> Self {
        let counts = bounds.size().map(|size| (size / side) as usize + 1);
        Self {
            corner: Vec3(bounds.min),
            side,
            counts,
            is_marked: vec![false; counts.iter().product()],
        }
    }

    /// Those that the bounding box of some points reaches into, first and last along each axis; none where it lies outside. The box is taken a little larger, so that
    /// rounding leaves out none.
    fn around(&self, points: &[Vec3]) -> Option<[RangeInclusive<usize>; 3]> {
        let bounds = BoundingBox::of(points);
        let along = |axis: usize| {
            let place = |x: f64| (x - self.corner[axis]) / self.side;
            let (first, last) = (place(bounds.min[axis]) - 1e-3, place(bounds.max[axis]) + 1e-3);
            let is_inside = last >= 0.0 && first < self.counts[axis] as f64;
            is_inside.then(|| first.max(0.0) as usize..=(last as usize).min(self.counts[axis] - 1))
        };
        Some([along(0)?, along(1)?, along(2)?])
    }

    fn mark(&mut self, points: &[Vec3]) {
        if let Some(around) = self.around(points) {
            numbers(self.counts, around).for_each(|cell| self.is_marked[cell] = true);
        }
    }

    /// Whether the bounding box of some points reaches into a marked cell, or into very many.
    fn is_marked(&self, points: &[Vec3]) -> bool {
        self.around(points).is_none_or(|around| {
            around
                .iter()
                .map(|range| range.clone().count())
                .product::<usize>()
                > MANY_CELLS
                || numbers(self.counts, around).any(|cell| self.is_marked[cell])
        })
    }
}

/// The numbers of a block of cells, of so many along each axis.
fn numbers(
    [_, rows, columns]: [usize; 3],
    [x, y, z]: [RangeInclusive<usize>; 3],
) -> impl Iterator<Item = usize> {
    x.flat_map(move |x| {
        let z = z.clone();
        y.clone()
            .flat_map(move |y| z.clone().map(move |z| (x * rows + y) * columns + z))
    })
}

#[cfg(test)]
mod tests {
    use super::super::Pool;
    use super::*;
    use job::Job;
    use mesh::{TriMesh, shapes};

    fn factor(mesh: TriMesh, displacement: f64) -> f64 {
        let original = Original::pooled(mesh, 24, Pool::default(), &Job::default()).unwrap();
        let displacements = vec![displacement; original.patches().len()];
        let factors = factors(&original, &displacements);
        factors.into_iter().fold(1.0, f64::min)
    }

    #[test]
    fn a_thin_ring_is_marked_less_by_its_thickness_and_a_ball_is_not() {
        let diagonal = (2.0_f64 * 2.2 * 2.2 + 0.2 * 0.2).sqrt();
        let ring = |tube: f64| shapes::torus(200, 12, 1.0, tube);
        let displacement = 4e-4 * diagonal;
        // Across the tube it is twice its radius thick, measured between facets a little less.
        let expected = SHARE * 2.0 * 0.01 / displacement;
        let found = factor(ring(0.01), displacement);
        assert!(
            (0.9 * expected..=expected * 1.01).contains(&found),
            "{found} for {expected}"
        );
        assert_eq!(factor(shapes::icosphere(4), displacement), 1.0);
        assert_eq!(factor(ring(0.0005), displacement), LEAST);
    }

    #[test]
    fn no_triangle_that_a_line_meets_is_left_out() {
        let shapes = [
            shapes::torus(60, 20, 1.0, 0.1),
            shapes::soup(400, 7),
            shapes::book_of_slivers(40, 1e-7),
            shapes::translated(&shapes::bumpy_sphere(3, 5), [1e5, 0.0, -1e5]),
        ];
        for mesh in shapes {
            let reach = 0.05 * mesh.bounding_box().diagonal();
            let normals = mesh.vertex_normals();
            let place = |v: usize| Place {
                point: mesh.point(v),
                normal: Vec3(normals[v]),
            };
            let places: Vec<Place> = (0..mesh.vertex_count()).step_by(7).map(place).collect();
            let near = triangles_near(&mesh, &places, reach);
            let (some, all) = (Surface::of(&mesh, &near), Surface::new(&mesh));
            for Place { point, normal } in places {
                let hit = |surface: &Surface| {
                    surface
                        .hit(point.into(), normal.into(), reach, |t| {
                            mesh.triangle_normal(t as usize).dot(normal) < FACING
                        })
                        .map(|hit| hit.t)
                };
                assert_eq!(hit(&some), hit(&all));
            }
        }
    }

    #[test]
    fn an_open_sheet_has_no_other_side() {
        assert_eq!(factor(shapes::rectangle(30, 30, 1.0, 1.0), 1e-3), 1.0);
    }
}
