//! Lays a suspect onto an original: by places that look alike, and then by the surfaces.
//!
//! Two places of each, whose codes, distance and normals agree, say where the suspect would lie; the poses that most other pairs of places agree with are refined by the distances of samples from the planes of the
//! nearest samples (Chen and Medioni 1991), with the size as a seventh unknown.

use mesh::Vec3;

use crate::descriptor::{CODE, Grid, Place, Sought, Surface};

/// Pairs of places, the likest of each size, of which poses are made.
const PAIRS: usize = 64;
/// Places so far apart are not each other's neighbours.
const ELSEWHERE: f64 = 0.1;
/// How many times farther or nearer two places may lie than those on the original.
const STRETCH: f64 = 1.105;
/// The least distance of two places that say how a suspect lies.
const LEAST_BASE: f64 = 0.08;
/// Pairs agree with a pose that lie so near.
const AGREEING: f64 = 0.06;
/// Poses that are compared by the surfaces, and how many of these are refined.
const COMPARED: usize = 16;
const POSES: usize = 2;
/// They are compared by every so many samples, of which those count that lie so near.
const EVERY: usize = 4;
const NEAR: f64 = 0.03;
/// Samples are looked for within these distances, from step to step.
const REACHES: [f64; 6] = [0.06, 0.06, 0.05, 0.04, 0.03, 0.03];
/// A sample that lies so far off counts half.
const HALF: f64 = 0.004;

/// x ↦ R x s + t.
#[derive(Clone, Copy, Debug)]
struct Pose {
    columns: [Vec3; 3],
    shift: Vec3,
}

impl Pose {
    fn turn(&self, v: Vec3) -> Vec3 {
        self.columns[0] * v.0[0] + self.columns[1] * v.0[1] + self.columns[2] * v.0[2]
    }

    fn apply(&self, p: Vec3) -> Vec3 {
        self.turn(p) + self.shift
    }
}

/// How a suspect may lie on an original, by places that look alike.
pub(super) struct Guess {
    /// So many samples lie near the original in the first pose.
    pub(super) near: usize,
    poses: Vec<Pose>,
}

impl Guess {
    pub(super) fn of(sought: &Sought, surface: &Surface) -> Self {
        let mut poses = poses(&pairs(sought, surface));
        let grid = Grid::new(&surface.points, NEAR);
        let near = |pose: &Pose| {
            let samples = sought.samples.iter().step_by(EVERY);
            let is_near = |&&(point, normal): &&(Vec3, Vec3)| {
                let (p, n) = (pose.apply(point), pose.turn(normal));
                grid.any_near(p, |i| surface.normals[i].dot(n) > 0.7)
            };
            samples.filter(is_near).count()
        };
        poses.iter_mut().for_each(|(count, pose)| *count = near(pose));
        poses.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
        poses.truncate(POSES);
        Self {
            near: poses.first().map_or(0, |(count, _)| *count),
            poses: poses.into_iter().map(|(_, pose)| pose).collect(),
        }
    }

    /// The share of the suspect that lies on the original, samples weighed by how near they come: from 0 to 1.
    pub(super) fn share(&self, sought: &Sought, surface: &Surface) -> f64 {
        let grid = Grid::new(&surface.points, REACHES[0]);
        let shares = self
            .poses
            .iter()
            .map(|pose| refined(sought, surface, &grid, *pose));
        shares.fold(0.0, f64::max)
    }
}

/// Places that look alike, of the suspect and of the original.
struct Pair {
    suspect: (Vec3, Vec3),
    original: (Vec3, Vec3),
}

/// To every place of the suspect the likest of the original; of these, for either size of balls, those that stand out most from others of the original: flat places are like all flat places.
fn pairs(sought: &Sought, surface: &Surface) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (suspect, original) in sought.places.iter().zip(&surface.places) {
        let mut codes = Codes::of(original);
        let likest = suspect.iter().enumerate().filter_map(|(i, place)| {
            let (ratio, best) = codes.likest(&place.code)?;
            Some((ratio, i, best))
        });
        let mut likest: Vec<(f64, usize, usize)> = likest.collect();
        likest.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        pairs.extend(likest.iter().take(PAIRS).map(|&(_, i, j)| Pair {
            suspect: (suspect[i].point, suspect[i].normal),
            original: (original[j].point, original[j].normal),
        }));
    }
    pairs
}

/// Places whose codes are compared at once.
const AT_ONCE: usize = 32;

/// The codes of an original's places, [`AT_ONCE`] of them axis by axis.
struct Codes<'a> {
    places: &'a [Place],
    chunks: Vec<[[u8; AT_ONCE]; CODE]>,
    /// Of each chunk, how much its places differ from the code that is sought, and the least of that.
    differences: Vec<[u8; AT_ONCE]>,
    least: Vec<u8>,
}

impl<'a> Codes<'a> {
    fn of(places: &'a [Place]) -> Self {
        let chunk = |places: &[Place]| {
            let mut chunk = [[0; AT_ONCE]; CODE];
            for (k, place) in places.iter().enumerate() {
                (0..CODE).for_each(|axis| chunk[axis][k] = place.code[axis]);
            }
            chunk
        };
        let chunks: Vec<_> = places.chunks(AT_ONCE).map(chunk).collect();
        Self {
            places,
            differences: vec![[0; AT_ONCE]; chunks.len()],
            least: vec![0; chunks.len()],
            chunks,
        }
    }

    /// The place whose code is the likest, and how much nearer it is than any that lies [elsewhere](ELSEWHERE): from 0, where it stands out, to 1.
    fn likest(&mut self, code: &[u8; CODE]) -> Option<(f64, usize)> {
        for (c, chunk) in self.chunks.iter().enumerate() {
            let differences = &mut self.differences[c];
            *differences = self::differences(chunk, code);
            // Places that are not there are like nothing.
            let count = (self.places.len() - c * AT_ONCE).min(AT_ONCE);
            differences[count..].fill(u8::MAX);
            self.least[c] = differences.iter().fold(u8::MAX, |least, &x| least.min(x));
        }
        let &least = self.least.iter().min()?;
        let chunk = self.least.iter().position(|&x| x == least)?;
        let best = chunk * AT_ONCE + self.differences[chunk].iter().position(|&x| x == least)?;
        let point = self.places[best].point;
        let mut other = u8::MAX;
        for (c, chunk) in self.differences.iter().enumerate() {
            if self.least[c] >= other {
                continue;
            }
            for (place, &difference) in self.places[c * AT_ONCE..].iter().zip(chunk) {
                if difference < other && (place.point - point).squared() > ELSEWHERE * ELSEWHERE {
                    other = difference;
                }
            }
        }
        Some(((f64::from(least) + 1.0) / (f64::from(other) + 1.0), best))
    }
}

/// The sums of absolute differences of bytes; what is greater than a byte is like nothing.
fn differences(codes: &[[u8; AT_ONCE]; CODE], code: &[u8; CODE]) -> [u8; AT_ONCE] {
    let mut sums = [0_u8; AT_ONCE];
    for (axis, &own) in codes.iter().zip(code) {
        for (sum, other) in sums.iter_mut().zip(axis) {
            *sum = sum.saturating_add(other.saturating_sub(own) | own.saturating_sub(*other));
        }
    }
    sums
}

/// Pairs, coordinate by coordinate, so that several are compared at a time with what a pose says.
struct Judges {
    suspect: Ends,
    original: Ends,
}

/// Points and normals.
type Ends = [[[f32; JUDGES]; 3]; 2];

/// As many as there are pairs at most.
const JUDGES: usize = 2 * PAIRS;

impl Judges {
    fn of(pairs: &[Pair]) -> Self {
        // Those that are not there agree with nothing.
        let mut judges = Self {
            suspect: [[[f32::MAX; JUDGES]; 3]; 2],
            original: [[[0.0; JUDGES]; 3]; 2],
        };
        for (k, pair) in pairs.iter().enumerate().take(JUDGES) {
            let of = |ends: &mut Ends, (point, normal): (Vec3, Vec3)| {
                for axis in 0..3 {
                    (ends[0][axis][k], ends[1][axis][k]) = (point.0[axis] as f32, normal.0[axis] as f32);
                }
            };
            of(&mut judges.suspect, pair.suspect);
            of(&mut judges.original, pair.original);
        }
        judges
    }

    /// Which pairs may lie as far from one on the suspect as on the original, and far enough: in single precision, and therefore a little more than do.
    fn alike_apart(&self, one: usize) -> [bool; JUDGES] {
        const LEAST: f32 = (0.999 * LEAST_BASE * LEAST_BASE) as f32;
        const MOST: f32 = (1.001 * STRETCH * STRETCH) as f32;
        let squares = |[points, _]: &Ends| {
            let mut squares = [0.0; JUDGES];
            for axis in points {
                for (square, x) in squares.iter_mut().zip(axis) {
                    *square += (x - axis[one]) * (x - axis[one]);
                }
            }
            squares
        };
        let (suspect, original) = (squares(&self.suspect), squares(&self.original));
        std::array::from_fn(|k| {
            let (less, more) = (suspect[k].min(original[k]), suspect[k].max(original[k]));
            less >= LEAST && more <= MOST * less
        })
    }

    /// How many agree with a pose.
    fn agreeing(&self, pose: &Pose) -> usize {
        let columns = pose.columns.map(|column| column.0.map(|x| x as f32));
        let shift = pose.shift.0.map(|x| x as f32);
        let mut squares = [0.0; JUDGES];
        let mut cosines = [0.0; JUDGES];
        let ([point, normal], [onto, along]) = (&self.suspect, &self.original);
        for axis in 0..3 {
            let turned = |v: &[[f32; JUDGES]; 3], k: usize| {
                columns[0][axis] * v[0][k] + columns[1][axis] * v[1][k] + columns[2][axis] * v[2][k]
            };
            for k in 0..JUDGES {
                let off = turned(point, k) + shift[axis] - onto[axis][k];
                squares[k] += off * off;
                cosines[k] += turned(normal, k) * along[axis][k];
            }
        }
        let agrees = |(&square, &cosine): (&f32, &f32)| square < (AGREEING * AGREEING) as f32 && cosine > 0.8;
        squares.iter().zip(&cosines).filter(|&pair| agrees(pair)).count()
    }
}

/// The poses that most pairs agree with.
fn poses(pairs: &[Pair]) -> Vec<(usize, Pose)> {
    let judges = Judges::of(pairs);
    let mut found: Vec<(usize, Pose)> = Vec::new();
    for (i, first) in pairs.iter().enumerate() {
        let apart = judges.alike_apart(i);
        let others = pairs.iter().zip(apart).skip(i + 1);
        let poses = others.filter_map(|(second, is_alike)| is_alike.then(|| pose(first, second))?);
        found.extend(poses.map(|pose| (judges.agreeing(&pose), pose)));
    }
    found.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    let mut chosen: Vec<(usize, Pose)> = Vec::new();
    for (count, pose) in found {
        let middle = pairs.first().map_or(Vec3::ZERO, |pair| pair.suspect.0);
        let is_other = |(_, other): &(usize, Pose)| {
            (other.apply(middle) - pose.apply(middle)).norm() > AGREEING
                || (0..3).any(|k| other.columns[k].dot(pose.columns[k]) < 0.95)
        };
        if chosen.len() < COMPARED && chosen.iter().all(is_other) {
            chosen.push((count, pose));
        }
    }
    chosen
}

/// The pose of two pairs, if their distances and normals agree.
fn pose(a: &Pair, b: &Pair) -> Option<Pose> {
    let (p, q) = (b.suspect.0 - a.suspect.0, b.original.0 - a.original.0);
    let (square, other) = (p.squared(), q.squared());
    if square.min(other) < LEAST_BASE * LEAST_BASE
        || square.max(other) > STRETCH * STRETCH * square.min(other)
    {
        return None;
    }
    let (p, q) = (p / square.sqrt(), q / other.sqrt());
    let angles = |line: Vec3, m: Vec3, n: Vec3| [line.dot(m), line.dot(n), m.dot(n)];
    let (of_suspect, of_original) = (
        angles(p, a.suspect.1, b.suspect.1),
        angles(q, a.original.1, b.original.1),
    );
    if of_suspect
        .iter()
        .zip(of_original)
        .any(|(x, y)| (x - y).abs() > 0.25)
    {
        return None;
    }
    let frame = |line: Vec3, normal: Vec3| {
        let across = line.cross(normal);
        (across.norm() > 0.2).then(|| [line, across.unit(), line.cross(across.unit())])
    };
    let from = frame(p, a.suspect.1 + b.suspect.1)?;
    let onto = frame(q, a.original.1 + b.original.1)?;
    let column =
        |axis: usize| onto[0] * from[0].0[axis] + onto[1] * from[1].0[axis] + onto[2] * from[2].0[axis];
    let columns = [column(0), column(1), column(2)];
    let pose = Pose {
        columns,
        shift: Vec3::ZERO,
    };
    let middle = (a.suspect.0 + b.suspect.0) * 0.5;
    let shift = (a.original.0 + b.original.0) * 0.5 - pose.apply(middle);
    Some(Pose { shift, ..pose })
}

/// The share that lies there once the pose is refined.
fn refined(sought: &Sought, surface: &Surface, grid: &Grid, mut pose: Pose) -> f64 {
    let mut best = 0.0;
    let mut nearest: Vec<Option<usize>> = vec![None; sought.samples.len()];
    for reach in REACHES {
        let (mut matrix, mut right) = ([[0.0; 7]; 7], [0.0; 7]);
        let mut share = 0.0;
        let centre =
            pose.apply(sought.samples.iter().map(|s| s.0).sum::<Vec3>() / sought.samples.len() as f64);
        for (&(point, normal), nearest) in sought.samples.iter().zip(&mut nearest) {
            let (p, n) = (pose.apply(point), pose.turn(normal));
            let is_alike = |i: usize| surface.normals[i].dot(n) > 0.3;
            // What was the nearest before is near: no other lies farther.
            let before = nearest.filter(|&i| is_alike(i));
            let farthest = before.map_or(reach, |i| (surface.points[i] - p).norm() * (1.0 + 1e-9) + 1e-12);
            *nearest = grid.nearest(p, reach.min(farthest), is_alike);
            let Some(i) = *nearest else { continue };
            let m = surface.normals[i];
            let off = m.dot(surface.points[i] - p);
            let weight = 1.0 / (1.0 + (off / HALF).powi(2));
            share += weight;
            let arm = p - centre;
            let turning = arm.cross(m);
            let row = [
                turning.0[0],
                turning.0[1],
                turning.0[2],
                m.0[0],
                m.0[1],
                m.0[2],
                m.dot(arm),
            ];
            for i in 0..7 {
                for j in 0..7 {
                    matrix[i][j] += weight * row[i] * row[j];
                }
                right[i] += weight * row[i] * off;
            }
        }
        best = f64::max(best, share / sought.samples.len() as f64);
        let trace: f64 = (0..7).map(|i| matrix[i][i]).sum();
        for (i, row) in matrix.iter_mut().enumerate() {
            row[i] += 1e-6 * trace + 1e-12;
        }
        let step = solved(matrix, right);
        pose = moved(&pose, step, centre);
    }
    best
}

/// The pose turned, shifted and stretched about a centre by small steps.
fn moved(pose: &Pose, step: [f64; 7], centre: Vec3) -> Pose {
    let turn = Vec3([step[0], step[1], step[2]]);
    let angle = turn.norm();
    let axis = turn.unit();
    let stretch = step[6].clamp(-0.1, 0.1).exp();
    let turned = |v: Vec3| {
        let (sine, cosine) = angle.sin_cos();
        (v * cosine + axis.cross(v) * sine + axis * (axis.dot(v) * (1.0 - cosine))) * stretch
    };
    let shift = turned(pose.shift - centre) + centre + Vec3([step[3], step[4], step[5]]);
    Pose {
        columns: pose.columns.map(turned),
        shift,
    }
}

/// A x = b by Cholesky's factors; A is positive definite.
fn solved(mut a: [[f64; 7]; 7], mut b: [f64; 7]) -> [f64; 7] {
    for i in 0..7 {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| a[i][k] * a[j][k]).sum();
            a[i][j] = match i == j {
                true => (a[i][i] - sum).max(1e-18).sqrt(),
                false => (a[i][j] - sum) / a[j][j],
            };
        }
    }
    for i in 0..7 {
        let sum: f64 = (0..i).map(|k| a[i][k] * b[k]).sum();
        b[i] = (b[i] - sum) / a[i][i];
    }
    for i in (0..7).rev() {
        let sum: f64 = (i + 1..7).map(|k| a[k][i] * b[k]).sum();
        b[i] = (b[i] - sum) / a[i][i];
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Descriptor, Query};
    use mesh::{Similarity, TriMesh, Welded, shapes};
    use proptest::prelude::*;

    fn turn(angles: [f64; 4]) -> Pose {
        let turn = Similarity::from_quaternion(angles);
        let column = |axis: usize| {
            let mut v = Vec3::ZERO;
            v[axis] = 1.0;
            turn.apply(v)
        };
        Pose {
            columns: [column(0), column(1), column(2)],
            shift: Vec3([0.3, -0.2, 0.1]),
        }
    }

    fn directions() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-1.0..1.0_f64)
            .prop_filter("a direction", |p| Vec3(*p).norm() > 0.2)
            .prop_map(|p| Vec3(p).unit())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn two_pairs_of_places_say_how_the_suspect_lies(a in directions(), b in directions(), m in directions(), n in directions(), angles in prop::array::uniform4(-1.0..1.0_f64)) {
            prop_assume!(angles.iter().map(|x| x * x).sum::<f64>() > 0.01);
            let truth = turn(angles);
            let pair = |point: Vec3, normal: Vec3| Pair { suspect: (point, normal), original: (truth.apply(point), truth.turn(normal)) };
            let line = (b - a).unit();
            prop_assume!((b - a).norm() > 0.1 && line.cross(m + n).norm() > 0.3);
            let found = pose(&pair(a, m), &pair(b, n)).expect("a pose");
            for p in [a, b, m] {
                prop_assert!((found.apply(p) - truth.apply(p)).norm() < 1e-9);
            }
        }

        #[test]
        fn the_true_pose_wins_although_half_of_the_pairs_are_wrong(points in prop::collection::vec((directions(), directions()), 16), wrong in prop::collection::vec((directions(), directions()), 16), angles in prop::array::uniform4(-1.0..1.0_f64)) {
            prop_assume!(angles.iter().map(|x| x * x).sum::<f64>() > 0.01);
            let truth = turn(angles);
            let right = points.iter().map(|&(p, n)| Pair { suspect: (p, n), original: (truth.apply(p), truth.turn(n)) });
            let wrong = points.iter().zip(&wrong).map(|(&suspect, &original)| Pair { suspect, original });
            let pairs: Vec<Pair> = right.chain(wrong).collect();
            let (count, best) = poses(&pairs)[0];
            prop_assert!(count >= 16);
            for (p, _) in points {
                prop_assert!((best.apply(p) - truth.apply(p)).norm() < AGREEING);
            }
        }

        #[test]
        fn solved_solves(rows in prop::array::uniform7(prop::array::uniform7(-1.0..1.0_f64)), x in prop::array::uniform7(-1.0..1.0_f64)) {
            // Rᵀ R + 1 is positive definite.
            let a: [[f64; 7]; 7] = std::array::from_fn(|i| std::array::from_fn(|j| (0..7).map(|k| rows[k][i] * rows[k][j]).sum::<f64>() + f64::from(u8::from(i == j))));
            let b = std::array::from_fn(|i| (0..7).map(|j| a[i][j] * x[j]).sum());
            for (found, x) in solved(a, b).into_iter().zip(x) {
                prop_assert!((found - x).abs() < 1e-9);
            }
        }
    }

    fn share(suspect: &TriMesh, size: usize, original: &TriMesh) -> f64 {
        let query = Query::of(suspect, &job::Job::default()).unwrap();
        let surface = Surface::of(&Descriptor::of(original).unwrap().surface).unwrap();
        Guess::of(&query.sizes[size], &surface).share(&query.sizes[size], &surface)
    }

    #[test]
    fn a_model_that_was_moved_lies_on_itself_and_not_on_another() {
        let (mesh, other) = (shapes::bumpy_torus(60, 30, 1), shapes::bumpy_torus(60, 30, 2));
        let moved = Similarity {
            scale: 3.0,
            translation: [1.0, 2.0, 3.0],
            ..Similarity::from_quaternion([0.3, -0.5, 0.2, 0.7])
        };
        let suspect = shapes::moved(&mesh, &moved);
        let (own, of_other) = (share(&suspect, 0, &mesh), share(&suspect, 0, &other));
        assert!(own > 0.8, "{own}");
        assert!(of_other < 0.7 * own, "{of_other} of {own}");
    }

    #[test]
    fn what_is_left_of_a_model_lies_on_it_in_the_right_size() {
        let mesh = shapes::bumpy_torus(60, 30, 1);
        let is_kept = |corners: &&[u32; 3]| corners.iter().all(|&v| mesh.point(v as usize).0[0] > 0.0);
        let kept: Vec<[u32; 3]> = mesh.triangles().iter().filter(is_kept).copied().collect();
        let half = Welded::new(mesh.positions(), &kept).unwrap().into_mesh();
        // Half of the area is 1.08^4.5 in roots.
        let shares: Vec<f64> = [0, 4, 5].map(|size| share(&half, size, &mesh)).to_vec();
        assert!(shares[1].max(shares[2]) > 0.7, "{shares:?}");
        assert!(shares[0] < shares[1].max(shares[2]), "{shares:?}");
    }
}
