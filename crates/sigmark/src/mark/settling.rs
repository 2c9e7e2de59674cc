//! What a displacement of the original does to a suspect that was decimated afterwards.
//!
//! Collapses of edges put a vertex where the quadric of all planes that went into it is least, Σ (n·x − d)² (Garland and Heckbert 1997). A displacement δ moves those planes: at x, by n·δ(x) along their
//! normals, where δ is continued from each triangle over its plane by its values at the corners. So the lowest point moves by
//!
//! A⁻¹ Σ n (n·δ(x)),  A = Σ n nᵀ,
//!
//! to first order where x is near the planes, and what lies on a triangle of the suspect moves as its corners do. Where vertices were taken from a region as wide as a wave of δ, that is neither δ nor its mean there: planes hold
//! δ's slopes, too.

use mesh::{TriMesh, Vec3};

use super::{
    Patch,
    planes::{Plane, pulls},
};

/// From which vertices of an original a decimated suspect's vertices came, and how these follow them. The suspect lies on the original.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Settling {
    /// For each vertex of the original, the corners of the suspect's triangle in which it was seen, and their weights (#V); none where nothing was seen, or is not asked for.
    pub(crate) places: Vec<Option<([u32; 3], [f64; 3])>>,
    /// For each vertex of the original, the suspect's vertex into which it went (#V). Each vertex of the suspect has its region from one of the ways in which regions
    /// were told; as those of different ways may overlap, each way stands for itself.
    pub(crate) regions: Vec<Vec<Option<u32>>>,
    /// Of each vertex of the suspect; none where its planes don't tell.
    pub(crate) lowest: Vec<Option<Lowest>>,
}

/// The lowest point of a region's quadric, which is held in its place along the surface, where planes tell little.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lowest {
    pub(crate) point: Vec3,
    /// A⁻¹, by rows.
    pub(crate) inverse: [Vec3; 3],
}

impl Settling {
    /// The same for what is displaced within one patch.
    pub(crate) fn of_patch(&self, patch: &Patch) -> SettlingOfPatch {
        let places: Vec<Option<([u32; 3], [f64; 3])>> = patch.gather(&self.places);
        let mut corners: Vec<u32> = places
            .iter()
            .flatten()
            .flat_map(|&(corners, _)| corners)
            .collect();
        corners.sort_unstable();
        corners.dedup();
        let number = |w: u32| corners.binary_search(&w).ok();
        let lowest: Vec<Option<Lowest>> = corners.iter().map(|&w| self.lowest[w as usize]).collect();
        let of_way = |regions: &Vec<Option<u32>>| {
            let regions = patch.gather(regions);
            let regions: Vec<Option<usize>> = regions.into_iter().map(|w| number(w?)).collect();
            planes(patch.mesh(), &regions, &lowest)
        };
        let planes = self.regions.iter().flat_map(of_way).collect();
        let known = |w: u32| number(w).filter(|&w| lowest[w].is_some());
        let in_patch = |(corners, weights): ([u32; 3], [f64; 3])| {
            let [a, b, c] = corners.map(known);
            Some(([a?, b?, c?], weights))
        };
        SettlingOfPatch {
            places: places.into_iter().map(|place| in_patch(place?)).collect(),
            inverses: inverses(&lowest),
            planes,
        }
    }
}

/// How vertices of a suspect follow what is displaced within one patch. They are numbered among those that are corners where the patch was seen.
pub(crate) struct SettlingOfPatch {
    /// For each vertex of the patch, the corners around it and their weights; none where it is not known how all three follow.
    places: Vec<Option<([usize; 3], [f64; 3])>>,
    /// A⁻¹ of each vertex of the suspect, by rows; 0 where it is not known.
    inverses: Vec<[Vec3; 3]>,
    planes: Vec<Plane>,
}

fn inverses(lowest: &[Option<Lowest>]) -> Vec<[Vec3; 3]> {
    let inverse = |lowest: &Option<Lowest>| lowest.map_or([Vec3::ZERO; 3], |lowest| lowest.inverse);
    lowest.iter().map(inverse).collect()
}

/// The planes of all regions: each triangle's goes to the regions of its corners.
fn planes(mesh: &TriMesh, regions: &[Option<usize>], lowest: &[Option<Lowest>]) -> Vec<Plane> {
    let mut planes = Vec::new();
    for (t, corners) in mesh.triangles().iter().enumerate() {
        let of_corners = corners.map(|v| regions[v as usize]);
        for i in 0..3 {
            let is_first = !of_corners[..i].contains(&of_corners[i]);
            let Some(region) = of_corners[i].filter(|_| is_first) else {
                continue;
            };
            let Some(Lowest { point, .. }) = lowest[region] else {
                continue;
            };
            let times = of_corners.iter().filter(|&&of| of == Some(region)).count() as f64;
            planes.extend(Plane::of(*corners, mesh.corners(t), (region, point), times));
        }
    }
    planes
}

impl SettlingOfPatch {
    /// How far each vertex of the suspect moves when the vertices of the patch are displaced by a function along each of the three axes; 0 where that is not known.
    pub(crate) fn moved_by(&self, function: &[f64]) -> Vec<[Vec3; 3]> {
        let sums = pulls(&self.planes, function, self.inverses.len());
        // Sums are symmetric: their rows are their columns.
        let moved =
            |(rows, sum): (&[Vec3; 3], [Vec3; 3])| sum.map(|column| Vec3(rows.map(|row| row.dot(column))));
        self.inverses.iter().zip(sums).map(moved).collect()
    }

    /// How far what is seen at a vertex of the patch moves along a vector where such a function displaces the patch along an axis; none where that is not known.
    pub(crate) fn seen_along(
        &self,
        moved: &[[Vec3; 3]],
        vertex: usize,
        axis: usize,
        along: Vec3,
    ) -> Option<f64> {
        let (corners, weights) = self.places[vertex]?;
        let parts = corners.into_iter().zip(weights);
        Some(
            parts
                .map(|(corner, weight)| weight * along.dot(moved[corner][axis]))
                .sum(),
        )
    }
}

/// Weights of a triangle's corners, with sum 1, for a point of its plane; a third each where it has no area.
pub(crate) fn barycentric([a, b, c]: [Vec3; 3], p: Vec3) -> [f64; 3] {
    let normal = (b - a).cross(c - a);
    let square = normal.squared();
    if square == 0.0 {
        return [1.0 / 3.0; 3];
    }
    let of = |from: Vec3, to: Vec3| (to - from).cross(p - from).dot(normal) / square;
    [of(b, c), of(c, a), of(a, b)]
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use decimation::Quadric;
    use mesh::shapes;

    /// The quadric of each region: every triangle's plane, as often as it has corners there.
    pub(crate) fn quadrics(mesh: &TriMesh, regions: &[Option<usize>], count: usize) -> Vec<Quadric> {
        let mut quadrics = vec![Quadric::ZERO; count];
        for (t, corners) in mesh.triangles().iter().enumerate() {
            let [a, b, c] = mesh.corners(t);
            let normal = (b - a).cross(c - a).unit();
            let plane = Quadric::of_plane(normal, normal.dot(a));
            for region in corners.iter().filter_map(|&v| regions[v as usize]) {
                quadrics[region] += plane;
            }
        }
        quadrics
    }

    fn lowest(quadrics: &[Quadric]) -> Vec<Option<Lowest>> {
        let of = |quadric: &Quadric| {
            Some(Lowest {
                point: quadric.minimum()?,
                inverse: quadric.inverse()?,
            })
        };
        quadrics.iter().map(of).collect()
    }

    #[test]
    fn lowest_points_move_as_foretold() {
        let mesh = shapes::bumpy_sphere(4, 3);
        let seeds: Vec<usize> = (0..mesh.vertex_count()).step_by(40).collect();
        let nearest = |v: usize| {
            let apart = |s: &usize| (mesh.point(v) - mesh.point(seeds[*s])).squared();
            (0..seeds.len()).min_by(|a, b| apart(a).total_cmp(&apart(b)))
        };
        let regions: Vec<Option<usize>> = (0..mesh.vertex_count()).map(nearest).collect();
        let before = quadrics(&mesh, &regions, seeds.len());
        let lowest = lowest(&before);
        let settling = SettlingOfPatch {
            places: Vec::new(),
            inverses: inverses(&lowest),
            planes: planes(&mesh, &regions, &lowest),
        };
        // Waves about as long as regions are wide.
        let wave: Vec<f64> = mesh
            .positions()
            .iter()
            .map(|[x, y, z]| (9.0 * x + 5.0 * y - 7.0 * z).sin())
            .collect();
        let moved = settling.moved_by(&wave);
        for (axis, way) in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().enumerate() {
            let height = 1e-6;
            let displaced =
                (0..mesh.vertex_count()).map(|v| (mesh.point(v) + way * (height * wave[v])).into());
            let displaced = mesh.with_positions(displaced.collect()).unwrap();
            let after = quadrics(&displaced, &regions, seeds.len());
            let (mut off, mut all, mut off_as_it_is) = (0.0, 0.0, 0.0);
            for (region, seed) in seeds.iter().enumerate() {
                let step = (after[region].minimum().unwrap() - lowest[region].unwrap().point) / height;
                let normal = lowest[region].unwrap().point.unit();
                off += (step - moved[region][axis]).dot(normal).powi(2);
                off_as_it_is += (step - way * wave[*seed]).dot(normal).powi(2);
                all += step.dot(normal).powi(2);
            }
            // To first order, but for what planes turn where they don't meet the lowest point.
            assert!(off < 0.05 * all, "{axis}: {off} of {all}");
            assert!(off_as_it_is > 5.0 * off, "{axis}: {off_as_it_is}, {off}");
        }
    }

    #[test]
    fn a_shift_moves_all_that_is_seen_by_as_much() {
        let mesh = shapes::bumpy_sphere(2, 1);
        let regions: Vec<Option<usize>> = (0..mesh.vertex_count()).map(|v| Some(v % 2)).collect();
        let lowest = lowest(&quadrics(&mesh, &regions, 2));
        let settling = SettlingOfPatch {
            places: vec![Some(([0, 1, 0], [0.25, 0.5, 0.25])), None],
            inverses: inverses(&lowest),
            planes: planes(&mesh, &regions, &lowest),
        };
        let moved = settling.moved_by(&vec![1.0; mesh.vertex_count()]);
        let along = Vec3([0.3, -0.4, 0.9]);
        for axis in 0..3 {
            let seen = settling.seen_along(&moved, 0, axis, along).unwrap();
            assert!((seen - along[axis]).abs() < 1e-9, "{seen}");
        }
        assert_eq!(settling.seen_along(&moved, 1, 0, along), None);
    }

    #[test]
    fn weights_of_corners_give_back_the_point() {
        let corners = [
            Vec3([1.0, 0.0, 0.0]),
            Vec3([0.0, 2.0, 0.5]),
            Vec3([0.0, -1.0, 3.0]),
        ];
        let expected = [0.5, -0.25, 0.75];
        let point = corners
            .iter()
            .zip(expected)
            .fold(Vec3::ZERO, |sum, (&corner, weight)| sum + corner * weight);
        for (weight, expected) in barycentric(corners, point).into_iter().zip(expected) {
            assert!((weight - expected).abs() < 1e-12);
        }
        assert_eq!(barycentric([corners[0]; 3], point), [1.0 / 3.0; 3]);
    }
}
