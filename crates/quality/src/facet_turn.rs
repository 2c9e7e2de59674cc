//! How far facets turn: what a highlight shows of a displacement.

use job::Job;
use mesh::{TriMesh, Vec3};
use serde::Serialize;

use crate::{Measurement, Metric, Needs, QualityError, same_connectivity};

/// By which angle each triangle's normal turned, in degrees from 0 to 180; none where a triangle had or has no area.
///
/// ```
/// use quality::FacetTurn;
/// let flat = mesh::shapes::rectangle(4, 4, 1.0, 1.0);
/// let turn = FacetTurn::between(&flat, &flat)?;
/// assert_eq!((turn.summary().max, turn.flipped()), (0.0, 0));
/// # Ok::<(), quality::QualityError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct FacetTurn {
    degrees: Vec<Option<f64>>,
}

/// What is said of some triangles' turns, in degrees; zeros of none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct TurnSummary {
    /// Half of the triangles turn less.
    pub median: f64,
    /// 99 of 100 triangles turn less.
    pub p99: f64,
    /// The one that turns most.
    pub max: f64,
}

impl FacetTurn {
    /// From a mesh to another of the same triangles over the same vertices.
    ///
    /// # Errors
    /// [`QualityError::Connectivity`] if the triangles differ.
    pub fn between(reference: &TriMesh, other: &TriMesh) -> Result<Self, QualityError> {
        same_connectivity(reference, other)?;
        let degrees = |t: usize| {
            let [before, after] = [normal(reference, t)?, normal(other, t)?];
            // By the tangent: near 0 and 180 degrees a cosine has no digits left.
            Some(before.cross(after).norm().atan2(before.dot(after)).to_degrees())
        };
        Ok(Self {
            degrees: (0..reference.triangle_count()).map(degrees).collect(),
        })
    }

    /// The angle of each triangle, #F.
    pub fn degrees(&self) -> &[Option<f64>] {
        &self.degrees
    }

    /// How many triangles look the other way.
    pub fn flipped(&self) -> usize {
        self.degrees
            .iter()
            .flatten()
            .filter(|&&angle| angle > 90.0)
            .count()
    }

    /// Median, 99th percentile and maximum over all triangles.
    pub fn summary(&self) -> TurnSummary {
        self.summary_of(|_| true)
    }

    /// The same over the triangles that are chosen by their index.
    pub fn summary_of(&self, is_chosen: impl Fn(usize) -> bool) -> TurnSummary {
        let chosen = self.degrees.iter().enumerate().filter(|(t, _)| is_chosen(*t));
        let mut angles: Vec<f64> = chosen.filter_map(|(_, angle)| *angle).collect();
        angles.sort_by(f64::total_cmp);
        let Some(&max) = angles.last() else {
            return TurnSummary::default();
        };
        let quantile = |share: f64| angles[((angles.len() - 1) as f64 * share).round() as usize];
        TurnSummary {
            median: quantile(0.5),
            p99: quantile(0.99),
            max,
        }
    }
}

/// The normal of a triangle, of any length; none of one without area.
fn normal(mesh: &TriMesh, triangle: usize) -> Option<Vec3> {
    let [a, b, c] = mesh.corners(triangle);
    let normal = (b - a).cross(c - a);
    (normal.squared() > 0.0).then_some(normal)
}

/// [`FacetTurn`] as a metric.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FacetTurnMetric;

impl Metric for FacetTurnMetric {
    fn name(&self) -> &'static str {
        "facet_turn"
    }

    fn needs(&self) -> Needs {
        Needs::SameConnectivity
    }

    fn measure(&self, reference: &TriMesh, other: &TriMesh, _job: &Job) -> Result<Measurement, QualityError> {
        let turn = FacetTurn::between(reference, other)?;
        let TurnSummary { median, p99, max } = turn.summary();
        Ok(Measurement::new([
            ("median", median.into()),
            ("p99", p99.into()),
            ("max", max.into()),
            ("flipped", turn.flipped().into()),
        ]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::{Similarity, shapes};
    use proptest::prelude::*;

    proptest! {
        /// A rotation by an angle about z turns a facet whose normal lies in the plane by that angle.
        #[test]
        fn a_turned_facet_turns_by_that_angle(angle in 0.0f64..179.0) {
            let upright = TriMesh::new(vec![[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0]], vec![[0, 1, 2]]).unwrap();
            let half = (angle / 2.0).to_radians();
            let turn = Similarity::from_quaternion([half.cos(), 0.0, 0.0, half.sin()]);
            let positions = upright.positions().iter().map(|&p| turn.apply(p)).collect();
            let turned = upright.with_positions(positions).unwrap();
            let found = FacetTurn::between(&upright, &turned).unwrap();
            prop_assert!((found.summary().max - angle).abs() < 1e-9);
            prop_assert_eq!(found.flipped(), usize::from(angle > 90.0));
        }
    }

    #[test]
    fn quantiles_are_of_the_chosen_and_triangles_without_area_do_not_count() {
        let mesh = shapes::bumpy_sphere(3, 1);
        let moved = shapes::jittered(&mesh, 0.05, 2);
        let turn = FacetTurn::between(&mesh, &moved).unwrap();
        let TurnSummary { median, p99, max } = turn.summary();
        assert!(0.0 < median && median < p99 && p99 < max);
        assert_eq!(turn.summary_of(|t| t == 5).max, turn.degrees()[5].unwrap());
        assert_eq!(turn.summary_of(|_| false), TurnSummary::default());
        let line = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], vec![[0, 1, 2]]).unwrap();
        assert_eq!(FacetTurn::between(&line, &line).unwrap().degrees(), [None]);
    }
}
