//! What the vertices of a decimated suspect say of the planes that went into them.
//!
//! Collapses of edges put a vertex where the quadric of all planes of its region is least (Garland and Heckbert 1997): there the pulls of the planes balance,
//!
//! Σ n (n·x − d) = 0.
//!
//! Of the marked original's planes that is true to the last digit. Those of the original itself pull with g, which the mark's displacement δ takes away: to first order
//! Σ n (n·δ(x)) with δ continued from each triangle over its plane by its values at the corners: three equations for each vertex of the suspect, along the surface as well as across it.
//!
//! Which planes they are is known in part. Decimation that is done again with marks of random bits draws regions as they may be; what was decimated is one more draw, so
//! g is, but for the mark, as far from the mean of the draws' pulls as these are from each other. Where regions are uncertain a vertex is known well in some directions and hardly in others, and each vertex counts in
//! each direction by the draws' covariance there.

use job::{Job, JobError};
use mesh::{Edges, TriMesh, Vec3};

use super::{
    Patch,
    planes::{Plane, pulls as pulls_of_planes},
};

/// Into which of the suspect's vertices each vertex of the original went, as it may have been (#V).
pub(crate) type Draw = Vec<Option<u32>>;

/// Of the mark, what pulls are off by where all draws agree: by rounding in a file, and by what is of second order.
const LEAST_NOISE: f64 = 0.05;

/// Of the planes of a region, the least share in a patch for which its mark says something of the vertex.
const LEAST_SHARE: f64 = 1e-3;

/// The balance of each vertex of a suspect that lies on its original.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Balances {
    shares: Shares,
    /// Of each vertex of the suspect; none where its planes don't tell.
    balances: Vec<Option<Balance>>,
    /// The mean square of the mark's displacement along an axis.
    mark: f64,
    /// By which equations are multiplied: displacements count as they are, in the mean.
    unit: f64,
}

/// Of a vertex of the suspect.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Balance {
    point: Vec3,
    /// The mean over the draws of Σ n (n·x − d).
    pull: Vec3,
    /// The same of Σ n nᵀ, by rows.
    stiffness: Matrix,
    /// Of the pull, by rows.
    covariance: Matrix,
}

type Matrix = [Vec3; 3];

/// For each vertex of the original the suspect's vertices into which it may have gone, and the share of the draws in which it did.
#[derive(Clone, Debug, PartialEq)]
struct Shares {
    offsets: Vec<usize>,
    all: Vec<(u32, f32)>,
}

impl Shares {
    fn of(draws: &[Draw]) -> Self {
        let vertices = draws.first().map_or(0, Vec::len);
        let (mut offsets, mut all) = (vec![0], Vec::<(u32, f32)>::with_capacity(2 * vertices));
        let share = 1.0 / draws.len() as f32;
        for v in 0..vertices {
            let first = all.len();
            for region in draws.iter().filter_map(|draw| draw[v]) {
                match all[first..].iter_mut().find(|(w, _)| *w == region) {
                    Some((_, of_it)) => *of_it += share,
                    None => all.push((region, share)),
                }
            }
            offsets.push(all.len());
        }
        Self { offsets, all }
    }

    fn at(&self, vertex: usize) -> &[(u32, f32)] {
        &self.all[self.offsets[vertex]..self.offsets[vertex + 1]]
    }

    /// How much a triangle's plane counts in each of the regions that its corners may be in.
    fn of_corners(&self, corners: [usize; 3], to: &mut Vec<(u32, f64)>) {
        to.clear();
        for &(w, share) in corners.iter().flat_map(|&v| self.at(v)) {
            match to.iter_mut().find(|(of, _)| *of == w) {
                Some((_, times)) => *times += f64::from(share),
                None => to.push((w, f64::from(share))),
            }
        }
    }
}

impl Balances {
    /// Those of a suspect that lies on its original, by draws of regions, and the mark's root mean square displacement.
    ///
    /// # Errors
    /// [`JobError::Cancelled`].
    pub(crate) fn of(
        original: &TriMesh,
        suspect: &TriMesh,
        draws: &[Draw],
        mark: f64,
        job: &Job,
    ) -> Result<Self, JobError> {
        let mark = mark * mark / 3.0;
        let normals: Vec<Vec3> = (0..original.triangle_count())
            .map(|t| normal(original.corners(t)))
            .collect();
        let pulls = |draw: usize| pulls(original, &normals, suspect, &draws[draw]);
        let pulls = job.quiet().map(draws.len(), 1, pulls)?;
        let shares = Shares::of(draws);
        let stiffness = stiffness(original, &normals, &shares, suspect.vertex_count());
        // Where decimators go by other rules.
        let at_border = Edges::of(suspect).at_border();
        let of_vertex = |w: usize| -> Option<Balance> {
            let stiffness = stiffness[w];
            let weight: f64 = (0..3).map(|i| stiffness[i][i]).sum();
            if at_border[w] || weight <= 0.0 {
                return None;
            }
            let of_draws = || pulls.iter().map(|pulls| pulls[w]);
            let pull = of_draws().sum::<Vec3>() / draws.len() as f64;
            let least = (LEAST_NOISE * weight).powi(2) * 3.0 * mark;
            let mut covariance = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * least);
            // The suspect is one more draw, and the mean is of few.
            let count = draws.len() as f64;
            let each = (1.0 + 1.0 / count) / (count - 1.0).max(1.0);
            for off in of_draws().map(|of_draw| of_draw - pull) {
                (0..3).for_each(|i| covariance[i] += off * (each * off[i]));
            }
            Some(Balance {
                point: suspect.point(w),
                pull,
                stiffness,
                covariance,
            })
        };
        let mut balances = Self {
            shares,
            balances: (0..suspect.vertex_count()).map(of_vertex).collect(),
            mark,
            unit: 1.0,
        };
        balances.unit = balances.unit_of_shifts();
        Ok(balances)
    }

    /// By what equations without noise of a unit are multiplied for a shift to count as it is, in the root mean square.
    fn unit_of_shifts(&self) -> f64 {
        let of = |balance: &Balance| {
            let root = inverse_root(balance.covariance)?;
            let squares = root.map(|row| product(balance.stiffness, row).squared());
            Some(squares.iter().sum::<f64>() / 3.0)
        };
        let squares: Vec<f64> = self.balances.iter().flatten().filter_map(of).collect();
        let sum: f64 = squares.iter().sum();
        if sum > 0.0 {
            (squares.len() as f64 / sum).sqrt()
        } else {
            1.0
        }
    }

    /// What they say of displacements within one patch.
    pub(crate) fn of_patch(&self, patch: &Patch) -> BalancesOfPatch {
        let mesh = patch.mesh();
        let whole = |v: u32| patch.vertices()[v as usize] as usize;
        let mut vertices: Vec<u32> = patch
            .vertices()
            .iter()
            .flat_map(|&v| self.shares.at(v as usize))
            .map(|&(w, _)| w)
            .filter(|&w| self.balances[w as usize].is_some())
            .collect();
        vertices.sort_unstable();
        vertices.dedup();
        let number = |w: u32| vertices.binary_search(&w).ok();
        let (mut planes, mut regions) = (Vec::new(), Vec::new());
        let mut inside = vec![[Vec3::ZERO; 3]; vertices.len()];
        for (t, corners) in mesh.triangles().iter().enumerate() {
            self.shares.of_corners(corners.map(whole), &mut regions);
            for &(w, times) in &regions {
                let Some((w, balance)) = number(w).zip(self.balances[w as usize]) else {
                    continue;
                };
                if let Some(plane) = Plane::of(*corners, mesh.corners(t), (w, balance.point), times) {
                    (0..3).for_each(|i| inside[w][i] += plane.normal * (times * plane.normal[i]));
                    planes.push(plane);
                }
            }
        }
        let equations = vertices.iter().zip(inside);
        let equations = equations.map(|(&w, inside)| self.equations(w, inside)).collect();
        BalancesOfPatch { equations, planes }
    }

    /// Those of a vertex of which these planes are in the patch; what the mark does to the others is noise.
    fn equations(&self, w: u32, inside: Matrix) -> Option<Equations> {
        let Balance {
            point,
            pull,
            stiffness,
            covariance,
        } = self.balances[w as usize]?;
        let weight = |matrix: Matrix| (0..3).map(|i| matrix[i][i]).sum::<f64>();
        if weight(inside) < LEAST_SHARE * weight(stiffness) {
            return None;
        }
        let outside = std::array::from_fn(|i| stiffness[i] - inside[i]);
        let root = inverse_root(add_square(covariance, outside, self.mark))?;
        let along = root.map(|row| row * self.unit);
        Some(Equations {
            point,
            stiffness,
            along,
            pull,
        })
    }
}

/// What is known of displacements of a patch by vertices of the suspect, which are numbered among those that may hold some of it.
#[derive(Debug)]
pub(crate) struct BalancesOfPatch {
    equations: Vec<Option<Equations>>,
    planes: Vec<Plane>,
}

/// Three equations: along each of these vectors the pull of the original's planes is what displacements take away, with noise of the same mean square in all equations.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Equations {
    pub(crate) point: Vec3,
    stiffness: Matrix,
    pub(crate) along: Matrix,
    pub(crate) pull: Vec3,
}

impl Equations {
    /// Where along itself a displacement that is the same all over the region is seen by an equation.
    pub(crate) fn of_shift(&self, along: Vec3) -> Vec3 {
        product(self.stiffness, along)
    }
}

impl BalancesOfPatch {
    /// The equations of each vertex of the suspect; none where there are none.
    pub(crate) fn equations(&self) -> &[Option<Equations>] {
        &self.equations
    }

    /// The pull of the original's planes at each vertex of the suspect when, before the decimation, the vertices of the patch were displaced by a function along each of the three axes.
    pub(crate) fn moved_by(&self, function: &[f64]) -> Vec<[Vec3; 3]> {
        pulls_of_planes(&self.planes, function, self.equations.len())
    }

    /// The same where they were displaced by vector fields.
    pub(crate) fn moved_by_fields<const N: usize>(&self, fields: &[[Vec3; N]]) -> Vec<[Vec3; N]> {
        let mut sums = vec![[Vec3::ZERO; N]; self.equations.len()];
        for plane in &self.planes {
            for (sum, value) in sums[plane.region].iter_mut().zip(plane.moved_by(fields)) {
                *sum += plane.normal * value;
            }
        }
        sums
    }
}

/// The unit normal of a triangle.
fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a).unit()
}

/// Σ n (n·x − d) at each vertex of the suspect, of the planes of a draw's regions.
fn pulls(original: &TriMesh, normals: &[Vec3], suspect: &TriMesh, draw: &Draw) -> Vec<Vec3> {
    let mut pulls = vec![Vec3::ZERO; suspect.vertex_count()];
    for (corners, &normal) in original.triangles().iter().zip(normals) {
        let corner = original.point(corners[0] as usize);
        for w in corners.iter().filter_map(|&v| draw[v as usize]) {
            let way = suspect.point(w as usize) - corner;
            pulls[w as usize] += normal * normal.dot(way);
        }
    }
    pulls
}

/// Σ n nᵀ, by rows, of the planes of each region.
fn stiffness(original: &TriMesh, normals: &[Vec3], shares: &Shares, count: usize) -> Vec<Matrix> {
    let mut all = vec![[Vec3::ZERO; 3]; count];
    let mut regions = Vec::new();
    for (corners, &normal) in original.triangles().iter().zip(normals) {
        shares.of_corners(corners.map(|v| v as usize), &mut regions);
        for &(w, times) in &regions {
            (0..3).for_each(|i| all[w as usize][i] += normal * (times * normal[i]));
        }
    }
    all
}

/// M x, of a symmetric matrix.
fn product(matrix: Matrix, x: Vec3) -> Vec3 {
    Vec3(matrix.map(|row| row.dot(x)))
}

/// C + s A Aᵀ, of a symmetric A.
fn add_square(mut covariance: Matrix, a: Matrix, square: f64) -> Matrix {
    for i in 0..3 {
        covariance[i] += Vec3(std::array::from_fn(|j| square * a[i].dot(a[j])));
    }
    covariance
}

/// L⁻¹ of a covariance L Lᵀ, by rows; none where it can't be told.
fn inverse_root([x, y, z]: Matrix) -> Option<Matrix> {
    // Gram and Schmidt: each coordinate without what those before it say of it.
    let a = x[0].sqrt();
    let (b, c) = (y[0] / a, z[0] / a);
    let d = (y[1] - b * b).sqrt();
    let e = (z[1] - b * c) / d;
    let f = (z[2] - c * c - e * e).sqrt();
    let first = Vec3([1.0 / a, 0.0, 0.0]);
    let second = (Vec3::Y - first * b) / d;
    let third = (Vec3::Z - first * c - second * e) / f;
    let rows = [first, second, third];
    let is_finite = rows.iter().all(|row| row.0.iter().all(|x| x.is_finite()));
    is_finite.then_some(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mark::{Patches, settling::tests::quadrics};
    use mesh::shapes;
    use proptest::prelude::*;

    /// A sphere, the vertices that it is decimated to, and the region of each of its own.
    fn sphere() -> (TriMesh, TriMesh, Draw) {
        let (original, coarse) = (shapes::bumpy_sphere(5, 3), shapes::icosphere(2));
        let nearest = |v: usize| {
            let place = original.point(v).unit();
            let apart = |w: &usize| (coarse.point(*w) - place).squared();
            (0..coarse.vertex_count()).min_by(|a, b| apart(a).total_cmp(&apart(b)))
        };
        let regions = (0..original.vertex_count()).map(|v| nearest(v).map(|w| w as u32));
        let regions: Draw = regions.collect();
        // Where the surface is, so that no plane is far away.
        let on_surface = |w: usize| {
            let place = coarse.point(w);
            let apart = |v: &usize| (original.point(*v).unit() - place).squared();
            let nearest = (0..original.vertex_count()).min_by(|a, b| apart(a).total_cmp(&apart(b)));
            original.positions()[nearest.unwrap()]
        };
        let places = (0..coarse.vertex_count()).map(on_surface).collect();
        let coarse = coarse.with_positions(places).unwrap();
        (original, coarse, regions)
    }

    #[test]
    fn pulls_are_what_a_displacement_added_before_the_decimation() {
        let (original, coarse, regions) = sphere();
        let patches = Patches::from_labels(&original, &vec![1; original.vertex_count()]).unwrap();
        let wave = |v: usize| {
            let Vec3([x, y, z]) = original.point(v);
            (9.0 * x + 5.0 * y - 7.0 * z).sin()
        };
        let function: Vec<f64> = (0..original.vertex_count()).map(wave).collect();
        let height = 1e-6;
        for (axis, way) in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().enumerate() {
            let displaced =
                (0..function.len()).map(|v| (original.point(v) + way * (height * function[v])).into());
            let displaced = original.with_positions(displaced.collect()).unwrap();
            let of: Vec<Option<usize>> = regions.iter().map(|w| w.map(|w| w as usize)).collect();
            let lowest = quadrics(&displaced, &of, coarse.vertex_count()).into_iter();
            let lowest = lowest.map(|quadric| quadric.minimum().unwrap().into());
            let suspect = coarse.with_positions(lowest.collect()).unwrap();
            let draws = [regions.clone(), regions.clone()];
            let balances = Balances::of(&original, &suspect, &draws, height, &Job::default()).unwrap();
            let of_patch = balances.of_patch(&patches[0]);
            let moved = of_patch.moved_by(&function);
            let (mut off, mut all) = (0.0, 0.0);
            for (equations, moved) in of_patch.equations().iter().zip(moved) {
                let Equations { along, pull, .. } = equations.unwrap();
                for along in along {
                    off += along.dot(pull - moved[axis] * height).powi(2);
                    all += along.dot(pull).powi(2);
                }
            }
            // But for what planes turn where they don't meet the vertex.
            assert!(off < 0.05 * all, "{axis}: {off} of {all}");
        }
    }

    #[test]
    fn a_shift_is_seen_by_equations_as_by_a_field() {
        let (original, coarse, regions) = sphere();
        let patches = Patches::from_labels(&original, &vec![1; original.vertex_count()]).unwrap();
        let mut other = regions.clone();
        let neighbours = original.neighbours();
        for v in (0..other.len()).step_by(5) {
            other[v] = regions[neighbours.of(v)[0] as usize];
        }
        let balances = Balances::of(&original, &coarse, &[regions, other], 1e-3, &Job::default()).unwrap();
        let of_patch = balances.of_patch(&patches[0]);
        let way = Vec3([0.3, -0.4, 0.9]);
        let moved = of_patch.moved_by_fields(&vec![[way]; original.vertex_count()]);
        let (mut squares, mut count) = (0.0, 0.0);
        for (equations, [moved]) in of_patch.equations().iter().zip(moved) {
            let equations = equations.unwrap();
            for along in equations.along {
                let of_shift = equations.of_shift(along);
                assert!((along.dot(moved) - of_shift.dot(way)).abs() < 1e-9);
                squares += of_shift.squared();
                count += 1.0;
            }
        }
        assert!((squares / count - 1.0_f64).abs() < 1e-9, "{squares} of {count}");
    }

    #[test]
    fn where_draws_differ_noise_is_as_much_as_they_do() {
        let (original, coarse, regions) = sphere();
        let mut other = regions.clone();
        let changed = regions[0];
        let of_region = other.iter_mut().filter(|region| **region == changed);
        of_region.for_each(|region| *region = None);
        let draws = [regions, other];
        let balances = Balances::of(&original, &coarse, &draws, 1e-9, &Job::default()).unwrap();
        let variance = |w: usize| -> f64 {
            let balance = balances.balances[w].unwrap();
            (0..3).map(|i| balance.covariance[i][i]).sum()
        };
        let changed = changed.unwrap() as usize;
        assert!((0..coarse.vertex_count()).all(|w| w == changed || variance(changed) > 1e3 * variance(w)));
        assert!((balances.shares.at(0)[0].1 - 0.5).abs() < 1e-6);
    }

    proptest! {
        #[test]
        fn roots_make_noise_white(rows in prop::array::uniform3(prop::array::uniform3(-1.0..1.0f64))) {
            let rows = rows.map(Vec3);
            prop_assume!(rows[0].dot(rows[1].cross(rows[2])).abs() > 1e-3);
            let covariance: Matrix = std::array::from_fn(|i| Vec3(std::array::from_fn(|j| rows[i].dot(rows[j]))));
            let root = inverse_root(covariance).unwrap();
            for (i, row) in root.iter().enumerate() {
                for (j, other) in root.iter().enumerate() {
                    let product = row.dot(product(covariance, *other));
                    prop_assert!((product - f64::from(u8::from(i == j))).abs() < 1e-6, "{product}");
                }
            }
        }
    }

    #[test]
    fn what_is_no_covariance_has_no_root() {
        assert!(inverse_root([Vec3::ZERO; 3]).is_none());
        assert!(inverse_root([Vec3::X, Vec3::Y, Vec3::Z * -1.0]).is_none());
        assert!(inverse_root([Vec3::X, Vec3::Y, Vec3::Z * f64::NAN]).is_none());
    }
}
