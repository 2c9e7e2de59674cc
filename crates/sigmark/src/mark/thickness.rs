//! How thick a model is, and how much of a mark it takes for that: a wire that waves is seen long before a highlight tells anything.

use mesh::{Surface, Vec3};

use super::Original;

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

/// By how much the strength of each patch is taken back, given its root mean square displacement: 1 where nothing is.
pub(super) fn factors(original: &Original, displacements: &[f64]) -> Vec<f64> {
    let surface = Surface::new(original.mesh());
    let reach = THICKEST * original.mesh().bounding_box().diagonal();
    let facing: Vec<Vec3> = original.mesh().triangle_normals().into_iter().map(Vec3).collect();
    let patches = original.patches().iter().zip(displacements);
    patches
        .map(|(patch, displacement)| {
            let normals = patch.mesh().vertex_normals();
            let step = normals.len().div_ceil(PLACES);
            let places = (0..normals.len()).step_by(step.max(1));
            let mut walls: Vec<f64> = places
                .map(|v| {
                    let (point, normal) = (patch.mesh().positions()[v], Vec3(normals[v]));
                    let is_other_side = |t: u32| facing[t as usize].dot(normal) < FACING;
                    let hit = surface.hit(point, normal.0, reach, is_other_side);
                    hit.filter(|hit| hit.t < 0.0).map_or(reach, |hit| -hit.t)
                })
                .collect();
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
    fn an_open_sheet_has_no_other_side() {
        assert_eq!(factor(shapes::rectangle(30, 30, 1.0, 1.0), 1e-3), 1.0);
    }
}
