//! Samples of a triangle, at most one interval apart, with the area that each stands for.

use crate::vector::{Vec3, add, cross, norm, scaled, sub};

/// Triangles with longer edges, in intervals, are halved before they are sampled, so that samples that are measured together
/// lie close together.
const LONGEST: f64 = 12.0;

/// Halvings of one triangle; 2⁶⁰ samples would be more than anyone can wait for.
const HALVINGS: u32 = 60;

/// Points of one small triangle, with their weights.
#[derive(Default)]
pub(crate) struct Samples {
    pub(crate) points: Vec<Vec3>,
    /// The area that each point stands for.
    pub(crate) weights: Vec<f64>,
}

impl Samples {
    pub(crate) fn clear(&mut self) {
        self.points.clear();
        self.weights.clear();
    }

    /// A point of no weight.
    pub(crate) fn add_point(&mut self, p: Vec3) {
        self.points.push(p);
        self.weights.push(0.0);
    }

    /// Rows parallel to the longest edge, at most `interval` apart, of points at most `interval` apart.
    ///
    /// Rows cut the triangle into a smaller one and trapezia of equal height; the points of a row lie at the height of its
    /// centroid, evenly on both sides of the median, and share its area. So the weighted sum of a linear function is its
    /// integral.
    fn add_rows(&mut self, corners: [Vec3; 3], interval: f64) {
        let (base, [a, b, apex]) = from_longest_edge(corners);
        let twice_area = norm(cross(sub(b, a), sub(apex, a)));
        if twice_area == 0.0 {
            return;
        }
        let rows = (twice_area / (base * interval)).ceil().max(1.0);
        for row in 0..rows as usize {
            // Heights as fractions: at height t the triangle is 1 − t as wide as at its base.
            let (low, high) = (row as f64 / rows, (row + 1) as f64 / rows);
            let area = (high - low) * (1.0 - 0.5 * (high + low));
            let moment = (high - low) * (0.5 * (high + low) - (high * high + high * low + low * low) / 3.0);
            let t = moment / area;
            let (left, right) = (towards(a, apex, t), towards(b, apex, t));
            let count = (base * (1.0 - t) / interval).ceil().max(1.0);
            let weight = 0.5 * twice_area * 2.0 * area / count;
            for i in 0..count as usize {
                self.points.push(towards(left, right, (i as f64 + 0.5) / count));
                self.weights.push(weight);
            }
        }
    }
}

/// Samples of a triangle, in pieces whose points lie close together: `visit` is called with each piece.
pub(crate) fn sample(
    corners: [Vec3; 3],
    interval: f64,
    samples: &mut Samples,
    visit: &mut impl FnMut(&mut Samples),
) {
    let mut open = vec![(corners, 0)];
    while let Some((corners, halvings)) = open.pop() {
        let (longest, [a, b, c]) = from_longest_edge(corners);
        if longest > LONGEST * interval && halvings < HALVINGS {
            let middle = towards(a, b, 0.5);
            open.push(([middle, b, c], halvings + 1));
            open.push(([a, middle, c], halvings + 1));
        } else {
            samples.add_rows(corners, interval);
            visit(samples);
            samples.clear();
        }
    }
}

/// The length of the longest edge, and the corners turned so that it runs from the first to the second.
fn from_longest_edge([a, b, c]: [Vec3; 3]) -> (f64, [Vec3; 3]) {
    let turned =
        [[a, b, c], [b, c, a], [c, a, b]].map(|corners| (norm(sub(corners[1], corners[0])), corners));
    let longer = |x: (f64, [Vec3; 3]), y: (f64, [Vec3; 3])| if y.0 > x.0 { y } else { x };
    longer(longer(turned[0], turned[1]), turned[2])
}

fn towards(a: Vec3, b: Vec3, t: f64) -> Vec3 {
    add(scaled(a, 1.0 - t), scaled(b, t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::dot;
    use proptest::prelude::*;

    fn all_samples(corners: [Vec3; 3], interval: f64) -> Samples {
        let (mut one, mut all) = (Samples::default(), Samples::default());
        sample(corners, interval, &mut one, &mut |piece| {
            all.points.extend(&piece.points);
            all.weights.extend(&piece.weights);
        });
        all
    }

    fn triangles() -> impl Strategy<Value = [Vec3; 3]> {
        (
            prop::array::uniform3(prop::array::uniform3(-1.0..1.0_f64)),
            0..4_i32,
        )
            .prop_map(|([a, b, c], thin)| [a, b, add(towards(a, b, 0.3), scaled(c, 10_f64.powi(-thin)))])
    }

    proptest! {
        #[test]
        fn linear_functions_are_integrated_exactly(corners in triangles(), interval in 0.02..2.0_f64, f in prop::array::uniform3(-1.0..1.0_f64)) {
            let [a, b, c] = corners;
            let samples = all_samples(corners, interval);
            let area = 0.5 * norm(cross(sub(b, a), sub(c, a)));
            let integral = area * dot(f, add(add(a, b), c)) / 3.0;
            let sum: f64 = samples.points.iter().zip(&samples.weights).map(|(&p, w)| w * dot(f, p)).sum();
            prop_assert!((sum - integral).abs() < 1e-12 * area.max(1e-3));
            prop_assert!((samples.weights.iter().sum::<f64>() - area).abs() < 1e-12 * area.max(1e-3));
        }

        #[test]
        fn every_point_of_a_triangle_has_a_sample_or_a_corner_near_it(corners in triangles(), interval in 0.05..0.5_f64, u in 0.0..1.0_f64, v in 0.0..1.0_f64) {
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let [a, b, c] = corners;
            let p = add(a, add(scaled(sub(b, a), u), scaled(sub(c, a), v)));
            let samples = all_samples(corners, interval);
            let nearest = samples.points.iter().chain(&corners).map(|&q| norm(sub(p, q))).fold(f64::INFINITY, f64::min);
            prop_assert!(nearest <= 1.5 * interval, "{nearest} {interval}");
        }
    }

    #[test]
    fn triangles_without_area_have_no_samples() {
        assert!(
            all_samples([[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0]], 0.1)
                .points
                .is_empty()
        );
        assert!(all_samples([[1.0; 3]; 3], 0.1).points.is_empty());
    }
}
