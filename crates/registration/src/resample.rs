//! The suspect's surface seen from the original's vertices (section 4.4.1 of the paper).

use job::{Job, JobError};
use mesh::{Edges, Hit, Similarity, Surface, TriMesh, Vec3};

use crate::{PreparedMesh, RegistrationError, error::check_option, matrix::Mat3, sampled::GRAIN};

/// How far and at what angle a vertex looks for the suspect's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResampleOptions {
    /// Farthest offset along the normal, as a fraction of the original's bounding-box diagonal.
    pub reach: f64,
    /// Least cosine between the original's normal and that of the surface that is met. Keeps the far side of
    /// thin parts out.
    pub facing: f64,
}

impl Default for ResampleOptions {
    fn default() -> Self {
        Self {
            reach: 0.01,
            facing: 0.1,
        }
    }
}

/// What each vertex of the original sees of the suspect.
#[derive(Clone, Debug, PartialEq)]
pub struct Resampled {
    /// Signed distance along the vertex normal to the suspect, in the original's unit; none where nothing was
    /// met.
    pub offsets: Vec<Option<f64>>,
    /// The suspect's triangle that was met.
    pub triangles: Vec<Option<u32>>,
    /// Whether the suspect's triangles face the other way than the original's.
    pub inside_out: bool,
    /// Whether the suspect's orientation is consistent enough for [`ResampleOptions::facing`] to have been
    /// applied.
    pub oriented: bool,
}

impl Resampled {
    /// The resampled mesh's vertices: v + h n where the suspect was met, and the original's vertex elsewhere,
    /// as the paper has it.
    pub fn positions(&self, original: &TriMesh) -> Vec<[f64; 3]> {
        let vertices = original.positions().iter().zip(original.vertex_normals());
        let moved = vertices
            .zip(&self.offsets)
            .map(|((&v, n), h)| (Vec3(v) + Vec3(n) * h.unwrap_or(0.0)).0);
        moved.collect()
    }
}

/// Shoots a line along the angle-weighted normal of every vertex of the original, both ways, and takes the
/// nearest hit.
///
/// `transform` takes the suspect to the original. A hit farther than the reach does not count, nor one whose
/// surface faces another way (by more than the angle allowed), since that is the other side of a thin part.
/// The suspect may be inside out as a whole; if it faces no way in particular, as a heap of unoriented
/// triangles does, the facing is not asked. A sheet that was made solid has two walls, one on either side of the
/// original: one of them is seen throughout. Vertices without a normal see nothing.
///
/// # Errors
/// When an option is out of range; [`RegistrationError::Job`].
///
/// ```
/// use mesh::{Similarity, shapes};
/// let (options, job) = Default::default();
/// let original = shapes::icosphere(3);
/// let smaller = shapes::scaled(&original, 0.999);
/// let seen = registration::resample(&original, &smaller, &Similarity::IDENTITY, &options, &job)?;
/// assert!(seen.offsets.iter().all(|h| (h.unwrap() + 0.001).abs() < 1e-5));
/// # Ok::<(), registration::RegistrationError>(())
/// ```
pub fn resample(
    original: impl Into<PreparedMesh>,
    suspect: impl Into<PreparedMesh>,
    transform: &Similarity,
    options: &ResampleOptions,
    job: &Job,
) -> Result<Resampled, RegistrationError> {
    check(options)?;
    let (original, suspect) = (original.into(), suspect.into());
    let lines = Lines {
        job,
        suspect: suspect.mesh(),
        origins: original.mesh().positions(),
        directions: original.vertex_normals(),
        surface: suspect.surface(),
        normals: suspect.triangle_normals(),
        to_original: *transform,
        to_suspect: transform.inverse(),
        reach: options.reach * original.mesh().bounding_box().diagonal(),
    };
    Ok(lines.shoot(options.facing)?)
}

fn check(options: &ResampleOptions) -> Result<(), RegistrationError> {
    let &ResampleOptions { reach, facing } = options;
    let fits = reach > 0.0 && reach.is_finite();
    check_option("reach", reach, fits, "greater than 0")?;
    let fits = (-1.0..=1.0).contains(&facing);
    check_option("facing", facing, fits, "between -1 and 1")
}

/// Lines through the original's vertices, and the surface in its own frame.
struct Lines<'a> {
    suspect: &'a TriMesh,
    origins: &'a [[f64; 3]],
    directions: &'a [[f64; 3]],
    surface: &'a Surface,
    normals: &'a [[f64; 3]],
    to_original: Similarity,
    to_suspect: Similarity,
    reach: f64,
    job: &'a Job,
}

/// Vertices between two reports of progress.
const CHUNK: usize = 4 * GRAIN;

/// Of the nearest hits, so many must agree on a side before the facing is asked: triangles without orientation agree by half,
/// a model with most of its surface in order by nearly all.
const ORIENTED: f64 = 0.75;

/// Of the edges between two triangles, so many must be passed in opposite directions by these before the suspect is taken for oriented.
const CONSISTENT: f64 = 0.9;

impl Lines<'_> {
    fn shoot(&self, facing: f64) -> Result<Resampled, JobError> {
        let nearest = self.hits(|v| self.hit(v, |_| true))?;
        let outward = |(v, hit): (usize, &Option<Hit>)| hit.map(|hit| self.cosine(v, hit.triangle) > 0.0);
        let sides: Vec<bool> = nearest.iter().enumerate().filter_map(outward).collect();
        let outward = sides.iter().filter(|&&side| side).count();
        let inside_out = 2 * outward < sides.len();
        let majority = outward.max(sides.len() - outward);
        let oriented = majority as f64 >= ORIENTED * sides.len() as f64 || is_oriented(self.suspect);
        let hits = if oriented {
            let sign = if inside_out { -1.0 } else { 1.0 };
            self.hits(|v| {
                let faces = |t: u32| sign * self.cosine(v, t) >= facing;
                // Most nearest hits face the right way; only the others are looked for again.
                nearest[v].and_then(|hit| {
                    if faces(hit.triangle) {
                        Some(hit)
                    } else {
                        self.hit(v, faces)
                    }
                })
            })?
        } else {
            nearest
        };
        Ok(Resampled {
            offsets: hits.iter().map(|hit| hit.map(|hit| hit.t)).collect(),
            triangles: hits.iter().map(|hit| hit.map(|hit| hit.triangle)).collect(),
            inside_out,
            oriented,
        })
    }

    /// The hit of each vertex.
    fn hits(&self, hit: impl Fn(usize) -> Option<Hit> + Sync + Send) -> Result<Vec<Option<Hit>>, JobError> {
        self.job.map_reported(self.origins.len(), CHUNK, hit)
    }

    /// The nearest accepted hit of a vertex's line; t in the original's unit.
    fn hit(&self, v: usize, accept: impl Fn(u32) -> bool) -> Option<Hit> {
        let origin = self.to_suspect.apply(self.origins[v]);
        let direction = Mat3::from(self.to_suspect.rotation) * self.direction(v) * self.to_suspect.scale;
        self.surface.hit(origin, direction.0, self.reach, accept)
    }

    /// Between a vertex's normal and that of a suspect triangle moved onto the original.
    fn cosine(&self, v: usize, triangle: u32) -> f64 {
        let normal = Vec3(self.normals[triangle as usize]);
        self.direction(v)
            .dot(Mat3::from(self.to_original.rotation) * normal)
    }

    fn direction(&self, v: usize) -> Vec3 {
        Vec3(self.directions[v])
    }
}

/// Whether neighbouring triangles face the same side, but for a few.
fn is_oriented(mesh: &TriMesh) -> bool {
    let edges = Edges::of(mesh);
    let (mut inner, mut alike) = (0_usize, 0_usize);
    for (e, &[a, b]) in edges.vertices().iter().enumerate() {
        let &[one, other] = edges.triangles(e) else {
            continue;
        };
        let is_along = |t: u32| {
            let corners = mesh.triangles()[t as usize];
            (0..3).any(|i| [corners[i], corners[(i + 1) % 3]] == [a, b])
        };
        inner += 1;
        alike += usize::from(is_along(one) != is_along(other));
    }
    inner > 0 && alike as f64 >= CONSISTENT * inner as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    fn turned() -> Similarity {
        Similarity {
            scale: 20.0,
            translation: [1.0, -2.0, 3.0],
            ..Similarity::from_quaternion([1.0, 0.4, -0.3, 2.0])
        }
    }

    /// A plate of thickness 0.01, one diagonal long.
    fn plate() -> TriMesh {
        let sheet = shapes::rectangle(8, 8, 1.0, 1.0);
        let top = shapes::translated(&sheet, [0.0, 0.0, 0.01]);
        shapes::disjoint_union(&[top, shapes::inside_out(&sheet)])
    }

    fn seeing(seen: &Resampled) -> usize {
        seen.offsets.iter().flatten().count()
    }

    #[test]
    fn a_moved_copy_is_seen_at_offset_zero_by_every_vertex() {
        let original = shapes::bumpy_torus(24, 16, 3);
        let suspect = shapes::moved(&original, &turned());
        let seen = resample(
            &original,
            &suspect,
            &turned().inverse(),
            &ResampleOptions::default(),
            &Job::default(),
        )
        .unwrap();
        assert!(seen.offsets.iter().all(|h| h.expect("seen").abs() < 1e-13));
        assert!(seen.oriented && !seen.inside_out);
        for (p, q) in seen.positions(&original).iter().zip(original.positions()) {
            assert!((Vec3(*p) - Vec3(*q)).norm() < 1e-13);
        }
    }

    #[test]
    fn an_offset_surface_is_seen_at_its_offset_in_the_unit_of_the_original() {
        let original = shapes::rectangle(5, 5, 1.0, 1.0);
        let lifted = shapes::translated(&original, [0.0, 0.0, 0.003]);
        let suspect = shapes::moved(&lifted, &turned());
        let seen = resample(
            &original,
            &suspect,
            &turned().inverse(),
            &ResampleOptions::default(),
            &Job::default(),
        )
        .unwrap();
        let inner = seen.offsets.iter().flatten();
        assert!(inner.clone().count() >= 16 && inner.clone().all(|h| (h - 0.003).abs() < 1e-14));
    }

    /// Of a sheet with a wall on either side, half of the nearest hits would be on each.
    #[test]
    fn of_a_sheet_that_was_made_solid_one_wall_is_seen() {
        let sheet = shapes::rectangle(8, 8, 1.0, 1.0);
        let lifted = |by: f64| shapes::translated(&sheet, [0.0, 0.0, by]);
        // Which of the two is nearer changes from place to place.
        let uneven = |mesh: &TriMesh| {
            let wave = |p: &[f64; 3]| [p[0], p[1], p[2] + 0.001 * (9.0 * p[0]).sin() * (7.0 * p[1]).cos()];
            mesh.with_positions(mesh.positions().iter().map(wave).collect())
                .unwrap()
        };
        let solid = shapes::disjoint_union(&[
            uneven(&lifted(0.003)),
            shapes::inside_out(&uneven(&lifted(-0.003))),
        ]);
        let (options, job) = (ResampleOptions::default(), Job::default());
        let seen = resample(&sheet, &solid, &Similarity::IDENTITY, &options, &job).unwrap();
        assert!(seen.oriented);
        let offsets: Vec<f64> = seen.offsets.iter().flatten().copied().collect();
        assert!(offsets.len() >= 49, "the wall has no rim");
        assert!(
            offsets.iter().all(|h| h.signum() == offsets[0].signum()),
            "{offsets:?}"
        );
    }

    #[test]
    fn what_is_cut_away_is_missing_and_keeps_the_originals_vertex() {
        let original = shapes::bumpy_sphere(3, 1);
        let left: Vec<_> = (0..original.triangle_count())
            .filter(|&t| original.corners(t).iter().all(|p| p[0] < 0.0))
            .map(|t| original.triangles()[t])
            .collect();
        let suspect = TriMesh::new(original.positions().to_vec(), left).unwrap();
        let seen = resample(
            &original,
            &suspect,
            &Similarity::IDENTITY,
            &ResampleOptions::default(),
            &Job::default(),
        )
        .unwrap();
        let positions = seen.positions(&original);
        for (v, p) in original.positions().iter().enumerate() {
            assert!(p[0] < 0.0 || seen.offsets[v].is_none());
            assert!((Vec3(positions[v]) - Vec3(*p)).norm() < 1e-13);
        }
        assert!(seeing(&seen) > original.vertex_count() / 3);
    }

    #[test]
    fn the_far_side_of_a_thin_part_is_not_mistaken_for_the_near_one() {
        let original = plate();
        // The top is gone: its vertices could only meet the bottom, which faces the other way.
        let bottom = shapes::inside_out(&shapes::rectangle(8, 8, 1.0, 1.0));
        let mirrored_bottom = shapes::inside_out(&bottom);
        for (suspect, inside_out) in [(plate(), false), (shapes::inside_out(&plate()), true)] {
            let seen = resample(
                &original,
                &suspect,
                &Similarity::IDENTITY,
                &ResampleOptions::default(),
                &Job::default(),
            )
            .unwrap();
            assert_eq!((seen.inside_out, seen.oriented), (inside_out, true));
            assert!(
                seen.offsets.iter().flatten().all(|h| h.abs() < 1e-15)
                    && seeing(&seen) == original.vertex_count()
            );
        }
        // With most of the surface present, the facing is known, and one sheet's loss is noticed.
        let rest = shapes::translated(&shapes::bumpy_sphere(3, 1), [5.0, 0.0, 0.0]);
        let original = shapes::disjoint_union(&[original, rest.clone()]);
        for (sheet, seen_top) in [(bottom, false), (mirrored_bottom, true)] {
            let suspect = shapes::disjoint_union(&[sheet, rest.clone()]);
            let seen = resample(
                &original,
                &suspect,
                &Similarity::IDENTITY,
                &ResampleOptions::default(),
                &Job::default(),
            )
            .unwrap();
            assert_eq!(seen.offsets[..81].iter().any(Option::is_some), seen_top);
            assert_eq!(seen.offsets[81..162].iter().any(Option::is_some), !seen_top);
        }
    }

    #[test]
    fn mirrored_and_inside_out_copies_are_seen_and_told() {
        let original = shapes::bumpy_sphere(2, 1);
        let mirror = Similarity {
            rotation: [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            ..Similarity::IDENTITY
        };
        // `mirrored` keeps the surface facing outward, so moving it back by a mirror keeps it so.
        let suspect = shapes::mirrored(&original);
        let (options, job) = (ResampleOptions::default(), Job::default());
        let seen = resample(&original, &suspect, &mirror, &options, &job).unwrap();
        assert_eq!((seeing(&seen), seen.inside_out), (original.vertex_count(), false));
        let seen = resample(&original, shapes::inside_out(&suspect), &mirror, &options, &job).unwrap();
        assert_eq!((seeing(&seen), seen.inside_out), (original.vertex_count(), true));
    }

    #[test]
    fn threads_change_nothing() {
        let (original, suspect) = (shapes::bumpy_sphere(3, 1), shapes::bumpy_sphere(3, 2));
        let with = |threads| {
            let options = ResampleOptions {
                reach: 0.1,
                ..Default::default()
            };
            let job = Job::new(threads);
            resample(&original, &suspect, &Similarity::IDENTITY, &options, &job).unwrap()
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn options_out_of_range_are_named() {
        let ball = shapes::icosphere(0);
        for options in [
            ResampleOptions {
                reach: 0.0,
                ..Default::default()
            },
            ResampleOptions {
                reach: f64::NAN,
                ..Default::default()
            },
            ResampleOptions {
                facing: 1.5,
                ..Default::default()
            },
        ] {
            let result = resample(&ball, &ball, &Similarity::IDENTITY, &options, &Job::default());
            assert!(matches!(result, Err(RegistrationError::Option { .. })));
        }
    }
}
