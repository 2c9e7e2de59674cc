//! A smooth field around one vertex, of which only one direction is seen at each place.
//!
//! A surface that was brought back nearly to where it was tells dᵢ = uᵢ·(δᵢ + e(xᵢ)): along the normal where a line met it, and uᵢ = f / (f·n) for the normal f that it met (see `Registered`). Of the error e nothing is known but that it is smooth, so around each vertex a polynomial of degree 2 with
//! three components is fitted to the dⱼ there. Sliding along the surface is seen where the surface has slopes; where it has none nothing tells of it, and nothing comes of it. What is not told is held to zero as if it was noise of the size that was given.

use mesh::{TriMesh, Vec3};

use super::{
    FrameOptions, LocalFrames, ROUNDS,
    fit::{LEAST_WEIGHT, Neighbour, QUADRATIC, cholesky, monomials, solve, welsch},
    windows::Windows,
};

/// Samples within the reach of a vertex, about.
const SAMPLES: f64 = 160.0;

/// Three components.
const UNKNOWNS: usize = 3 * QUADRATIC;

/// Pairs of monomials, the second not after the first, and of axes.
const PAIRS: usize = QUADRATIC * (QUADRATIC + 1) / 2;
const AXES: [[usize; 2]; 6] = [[0, 0], [1, 0], [1, 1], [2, 0], [2, 1], [2, 2]];

/// How large an error is expected, beside the noise.
const EXPECTED: f64 = 10.0;

/// Fewer neighbours say too little.
const FEWEST: usize = 2 * QUADRATIC;

/// What is seen of a region.
struct Lines<'a> {
    region: &'a TriMesh,
    /// u, and u·δ.
    seen: &'a [Option<(Vec3, f64)>],
    reach: f64,
    weights: Vec<f64>,
}

pub(super) fn fit(region: &TriMesh, seen: &[Option<(Vec3, f64)>], options: &FrameOptions) -> LocalFrames {
    assert_eq!(region.vertex_count(), seen.len(), "one u·δ a vertex");
    let is_seen: Vec<bool> = seen.iter().map(Option::is_some).collect();
    let windows = Windows::around(region, &is_seen, options.reach, SAMPLES);
    let mut lines = Lines {
        region,
        seen,
        reach: options.reach,
        weights: vec![1.0; seen.len()],
    };
    let samples = windows.samples();
    for _ in 0..ROUNDS {
        let off = |&sample: &u32| lines.at(sample, windows.of(sample)).map(|(off, _)| off.abs());
        let off: Vec<Option<f64>> = samples.iter().map(off).collect();
        welsch(samples, &off, &mut lines.weights);
    }
    let mut frames = LocalFrames {
        beside: Vec::with_capacity(seen.len()),
        stretch: Vec::with_capacity(seen.len()),
        shares: Vec::new(),
        ends: Vec::with_capacity(seen.len()),
        along: Some(
            seen.iter()
                .map(|seen| seen.map_or(Vec3::ZERO, |(u, _)| u))
                .collect(),
        ),
        hidden: None,
        elastic: None,
        hand: 1.0,
    };
    for (vertex, seen) in (0..).zip(seen) {
        let fitted = seen.and_then(|(u, _)| Some((u, lines.at(vertex, windows.of(vertex))?)));
        frames.stretch.push([f64::from(u8::from(fitted.is_some())); 2]);
        frames
            .beside
            .push(fitted.as_ref().map(|(u, (off, _))| *u * (off / u.squared())));
        frames
            .shares
            .extend(fitted.into_iter().flat_map(|(_, (_, shares))| shares));
        frames.ends.push(frames.shares.len());
    }
    frames
}

impl Lines<'_> {
    /// dᵢ − Σⱼ sᵢⱼ dⱼ, and j with sᵢⱼ.
    fn at(&self, vertex: u32, around: &[Neighbour]) -> Option<(f64, Vec<(u32, f32)>)> {
        let (u, own) = self.seen[vertex as usize]?;
        let here = self.region.point(vertex as usize);
        let mut sums = [[0.0; 6]; PAIRS];
        let mut rows = Vec::with_capacity(around.len());
        for neighbour in around {
            let v = neighbour.vertex as usize;
            let weight = neighbour.weight * self.weights[v];
            let Some((u, d)) = self.seen[v].filter(|_| weight > LEAST_WEIGHT) else {
                continue;
            };
            let x = (self.region.point(v) - here) * (1.0 / self.reach);
            let monomials = monomials(x);
            add(&mut sums, &monomials, &AXES.map(|[a, b]| weight * u[a] * u[b]));
            rows.push((neighbour.vertex, weight, monomials, u, d));
        }
        if rows.len() < FEWEST {
            return None;
        }
        let factor = cholesky(&normal(&sums), |_| 1.0 / (EXPECTED * EXPECTED))?;
        // Where it is, the polynomial is its constant.
        let mut own_row = [0.0; UNKNOWNS];
        own_row[..3].copy_from_slice(&u.0);
        let shares_of = solve(&factor, own_row);
        let mut off = own;
        let mut shares = Vec::with_capacity(rows.len());
        for (v, weight, monomials, u, d) in rows {
            let along =
                |(monomial, of): (f64, &[f64])| monomial * (u[0] * of[0] + u[1] * of[1] + u[2] * of[2]);
            let sum: f64 = monomials
                .into_iter()
                .zip(shares_of.chunks_exact(3))
                .map(along)
                .sum();
            let share = weight * sum;
            off -= d * share;
            shares.push((v, share as f32));
        }
        Some((off, shares))
    }
}

/// Adds the products of two monomials, and of two coordinates of u: the normal equations of all columns, each monomial along each axis, are made of 330 sums of these, and have 465 numbers.
fn add(sums: &mut [[f64; 6]; PAIRS], monomials: &[f64; QUADRATIC], products: &[f64; 6]) {
    let mut sums = sums.iter_mut();
    for (i, first) in monomials.iter().enumerate() {
        for (second, sums) in monomials[..=i].iter().zip(sums.by_ref()) {
            let both = first * second;
            for (sum, product) in sums.iter_mut().zip(products) {
                *sum += both * product;
            }
        }
    }
}

/// The lower triangle of the normal equations.
fn normal(sums: &[[f64; 6]; PAIRS]) -> [[f64; UNKNOWNS]; UNKNOWNS] {
    let mut normal = [[0.0; UNKNOWNS]; UNKNOWNS];
    let pairs = (0..QUADRATIC).flat_map(|i| (0..=i).map(move |j| (i, j)));
    for ((i, j), sums) in pairs.zip(sums) {
        for ([a, b], sum) in AXES.into_iter().zip(sums) {
            normal[3 * i + a][3 * j + b] = *sum;
            normal[3 * i + b][3 * j + a] = *sum;
        }
    }
    normal
}

#[cfg(test)]
mod tests {
    use mesh::shapes;

    use super::*;
    use crate::Degree;
    use crate::LeftOfScalar;

    const OPTIONS: FrameOptions = FrameOptions {
        reach: 0.35,
        noise: 2e-3,
        degree: Degree::Quadratic,
    };

    /// What is seen of a field along the normals of a mesh, and a little askew.
    fn seen(mesh: &TriMesh, field: impl Fn(Vec3) -> Vec3) -> Vec<Option<(Vec3, f64)>> {
        let along = |(v, normal): (usize, Vec3)| {
            let p = mesh.point(v);
            let u = (normal + p.map(|x| 0.2 * (9.0 * x).sin())) * 1.1;
            Some((u, u.dot(field(p))))
        };
        mesh.vertex_normals()
            .into_iter()
            .map(Vec3)
            .enumerate()
            .map(along)
            .collect()
    }

    fn quadratic(Vec3([x, y, z]): Vec3) -> Vec3 {
        Vec3([2.0 * y + x * z, 1.0 - 2.0 * x, x * y - z]) * 1e-3
    }

    /// Far shorter than the reach.
    fn ripple(p: Vec3) -> Vec3 {
        p.map(|x| 2e-3 * (40.0 * x).sin())
    }

    // What directions tell little of is held to zero, and so stays in part.
    #[test]
    fn nearly_all_of_a_smooth_error_is_gone_and_what_is_left_of_a_field_is_what_is_seen_of_it() {
        let mesh = shapes::bumpy_torus(80, 50, 1);
        let size = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>().sqrt();
        let of = |field: &dyn Fn(Vec3) -> Vec3| {
            let seen = seen(&mesh, field);
            let frames = LocalFrames::fit_along(&mesh, &seen, &OPTIONS);
            let beside = frames.beside().iter().zip(&seen);
            let told: Vec<f64> = beside
                .map(|(beside, seen)| beside.unwrap_or(Vec3::ZERO).dot(seen.unwrap().0))
                .collect();
            (frames, told)
        };
        let smooth = size(
            &seen(&mesh, quadratic)
                .iter()
                .map(|seen| seen.unwrap().1)
                .collect::<Vec<_>>(),
        );
        let (_, left) = of(&quadratic);
        assert!(size(&left) < 0.15 * smooth, "{} of {smooth}", size(&left));

        let (frames, told) = of(&|p| quadratic(p) + ripple(p));
        let places: Vec<Vec3> = (0..mesh.vertex_count()).map(|v| ripple(mesh.point(v))).collect();
        let by_axis = [0, 1, 2].map(|axis| {
            let field: Vec<f64> = places.iter().map(|place| place[axis]).collect();
            match frames.left_of_scalar(&field) {
                LeftOfScalar::Along(left) => left,
                _ => panic!("only one direction was seen"),
            }
        });
        let foretold: Vec<f64> = (0..mesh.vertex_count())
            .map(|v| (0..3).map(|axis| by_axis[axis][v][axis]).sum())
            .collect();
        let off: Vec<f64> = told.iter().zip(&foretold).map(|(a, b)| a - b).collect();
        assert!(
            size(&off) < 0.1 * size(&foretold),
            "{} of {}",
            size(&off),
            size(&foretold)
        );
        assert!(size(&foretold) > 0.3 * size(&places.iter().map(|p| p.norm()).collect::<Vec<_>>()));
    }
}
