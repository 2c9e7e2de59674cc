//! A polynomial around one vertex.

use mesh::{TriMesh, Vec3};

use super::FrameOptions;
use crate::matrix::{Mat3, svd};

/// A vertex around another, and how much it counts for its distance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Neighbour {
    pub(super) vertex: u32,
    pub(super) weight: f64,
}

/// What is fitted around a vertex.
pub(super) struct Fitted {
    /// yᵢ − Σⱼ sᵢⱼ yⱼ.
    pub(super) off: Vec3,
    /// Jᵢ.
    pub(super) gradient: Mat3,
    /// j and sᵢⱼ.
    pub(super) shares: Vec<(u32, f32)>,
}

/// Monomials of degree 2 and less of three coordinates: 1, three, six.
pub(super) const QUADRATIC: usize = 10;

/// Those of degree 3 and less: ten more.
pub(super) const CUBIC: usize = 20;

/// So many times as many neighbours as unknowns, or the fit says nothing.
const FEWEST: usize = 2;

/// Monomials that a surface has no extent for: this much of what neighbours count holds their coefficients to zero.
pub(super) const RIDGE: f64 = 1e-9;

/// How far a gradient may be from a similarity before the noise is believed instead, across a reach.
const STRAIN: f64 = 0.3;

/// Vertices that count less are left out.
pub(super) const LEAST_WEIGHT: f64 = 0.01;

/// A vertex around another: its number, how much it counts, and where it lies from there, in the region by reaches and in the suspect.
pub(super) type Around = (u32, f64, Vec3, Vec3);

/// What fits of one region have in common, of polynomials with N monomials.
pub(super) struct Fitting<'a, const N: usize> {
    region: &'a TriMesh,
    places: &'a [Vec3],
    reach: f64,
    /// What holds gradients to a similarity, as a share of what neighbours count.
    prior: f64,
    /// How well each vertex fits its own surroundings, from 0 to 1.
    weights: Vec<f64>,
    /// −1 where the suspect is a mirrored copy.
    pub(super) hand: f64,
}

impl<'a, const N: usize> Fitting<'a, N> {
    pub(super) fn new(region: &'a TriMesh, places: &'a [Vec3], options: &FrameOptions) -> Self {
        Self {
            region,
            places,
            reach: options.reach,
            prior: (options.noise / (STRAIN * options.reach)).powi(2),
            weights: vec![1.0; places.len()],
            hand: 1.0,
        }
    }

    /// Tells from some vertices whether the suspect is a mirrored copy.
    pub(super) fn tell_hand<'n>(&mut self, around: impl Iterator<Item = (u32, &'n [Neighbour])>) {
        let mut sum = 0.0;
        for (vertex, around) in around {
            let around = self.gathered(vertex, around);
            let total: f64 = around.iter().map(|a| a.1).sum();
            let (covariance, spread) = covariance(&around, total);
            let size = svd(&covariance).values[0] * spread;
            if size > 0.0 {
                sum += covariance.determinant() / svd(&covariance).values[0].powi(3);
            }
        }
        self.hand = if sum < 0.0 { -1.0 } else { 1.0 };
    }

    /// Weighs samples by how far they are off.
    pub(super) fn weigh(&mut self, samples: &[u32], off: &[Option<f64>]) {
        welsch(samples, off, &mut self.weights);
    }

    /// How far the suspect is off the fit around a vertex: all of it that weights ask for.
    pub(super) fn off(&self, vertex: u32, around: &[Neighbour]) -> Option<f64> {
        let around = Surroundings::<N>::of(self.gathered(vertex, around))?;
        Some(around.off(&around.shares()?).norm())
    }

    /// The fit around a vertex.
    pub(super) fn at(&self, vertex: u32, around: &[Neighbour]) -> Option<Fitted> {
        let around = Surroundings::<N>::of(self.gathered(vertex, around))?;
        let shares = around.shares()?;
        let motion = similarity(&around.gathered, around.total, self.hand);
        let mut gradient = motion;
        gradient += around.beside(motion, self.prior)?;
        let unit = 1.0 / self.reach;
        Some(Fitted {
            off: around.off(&shares),
            gradient: Mat3(gradient.0.map(|row| row * unit)),
            shares: around
                .gathered
                .iter()
                .zip(shares)
                .map(|(a, share)| (a.0, share as f32))
                .collect(),
        })
    }

    /// What lies around a vertex and counts.
    fn gathered(&self, vertex: u32, around: &[Neighbour]) -> Vec<Around> {
        let (here, there) = (self.region.point(vertex as usize), self.places[vertex as usize]);
        let known = |n: &&Neighbour| self.weights[n.vertex as usize] > LEAST_WEIGHT;
        let place = |n: &Neighbour| {
            let v = n.vertex as usize;
            let x = (self.region.point(v) - here) * (1.0 / self.reach);
            (n.vertex, n.weight * self.weights[v], x, self.places[v] - there)
        };
        around.iter().filter(known).map(place).collect()
    }
}

/// What lies around a vertex, with the monomials there and their normal equations.
struct Surroundings<const N: usize> {
    gathered: Vec<Around>,
    /// What all of it counts.
    total: f64,
    rows: Vec<[f64; N]>,
    /// By its lower triangle.
    normal: [[f64; N]; N],
}

impl<const N: usize> Surroundings<N> {
    /// None of too little.
    fn of(gathered: Vec<Around>) -> Option<Self> {
        if gathered.len() < FEWEST * N {
            return None;
        }
        let rows: Vec<[f64; N]> = gathered.iter().map(|&(_, _, x, _)| monomials(x)).collect();
        let mut normal = [[0.0; N]; N];
        for (row, &(_, weight, ..)) in rows.iter().zip(&gathered) {
            for i in 0..N {
                let weighed = weight * row[i];
                for j in 0..=i {
                    normal[i][j] += weighed * row[j];
                }
            }
        }
        Some(Self {
            total: gathered.iter().map(|a| a.1).sum(),
            gathered,
            rows,
            normal,
        })
    }

    /// sᵢⱼ.
    fn shares(&self) -> Option<Vec<f64>> {
        let factor = cholesky(&self.normal, constants_free(RIDGE * self.total))?;
        let mut unit = [0.0; N];
        unit[0] = 1.0;
        let shares = solve(&factor, unit);
        let share =
            |(row, a): (&[f64; N], &Around)| a.1 * row.iter().zip(&shares).map(|(a, b)| a * b).sum::<f64>();
        Some(self.rows.iter().zip(&self.gathered).map(share).collect())
    }

    /// yᵢ − Σⱼ sᵢⱼ yⱼ; y counts from the vertex' own place.
    fn off(&self, shares: &[f64]) -> Vec3 {
        let mut off = Vec3::ZERO;
        for (&(.., y), &share) in self.gathered.iter().zip(shares) {
            off -= y * share;
        }
        off
    }

    /// The gradient of what a similarity leaves of y, held to zero by so much of what all counts.
    fn beside(&self, motion: Mat3, prior: f64) -> Option<Mat3> {
        let mut right = [Vec3::ZERO; N];
        for (row, &(_, weight, x, y)) in self.rows.iter().zip(&self.gathered) {
            let rest = y - motion * x;
            for i in 0..N {
                right[i] += rest * (weight * row[i]);
            }
        }
        let held = cholesky(&self.normal, constants_free(prior * self.total))?;
        Some(Mat3([0, 1, 2].map(|axis| {
            let solution = solve(&held, right.map(|r| r[axis]));
            Vec3([solution[1], solution[2], solution[3]])
        })))
    }
}

/// The best similarity of what lies around (Umeyama 1991), without its translation; of the hand that is given.
pub(super) fn similarity(around: &[Around], total: f64, hand: f64) -> Mat3 {
    let (covariance, spread) = covariance(around, total);
    let svd = svd(&covariance);
    let (Mat3(left), Mat3(right)) = (svd.left, svd.right);
    let sign = (svd.left.determinant() * svd.right.determinant() * hand).signum();
    let scale = (svd.values[0] + svd.values[1] + sign * svd.values[2]) / spread.max(f64::MIN_POSITIVE);
    let mut motion = Mat3::ZERO;
    for (i, sign) in [1.0, 1.0, sign].into_iter().enumerate() {
        motion += Mat3::outer(left[i] * (scale * sign), right[i]);
    }
    motion
}

/// Weighs samples by how far they are off (Welsch's weights, in twice the median).
pub(super) fn welsch(samples: &[u32], off: &[Option<f64>], weights: &mut [f64]) {
    let mut known: Vec<f64> = off.iter().copied().flatten().collect();
    if known.is_empty() {
        return;
    }
    let middle = known.len() / 2;
    let median = known
        .select_nth_unstable_by(middle, f64::total_cmp)
        .1
        .max(f64::MIN_POSITIVE);
    for (&sample, off) in samples.iter().zip(off) {
        let beside = off.unwrap_or(f64::INFINITY) / (2.0 * median);
        weights[sample as usize] = (-0.5 * beside * beside).exp();
    }
}

/// Σ w (y − ȳ)(x − x̄)ᵀ and Σ w |x − x̄|².
fn covariance(around: &[Around], total: f64) -> (Mat3, f64) {
    let mean = |of: fn(&Around) -> Vec3| {
        let sum: Vec3 = around.iter().map(|a| of(a) * a.1).sum();
        sum * (1.0 / total.max(f64::MIN_POSITIVE))
    };
    let (x_mean, y_mean) = (mean(|a| a.2), mean(|a| a.3));
    let (mut covariance, mut spread) = (Mat3::ZERO, 0.0);
    for &(_, weight, x, y) in around {
        let (x, y) = (x - x_mean, y - y_mean);
        covariance += Mat3::outer(y * weight, x);
        spread += weight * x.squared();
    }
    (covariance, spread)
}

/// The first N of the monomials of degree 3 and less, the lower degrees first.
pub(super) fn monomials<const N: usize>(Vec3([x, y, z]): Vec3) -> [f64; N] {
    const { assert!(N <= CUBIC) };
    let [xx, yy, zz] = [x * x, y * y, z * z];
    let all = [
        1.0,
        x,
        y,
        z,
        xx,
        yy,
        zz,
        x * y,
        y * z,
        z * x,
        xx * x,
        yy * y,
        zz * z,
        xx * y,
        yy * z,
        zz * x,
        x * yy,
        y * zz,
        z * xx,
        x * y * z,
    ];
    std::array::from_fn(|i| all[i])
}

/// So much for all unknowns but the first: constants are reproduced whatever holds the rest.
pub(super) fn constants_free(ridge: f64) -> impl Fn(usize) -> f64 {
    move |i| if i > 0 { ridge } else { 0.0 }
}

/// The factor of a symmetric matrix that is known by its lower triangle, with a ridge added to its diagonal.
pub(super) fn cholesky<const N: usize>(
    matrix: &[[f64; N]; N],
    ridge: impl Fn(usize) -> f64,
) -> Option<[[f64; N]; N]> {
    let mut factor = [[0.0; N]; N];
    for i in 0..N {
        for j in 0..=i {
            let inner: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
            let rest = matrix[i][j] - inner;
            if i == j {
                let rest = rest + ridge(i);
                if rest.is_nan() || rest <= 0.0 {
                    return None;
                }
                factor[i][i] = rest.sqrt();
            } else {
                factor[i][j] = rest / factor[j][j];
            }
        }
    }
    Some(factor)
}

pub(super) fn solve<const N: usize>(factor: &[[f64; N]; N], mut right: [f64; N]) -> [f64; N] {
    for i in 0..N {
        let inner: f64 = (0..i).map(|k| factor[i][k] * right[k]).sum();
        right[i] = (right[i] - inner) / factor[i][i];
    }
    for i in (0..N).rev() {
        let inner: f64 = (i + 1..N).map(|k| factor[k][i] * right[k]).sum();
        right[i] = (right[i] - inner) / factor[i][i];
    }
    right
}
