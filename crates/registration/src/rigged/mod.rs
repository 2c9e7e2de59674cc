//! The pose of a model by its own rig.
//!
//! With linear blend skinning a posed vertex is y = Σⱼ wⱼ Aⱼ (x + Σₖ cₖ dₖ), linear in the joints' affine maps Aⱼ (3 × 4), and for given maps in how far each morph target is taken, cₖ: robust least squares over all vertices
//! finds both (`linear.rs`). Mostly joints turn and move and do no more, which takes six numbers each in place of twelve; programs that preserve volume blend such motions as dual quaternions. Both are found from there
//! (`rigid.rs`). Whichever explains the suspect with the fewest unknowns is undone, vertex by vertex.
//! A few numbers a joint and one a target are few beside the vertices that they move, so a mark stays; nothing is assumed smooth.

mod linear;
mod placed;
mod rigid;
mod surface;

pub use placed::{UnposedSuspect, unpose_placed};
pub use surface::{UnposedSurface, unpose_bent, unpose_surface};

use std::collections::HashMap;

use job::{Job, JobError};
use mesh::{Rig, TriMesh, Vec3};

use crate::Correspondence;
use linear::Linear;
use rigid::{Blending, Rigid};

/// A suspect brought back into the original's pose.
#[derive(Clone, Debug)]
pub struct Unposed {
    /// Where the suspect's vertices were before it was posed (#V of the suspect); those of no partner stay. In the original's frame.
    pub positions: Vec<[f64; 3]>,
    /// The partners whose place could be undone: others were folded away.
    pub map: Correspondence,
    /// The median distance of posed vertices from where the rig takes them, in diagonals of the original.
    pub residual: f64,
}

/// More unknowns than this are not solved for: joints and targets are tens, rarely hundreds.
const MOST_JOINTS: usize = 512;
const MOST_TARGETS: usize = 512;

/// So many times the median, a vertex fits no pose, whichever.
const OUTLIER: f64 = 5.0;

/// Farther from the original's middle, in diagonals, nothing is brought back.
const FARTHEST: f64 = 100.0;

/// Fewer vertices say nothing of a pose.
const FEWEST_VERTICES: usize = 12;

/// Brings a suspect, whose vertices were found again, back into the original's pose; none where the rig has too many joints or targets, or says nothing of enough vertices, or folded them all away.
///
/// Blind to what a mark says: only places and weights are looked at.
///
/// # Errors
/// When the job was cancelled.
pub fn unpose(
    original: &TriMesh,
    rig: &Rig,
    suspect: &TriMesh,
    map: &Correspondence,
    job: &Job,
) -> Result<Option<Unposed>, JobError> {
    let fits = rig.vertices() == original.vertex_count()
        && (1..=MOST_JOINTS).contains(&rig.joints())
        && rig.targets().len() <= MOST_TARGETS;
    if !fits {
        return Ok(None);
    }
    let pairs = Pairs::of(original, rig, suspect, map);
    if pairs.rows.len() < FEWEST_VERTICES {
        return Ok(None);
    }
    let Some(linear) = Linear::fit(&pairs, job)? else {
        return Ok(None);
    };
    let mut explained = vec![pairs.explained(&linear, suspect, map)];
    let mut before = None;
    for blending in [Blending::Linear, Blending::DualQuaternions] {
        if let Some(rigid) = Rigid::fit(&pairs, blending, &linear, before.as_ref(), job)? {
            explained.push(pairs.explained(&rigid, suspect, map));
            before = Some(rigid);
        }
    }
    let found = simplest(explained);
    Ok(found.filter(|found| found.map.matched() >= FEWEST_VERTICES))
}

/// What a pose makes of a suspect.
struct Explained {
    /// How far each vertex is from where the pose takes it.
    distances: Vec<f64>,
    unknowns: usize,
    unposed: Unposed,
}

/// The one that takes the fewest numbers to say where the vertices are (Schwarz's criterion): 3 n ln(residual) + ½ k ln(3 n). Of the residual, root mean square, no vertex has more than one that clearly fits no pose: with many unknowns the median
/// would be small where half of the vertices are met exactly and the others missed.
fn simplest(explained: Vec<Explained>) -> Option<Unposed> {
    let medians = explained.iter().map(|one| median(one.distances.clone()));
    let most = OUTLIER * medians.fold(0.0, f64::max);
    let length = |one: &Explained| {
        let squares = one.distances.iter().map(|distance| distance.min(most).powi(2));
        let mean = squares.sum::<f64>() / one.distances.len().max(1) as f64;
        let numbers = 3.0 * one.distances.len() as f64;
        numbers * 0.5 * (mean + (1e-7 * most).powi(2) + f64::MIN_POSITIVE).ln()
            + 0.5 * one.unknowns as f64 * numbers.ln()
    };
    let best = explained
        .iter()
        .map(length)
        .enumerate()
        .min_by(|a, b| a.1.total_cmp(&b.1))?
        .0;
    explained.into_iter().nth(best).map(|one| one.unposed)
}

/// As [`unpose`], by whichever of several maps of the suspect's vertices its rig explains best, or by [the order](Correspondence::by_order) of both files' triangles: where pieces are alike, the places of a posed suspect don't
/// say which is which.
///
/// # Errors
/// When the job was cancelled.
pub fn unpose_any(
    original: &TriMesh,
    rig: &Rig,
    suspect: &TriMesh,
    maps: &[Correspondence],
    job: &Job,
) -> Result<Option<Unposed>, JobError> {
    let mut best: Option<Unposed> = None;
    let by_order = Correspondence::by_order(original, suspect).filter(|map| !maps.contains(map));
    for map in maps.iter().chain(&by_order) {
        let found = unpose(original, rig, suspect, map, job)?;
        let is_better = |found: &Unposed| best.as_ref().is_none_or(|best| found.residual < best.residual);
        best = found.filter(is_better).or(best);
    }
    Ok(best)
}

impl Unposed {
    /// The positions, with those vertices that could not be brought back laid between their neighbours; and how many these are. Pieces of which no vertex was brought back stay.
    pub fn completed(&self, suspect: &TriMesh) -> (Vec<[f64; 3]>, usize) {
        let mut positions = self.positions.clone();
        let mut is_there = vec![false; positions.len()];
        for &partner in self.map.suspect_of.iter().flatten() {
            is_there[partner as usize] = true;
        }
        let missing = is_there.iter().filter(|is_there| !**is_there).count();
        loop {
            let mut sums = HashMap::<u32, (Vec3, f64)>::new();
            for corners in suspect.triangles() {
                for (i, &v) in corners
                    .iter()
                    .enumerate()
                    .filter(|&(_, &v)| !is_there[v as usize])
                {
                    let others = [corners[(i + 1) % 3], corners[(i + 2) % 3]];
                    for other in others.into_iter().filter(|&other| is_there[other as usize]) {
                        let (sum, count) = sums.entry(v).or_default();
                        *sum += Vec3(positions[other as usize]);
                        *count += 1.0;
                    }
                }
            }
            if sums.is_empty() {
                return (positions, missing);
            }
            for (v, (sum, count)) in sums {
                positions[v as usize] = (sum * (1.0 / count)).into();
                is_there[v as usize] = true;
            }
        }
    }
}

/// One vertex in both poses.
struct Row<'a> {
    vertex: usize,
    /// In the original, from its centre, in diagonals.
    x: Vec3,
    /// In the suspect, from its centre.
    y: Vec3,
    weights: &'a [(u32, f64)],
    /// What the morph targets add to `x`.
    offsets: Vec<(u32, Vec3)>,
}

impl Row<'_> {
    /// Where the vertex is before joints move it, with the targets taken so far.
    fn place(&self, shape: &[f64]) -> Vec3 {
        self.x + self.offset(shape)
    }

    fn offset(&self, shape: &[f64]) -> Vec3 {
        let moved = self.offsets.iter();
        moved
            .map(|&(target, offset)| offset * shape[target as usize])
            .sum()
    }
}

/// All vertices that have a partner and a joint.
struct Pairs<'a> {
    rows: Vec<Row<'a>>,
    joints: usize,
    targets: usize,
    diagonal: f64,
    centre: Vec3,
    /// Of the suspect, root mean square.
    size: f64,
}

/// Where a rig takes vertices.
trait Pose {
    /// Where a row's vertex is taken.
    fn moved(&self, row: &Row<'_>) -> Vec3;

    /// Where a row's vertex comes from, if that can be told.
    fn undone(&self, row: &Row<'_>) -> Option<Vec3>;

    /// By how much it scales.
    fn scale(&self) -> f64;

    /// How many numbers it has.
    fn unknowns(&self) -> usize;
}

impl<'a> Pairs<'a> {
    fn of(original: &TriMesh, rig: &'a Rig, suspect: &TriMesh, map: &Correspondence) -> Self {
        let diagonal = original.bounding_box().diagonal();
        let found = map.suspect_of.iter().enumerate().take(rig.vertices());
        let mut offsets = vec![Vec::new(); rig.vertices()];
        for (number, target) in (0..).zip(rig.targets()) {
            for &(vertex, offset) in target {
                offsets[vertex as usize].push((number, Vec3(offset) * (1.0 / diagonal)));
            }
        }
        let mut rows: Vec<Row<'a>> = found
            .filter_map(|(vertex, partner)| {
                let weights = rig.weights_of(vertex);
                let y = Vec3(suspect.positions()[(*partner)? as usize]);
                let x = original.point(vertex) * (1.0 / diagonal);
                (!weights.is_empty()).then_some(Row {
                    vertex,
                    x,
                    y,
                    weights,
                    offsets: std::mem::take(&mut offsets[vertex]),
                })
            })
            .collect();
        let mean = |of: fn(&Row<'_>) -> Vec3| {
            let sum = rows.iter().map(of).fold(Vec3([0.0; 3]), |sum, v| sum + v);
            sum * (1.0 / rows.len().max(1) as f64)
        };
        let (centre, suspect_centre) = (mean(|row| row.x), mean(|row| row.y));
        for row in &mut rows {
            row.x -= centre;
            row.y -= suspect_centre;
        }
        let squares: f64 = rows.iter().map(|row| row.y.squared()).sum();
        Self {
            size: (squares / rows.len().max(1) as f64).sqrt(),
            joints: rig.joints(),
            targets: rig.targets().len(),
            rows,
            diagonal,
            centre,
        }
    }

    /// How far a pose leaves each vertex from where it is.
    fn distances(&self, pose: &impl Pose) -> Vec<f64> {
        self.rows
            .iter()
            .map(|row| (pose.moved(row) - row.y).norm())
            .collect()
    }

    fn explained(&self, pose: &impl Pose, suspect: &TriMesh, map: &Correspondence) -> Explained {
        Explained {
            distances: self.distances(pose),
            unknowns: pose.unknowns(),
            unposed: self.undone(pose, suspect, map),
        }
    }

    /// Whether a pose leaves no more than rounding.
    fn is_exact(&self, median: f64) -> bool {
        median <= 1e-14 * self.size
    }

    /// The suspect before it was posed.
    fn undone(&self, pose: &impl Pose, suspect: &TriMesh, map: &Correspondence) -> Unposed {
        let mut positions = suspect.positions().to_vec();
        let mut found = vec![None; map.suspect_of.len()];
        for row in &self.rows {
            let before = pose.undone(row).filter(|x| x.norm() < FARTHEST);
            if let (Some(x), Some(partner)) = (before, map.suspect_of[row.vertex]) {
                positions[partner as usize] = ((x + self.centre) * self.diagonal).into();
                found[row.vertex] = Some(partner);
            }
        }
        Unposed {
            positions,
            map: Correspondence { suspect_of: found },
            residual: median(self.distances(pose)) / pose.scale(),
        }
    }
}

/// Welsch's weights by distances, in four times their median, which comes with them. Narrower, unknowns that are many fit half of the vertices exactly and leave out the others.
fn robust_weights(distances: Vec<f64>) -> (Vec<f64>, f64) {
    let median = median(distances.clone());
    let weight = |distance: f64| {
        let beside = 0.25 * distance / median.max(f64::MIN_POSITIVE);
        (-0.5 * beside * beside).exp()
    };
    (distances.into_iter().map(weight).collect(), median)
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use mesh::{MorphTarget, shapes};

    use super::{linear::Affine, *};

    const JOINTS: usize = 5;

    fn brought_back(original: &TriMesh, rig: &Rig, suspect: &TriMesh, map: &Correspondence) -> Unposed {
        unpose(original, rig, suspect, map, &Job::default())
            .unwrap()
            .unwrap()
    }

    /// A torus that bends at five places, and hats as weights.
    fn rigged() -> (TriMesh, Rig) {
        let mesh = shapes::bumpy_torus(60, 40, 1);
        let weights = |p: &[f64; 3]| {
            let turn = (p[1].atan2(p[0]) / std::f64::consts::TAU + 0.5) * JOINTS as f64;
            let (joint, share) = (turn.floor(), turn.fract());
            let [here, next] = [joint as u32, joint as u32 + 1].map(|joint| joint % JOINTS as u32);
            vec![(here, 1.0 - share), (next, share)]
        };
        let rig = Rig::new(&mesh.positions().iter().map(weights).collect::<Vec<_>>());
        (mesh, rig)
    }

    fn turned(axis: usize, angle: f64, offset: f64) -> Affine {
        let (sin, cos) = angle.sin_cos();
        let mut columns = [[0.0; 3]; 3];
        columns[axis][axis] = 1.0;
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
        (columns[a][a], columns[a][b], columns[b][a], columns[b][b]) = (cos, sin, -sin, cos);
        let [a, b, c] = columns.map(|column| Vec3(column) * 3.0);
        [a, b, c, Vec3([10.0 * offset, -offset, offset])]
    }

    fn posed(mesh: &TriMesh, rig: &Rig, angle: f64) -> TriMesh {
        let joint = |j: usize| turned(j % 3, angle * (j as f64 - 2.0) / 2.0, j as f64);
        let pose: Vec<Affine> = (0..JOINTS).map(joint).collect();
        let place = |v: usize| skinned(&pose, rig.weights_of(v), mesh.point(v)).into();
        mesh.with_positions((0..mesh.vertex_count()).map(place).collect())
            .unwrap()
    }

    fn skinned(pose: &[Affine], weights: &[(u32, f64)], x: Vec3) -> Vec3 {
        let moved = |&(joint, weight): &(u32, f64)| {
            let [a, b, c, t] = pose[joint as usize];
            (a * x.0[0] + b * x.0[1] + c * x.0[2] + t) * weight
        };
        weights.iter().map(moved).sum()
    }

    fn identity(vertices: usize) -> Correspondence {
        Correspondence {
            suspect_of: (0..vertices as u32).map(Some).collect(),
        }
    }

    #[test]
    fn a_pose_is_undone_and_what_was_marked_before_it_stays() {
        let (mesh, rig) = rigged();
        let diagonal = mesh.bounding_box().diagonal();
        // A mark of alternating sign, which no joint can imitate.
        let mark = |v: usize| 4e-4 * diagonal * if (v * 7919) % 13 < 6 { 1.0 } else { -1.0 };
        let marked = (0..mesh.vertex_count()).map(|v| (mesh.point(v) * (1.0 + mark(v))).into());
        let marked = mesh.with_positions(marked.collect()).unwrap();
        for angle in [0.0, 1.0, 2.0] {
            let suspect = posed(&marked, &rig, angle);
            let map = identity(mesh.vertex_count());
            let found = brought_back(&mesh, &rig, &suspect, &map);
            let (mut wrong, mut sizes) = (0.0, 0.0);
            for v in (0..mesh.vertex_count()).filter(|&v| found.map.suspect_of[v].is_some()) {
                wrong += (Vec3(found.positions[v]) - marked.point(v)).squared();
                sizes += (marked.point(v) - mesh.point(v)).squared();
            }
            assert!(found.map.matched() > mesh.vertex_count() * 19 / 20);
            assert!(wrong < 0.05 * sizes, "angle {angle}: {wrong} of {sizes}");
            assert!(found.residual < 1e-3 * diagonal);
        }
    }

    #[test]
    fn vertices_that_were_not_found_are_laid_between_their_neighbours() {
        let (mesh, rig) = rigged();
        let suspect = posed(&mesh, &rig, 1.0);
        let mut map = identity(mesh.vertex_count());
        (300..330).for_each(|v| map.suspect_of[v] = None);
        let found = brought_back(&mesh, &rig, &suspect, &map);
        let (positions, missing) = found.completed(&suspect);
        assert!((30..60).contains(&missing), "{missing}");
        let diagonal = mesh.bounding_box().diagonal();
        for (v, place) in positions.iter().enumerate() {
            assert!((Vec3(*place) - mesh.point(v)).norm() < 0.1 * diagonal);
        }
    }

    #[test]
    fn pieces_that_are_alike_are_told_by_the_order_of_the_triangles() {
        let one = shapes::icosphere(2);
        let count = one.vertex_count();
        let pieces: Vec<TriMesh> = (0..5)
            .map(|i| shapes::translated(&one, [3.0 * f64::from(i), 0.0, 0.0]))
            .collect();
        let mesh = shapes::disjoint_union(&pieces);
        let rig = Rig::new(
            &(0..5 * count)
                .map(|v| vec![((v / count) as u32, 1.0)])
                .collect::<Vec<_>>(),
        );
        let pose = Rigid::for_tests(Blending::Linear, 5, 1.0, false, &[]);
        let true_map = identity(5 * count);
        let pairs = Pairs::of(&mesh, &rig, &mesh, &true_map);
        let suspect = mesh
            .with_positions(pairs.rows.iter().map(|row| pose.moved(row).into()).collect())
            .unwrap();
        let map = Correspondence::by_order(&mesh, &suspect).unwrap();
        assert_eq!(map, true_map);
        let mut turned = true_map.clone();
        turned.suspect_of.rotate_left(17);
        let found = unpose_any(&mesh, &rig, &suspect, &[turned], &Job::default())
            .unwrap()
            .unwrap();
        assert!(found.residual < 1e-9 && found.map == true_map);
        assert_eq!(Correspondence::by_order(&mesh, &shapes::shuffled(&mesh, 3)), None);
    }

    #[test]
    fn another_shape_of_the_same_net_is_not_explained() {
        let (mesh, rig) = rigged();
        let other = shapes::bumpy_torus(60, 40, 2);
        let suspect = posed(&other, &rig, 1.0);
        let found = brought_back(&mesh, &rig, &suspect, &identity(mesh.vertex_count()));
        assert!(found.residual > 1e-3, "{}", found.residual);
    }

    #[test]
    fn a_joint_of_one_vertex_and_a_flat_part_are_no_trouble() {
        let (mesh, _) = rigged();
        let flat = |p: &[f64; 3]| [p[0], p[1], 0.0];
        let flat = mesh
            .with_positions(mesh.positions().iter().map(flat).collect())
            .unwrap();
        let weights = |v| vec![(u32::from(v > 0) + u32::from(v > 1000), 1.0)];
        let rig = Rig::new(&(0..mesh.vertex_count()).map(weights).collect::<Vec<_>>());
        let found = brought_back(
            &flat,
            &rig,
            &shapes::scaled(&flat, 5.0),
            &identity(mesh.vertex_count()),
        );
        assert!(found.residual < 1e-7, "{}", found.residual);
    }

    #[test]
    fn motions_that_were_blended_as_dual_quaternions_are_undone_exactly_also_mirrored() {
        let (mesh, rig) = rigged();
        let map = identity(mesh.vertex_count());
        for mirrors in [false, true] {
            let pose = Rigid::for_tests(Blending::DualQuaternions, JOINTS, 1.2, mirrors, &[]);
            check_undone(&mesh, &rig, &pose, &map);
        }
    }

    fn check_undone(mesh: &TriMesh, rig: &Rig, pose: &Rigid, map: &Correspondence) {
        let pairs = Pairs::of(mesh, rig, mesh, map);
        let moved = pairs.rows.iter().map(|row| pose.moved(row).into()).collect();
        let suspect = mesh.with_positions(moved).unwrap();
        let found = brought_back(mesh, rig, &suspect, map);
        assert!(found.residual < 1e-9, "{}", found.residual);
        for (v, place) in found.positions.iter().enumerate() {
            assert!((Vec3(*place) - mesh.point(v)).norm() < 1e-7);
        }
    }

    /// Two that bulge, one that is the first again, and one that a joint could do.
    fn with_targets(mesh: &TriMesh, rig: Rig) -> Rig {
        let bulge = |v: usize, by: f64| (v as u32, (mesh.point(v) * by).into());
        let all = 0..mesh.vertex_count();
        let some: MorphTarget = all.clone().filter(|v| v % 7 < 3).map(|v| bulge(v, 0.3)).collect();
        let few: MorphTarget = (100..180).map(|v| bulge(v, -0.2)).collect();
        let shift = all.map(|v| (v as u32, [0.1, 0.0, 0.2])).collect();
        rig.with_targets([some.clone(), few, some, shift])
    }

    #[test]
    fn morph_targets_are_undone_with_the_joints_also_such_as_say_the_same_twice() {
        let (mesh, rig) = rigged();
        let rig = with_targets(&mesh, rig);
        let map = identity(mesh.vertex_count());
        for blending in [Blending::Linear, Blending::DualQuaternions] {
            for shape in [[0.7, 0.0, 0.0, 0.0], [0.3, -1.0, 0.4, 0.5]] {
                let pose = Rigid::for_tests(blending, JOINTS, 0.9, false, &shape);
                check_undone(&mesh, &rig, &pose, &map);
            }
        }
    }

    #[test]
    fn joints_that_only_turn_take_six_numbers_each() {
        let (mesh, rig) = rigged();
        let map = identity(mesh.vertex_count());
        let diagonal = mesh.bounding_box().diagonal();
        let pose = Rigid::for_tests(Blending::Linear, JOINTS, 1.2, false, &[]);
        let pairs = Pairs::of(&mesh, &rig, &mesh, &map);
        // What is not the pose's: noise, as a mark is.
        let noise = |v: usize| ((v * 7919 % 13) as f64 / 13.0 - 0.5) * 1e-3 * diagonal;
        let moved = pairs
            .rows
            .iter()
            .map(|row| (pose.moved(row) + Vec3([noise(row.vertex); 3])).into());
        let suspect = mesh.with_positions(moved.collect()).unwrap();
        let pairs = Pairs::of(&mesh, &rig, &suspect, &map);
        let affine = Linear::fit(&pairs, &Job::default()).unwrap().unwrap();
        let rigid = Rigid::fit(&pairs, Blending::Linear, &affine, None, &Job::default())
            .unwrap()
            .unwrap();
        assert!(rigid.unknowns() < 6 * JOINTS + 2 && affine.unknowns() == 12 * JOINTS);
        let poses = vec![
            pairs.explained(&affine, &suspect, &map),
            pairs.explained(&rigid, &suspect, &map),
        ];
        let rigid = poses[1].unposed.positions.clone();
        assert_eq!(simplest(poses).unwrap().positions, rigid);
    }
}
