//! Samples of a triangle, about one interval apart, with the area that each stands for.

use mesh::Vec3;

/// Triangles with longer edges, in intervals, are halved before they are sampled, so that samples that are measured together
/// lie close together.
const LONGEST: f64 = 12.0;

/// Halvings of one triangle; 2⁶⁰ samples would be more than anyone can wait for.
const HALVINGS: u32 = 60;

/// Points of one small triangle, with their weights.
#[derive(Default)]
pub(crate) struct Samples {
    pub(crate) points: Vec<[f64; 3]>,
    /// The area that each point stands for.
    pub(crate) weights: Vec<f64>,
}

impl Samples {
    pub(crate) fn clear(&mut self) {
        self.points.clear();
        self.weights.clear();
    }

    pub(crate) fn append(&mut self, other: &Self) {
        self.points.extend(&other.points);
        self.weights.extend(&other.weights);
    }

    /// A point of no weight.
    pub(crate) fn add_point(&mut self, p: [f64; 3]) {
        self.points.push(p);
        self.weights.push(0.0);
    }

    /// Rows parallel to the longest edge, about an `interval` apart, of points about an interval apart; two by two at least.
    ///
    /// Rows cut the triangle into a smaller one and trapezia of equal height; the points of a row share its area, evenly on both
    /// sides of the median. Heights and offsets are stretched a little from where the middles would be, so that second
    /// moments are those of the triangle: the weighted sum of a quadratic function is its integral. Else triangles smaller than
    /// the interval would lose the variation of the squared distance over them.
    fn add_rows(&mut self, corners: [Vec3; 3], interval: f64) {
        let (base, [a, b, apex]) = from_longest_edge(corners);
        let twice_area = (b - a).cross(apex - a).norm();
        if twice_area == 0.0 {
            return;
        }
        let rows = (twice_area / (base * interval)).ceil().max(2.0);
        // Heights as fractions, with densities 2 (1 − t): the mean is 1/3, the variance 1/18.
        let strips = (0..rows as usize).map(|row| strip(row as f64 / rows, (row + 1) as f64 / rows));
        let variance: f64 = strips
            .clone()
            .map(|(share, t)| share * (t - 1.0 / 3.0).powi(2))
            .sum();
        let stretch = (1.0 / (18.0 * variance)).sqrt();
        for (share, centroid) in strips {
            let t = 1.0 / 3.0 + stretch * (centroid - 1.0 / 3.0);
            let (left, right) = (towards(a, apex, t), towards(b, apex, t));
            let count = (base * (1.0 - t) / interval).ceil().max(2.0);
            let stretch = 1.0 / (1.0 - 1.0 / (count * count)).sqrt();
            for i in 0..count as usize {
                let place = 0.5 + stretch * ((i as f64 + 0.5) / count - 0.5);
                self.points.push(towards(left, right, place).0);
                self.weights.push(0.5 * twice_area * share / count);
            }
        }
    }
}

/// The share of a triangle's area between two heights, and the height of its centroid; the base is at 0, the apex at 1.
fn strip(low: f64, high: f64) -> (f64, f64) {
    let half = (high - low) * (1.0 - 0.5 * (high + low));
    let moment = (high - low) * (0.5 * (high + low) - (high * high + high * low + low * low) / 3.0);
    (2.0 * half, moment / half)
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
    let turned = [[a, b, c], [b, c, a], [c, a, b]].map(|corners| ((corners[1] - corners[0]).norm(), corners));
    let longer = |x: (f64, [Vec3; 3]), y: (f64, [Vec3; 3])| if y.0 > x.0 { y } else { x };
    longer(longer(turned[0], turned[1]), turned[2])
}

fn towards(a: Vec3, b: Vec3, t: f64) -> Vec3 {
    a * (1.0 - t) + b * t
}

#[cfg(test)]
mod tests {
    use super::*;
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
            .prop_map(|(corners, thin)| {
                let [a, b, c] = corners.map(Vec3);
                [a, b, towards(a, b, 0.3) + c * 10_f64.powi(-thin)]
            })
    }

    proptest! {
        #[test]
        fn quadratic_functions_are_integrated_exactly(corners in triangles(), interval in 0.02..2.0_f64, f in prop::array::uniform3(-1.0..1.0_f64), g in -1.0..1.0_f64) {
            let samples = all_samples(corners, interval);
            let [a, b, c] = corners;
            let area = 0.5 * (b - a).cross(c - a).norm();
            let f = Vec3(f);
            // ∫ (f·p + g)² = |t|/12 (Σ h_i² + (Σ h_i)²) with the values h_i at the corners.
            let heights = corners.map(|p| f.dot(p) + g);
            let sum: f64 = heights.iter().sum();
            let integral = area / 12.0 * (Vec3(heights).squared() + sum * sum);
            let sampled: f64 = samples.points.iter().zip(&samples.weights).map(|(&p, w)| w * (f.dot(Vec3(p)) + g).powi(2)).sum();
            prop_assert!((sampled - integral).abs() < 1e-12 * area.max(1e-3), "{sampled} {integral}");
            let linear: f64 = samples.points.iter().zip(&samples.weights).map(|(&p, w)| w * (f.dot(Vec3(p)) + g)).sum();
            prop_assert!((linear - area * sum / 3.0).abs() < 1e-12 * area.max(1e-3));
        }

        #[test]
        fn every_point_of_a_triangle_has_a_sample_or_a_corner_near_it(corners in triangles(), interval in 0.05..0.5_f64, u in 0.0..1.0_f64, v in 0.0..1.0_f64) {
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let [a, b, c] = corners;
            let p = a + ((b - a) * u + (c - a) * v);
            let samples = all_samples(corners, interval);
            let nearest = samples.points.iter().map(|&q| Vec3(q)).chain(corners).map(|q| (p - q).norm()).fold(f64::INFINITY, f64::min);
            prop_assert!(nearest <= 1.5 * interval, "{nearest} {interval}");
        }
    }

    #[test]
    fn triangles_without_area_have_no_samples() {
        assert!(
            all_samples([[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0]].map(Vec3), 0.1)
                .points
                .is_empty()
        );
        assert!(all_samples([Vec3([1.0; 3]); 3], 0.1).points.is_empty());
    }
}
