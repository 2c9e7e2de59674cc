//! The pose of a model by its own rig, where the suspect has none of its vertices: decimated, divided, re-meshed, cropped.
//!
//! Joints are found one after the other along the rig (`growth.rs`): the first lies where the surfaces, or one joint's part of them, were aligned; each other
//! begins where its neighbour takes it, and is turned about the place between both until what it moves lies on the suspect (`placing.rs`); which lies best comes next. Then all move together, point to plane
//! (`fit.rs`). Of several beginnings the one counts by which the surfaces lie on each other best. Nothing is asked of a mark.
//!
//! Where there is no rig, nodes that lie all over the original do as joints would (`nodes.rs`). At first all move as one, as the suspect was aligned; what lies on it there takes the others along, the nearest first; those that still lie badly are placed anew from their neighbours.
//!
//! What was found is undone point by point: what lies over a point of the posed original is put over the same point of the original as it was.

mod equations;
mod fit;
mod growth;
mod nodes;
mod placing;
mod skeleton;

use job::{Job, JobError};
use mesh::{Rig, Similarity, TriMesh, Vec3};

use super::{
    Pose, Row,
    placed::seeds,
    rigid::{Blending, Motion, Rigid},
};
use crate::{
    AlignOptions, Aligner, Alignment, Placement, PreparedMesh, RegistrationError,
    local_frames::bearable,
    matrix::{Mat3, svd},
    sampled::{GRAIN, Sampled},
};
use fit::{BY_NODES, Fit, RELAXING};
use growth::Beginning;
use nodes::{Nodes, Spread};
use skeleton::Skeleton;

/// A suspect whose surface was brought back into the original's pose.
#[derive(Clone, Debug)]
pub struct UnposedSurface {
    /// Where the suspect's vertices were before it was posed (#V of the suspect), in the original's frame.
    pub positions: Vec<[f64; 3]>,
    /// Share of the suspect's surface that lies on the posed original, 0 to 1.
    pub overlap: f64,
    /// Share of the original's surface that lies on the suspect, 0 to 1.
    pub coverage: f64,
    /// Root mean square distance of what does, in diagonals of the original.
    pub residual: f64,
}

/// More joints than this are not laid on a surface: each has six unknowns, in many rounds.
const MOST_LAID: usize = 256;

/// Nodes that are spread over a bent suspect, and those that are laid on it then.
const FEW: Spread = Spread {
    nodes: 40,
    reach: 1.5,
    power: 2,
};
/// Their motions change so slowly from place to place that nothing comes of it which isn't gone with what is smooth: neither how a pose was approximated, nor what the fit took of a mark.
const MANY: Spread = Spread {
    nodes: 100,
    reach: 3.5,
    power: 4,
};

/// A bent suspect of which less lies on the original once its few nodes are laid is not it.
const LEAST_LAID: f64 = 0.5;

/// Where less of the original lies on the suspect, 0 to 1, once joints are placed, this is not its pose: of other models a third does, of the right one half and more.
const LIES: f64 = 0.35;

/// With so much of both on each other, no other pose is looked for: with a joint that lies badly, nearly as much can lie on each other.
const WHOLE: f64 = 0.98;

/// From so many of the given transforms, those at which a joint lies best, a pose is looked for.
const SEEDS: usize = 2;

/// From so many of the given transforms nodes are spread.
const SPREAD: usize = 6;

/// Parts of so many joints, the largest, are aligned each by itself; from so many of these places, the best, a pose is looked for.
const PARTS: usize = 5;
const PLACES: usize = 3;

/// Samples of each surface by which a pose is judged.
const JUDGED: usize = 4000;

/// A pose, and how well it lays the original on the suspect.
struct Found {
    pose: Rigid,
    /// The original's triangles that joints move, where the pose takes them, and which of the original's each is.
    posed: PreparedMesh,
    triangles: Vec<usize>,
    /// Shares of the suspect and of the original.
    shares: [f64; 2],
    residual: f64,
}

impl Found {
    fn score(&self) -> f64 {
        self.shares[0] + 0.25 * self.shares[1]
    }

    /// Whether so much of both lies on each other.
    fn lies(&self, share: f64) -> bool {
        self.shares[0].min(self.shares[1]) > share
    }
}

/// Brings the surface of a suspect back from the pose in which the joints of a rig had put the original; none where the rig has too many joints, or does not say where each vertex belongs. `seeds` are transforms that may take the suspect, or a part of it, to the original.
///
/// Morph targets stay as they are, and mirrored suspects are not brought back. Blind to what a mark says: only surfaces and weights are looked at.
///
/// # Errors
/// When a mesh has no area; [`RegistrationError::Job`].
pub fn unpose_surface(
    original: &PreparedMesh,
    rig: &Rig,
    suspect: &PreparedMesh,
    seeds: &[Similarity],
    job: &Job,
) -> Result<Option<UnposedSurface>, RegistrationError> {
    let fits = rig.vertices() == original.mesh().vertex_count() && (1..=MOST_LAID).contains(&rig.joints());
    if !fits {
        return Ok(None);
    }
    let skeleton = Skeleton::of(original, rig)?;
    let laying = Laying::of(original, rig, &skeleton, suspect)?;
    let mut best = laying.by_seeds(seeds, job)?;
    laying.by_parts(&mut best, job)?;
    let Some(best) = best else {
        return Ok(None);
    };
    Ok(Some(laying.unposed(&best, job)?))
}

/// Brings the surface of a suspect back that something bent, twisted or posed, and nobody knows what, from the ways in which it may lie: nodes all over the original are taken for joints, few at first, and then many. None where no way lays nodes of which half of the suspect comes to lie on the original, or the original has too few vertices. As [`unpose_surface`] otherwise.
///
/// # Errors
/// As [`unpose_surface`].
pub fn unpose_bent(
    original: &PreparedMesh,
    suspect: &PreparedMesh,
    alignment: &Alignment,
    job: &Job,
) -> Result<Option<UnposedSurface>, RegistrationError> {
    let Some(few) = Nodes::over(original.mesh(), FEW, job)? else {
        return Ok(None);
    };
    let skeleton = Skeleton::of(original, &few.rig)?;
    let mut laying = Laying::of(original, &few.rig, &skeleton, suspect)?;
    laying.fit = laying.fit.by_nodes().about(&alignment.transform);
    let seeds = unmirrored(&seeds(alignment), original.sampled("original")?);
    let Some(found) = laying.by_spreading(&seeds, job)? else {
        return Ok(None);
    };
    let Some(many) = Nodes::over(original.mesh(), MANY, job)? else {
        return Ok(None);
    };
    let motion = |&vertex: &u32| found.pose.blended_motion(few.rig.weights_of(vertex as usize));
    let joints = many.vertices.iter().map(motion).collect();
    let begun = Rigid::of_joints(Blending::DualQuaternions, joints, found.pose.scale());
    let skeleton = Skeleton::of(original, &many.rig)?;
    let mut laying = Laying::of(original, &many.rig, &skeleton, suspect)?;
    laying.fit = laying.fit.by_nodes();
    let pose = laying.fit.together(begun, &BY_NODES, job)?;
    let Some(best) = laying.judged(pose, job)? else {
        return Ok(None);
    };
    let mut unposed = laying.unposed(&best, job)?;
    unposed.overlap *= one_shape(suspect.mesh(), &unposed.positions);
    Ok(Some(unposed))
}

/// An original that is to be laid on a suspect.
struct Laying<'a> {
    original: &'a PreparedMesh,
    rig: &'a Rig,
    suspect: &'a PreparedMesh,
    fit: Fit<'a>,
}

impl<'a> Laying<'a> {
    fn of(
        original: &'a PreparedMesh,
        rig: &'a Rig,
        skeleton: &'a Skeleton<'a>,
        suspect: &'a PreparedMesh,
    ) -> Result<Self, RegistrationError> {
        Ok(Self {
            original,
            rig,
            suspect,
            fit: Fit::new(skeleton, suspect)?,
        })
    }

    /// The pose of nodes from that of the transforms that may take the suspect to the original by which it lies there best; none where too little does.
    fn by_spreading(&self, seeds: &[Similarity], job: &Job) -> Result<Option<Found>, RegistrationError> {
        let mut best: Option<(f64, Rigid)> = None;
        for seed in seeds.iter().take(SPREAD) {
            let pose = self.fit.spread(seed, job)?;
            let off = self.fit.off(&pose, job)?;
            if best.as_ref().is_none_or(|(least, _)| off < *least) {
                best = Some((off, pose));
            }
        }
        let Some((_, pose)) = best else {
            return Ok(None);
        };
        let share = |pose: &Rigid| {
            let found = self.judged(pose.clone(), job)?;
            Ok(found.map_or(0.0, |found| found.shares[0]))
        };
        let Some(pose) = self.fit.spread_on(pose, share, job)? else {
            return Ok(None);
        };
        let found = self.judged(self.fit.together(pose, &RELAXING, job)?, job)?;
        Ok(found.filter(|found| found.shares[0] > LEAST_LAID))
    }

    /// The best pose from transforms that may take the suspect, or a part of it, to the original.
    fn by_seeds(&self, seeds: &[Similarity], job: &Job) -> Result<Option<Found>, RegistrationError> {
        let mut best = None;
        let begun = seeds.iter().filter(|seed| !seed.mirrors());
        let begun = begun.filter_map(|seed| self.fit.beginning(seed, None));
        self.better(&mut best, begun.collect(), SEEDS, job)?;
        Ok(best)
    }

    /// A better pose, until one is whole, from where parts of the original are found by themselves.
    fn by_parts(&self, best: &mut Option<Found>, job: &Job) -> Result<(), RegistrationError> {
        let skeleton = self.fit.skeleton;
        let mut begun = Vec::new();
        let aligner = Aligner::new(self.suspect, &AlignOptions::default())?;
        for joint in skeleton.largest(PARTS) {
            if best.as_ref().is_some_and(|best| best.lies(WHOLE)) {
                break;
            }
            let Some(part) = skeleton.part(self.original.mesh(), joint) else {
                continue;
            };
            let placement = match aligner.find(part, &job.quiet()) {
                // Of triangles without area alone.
                Err(RegistrationError::NoSurface { .. }) => continue,
                found => found?,
            };
            if let Placement::BySurface(alignment) = placement {
                let poses = [alignment.transform].into_iter().chain(alignment.alternatives);
                let seeds = poses.map(|pose| pose.inverse()).filter(|seed| !seed.mirrors());
                begun.extend(
                    seeds
                        .take(2)
                        .filter_map(|seed| self.fit.beginning(&seed, Some(joint))),
                );
            }
        }
        self.better(best, begun, PLACES, job)
    }

    fn unposed(&self, found: &Found, job: &Job) -> Result<UnposedSurface, RegistrationError> {
        Ok(UnposedSurface {
            positions: self.undone(found, job)?,
            overlap: found.shares[0],
            coverage: found.shares[1],
            residual: found.residual,
        })
    }

    /// Looks for a pose from so many beginnings, those of which most lies on the suspect first, until one is found that is whole.
    fn better(
        &self,
        best: &mut Option<Found>,
        mut begun: Vec<Beginning>,
        most: usize,
        job: &Job,
    ) -> Result<(), RegistrationError> {
        begun.sort_by(|a, b| b.score.total_cmp(&a.score));
        for begun in begun.iter().take(most) {
            if best.as_ref().is_some_and(|best| best.lies(WHOLE)) {
                break;
            }
            let is_it = |pose: &Rigid| self.fit.lies(pose) >= LIES;
            if let Some(pose) = self.fit.grown(begun, is_it, job)?
                && let Some(found) = self.judged(pose, job)?
                && best.as_ref().is_none_or(|best| found.score() > best.score())
            {
                *best = Some(found);
            }
        }
        Ok(())
    }

    /// The original where a pose takes it, in the suspect's frame, without what no joint moves; and the original's triangles. None where a pose takes it nowhere.
    fn posed(&self, pose: &Rigid, job: &Job) -> Result<Option<(TriMesh, Vec<usize>)>, RegistrationError> {
        let mesh = self.original.mesh();
        let place = |v: usize| -> [f64; 3] {
            let row = self.fit.skeleton.row(mesh.point(v), self.rig.weights_of(v));
            (pose.moved(&row) + self.fit.centre()).into()
        };
        let positions = job.quiet().map(mesh.vertex_count(), GRAIN, place)?;
        let is_moved = |&t: &usize| {
            let corners = mesh.triangles()[t].iter();
            corners
                .clone()
                .all(|&v| !self.rig.weights_of(v as usize).is_empty())
        };
        let kept: Vec<usize> = (0..mesh.triangle_count()).filter(is_moved).collect();
        let triangles = kept.iter().map(|&t| mesh.triangles()[t]).collect();
        Ok(TriMesh::new(positions, triangles).ok().map(|posed| (posed, kept)))
    }

    /// How well a pose lays the surfaces on each other, both ways; none where it leaves no surface.
    fn judged(&self, pose: Rigid, job: &Job) -> Result<Option<Found>, RegistrationError> {
        let Some((posed, triangles)) = self.posed(&pose, job)? else {
            return Ok(None);
        };
        let posed = PreparedMesh::from(posed);
        let Ok(on_original) = posed.sampled("original") else {
            return Ok(None);
        };
        let on_suspect = self.suspect.sampled("suspect")?;
        // A suspect that is a small piece is not near everything.
        let limit = AlignOptions::default().tolerance
            * on_original.diagonal.min(pose.scale()).min(on_suspect.diagonal);
        let near = |from: &Sampled, onto: &PreparedMesh| -> Result<(f64, Vec<f64>), JobError> {
            let picked: Vec<usize> = from.some(JUDGED).collect();
            let near = job.quiet().map(picked.len(), GRAIN, |i| {
                onto.surface().nearest_within(from.points[picked[i]].0, limit)
            })?;
            let near: Vec<f64> = near.into_iter().flatten().map(|near| near.distance).collect();
            Ok((near.len() as f64 / picked.len().max(1) as f64, near))
        };
        let (of_suspect, distances) = near(on_suspect, &posed)?;
        let (of_original, _) = near(on_original, self.suspect)?;
        let squares: f64 = distances.iter().map(|distance| distance * distance).sum();
        Ok(Some(Found {
            residual: (squares / distances.len().max(1) as f64).sqrt() / pose.scale(),
            shares: [of_suspect, of_original],
            triangles,
            pose,
            posed,
        }))
    }

    /// Each vertex of the suspect over the point of the original over which it lies in the pose.
    fn undone(&self, found: &Found, job: &Job) -> Result<Vec<[f64; 3]>, RegistrationError> {
        let (mesh, skeleton) = (self.original.mesh(), self.fit.skeleton);
        let place = |v: usize| -> [f64; 3] {
            let y = self.suspect.mesh().point(v);
            let near = found.posed.surface().nearest(y.0);
            let (t, foot) = (near.triangle as usize, Vec3(near.point));
            let shares = barycentric(found.posed.mesh().corners(t), foot);
            let corners = mesh.triangles()[found.triangles[t]];
            let before: Vec3 = (0..3).map(|i| mesh.point(corners[i] as usize) * shares[i]).sum();
            // What the suspect has over the foot is turned back with the corner that is nearest.
            let nearest = (0..3)
                .max_by(|&i, &j| shares[i].total_cmp(&shares[j]))
                .unwrap_or(0);
            let corner = corners[nearest] as usize;
            let at = |y: Vec3| Row {
                y: y - self.fit.centre(),
                ..skeleton.row(mesh.point(corner), self.rig.weights_of(corner))
            };
            let steps = [y, foot].map(|y| found.pose.undone(&at(y)));
            let over = match steps {
                [Some(to), Some(from)] => (to - from) * skeleton.diagonal(),
                _ => Vec3::ZERO,
            };
            (before + over).into()
        };
        Ok(job
            .quiet()
            .map(self.suspect.mesh().vertex_count(), GRAIN, place)?)
    }
}

/// Transforms that don't mirror, each that did reflected once more at each of the original's principal planes: what was bent may lie better mirrored than as it is.
fn unmirrored(seeds: &[Similarity], original: &Sampled) -> Vec<Similarity> {
    let axes = svd(&original.covariance).right.0;
    let reflected = |axis: Vec3| {
        let Mat3(mut rotation) = Mat3::IDENTITY;
        let twice = Mat3::outer(axis * 2.0, axis);
        (0..3).for_each(|i| rotation[i] -= twice.0[i]);
        Similarity {
            rotation: Mat3(rotation).rows(),
            translation: (axis * (2.0 * axis.dot(original.centroid))).into(),
            ..Similarity::IDENTITY
        }
    };
    let proper = |seed: &Similarity| match seed.mirrors() {
        false => vec![*seed],
        true => axes.map(|axis| seed.then(&reflected(axis))).to_vec(),
    };
    seeds.iter().flat_map(proper).collect()
}

/// The share of a suspect's area that is [no other shape](bearable) than it was where it came from.
fn one_shape(suspect: &TriMesh, before: &[[f64; 3]]) -> f64 {
    let edges = |positions: &[[f64; 3]], corners: &[u32; 3]| {
        let [p, q, r] = corners.map(|v| Vec3(positions[v as usize]));
        [q - p, r - p]
    };
    let of_triangle = |corners: &[u32; 3]| {
        let after = edges(suspect.positions(), corners);
        let stretch = stretch(edges(before, corners), after).unwrap_or_default();
        (after[0].cross(after[1]).norm(), stretch)
    };
    let (areas, stretches): (Vec<f64>, Vec<[f64; 2]>) = suspect.triangles().iter().map(of_triangle).unzip();
    let (mut own, mut all) = (0.0, 0.0);
    for (area, is_bearable) in areas.into_iter().zip(bearable(&stretches)) {
        all += if is_bearable.is_some() { area } else { 0.0 };
        own += if is_bearable == Some(true) { area } else { 0.0 };
    }
    own / f64::max(all, f64::MIN_POSITIVE)
}

/// The singular values of the map between two edges of a triangle before and after, the larger first; none where there is none.
fn stretch(before: [Vec3; 2], after: [Vec3; 2]) -> Option<[f64; 2]> {
    let products = |[a, b]: [Vec3; 2]| [a.squared(), a.dot(b), b.squared()];
    let ([e, f, g], [p, q, r]) = (products(before), products(after));
    let [from, to] = [e * g - f * f, p * r - q * q];
    // The eigenvalues of the metric after beside that before.
    let mean = 0.5 * (g * p - 2.0 * f * q + e * r) / from;
    let apart = (mean * mean - to / from).max(0.0).sqrt();
    let [most, least] = [mean + apart, mean - apart].map(|square| square.max(0.0).sqrt());
    (from > 0.0 && least > 0.0 && most.is_finite()).then_some([most, least])
}

/// The weights of a triangle's corners at a point in its plane; a third each where it has no area.
fn barycentric([a, b, c]: [Vec3; 3], p: Vec3) -> [f64; 3] {
    let normal = (b - a).cross(c - a);
    let doubled = normal.squared();
    if doubled <= 0.0 {
        return [1.0 / 3.0; 3];
    }
    let of = |u: Vec3, v: Vec3| (u - p).cross(v - p).dot(normal) / doubled;
    let (first, second) = (of(b, c), of(c, a));
    [first, second, 1.0 - first - second]
}

/// Both ways in which joints are blended.
const BLENDINGS: [Blending; 2] = [Blending::Linear, Blending::DualQuaternions];

#[cfg(test)]
mod tests {
    use mesh::shapes;

    use super::{
        fit::{COARSE, turned_about},
        *,
    };

    /// A long body with bumps.
    fn body(divisions: u32) -> TriMesh {
        let mesh = shapes::bumpy_sphere(divisions, 7);
        let long = |&[x, y, z]: &[f64; 3]| [4.0 * x, y, 0.8 * z + 0.1 * x * y];
        mesh.with_positions(mesh.positions().iter().map(long).collect())
            .unwrap()
    }

    /// Four joints along a mesh, each with a part that it moves alone, and the mesh with each joint turned by so much against the one before.
    fn posed(angle: f64, mesh: &TriMesh) -> (Rig, TriMesh) {
        posed_by(angle, mesh, |share| share)
    }

    /// Joints share what lies between them as a function of 0 to 1 says.
    fn posed_by(angle: f64, mesh: &TriMesh, shared: impl Fn(f64) -> f64) -> (Rig, TriMesh) {
        let bounds = mesh.bounding_box();
        let weights = |p: &[f64; 3]| {
            let at = (p[0] - bounds.min[0]) / bounds.size()[0] * 4.0;
            let joint = (at - 0.5).floor().clamp(0.0, 2.0);
            let share = shared((3.0 * (at - joint - 1.0) + 0.5).clamp(0.0, 1.0));
            let weights = [(joint as u32, 1.0 - share), (joint as u32 + 1, share)];
            weights.into_iter().filter(|&(_, share)| share > 0.0).collect()
        };
        let rig = Rig::new(&mesh.positions().iter().map(weights).collect::<Vec<_>>());
        let turned = |joint: u32, p: Vec3| {
            (0..joint).rev().fold(p, |p, before| {
                let pivot = Vec3::X * (bounds.min[0] + bounds.size()[0] * f64::from(before + 1) / 4.0);
                let (sin, cos) = angle.sin_cos();
                let Vec3([x, y, z]) = p - pivot;
                pivot + Vec3([cos * x - sin * z, y, sin * x + cos * z])
            })
        };
        let place = |v: usize| -> [f64; 3] {
            let moved = rig.weights_of(v).iter();
            let moved = moved.map(|&(joint, share)| turned(joint, mesh.point(v)) * share);
            (moved.sum::<Vec3>() * 7.0).into()
        };
        let positions = (0..mesh.vertex_count()).map(place).collect();
        (rig, mesh.with_positions(positions).unwrap())
    }

    /// The same surface by a third of the triangles.
    fn coarser(mesh: &TriMesh) -> TriMesh {
        let job = Job::default();
        decimation::decimate(
            mesh,
            mesh.triangle_count() / 3,
            decimation::Decimator::ALL[0],
            &job,
        )
        .unwrap()
    }

    #[test]
    fn a_surface_without_the_originals_vertices_comes_back_from_its_pose() {
        let original = PreparedMesh::from(body(5));
        let diagonal = original.mesh().bounding_box().diagonal();
        // The last as of robots: each vertex has one joint.
        let whole = |share: f64| share.round();
        let posed = [
            (0.1, posed(0.1, original.mesh())),
            (0.4, posed(0.4, original.mesh())),
            (0.3, posed_by(0.3, original.mesh(), whole)),
        ];
        for (angle, (rig, suspect)) in posed {
            let suspect = PreparedMesh::from(coarser(&suspect));
            let aligner = Aligner::new(&original, &AlignOptions::default()).unwrap();
            let Placement::BySurface(alignment) = aligner.find(&suspect, &Job::default()).unwrap() else {
                panic!("vertices were found")
            };
            let found = unpose_surface(&original, &rig, &suspect, &[alignment.transform], &Job::default());
            let found = found.unwrap().unwrap();
            let shares = [found.overlap, found.coverage];
            assert!(shares.iter().all(|share| *share > 0.95), "{angle}: {shares:?}");
            let off = |p: &[f64; 3]| original.surface().nearest(*p).distance / diagonal;
            let mut off: Vec<f64> = found.positions.iter().map(off).collect();
            off.sort_by(f64::total_cmp);
            let [middle, most] = [0.5, 0.95].map(|share| off[(share * off.len() as f64) as usize]);
            assert!(middle < 2e-4 && most < 1e-3, "{angle}: {middle} {most}");
        }
    }

    /// Blended linearly, what lies between joints that turn so far would fall in.
    #[test]
    fn joints_that_turn_far_are_found_as_dual_quaternions_blend_them() {
        let original = PreparedMesh::from(body(5));
        let (rig, _) = posed(0.0, original.mesh());
        let skeleton = Skeleton::of(&original, &rig).unwrap();
        let mut joints = vec![Motion::of(Mat3::IDENTITY, Vec3::ZERO)];
        for joint in 1..4 {
            let link = skeleton
                .links
                .iter()
                .find(|link| link.joints == [joint - 1, joint]);
            joints.push(turned_about(
                &joints[joint - 1],
                link.unwrap().pivot,
                Vec3([2.4, 0.0, 0.4]),
            ));
        }
        let pose = Rigid::of_joints(Blending::DualQuaternions, joints, 7.0);
        let place = |v: usize| {
            let row = skeleton.row(original.mesh().point(v), rig.weights_of(v));
            pose.moved(&row).into()
        };
        let places = (0..original.mesh().vertex_count()).map(place).collect();
        let suspect = coarser(&original.mesh().with_positions(places).unwrap());
        let suspect = PreparedMesh::from(suspect);
        let seed = Similarity {
            scale: skeleton.diagonal() / 7.0,
            ..Similarity::IDENTITY
        };
        let found = unpose_surface(&original, &rig, &suspect, &[seed], &Job::default()).unwrap();
        let found = found.unwrap();
        assert!(
            found.overlap.min(found.coverage) > 0.98,
            "{} {}",
            found.overlap,
            found.coverage
        );
    }

    #[test]
    fn what_was_turned_and_scaled_is_one_shape_and_what_was_pulled_to_four_times_the_length_is_not() {
        let mesh = body(3);
        let similarity = Similarity {
            scale: 5.0,
            translation: [1.0, 2.0, 3.0],
            ..Similarity::from_quaternion([0.9, 0.3, -0.2, 0.1])
        };
        let moved = shapes::moved(&mesh, &similarity);
        assert!((one_shape(&moved, mesh.positions()) - 1.0).abs() < 1e-12);
        let after = [Vec3::X * 3.0, Vec3::X * 3.0 + Vec3::Y * 0.5];
        let [most, least] = stretch([Vec3::X, Vec3::Y], after).unwrap();
        // Of the matrix (3 3; 0 ½) the singular values have this product and this sum of squares.
        assert!((most * least - 1.5).abs() < 1e-12 && (most * most + least * least - 18.25).abs() < 1e-12);
        let half = |&[x, y, z]: &[f64; 3]| [if x > 0.0 { 4.0 * x } else { x }, y, z];
        let pulled = mesh
            .with_positions(mesh.positions().iter().map(half).collect())
            .unwrap();
        let share = one_shape(&pulled, mesh.positions());
        assert!(0.2 < share && share < 0.6, "{share}");
    }

    /// Three of four joints lie exactly: beside what these leave, the last is far off.
    #[test]
    fn a_joint_that_lies_badly_is_pulled_where_it_belongs() {
        let original = PreparedMesh::from(body(5));
        let (rig, suspect) = posed(0.0, original.mesh());
        let suspect = PreparedMesh::from(suspect);
        let skeleton = Skeleton::of(&original, &rig).unwrap();
        let fit = Fit::new(&skeleton, &suspect).unwrap();
        let there = Motion::of(Mat3::IDENTITY, Vec3::ZERO);
        let mut pose = Rigid::of_joints(Blending::Linear, vec![there; 4], 7.0 * skeleton.diagonal());
        assert!(fit.lies(&pose) > 0.999);
        let last = skeleton.links.iter().find(|link| link.joints == [2, 3]).unwrap();
        pose.set_joint(3, turned_about(&there, last.pivot, Vec3([0.0, 0.15, 0.0])));
        assert!(fit.lies(&pose) < 0.9);
        let pulled = fit.together(pose, &COARSE, &Job::default()).unwrap();
        assert!(fit.lies(&pulled) > 0.999, "{}", fit.lies(&pulled));
    }

    #[test]
    fn another_rig_and_another_model_bring_nothing_back() {
        let original = PreparedMesh::from(body(4));
        let other = PreparedMesh::from(shapes::bumpy_torus(60, 30, 3));
        let (rig, _) = posed(0.3, original.mesh());
        let of_other = unpose_surface(&original, &rig, &other, &[Similarity::IDENTITY], &Job::default());
        assert!(of_other.unwrap().is_none_or(|found| found.overlap < 0.8));
        let (foreign, _) = posed(0.3, other.mesh());
        let found = unpose_surface(&original, &foreign, &other, &[], &Job::default());
        assert!(found.unwrap().is_none());
    }

    #[test]
    fn what_no_joint_moves_is_passed_over() {
        let body = body(4);
        let away = shapes::moved(
            &body,
            &Similarity {
                translation: [0.0, 9.0, 0.0],
                ..Similarity::IDENTITY
            },
        );
        let (rig, suspect) = posed(0.3, &body);
        let weights = (0..body.vertex_count()).map(|v| rig.weights_of(v).to_vec());
        let rig = Rig::new(
            &weights
                .chain(vec![Vec::new(); away.vertex_count()])
                .collect::<Vec<_>>(),
        );
        let count = body.vertex_count() as u32;
        let positions = body.positions().iter().chain(away.positions()).copied().collect();
        let others = away.triangles().iter().map(|corners| corners.map(|v| v + count));
        let triangles = body.triangles().iter().copied().chain(others).collect();
        let both = PreparedMesh::from(TriMesh::new(positions, triangles).unwrap());
        let seed = Similarity {
            scale: 1.0 / 7.0,
            ..Similarity::IDENTITY
        };
        let suspect = PreparedMesh::from(suspect);
        let found = unpose_surface(&both, &rig, &suspect, &[seed], &Job::default())
            .unwrap()
            .unwrap();
        assert!(found.overlap > 0.95, "{}", found.overlap);
    }
}
