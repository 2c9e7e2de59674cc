//! Patches for a mark whose chips are pooled: small, each with as many harmonics as its share of the surface deserves.
//!
//! Every part of the model takes part that has room for [`LEAST_USEFUL`] useful harmonics, small pieces too; what is smaller stays as it is. The number of
//! harmonics of a patch is proportional to its area, so that all of the surface is marked in one band of spatial frequencies, as far as
//! its vertices carry that many: one harmonic takes eight of them, or four or two where the bits would not fit otherwise.

use job::Job;
use mesh::{Components, TriMesh, components};

use super::{
    LARGEST_PATCH, MOST_FUNCTIONS, MarkError, Patch, Patches, VERTICES_PER_FUNCTION, patches::label,
};

/// How finely a pooled mark is laid out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Pool {
    /// How often every bit stands in the whole mark, where there is room; none for 6.
    pub repetitions: Option<usize>,
    /// Into how many patches the model is cut, about; none for as many as make the harmonics cheap.
    pub patches: Option<usize>,
}

/// What is read under noise does not depend on it. A lower band is seen less and outlasts more smoothing, a higher one outlasts more decimation: of bunny,
/// armadillo and igea at the default strength facets turn by 0.7, 1.0 and 1.5 degrees in the median with 3, 6 and 12, T₀ after decimation by MeshLab to a tenth
/// is 56, 78 and 77 (47, 69 and 64; 237, 370 and 363), and after thirty steps of smoothing 29, 21 and 6 (69, 60 and 38; 88, 208 and 99).
const REPETITIONS: usize = 6;

/// Useful harmonics of a patch. The cost of all harmonics grows with it; harmonics are held at borders, and small patches are mostly border. With 95 they take half of the
/// time, and T₀ is 0.93 of it under noise and 0.95 after simplification (bunny, armadillo, horse, laurana; docs/decisions.md); with 342 they take more than twice as long, for nothing.
const USEFUL_IN_PATCH: usize = 171;

/// Patches have at most about so many vertices, which matters from two hundred thousand on. With 12 000 the skull of a million is signed in 6.2 s in place of 7.5,
/// in 91 patches of 12 harmonics, few of which are low.
const MOST_VERTICES: usize = 20_000;

/// Patches of a model in one piece have at least about so many: smaller ones are mostly border.
const LEAST_VERTICES: usize = 1_000;

/// A part of a model with room for fewer useful harmonics is left alone.
const LEAST_USEFUL: usize = 3;

/// Vertices to a harmonic, where there is room for the bits, and where there is not. With fewer than eight a mark turns large triangles beside small ones: those of a head of
/// 6 000 vertices by 12 degrees at the 99th percentile with four.
const VERTICES_PER_HARMONIC: [usize; 3] = [8, 4, VERTICES_PER_FUNCTION];

/// More patches of a component are cut from regions of it. With 217 patches of 4.3 million vertices, all that is done before harmonics takes 12 s
/// so in place of 18.
const PATCHES_AT_ONCE: usize = 64;

/// How unequal the patches of a component may be.
pub(super) const IMBALANCE: f64 = 0.03;

impl Pool {
    /// Cuts a mesh for a mark of so many bits: the patches, and how many harmonics each has.
    ///
    /// # Errors
    /// [`MarkError::Room`] when the mesh has no room for the bits, [`MarkError::PatchTooLarge`] when too few patches were asked for;
    /// [`MarkError::Job`].
    pub fn cut(&self, mesh: &TriMesh, bits: usize, job: &Job) -> Result<(Patches, Vec<usize>), MarkError> {
        let rate = self.repetitions.unwrap_or(REPETITIONS);
        if bits == 0 || rate == 0 {
            return Err(MarkError::EmptyLayout { bits, rate });
        }
        if mesh.area() == 0.0 {
            return Err(MarkError::NoArea { patch: 0 });
        }
        let wanted = bits.saturating_mul(rate).div_ceil(3);
        let components = components(mesh);
        let mut found = 0;
        for vertices_per_harmonic in VERTICES_PER_HARMONIC {
            let useful = useful_of_components(mesh, &components, wanted, vertices_per_harmonic);
            let parts = self.parts(&components, &useful);
            let labels = with_triangles(mesh, label(mesh, &components, &parts, PATCHES_AT_ONCE, job)?);
            if labels.iter().all(|&label| label == 0) {
                continue;
            }
            let patches = Patches::from_labels(mesh, &labels)?;
            check_sizes(mesh, &patches)?;
            let areas: Vec<f64> = patches.iter().map(|patch| patch.mesh().area()).collect();
            let most: Vec<usize> = patches
                .iter()
                .map(|patch| useful_of_patch(patch, vertices_per_harmonic))
                .collect();
            let useful = share(wanted, &areas, &most);
            found = found.max(3 * useful.iter().sum::<usize>());
            if found >= bits {
                return without_empty(mesh, patches, &useful);
            }
        }
        Err(MarkError::Room { found, least: bits })
    }

    /// How many patches each component becomes; none if it is left alone.
    fn parts(&self, components: &Components, useful: &[usize]) -> Vec<usize> {
        let taking_part = |&(_, useful): &(&usize, &usize)| *useful > 0;
        let sizes = components.sizes.iter().zip(useful);
        let vertices: usize = sizes.clone().filter(taking_part).map(|(size, _)| size).sum();
        let parts = |(&size, &useful): (&usize, &usize)| match self.patches {
            _ if useful == 0 => 0,
            Some(patches) => {
                let share = size as f64 / vertices as f64;
                ((patches as f64 * share).round() as usize).max(1)
            }
            None => {
                let by_harmonics = (useful as f64 / USEFUL_IN_PATCH as f64).round() as usize;
                by_harmonics
                    .min(size / LEAST_VERTICES)
                    .max(size.div_ceil(MOST_VERTICES))
            }
        };
        sizes.map(parts).collect()
    }
}

/// How many useful harmonics each component would have, at one density over the surface; none if it is left alone. Where a scene has so many parts that the
/// wanted number leaves too few for each, there are more.
fn useful_of_components(
    mesh: &TriMesh,
    components: &Components,
    wanted: usize,
    vertices_per_harmonic: usize,
) -> Vec<usize> {
    let mut areas = vec![0.0; components.count];
    for (t, triangle) in mesh.triangles().iter().enumerate() {
        areas[components.of_vertex[triangle[0] as usize] as usize] += mesh.triangle_area(t);
    }
    let sizes = components.sizes.iter();
    let most: Vec<usize> = sizes
        .map(|size| (size / vertices_per_harmonic).saturating_sub(1))
        .collect();
    let room: usize = most.iter().filter(|&&most| most >= LEAST_USEFUL).sum();
    let mut density = wanted;
    loop {
        let mut useful = share(density, &areas, &most);
        useful
            .iter_mut()
            .filter(|useful| **useful < LEAST_USEFUL)
            .for_each(|useful| *useful = 0);
        if useful.iter().sum::<usize>() >= wanted.min(room) || density > 2 * most.iter().sum::<usize>() {
            return useful;
        }
        density = density.saturating_mul(2);
    }
}

/// How many useful harmonics a patch has room for: it has none at vertices where it is held.
///
/// Where most vertices crowd in a small part of the surface, high harmonics live there alone, and are as many times larger there. So vertices count by their share of
/// the area too, with (Σ D)² / Σ D² for their number, unless the bits would not fit.
fn useful_of_patch(patch: &Patch, vertices_per_harmonic: usize) -> usize {
    let mesh = patch.mesh();
    let mut masses = vec![0.0; mesh.vertex_count()];
    for (t, triangle) in mesh.triangles().iter().enumerate() {
        let third = mesh.triangle_area(t) / 3.0;
        triangle.iter().for_each(|&v| masses[v as usize] += third);
    }
    let pairs = masses.iter().zip(patch.at_border());
    let free: Vec<f64> = pairs
        .filter(|(_, at_border)| !**at_border)
        .map(|(mass, _)| *mass)
        .collect();
    let sum: f64 = free.iter().sum();
    let squares: f64 = free.iter().map(|mass| mass * mass).sum();
    let spread = if squares > 0.0 {
        (sum * sum / squares) as usize
    } else {
        0
    };
    let counted = match vertices_per_harmonic {
        VERTICES_PER_FUNCTION => free.len(),
        _ => free.len().min(2 * spread),
    };
    (counted / vertices_per_harmonic)
        .min(MOST_FUNCTIONS)
        .saturating_sub(1)
}

/// Labels of the patches that hold a triangle, numbered anew: one of few vertices among large ones may hold none.
fn with_triangles(mesh: &TriMesh, mut labels: Vec<u32>) -> Vec<u32> {
    let count = labels.iter().copied().max().unwrap_or(0) as usize;
    let mut name = vec![0; count + 1];
    for triangle in mesh.triangles() {
        let [a, b, c] = triangle.map(|v| labels[v as usize]);
        if a == b && b == c {
            name[a as usize] = 1;
        }
    }
    name[0] = 0;
    let mut next = 0;
    for name in name.iter_mut().filter(|name| **name > 0) {
        next += 1;
        *name = next;
    }
    labels.iter_mut().for_each(|label| *label = name[*label as usize]);
    labels
}

fn check_sizes(mesh: &TriMesh, patches: &Patches) -> Result<(), MarkError> {
    match patches.iter().map(|patch| patch.vertices().len()).max() {
        Some(vertices) if vertices > LARGEST_PATCH => Err(MarkError::PatchTooLarge {
            vertices,
            most: LARGEST_PATCH,
            enough: mesh.vertex_count().div_ceil(LARGEST_PATCH / 2) + 1,
        }),
        _ => Ok(()),
    }
}

/// Whole numbers with a sum of `wanted`, proportional to the areas as far as none is above its most; all of them where that is not
/// enough.
pub(super) fn share(wanted: usize, areas: &[f64], most: &[usize]) -> Vec<usize> {
    let capped = |density: f64| {
        areas
            .iter()
            .zip(most)
            .map(move |(&area, &most)| (density * area).min(most as f64))
    };
    let room: usize = most
        .iter()
        .zip(areas)
        .filter(|(_, area)| **area > 0.0)
        .map(|(most, _)| most)
        .sum();
    if room <= wanted {
        return most
            .iter()
            .zip(areas)
            .map(|(&most, &area)| if area > 0.0 { most } else { 0 })
            .collect();
    }
    // The sum grows with the density: between nothing and what fills the part that is full last, halving settles all digits, however small that part is.
    let fullest = areas.iter().zip(most).filter(|(area, _)| **area > 0.0);
    let (mut low, mut high) = (
        0.0,
        fullest
            .map(|(area, &most)| most as f64 / area)
            .fold(0.0, f64::max)
            .min(f64::MAX),
    );
    loop {
        let middle = 0.5 * low + 0.5 * high;
        if middle <= low || middle >= high {
            break;
        }
        if capped(middle).sum::<f64>() < wanted as f64 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let exact: Vec<f64> = capped(high).collect();
    let mut shares: Vec<usize> = exact.iter().map(|&x| x as usize).collect();
    let mut order: Vec<usize> = (0..exact.len()).filter(|&i| shares[i] < most[i]).collect();
    order.sort_by(|&a, &b| exact[b].fract().total_cmp(&exact[a].fract()).then(a.cmp(&b)));
    let missing = wanted.saturating_sub(shares.iter().sum());
    order.into_iter().take(missing).for_each(|i| shares[i] += 1);
    shares
}

/// The patches with at least one useful harmonic, and m of each.
fn without_empty(
    mesh: &TriMesh,
    patches: Patches,
    useful: &[usize],
) -> Result<(Patches, Vec<usize>), MarkError> {
    let functions = useful
        .iter()
        .filter(|&&useful| useful > 0)
        .map(|useful| useful + 1)
        .collect();
    if useful.iter().all(|&useful| useful > 0) {
        return Ok((patches, functions));
    }
    let mut next = 0;
    let renamed: Vec<u32> = useful
        .iter()
        .map(|&useful| {
            next += u32::from(useful > 0);
            if useful > 0 { next } else { 0 }
        })
        .collect();
    let labels: Vec<u32> = patches
        .labels()
        .iter()
        .map(|&label| {
            if label == 0 {
                0
            } else {
                renamed[label as usize - 1]
            }
        })
        .collect();
    Ok((Patches::from_labels(mesh, &labels)?, functions))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;
    use proptest::prelude::*;

    fn cut(mesh: &TriMesh, bits: usize, pool: Pool) -> Result<(Patches, Vec<usize>), MarkError> {
        pool.cut(mesh, bits, &Job::default())
    }

    #[test]
    fn harmonics_follow_area_and_small_pieces_take_part() {
        let mesh = shapes::disjoint_union(&[
            shapes::icosphere(4),
            shapes::translated(&shapes::scaled(&shapes::icosphere(3), 0.5), [5.0, 0.0, 0.0]),
            shapes::translated(&shapes::tetrahedron(), [9.0, 0.0, 0.0]),
        ]);
        let (patches, functions) = cut(&mesh, 96, Pool::default()).unwrap();
        assert_eq!(patches.unmarked_vertices(), 4);
        let useful: Vec<f64> = functions.iter().map(|&m| m as f64 - 1.0).collect();
        assert_eq!(useful.iter().sum::<f64>(), (96 * REPETITIONS / 3) as f64);
        let areas: Vec<f64> = patches.iter().map(|patch| patch.mesh().area()).collect();
        let density = useful.iter().sum::<f64>() / areas.iter().sum::<f64>();
        for (useful, area) in useful.iter().zip(&areas) {
            assert!((useful - density * area).abs() < 1.0, "{useful} of {area}");
        }
    }

    #[test]
    fn a_scene_of_very_many_parts_is_one_work() {
        let parts =
            (0..200).map(|i| shapes::translated(&shapes::icosphere(1), [3.0 * f64::from(i), 0.0, 0.0]));
        let mesh = shapes::disjoint_union(&parts.collect::<Vec<_>>());
        let (patches, functions) = cut(&mesh, 512, Pool::default()).unwrap();
        assert_eq!(patches.len(), 200);
        assert!(3 * functions.iter().map(|m| m - 1).sum::<usize>() >= 512);
    }

    #[test]
    fn a_mesh_without_room_for_every_bit_is_refused_with_numbers() {
        let error = cut(&shapes::icosphere(2), 512, Pool::default()).unwrap_err();
        assert!(
            matches!(
                error,
                MarkError::Room {
                    found: 240,
                    least: 512
                }
            ),
            "{error}"
        );
        assert!(cut(&shapes::tetrahedron(), 512, Pool::default()).is_err());
        // A flat triangle has no area to be marked.
        let flat = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], vec![[0, 1, 2]]).unwrap();
        assert!(cut(&flat, 1, Pool::default()).is_err());
    }

    #[test]
    fn a_patch_of_single_vertices_is_left_out() {
        let mesh = shapes::icosphere(3);
        let left = |v: usize| mesh.positions()[v][0] < 0.0;
        let halves = |right: u32| -> Vec<u32> {
            let label = |v: usize| if left(v) { 1 } else { right };
            (0..mesh.vertex_count()).map(label).collect()
        };
        let mut labels = halves(3);
        labels[7] = 2;
        let mut expected = halves(2);
        expected[7] = 0;
        assert_eq!(with_triangles(&mesh, labels), expected);
        assert_eq!(with_triangles(&mesh, halves(2)), halves(2));
    }

    #[test]
    fn a_number_of_patches_can_be_asked_for() {
        let pool = Pool {
            patches: Some(5),
            ..Pool::default()
        };
        assert_eq!(cut(&shapes::icosphere(5), 96, pool).unwrap().0.len(), 5);
    }

    #[test]
    fn a_part_of_hardly_any_area_does_not_fill_all_others() {
        for area in [1e-10, 1e-62, 1e-300, f64::from_bits(1)] {
            assert_eq!(share(1024, &[12.0, area], &[5119, 19]), [1024, 0], "{area}");
        }
    }

    proptest! {
        #[test]
        fn shares_have_the_sum_and_keep_the_bounds(
            parts in prop::collection::vec((0.0..10.0f64, 0usize..60), 1..40),
            wanted in 1usize..800,
        ) {
            let (areas, most): (Vec<f64>, Vec<usize>) = parts.into_iter().unzip();
            let shares = share(wanted, &areas, &most);
            let room: usize = most.iter().zip(&areas).filter(|(_, a)| **a > 0.0).map(|(m, _)| m).sum();
            prop_assert_eq!(shares.iter().sum::<usize>(), wanted.min(room));
            prop_assert!(shares.iter().zip(&most).all(|(share, most)| share <= most));
        }
    }
}
