//! A deformation that is smooth wherever one looks closely enough, undone in local frames.
//!
//! A region of a suspect whose vertices were found again is y = φ(x + δ) + noise: φ bent, twisted, posed or dragged it, and δ is what the suspect has beside the original. Nothing is known of φ but that around most vertices it is nearly
//! a polynomial of degree 2 or 3. So around each vertex i such a polynomial is fitted to the vertices within the reach (`windows.rs`), by least squares whose weights fall with the distance and with how badly a vertex fits its own surroundings (`fit.rs`; Cleveland 1979). Its value at the vertex is Σⱼ sᵢⱼ yⱼ, linear in the places
//! around, and its gradient Jᵢ says how the suspect is turned and stretched there. So
//!
//! Jᵢ⁻¹ (yᵢ − Σⱼ sᵢⱼ yⱼ) = δᵢ − Σⱼ sᵢⱼ δⱼ,
//!
//! up to the derivatives of φ of the next degree: whatever was smooth is gone, of both. The fit takes the smooth part of δ with it, but what it leaves of any δ is known: [`LocalFrames::left_of`]. Whoever estimates δ compares what is seen with that, and nothing is lost but what can't be told from a pose.
//!
//! Blind to what a mark says: only places are looked at.

mod along;
mod elastic;
mod fit;
mod parts;
mod windows;

use mesh::{TriMesh, Vec3};

use crate::matrix::{Mat3, Svd, svd};
use elastic::Elastic;
use fit::{CUBIC, Fitting, Neighbour, QUADRATIC};
use parts::{Move, Part, Parts};
use windows::Windows;

/// A region of a suspect as its own surroundings see it; per vertex of the region.
#[derive(Clone, Debug)]
pub struct LocalFrames {
    /// δᵢ − Σⱼ sᵢⱼ δⱼ, in the region's frame and unit; none where too little was seen around, or space was folded.
    beside: Vec<Option<Vec3>>,
    /// The largest and the smallest singular value of Jᵢ; zeros where there is none. Where only one direction is seen the region was brought back before, and both are 1.
    stretch: Vec<[f64; 2]>,
    /// j and sᵢⱼ, one vertex after the other.
    shares: Vec<(u32, f32)>,
    /// Where the shares of each vertex end.
    ends: Vec<usize>,
    /// The vector u of each vertex where only u·δ is seen; none where all of δ is.
    along: Option<Vec<Vec3>>,
    /// The unit vector of each vertex along which nothing of δ is seen, 0 where all is; none where that is everywhere.
    hidden: Option<Vec<Vec3>>,
    /// The forces in a surface that was dragged, where there are no shares.
    elastic: Option<Elastic>,
    /// −1 where the suspect is a mirrored copy.
    hand: f64,
}

/// How the frames are made.
#[derive(Clone, Copy, Debug)]
pub struct FrameOptions {
    /// How far the surroundings of a vertex go, in the region's unit.
    pub reach: f64,
    /// About how far vertices lie beside a smooth deformation, in the region's unit: what gradients can't be told from.
    pub noise: f64,
    /// Of the polynomials. Those of surfaces that are seen along one direction only are quadratic.
    pub degree: Degree,
}

/// The degree of the polynomial around each vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Degree {
    /// 2.
    Quadratic,
    /// 3, which follows a bend further, and takes more vertices to tell.
    Cubic,
}

/// A place where lengths became so many times larger, or smaller, than they did in the median is another shape. Bent by half a turn, what is as thick as long is 1 + π / 2 times as long on its outside.
const BEARABLE_STRETCH: f64 = 2.5;

/// Samples within the reach of a vertex, about, to a monomial.
const SAMPLES: f64 = 8.0;

/// Rounds of robust weights.
const ROUNDS: usize = 3;

/// A gradient whose singular values go beyond this, beside the median of the middle ones, was folded or torn.
const FARTHEST_STRETCH: f64 = 5.0;

impl LocalFrames {
    /// Those of a region, given where each of its vertices is seen.
    ///
    /// # Panics
    /// When there isn't one place a vertex.
    pub fn fit(region: &TriMesh, seen: &[Option<[f64; 3]>], options: &FrameOptions) -> Self {
        assert_eq!(region.vertex_count(), seen.len(), "one place a vertex");
        match options.degree {
            Degree::Quadratic => Self::by_polynomials::<QUADRATIC>(region, seen, options),
            Degree::Cubic => Self::by_polynomials::<CUBIC>(region, seen, options),
        }
    }

    /// Those of polynomials with N monomials.
    fn by_polynomials<const N: usize>(
        region: &TriMesh,
        seen: &[Option<[f64; 3]>],
        options: &FrameOptions,
    ) -> Self {
        let is_seen: Vec<bool> = seen.iter().map(Option::is_some).collect();
        let windows = Windows::around(region, &is_seen, options.reach, SAMPLES * N as f64);
        let places: Vec<Vec3> = seen.iter().map(|p| Vec3(p.unwrap_or_default())).collect();
        let mut fitting = Fitting::<N>::new(region, &places, options);
        let samples: Vec<u32> = windows.samples().to_vec();
        fitting.tell_hand(samples.iter().map(|&sample| (sample, windows.of(sample))));
        for _ in 0..ROUNDS {
            let off = |&sample: &u32| fitting.off(sample, windows.of(sample));
            let off: Vec<Option<f64>> = samples.iter().map(off).collect();
            fitting.weigh(&samples, &off);
        }
        let mut frames = Self {
            beside: Vec::with_capacity(seen.len()),
            stretch: Vec::with_capacity(seen.len()),
            shares: Vec::new(),
            ends: Vec::with_capacity(seen.len()),
            along: None,
            hidden: None,
            elastic: None,
            hand: fitting.hand,
        };
        let mut gradients = Vec::with_capacity(seen.len());
        for (vertex, is_seen) in is_seen.iter().enumerate() {
            let fit = is_seen
                .then(|| fitting.at(vertex as u32, windows.of(vertex as u32)))
                .flatten();
            gradients.push(fit.as_ref().map(|fit| (fit.off, svd(&fit.gradient))));
            if let Some(fit) = fit {
                frames.shares.extend(fit.shares);
            }
            frames.ends.push(frames.shares.len());
        }
        let mut middle: Vec<f64> = gradients.iter().flatten().map(|(_, svd)| svd.values[1]).collect();
        let scale = match middle.len() {
            0 => 1.0,
            count => *middle.select_nth_unstable_by(count / 2, f64::total_cmp).1,
        };
        for gradient in gradients {
            let folded = |values: [f64; 3]| {
                !(values[0] < FARTHEST_STRETCH * scale && values[2] * FARTHEST_STRETCH > scale)
            };
            let undone = |off: Vec3, svd: &Svd| -> Vec3 {
                let (Mat3(left), Mat3(right)) = (svd.left, svd.right);
                (0..3)
                    .map(|i| right[i] * (left[i].dot(off) / svd.values[i]))
                    .sum()
            };
            frames.stretch.push(match &gradient {
                Some((_, svd)) => [svd.values[0], svd.values[2]],
                None => [0.0; 2],
            });
            frames.beside.push(match gradient {
                Some((off, svd)) if !folded(svd.values) => Some(undone(off, &svd)),
                _ => None,
            });
        }
        frames
    }

    /// Those of the parts whose move is known by a few numbers, so that nearly all of δ is left: first of parts that were moved as a whole, or nearly; then of these and of parts whose vertices were all pulled along one line, by as much as each may be, where what lies along the line is [hidden](Self::hidden). Elsewhere nothing is seen, but
    /// [stretches](Self::stretch) stay known. Nothing where there are no such parts, or only one direction is seen.
    ///
    /// # Panics
    /// When there isn't one place a vertex, or the frames are of another region.
    pub fn of_parts(&self, region: &TriMesh, seen: &[Option<[f64; 3]>], options: &FrameOptions) -> Vec<Self> {
        let count = region.vertex_count();
        assert_eq!([seen.len(), self.ends.len()], [count; 2], "one place a vertex");
        if self.along.is_some() {
            return Vec::new();
        }
        let mut parts = Parts::of(region, seen, options.noise, self.hand);
        let (mut taken, mut found) = (Vec::new(), Vec::new());
        for by in [Move::AsAWhole, Move::AlongALine] {
            let others = parts.take(by);
            if !others.is_empty() {
                taken.extend(others);
                found.push(self.seeing(&taken));
            }
        }
        found
    }

    /// Frames that see parts alone.
    fn seeing(&self, parts: &[Part]) -> Self {
        let count = self.ends.len();
        let mut frames = Self {
            beside: vec![None; count],
            shares: Vec::new(),
            ends: Vec::with_capacity(count),
            stretch: self.stretch.clone(),
            along: None,
            hidden: None,
            elastic: None,
            hand: self.hand,
        };
        let mut shares = vec![&[][..]; count];
        for part in parts {
            for (&(v, beside), of_it) in part.beside.iter().zip(&part.shares) {
                (frames.beside[v], shares[v]) = (Some(beside), of_it);
                if let Some(hidden) = part.hidden {
                    frames.hidden.get_or_insert_with(|| vec![Vec3::ZERO; count])[v] = hidden;
                }
            }
        }
        for of_it in shares {
            frames.shares.extend(of_it);
            frames.ends.push(frames.shares.len());
        }
        frames
    }

    /// Those of a surface that was dragged by handles, as rigid as possible: at each vertex the force that is left. [Stretches](Self::stretch) stay as they are. None where only one direction is seen.
    ///
    /// # Panics
    /// When there isn't one place a vertex, or the frames are of another region.
    pub fn of_elastic_surface(&self, region: &TriMesh, seen: &[Option<[f64; 3]>]) -> Option<Self> {
        let count = region.vertex_count();
        assert_eq!([seen.len(), self.ends.len()], [count; 2], "one place a vertex");
        if self.along.is_some() {
            return None;
        }
        let (elastic, beside) = Elastic::of(region, seen, self.hand);
        Some(Self {
            beside,
            shares: Vec::new(),
            ends: vec![0; count],
            stretch: self.stretch.clone(),
            along: None,
            hidden: None,
            elastic: Some(elastic),
            hand: self.hand,
        })
    }

    /// These, and others of the same region wherever these see nothing.
    ///
    /// # Panics
    /// When the others are of another region.
    #[must_use]
    pub fn or_elsewhere(&self, others: &Self) -> Self {
        assert_eq!(self.ends.len(), others.ends.len(), "frames of one region");
        let mut both = Self {
            shares: Vec::new(),
            ends: Vec::with_capacity(self.ends.len()),
            elastic: self.elastic.clone().or_else(|| others.elastic.clone()),
            ..self.clone()
        };
        let hides = self.hidden.is_some() || others.hidden.is_some();
        let mut hidden = Vec::new();
        for vertex in 0..self.ends.len() {
            let frames = if self.beside[vertex].is_some() {
                self
            } else {
                others
            };
            both.beside[vertex] = frames.beside[vertex];
            both.shares.extend(frames.shares_of(vertex));
            both.ends.push(both.shares.len());
            hidden.push(frames.hidden(vertex));
        }
        both.hidden = hides.then_some(hidden);
        both
    }

    /// Whether they see the forces in a surface that was dragged.
    pub fn is_elastic(&self) -> bool {
        self.elastic.is_some()
    }

    /// Whether something is [hidden](Self::hidden) anywhere.
    pub fn is_part_hidden(&self) -> bool {
        self.hidden.is_some()
    }

    /// The unit vector along which nothing of δ is seen at a vertex; 0 where all is.
    pub fn hidden(&self, vertex: usize) -> Vec3 {
        self.hidden.as_ref().map_or(Vec3::ZERO, |hidden| hidden[vertex])
    }

    fn shares_of(&self, vertex: usize) -> &[(u32, f32)] {
        let start = vertex.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.shares[start..self.ends[vertex]]
    }

    /// Those of a region of which only u·δ is seen at each vertex, and the region was brought back nearly to where it was: the rest of the way, which is smooth, is taken out as a polynomial of degree 2 around each vertex that such observations tell.
    ///
    /// # Panics
    /// When there isn't one u·δ a vertex.
    pub fn fit_along(region: &TriMesh, seen: &[Option<(Vec3, f64)>], options: &FrameOptions) -> Self {
        along::fit(region, seen, options)
    }

    /// δᵢ − Σⱼ sᵢⱼ δⱼ of what the suspect has beside the original, in the region's frame and unit; none where too little was seen around a vertex, or space was folded there.
    pub fn beside(&self) -> &[Option<Vec3>] {
        &self.beside
    }

    /// By how much lengths at each vertex became larger, along the direction where that is most and where it is least; zeros where too little was seen around it.
    pub fn stretch(&self) -> &[[f64; 2]] {
        &self.stretch
    }

    /// What these frames leave of a field δ over the region's vertices, such as δᵢ − Σⱼ sᵢⱼ δⱼ; 0 where nothing was seen.
    ///
    /// # Panics
    /// When there isn't one value a vertex.
    pub fn left_of(&self, field: &[Vec3]) -> Vec<Vec3> {
        assert_eq!(field.len(), self.ends.len(), "one value a vertex");
        let mut by_shares = self.left_by_shares(field);
        for (left, &hidden) in by_shares.iter_mut().zip(self.hidden.iter().flatten()) {
            *left -= hidden * hidden.dot(*left);
        }
        let Some(elastic) = &self.elastic else {
            return by_shares;
        };
        let mut left = elastic.left_of(field);
        for (vertex, by_shares) in by_shares.into_iter().enumerate() {
            if !self.shares_of(vertex).is_empty() {
                left[vertex] = by_shares;
            }
        }
        left
    }

    /// What they leave of a field f that is the δ along one axis, whichever that is.
    ///
    /// # Panics
    /// When there isn't one value a vertex.
    pub fn left_of_scalar(&self, field: &[f64]) -> LeftOfScalar {
        assert_eq!(field.len(), self.ends.len(), "one value a vertex");
        if self.elastic.is_some() {
            let along = |axis: Vec3| -> Vec<Vec3> { field.iter().map(|&f| axis * f).collect() };
            let axes = [Vec3::X, Vec3::Y, Vec3::Z];
            return LeftOfScalar::OfAxes(axes.map(|axis| self.left_of(&along(axis))));
        }
        match &self.along {
            Some(along) => {
                let field: Vec<Vec3> = along.iter().zip(field).map(|(&u, &f)| u * f).collect();
                LeftOfScalar::Along(self.left_by_shares(&field))
            }
            None => LeftOfScalar::Alike(self.left_by_shares(field)),
        }
    }

    /// fᵢ − Σⱼ sᵢⱼ fⱼ.
    fn left_by_shares<T>(&self, field: &[T]) -> Vec<T>
    where
        T: Copy + Default + std::ops::Sub<Output = T> + std::ops::Mul<f64, Output = T>,
    {
        let left = |vertex: usize| {
            let shares = self.shares_of(vertex);
            if shares.is_empty() {
                return T::default();
            }
            let mut left = field[vertex];
            for &(of, share) in shares {
                left = left - field[of as usize] * f64::from(share);
            }
            left
        };
        (0..field.len()).map(left).collect()
    }
}

/// What frames leave of a field f along one axis.
#[derive(Clone, Debug)]
pub enum LeftOfScalar {
    /// As much whichever the axis is, and along that alone, less what is [hidden](LocalFrames::hidden).
    Alike(Vec<f64>),
    /// Of u f, where only u·δ is seen.
    Along(Vec<Vec3>),
    /// Of f along each of the three axes.
    OfAxes([Vec<Vec3>; 3]),
}

/// Whether each place is the same shape as before, by the largest and the smallest of its [stretches](LocalFrames::stretch); none where both are zero, since nothing is known of it. Where space was folded it is not.
pub fn bearable(stretch: &[[f64; 2]]) -> Vec<Option<bool>> {
    let is_told = |[most, _]: &&[f64; 2]| *most > 0.0;
    let mut middle: Vec<f64> = stretch
        .iter()
        .filter(is_told)
        .map(|[most, least]| (most * least).sqrt())
        .collect();
    if middle.is_empty() {
        return vec![None; stretch.len()];
    }
    let count = middle.len();
    let scale = *middle.select_nth_unstable_by(count / 2, f64::total_cmp).1;
    let is_bearable =
        |[most, least]: &[f64; 2]| *most <= BEARABLE_STRETCH * scale && least * BEARABLE_STRETCH >= scale;
    let of_one = |stretch: &[f64; 2]| Some(stretch).filter(is_told).map(is_bearable);
    stretch.iter().map(of_one).collect()
}

#[cfg(test)]
mod tests {
    use mesh::shapes;

    use super::*;

    const OPTIONS: FrameOptions = FrameOptions {
        reach: 0.35,
        noise: 2e-3,
        degree: Degree::Quadratic,
    };

    fn placed(mesh: &TriMesh, to: impl Fn(Vec3) -> Vec3) -> Vec<Option<[f64; 3]>> {
        (0..mesh.vertex_count())
            .map(|v| Some(to(mesh.point(v)).into()))
            .collect()
    }

    fn quadratic(Vec3([x, y, z]): Vec3) -> Vec3 {
        Vec3([
            2.0 * y + 0.3 * x * z,
            -2.0 * x + 0.2 * y * y,
            2.0 * z + 0.1 * x * y - 7.0,
        ])
    }

    /// A ripple along the axes, far shorter than the reach.
    fn ripple(p: Vec3) -> Vec3 {
        p.map(|x| 2e-3 * (40.0 * x).sin())
    }

    fn most_beside(frames: &LocalFrames) -> f64 {
        let beside = frames.beside().iter().flatten();
        beside.map(|d| d.norm()).fold(0.0, f64::max)
    }

    #[test]
    fn nothing_is_left_of_a_polynomial_of_degree_2() {
        let mesh = shapes::bumpy_torus(80, 50, 1);
        let frames = LocalFrames::fit(&mesh, &placed(&mesh, quadratic), &OPTIONS);
        let left = most_beside(&frames);
        assert!(left < 1e-5, "{left}");
        assert!(frames.beside().iter().all(Option::is_some));
        let constant = frames.left_by_shares(&vec![5.0; mesh.vertex_count()]);
        assert!(constant.iter().all(|left| left.abs() < 1e-4));
    }

    #[test]
    fn nothing_is_left_of_a_polynomial_of_degree_3_by_cubics() {
        let mesh = shapes::bumpy_torus(80, 50, 1);
        let cubic = |p: Vec3| {
            let Vec3([x, y, z]) = p;
            quadratic(p) + Vec3([0.1 * x * x * y, 0.05 * z * z * z, 0.1 * x * y * z])
        };
        let left = [Degree::Quadratic, Degree::Cubic].map(|degree| {
            let options = FrameOptions { degree, ..OPTIONS };
            most_beside(&LocalFrames::fit(&mesh, &placed(&mesh, cubic), &options))
        });
        assert!(left[0] > 2e-4 && left[1] < 3e-5, "{left:?}");
    }

    #[test]
    fn parts_that_were_moved_as_a_whole_are_seen_whole() {
        let mesh = shapes::bumpy_torus(80, 50, 1);
        let options = FrameOptions {
            noise: 3e-3,
            ..OPTIONS
        };
        let turned_by = |p: Vec3, angle: f64| {
            let (sin, cos) = angle.sin_cos();
            let Vec3([x, y, z]) = p + ripple(p);
            Vec3([x, cos * y - sin * z, sin * y + cos * z]) * 7.0
        };
        // One half stays, the other is turned, by a joint between.
        let jointed = |p: Vec3| {
            let t = ((p[0] + 0.3) / 0.6).clamp(0.0, 1.0);
            turned_by(p, t * t * (3.0 - 2.0 * t))
        };
        for hand in [1.0, -1.0] {
            let places = placed(&mesh, |p| {
                let Vec3([x, y, z]) = jointed(p);
                Vec3([hand * x, y, z])
            });
            let frames = LocalFrames::fit(&mesh, &places, &options);
            let whole = frames.of_parts(&mesh, &places, &options).remove(0);
            assert_eq!(whole.stretch(), frames.stretch());
            let (mut seen, mut there) = ([0, 0], [0, 0]);
            for (v, beside) in whole.beside().iter().enumerate() {
                let p = mesh.point(v);
                if p[0].abs() > 0.3 {
                    there[usize::from(p[0] > 0.0)] += 1;
                    seen[usize::from(p[0] > 0.0)] += usize::from(beside.is_some());
                }
                if let Some(beside) = beside {
                    assert!((*beside - ripple(p)).norm() < 3e-3, "{v}: {beside:?}");
                }
            }
            let ripples: Vec<Vec3> = (0..mesh.vertex_count()).map(|v| ripple(mesh.point(v))).collect();
            for (left, beside) in whole.left_of(&ripples).iter().zip(whole.beside()) {
                let off = *left - beside.unwrap_or(Vec3::ZERO);
                assert!(off.norm() < 3e-4, "{off:?}");
            }
            assert!(
                (0..2).all(|side| 10 * seen[side] > 8 * there[side]),
                "{seen:?} of {there:?}"
            );
            let ones = whole.left_by_shares(&vec![1.0; mesh.vertex_count()]);
            assert!(ones.iter().all(|left| left.abs() < 1e-4));
            let both = whole.or_elsewhere(&frames);
            let left = [&both, &whole, &frames].map(|frames| frames.left_of(&ripples));
            for (v, beside) in whole.beside().iter().enumerate() {
                let (of, left_of) = if beside.is_some() {
                    (&whole, &left[1])
                } else {
                    (&frames, &left[2])
                };
                assert_eq!((both.beside()[v], left[0][v]), (of.beside()[v], left_of[v]));
            }
        }
        let twisted = placed(&mesh, |p| turned_by(p, p[0]));
        let frames = LocalFrames::fit(&mesh, &twisted, &options);
        assert!(frames.of_parts(&mesh, &twisted, &options).is_empty());
    }

    // Pulled so that nothing stays where it was, and then turned.
    #[test]
    fn across_the_line_of_a_pull_all_of_a_field_is_left_however_far_each_vertex_went() {
        let mesh = shapes::bumpy_torus(24, 16, 1);
        let options = FrameOptions {
            noise: 3e-3,
            ..OPTIONS
        };
        let line = Vec3([0.3, 0.1, 0.4]);
        let pulled = |p: Vec3| {
            let t = (1.0 - (p - Vec3([1.0, 0.0, 0.3])).norm() / 3.0).max(0.0);
            let q = p + line * (t * t * (3.0 - 2.0 * t) + (5.0 * p[1]).sin());
            Vec3([2.0 * q[1], 5.0 - 2.0 * q[0], 2.0 * q[2]])
        };
        let field: Vec<Vec3> = (0..mesh.vertex_count()).map(|v| ripple(mesh.point(v))).collect();
        let places = placed(&mesh, |p| pulled(p + ripple(p)));
        let frames = LocalFrames::fit(&mesh, &places, &options);
        let found = frames.of_parts(&mesh, &places, &options);
        let [parts] = &found[..] else {
            panic!("no part moved as a whole: {}", found.len())
        };
        let (mut seen, mut off, mut size) = (0, 0.0, 0.0);
        for (v, (left, beside)) in parts.left_of(&field).into_iter().zip(parts.beside()).enumerate() {
            let Some(beside) = *beside else { continue };
            let across = parts.hidden(v).cross(line).norm() / line.norm();
            assert!(across < 0.02, "{:?}", parts.hidden(v));
            assert!(beside.dot(parts.hidden(v)).abs() < 1e-9 * beside.norm());
            seen += 1;
            off += (left - beside).squared();
            size += left.squared();
        }
        assert!(5 * seen > 4 * mesh.vertex_count(), "{seen}");
        assert!(off < 0.02 * size, "{off} of {size}");
    }

    #[test]
    fn what_is_left_of_a_field_is_what_is_seen_of_it_under_any_smooth_map_of_either_hand() {
        let mesh = shapes::bumpy_torus(80, 50, 1);
        let field: Vec<Vec3> = (0..mesh.vertex_count()).map(|v| ripple(mesh.point(v))).collect();
        let twist = |Vec3([x, y, z]): Vec3| {
            let (sin, cos) = x.sin_cos();
            Vec3([x, cos * y - sin * z, sin * y + cos * z]) * 100.0
        };
        for hand in [1.0, -1.0] {
            let bent = |p: Vec3| {
                let Vec3([x, y, z]) = twist(p + ripple(p));
                Vec3([hand * x, y, z])
            };
            let frames = LocalFrames::fit(&mesh, &placed(&mesh, bent), &OPTIONS);
            let left = frames.left_of(&field);
            let (mut off, mut size) = (0.0, 0.0);
            for (seen, left) in frames.beside().iter().zip(&left) {
                off += (seen.unwrap() - *left).squared();
                size += left.squared();
            }
            assert!(off < 0.1 * size && size > 0.0, "{hand}: {off} of {size}");
        }
    }

    #[test]
    fn what_is_folded_flat_or_not_seen_has_no_frame() {
        let mesh = shapes::bumpy_torus(40, 30, 1);
        let flat = placed(&mesh, |Vec3([x, y, _])| Vec3([x, y, 0.0]));
        let nowhere = placed(&mesh, |_| Vec3::ZERO);
        let unseen = vec![None; mesh.vertex_count()];
        let of = |seen: &[Option<[f64; 3]>]| {
            LocalFrames::fit(&mesh, seen, &OPTIONS)
                .beside()
                .iter()
                .flatten()
                .count()
        };
        assert_eq!((of(&nowhere), of(&unseen)), (0, 0));
        assert!(of(&flat) < mesh.vertex_count());
    }
}
