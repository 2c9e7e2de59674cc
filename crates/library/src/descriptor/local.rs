//! Which small shapes a surface has, wherever they lie: what is left of a shape that was posed.
//!
//! Around a point p with normal n a ball of radius r sees of the surface, in units of r: its mass m (1 for a plane), how far its mean lies off along the normal, o (positive where the surface bends away
//! from the normal), and how much longer than wide it is, e. Balls of three radii, as fractions of the root of the area, which bending keeps; over the surface, the shares of all (o, m), of (o, o′) for
//! neighbouring radii, and of (o, e). Shares are kept as roots, so that differences are those of Hellinger's distance.

use mesh::Vec3;

use super::{cloud::Cloud, grid::Grid};

/// Radii, in roots of the area.
const RADII: [f64; 3] = [0.07, 0.13, 0.22];

/// Of the samples every so many is a centre; and every so many is seen, so that each ball has about a hundred.
const STEP: usize = 4;
const SEEN: [usize; 3] = [1, 2, 6];

/// Bins of o from −[`MOST_OFFSET`] to it, of m, and of o and e in pairs.
const OFFSETS: usize = 8;
const MASSES: usize = 6;
const COARSE: usize = 6;
const MOST_OFFSET: f64 = 0.3;

/// Bytes of the description.
pub(super) const LENGTH: usize = 3 * OFFSETS * MASSES + 3 * COARSE * COARSE;

/// What a ball sees.
#[derive(Clone, Copy, Default)]
struct Seen {
    offset: f64,
    mass: f64,
    elongation: f64,
}

/// The shares of small shapes.
pub(super) fn describe(cloud: &Cloud) -> [u8; LENGTH] {
    let root = cloud.area.sqrt();
    let mut seen = vec![[Seen::default(); 3]; cloud.points.len().div_ceil(STEP)];
    for (r, radius) in RADII.into_iter().enumerate() {
        let radius = radius * root;
        let thinned: Vec<Vec3> = cloud.points.iter().step_by(SEEN[r]).copied().collect();
        let total: f64 = cloud.weights.iter().step_by(SEEN[r]).sum();
        let grid = Grid::new(&thinned, radius);
        for (c, seen) in seen.iter_mut().enumerate() {
            seen[r] = look(cloud, &grid, SEEN[r], c * STEP, radius);
            seen[r].mass /= total;
        }
    }
    let weight = |c: usize| cloud.weights[c * STEP];
    // Whether a file's triangles face outward is its own affair.
    let bend: f64 = seen
        .iter()
        .enumerate()
        .map(|(c, seen)| weight(c) * seen[2].offset)
        .sum();
    let sign = if bend < 0.0 { -1.0 } else { 1.0 };
    let mut bins = [0.0; LENGTH];
    let mut total = 0.0;
    for (c, seen) in seen.iter().enumerate() {
        let w = weight(c);
        total += w;
        let offset = |r: usize, bins: usize| {
            let unit = 0.5 + 0.5 * (sign * seen[r].offset / MOST_OFFSET);
            unit * bins as f64 - 0.5
        };
        let (mut first, pair) = (0, COARSE * COARSE);
        for r in 0..3 {
            let mass = (seen[r].mass.max(1e-3).log2() + 1.2) / 2.4 * MASSES as f64 - 0.5;
            spread(
                &mut bins[first..],
                [OFFSETS, MASSES],
                [offset(r, OFFSETS), mass],
                w,
            );
            first += OFFSETS * MASSES;
        }
        for r in 0..2 {
            spread(
                &mut bins[first..],
                [COARSE, COARSE],
                [offset(r, COARSE), offset(r + 1, COARSE)],
                w,
            );
            first += pair;
        }
        let elongation = seen[2].elongation * COARSE as f64 - 0.5;
        spread(
            &mut bins[first..],
            [COARSE, COARSE],
            [offset(2, COARSE), elongation],
            w,
        );
    }
    bins.map(|share| {
        (255.0 * (share / total).max(0.0).sqrt())
            .round()
            .clamp(0.0, 255.0) as u8
    })
}

/// What a ball around a sample sees.
fn look(cloud: &Cloud, grid: &Grid, step: usize, centre: usize, radius: f64) -> Seen {
    let p = cloud.points[centre];
    let (mut mass, mut mean, mut normal) = (0.0, Vec3([0.0; 3]), Vec3([0.0; 3]));
    // Of the second moments the trace and the trace of the square are enough.
    let mut moments = [0.0; 6];
    grid.near(p, |point, i| {
        let i = i * step;
        let (w, d) = (cloud.weights[i], point - p);
        mass += w;
        mean += d * w;
        normal += cloud.normals[i] * w;
        let [x, y, z] = d.0;
        for (moment, value) in moments.iter_mut().zip([x * x, y * y, z * z, x * y, x * z, y * z]) {
            *moment += w * value;
        }
    });
    if mass <= 0.0 {
        return Seen::default();
    }
    let mean = mean / mass;
    let [x, y, z] = mean.0;
    let [xx, yy, zz, xy, xz, yz] = moments.map(|moment| moment / mass);
    let (xx, yy, zz) = (xx - x * x, yy - y * y, zz - z * z);
    let (xy, xz, yz) = (xy - x * y, xz - x * z, yz - y * z);
    let trace = xx + yy + zz;
    let squares = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz);
    // Of eigenvalues a, b, 0 this is (a − b)² / (a + b)².
    let elongation = match trace > 0.0 {
        true => (2.0 * squares / (trace * trace) - 1.0).max(0.0).sqrt(),
        false => 0.0,
    };
    Seen {
        offset: -normal.unit().dot(mean) / radius,
        mass: mass * cloud.area / (std::f64::consts::PI * radius * radius),
        elongation,
    }
}

/// Adds a weight to the bins around a place, shared between neighbours; what lies outside goes to the border.
fn spread(bins: &mut [f64], [rows, columns]: [usize; 2], [row, column]: [f64; 2], weight: f64) {
    let split = |x: f64, count: usize| {
        let x = x.clamp(0.0, (count - 1) as f64);
        let low = (x.floor() as usize).min(count - 2);
        (low, x - low as f64)
    };
    let ((i, u), (j, v)) = (split(row, rows), split(column, columns));
    bins[i * columns + j] += weight * (1.0 - u) * (1.0 - v);
    bins[i * columns + j + 1] += weight * (1.0 - u) * v;
    bins[(i + 1) * columns + j] += weight * u * (1.0 - v);
    bins[(i + 1) * columns + j + 1] += weight * u * v;
}
