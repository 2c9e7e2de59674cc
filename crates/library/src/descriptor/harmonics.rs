//! How mass lies about a centre: energies of spherical harmonics by shell and degree.
//!
//! Of points uᵢ of weight wᵢ (their sum is 1) in shells with hat functions hₛ(|u|),
//!
//! > f_s,lm = Σᵢ wᵢ hₛ(|uᵢ|) Y_lm(uᵢ / |uᵢ|),  E_st,l = Σ_m f_s,lm f_t,lm − Σᵢ wᵢ² hₛ hₜ,
//!
//! with Schmidt's harmonics, Σ_m Y_lm(a) Y_lm(b) = P_l(a·b). A rotation mixes the f of one l and keeps every E. What is taken away is the part of i = j: the rest is a mean over pairs of different
//! points, which does not grow where there are fewer. What is kept of E is E / √(|E| + ε²), a root that is smooth at 0.

use std::sync::OnceLock;

use mesh::Vec3;

/// Shells and degrees of one kind of descriptor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    /// The radii at which a shell counts fully; within the first and beyond the last it goes on so.
    shells: &'static [f64],
    /// l = 0 … `degree`.
    degree: usize,
    /// Degrees 1 … `between` of neighbouring shells together.
    between: usize,
}

/// Of a whole: 96 numbers.
pub(super) const WHOLE: Layout = Layout {
    shells: &[0.25, 0.55, 0.8, 1.05, 1.35, 1.8],
    degree: 8,
    between: 8,
};

/// The largest degree.
const MOST: usize = 8;
/// Numbers of l = 0 … [`MOST`].
const TERMS: usize = (MOST + 1) * (MOST + 1);

/// ε of the root.
const SOFT: f64 = 0.006;

impl Layout {
    /// How many numbers.
    pub(super) const fn length(&self) -> usize {
        self.shells.len() * (self.degree + 1) + (self.shells.len() - 1) * self.between + 2
    }

    /// The numbers of points about the origin at a root mean square of 1.
    pub(super) fn describe(&self, points: &[Vec3], weights: &[f64]) -> Vec<f64> {
        let (shells, terms) = (self.shells.len(), (self.degree + 1) * (self.degree + 1));
        let mut f = vec![0.0; shells * terms];
        let mut own = vec![0.0; shells];
        let mut shared = vec![0.0; shells];
        let (mut mean, mut fourth) = (0.0, 0.0);
        let mut values = [0.0; TERMS];
        for (&p, &w) in points.iter().zip(weights) {
            let square = p.squared();
            let radius = square.sqrt();
            mean += w * radius;
            fourth += w * square * square;
            let direction = match radius > 1e-9 {
                true => p / radius,
                false => Vec3([0.0, 0.0, 1.0]),
            };
            harmonics(direction, self.degree, &mut values);
            let (s, upper) = self.place(radius);
            let mut add = |s: usize, share: f64| {
                let row = &mut f[s * terms..(s + 1) * terms];
                let share = w * share;
                row.iter_mut()
                    .zip(&values[..terms])
                    .for_each(|(f, y)| *f += share * y);
                own[s] += share * share;
            };
            add(s, 1.0 - upper);
            if upper > 0.0 {
                add(s + 1, upper);
                shared[s] += w * w * upper * (1.0 - upper);
            }
        }
        let mut numbers = Vec::with_capacity(self.length());
        let product = |s: usize, t: usize, l: usize| {
            let range = l * l..(l + 1) * (l + 1);
            let (a, b) = (&f[s * terms..], &f[t * terms..]);
            range.map(|i| a[i] * b[i]).sum::<f64>()
        };
        for s in 0..shells {
            for l in 0..=self.degree {
                let share = root(product(s, s, l) - own[s]);
                // Of degree 0 it is the mass of the shell.
                numbers.push(if l == 0 { 0.5 * share - 0.08 } else { share });
            }
        }
        for s in 0..shells - 1 {
            for l in 1..=self.between {
                numbers.push(root(product(s, s + 1, l) - shared[s]));
            }
        }
        numbers.push(mean - 0.85);
        numbers.push(0.25 * (fourth - 1.5));
        numbers
    }

    /// The numbers in bytes: 127 is 0, a step is 1 / 600.
    pub(super) fn bytes<const N: usize>(&self, points: &[Vec3], weights: &[f64]) -> [u8; N] {
        let numbers = self.describe(points, weights);
        std::array::from_fn(|i| {
            (127.0 + 600.0 * numbers.get(i).copied().unwrap_or(0.0))
                .round()
                .clamp(0.0, 255.0) as u8
        })
    }

    /// The shell below a radius, and the share of the one above it.
    fn place(&self, radius: f64) -> (usize, f64) {
        let above = self.shells.iter().position(|&node| radius < node);
        match above {
            Some(0) => (0, 0.0),
            Some(i) => (
                i - 1,
                (radius - self.shells[i - 1]) / (self.shells[i] - self.shells[i - 1]),
            ),
            None => (self.shells.len() - 1, 0.0),
        }
    }
}

fn root(energy: f64) -> f64 {
    energy / (energy.abs() + SOFT * SOFT).sqrt()
}

/// Schmidt's factors √((2 − δ_m0) (l − m)! / (l + m)!), at l (l + 1) + m.
fn factors() -> &'static [f64; TERMS] {
    static FACTORS: OnceLock<[f64; TERMS]> = OnceLock::new();
    FACTORS.get_or_init(|| {
        let mut factors = [1.0; TERMS];
        for l in 0..=MOST {
            for m in 1..=l {
                let quotient: f64 = (l - m + 1..=l + m).map(|k| k as f64).product();
                let factor = (2.0 / quotient).sqrt();
                factors[l * (l + 1) + m] = factor;
                factors[l * (l + 1) - m] = factor;
            }
        }
        factors
    })
}

/// Y_lm of a direction at l (l + 1) + m, up to a degree.
fn harmonics(Vec3([x, y, z]): Vec3, degree: usize, values: &mut [f64; TERMS]) {
    let factors = factors();
    let (mut cosine, mut sine) = (1.0, 0.0);
    let mut start = 1.0;
    for m in 0..=degree {
        // P_m^m / sin^m = (2 m − 1)!!, and the recurrence in l.
        let (mut before, mut now) = (0.0, start);
        for l in m..=degree {
            let middle = l * (l + 1);
            let legendre = factors[middle + m] * now;
            values[middle + m] = legendre * cosine;
            if m > 0 {
                values[middle - m] = legendre * sine;
            }
            let next = (z * (2 * l + 1) as f64 * now - (l + m) as f64 * before) / (l + 1 - m) as f64;
            (before, now) = (now, next);
        }
        (cosine, sine) = (cosine * x - sine * y, sine * x + cosine * y);
        start *= (2 * m + 1) as f64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::Similarity;
    use proptest::prelude::*;

    fn legendre(l: usize, x: f64) -> f64 {
        let (mut before, mut now) = (0.0, 1.0);
        for k in 0..l {
            (before, now) = (
                now,
                ((2 * k + 1) as f64 * x * now - k as f64 * before) / (k + 1) as f64,
            );
        }
        now
    }

    fn directions() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-1.0..1.0_f64)
            .prop_filter("a direction", |p| Vec3(*p).norm() > 0.1)
            .prop_map(|p| Vec3(p).unit())
    }

    proptest! {
        #[test]
        fn harmonics_obey_the_addition_theorem(a in directions(), b in directions()) {
            let (mut of_a, mut of_b) = ([0.0; TERMS], [0.0; TERMS]);
            harmonics(a, MOST, &mut of_a);
            harmonics(b, MOST, &mut of_b);
            for l in 0..=MOST {
                let sum: f64 = (l * l..(l + 1) * (l + 1)).map(|i| of_a[i] * of_b[i]).sum();
                prop_assert!((sum - legendre(l, a.dot(b))).abs() < 1e-12, "{l}: {sum}");
            }
        }

        #[test]
        fn rotations_and_mirrors_change_nothing(points in prop::collection::vec(prop::array::uniform3(-1.5..1.5_f64), 5..40), q in prop::array::uniform4(-1.0..1.0_f64), mirrored in any::<bool>()) {
            prop_assume!(q.iter().map(|x| x * x).sum::<f64>() > 0.01);
            let points: Vec<Vec3> = points.into_iter().map(Vec3).collect();
            let turn = Similarity::from_quaternion(q);
            let turned: Vec<Vec3> = points.iter().map(|&p| {
                let Vec3([x, y, z]) = turn.apply(p);
                Vec3([if mirrored { -x } else { x }, y, z])
            }).collect();
            let weights = vec![1.0 / points.len() as f64; points.len()];
            for layout in [WHOLE] {
                let (a, b) = (layout.describe(&points, &weights), layout.describe(&turned, &weights));
                prop_assert_eq!(a.len(), layout.length());
                for (a, b) in a.iter().zip(&b) {
                    prop_assert!((a - b).abs() < 1e-9, "{a} {b}");
                }
            }
        }
    }
}
