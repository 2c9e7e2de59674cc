use std::{borrow::Cow, ops::RangeInclusive};

use job::Job;
use mesh::{BoundingBox, Similarity, Vec3};
use registration::{Correspondence, PreparedMesh, ResampleOptions, Resampled, resample};

use super::{
    Reading, ReadingMethod,
    quadrics::{self, Asked},
    regions::Regions,
    tessellation,
};
use crate::mark::{Bending, JointEstimate, MarkError, MarkLayout, MarkStage, Registered};

/// A suspect, looked at from the vertices of a reference in any pose (section 4.4.1).
///
/// A pose is a transform to the reference's frame.
///
/// ```
/// use mesh::{Similarity, shapes};
/// use sigmark::mark::Reader;
///
/// let (original, suspect) = (shapes::bumpy_sphere(3, 1), shapes::flipped(&shapes::bumpy_sphere(3, 1), 5));
/// let suspect = Reader::new(&original)?.surface(&suspect);
/// assert_eq!(suspect.sample(&Similarity::IDENTITY, &Default::default())?.missing(), 0.0);
/// # Ok::<(), sigmark::mark::MarkError>(())
/// ```
pub struct Suspect {
    reference: PreparedMesh,
    mesh: PreparedMesh,
    seen_by: SeenBy,
}

/// A suspect under a pose, where it is not yet told where decimation puts vertices.
pub(super) struct Sampled {
    pub(super) pose: Similarity,
    pub(super) registered: Registered,
    /// What was met along normals; none where every vertex was found again.
    pub(super) surface: Option<Resampled>,
}

/// What of a suspect is looked at.
#[derive(Clone)]
pub(super) enum SeenBy {
    /// The vertices, all of which were found again.
    Vertices(Correspondence),
    /// The vertices that were found again, elsewhere the surface along the normal.
    Surface(Option<Correspondence>),
}

/// What was seen of a suspect in a pose, and what follows from it.
struct Round<'s> {
    pose: Similarity,
    /// The suspect before space was bent, if it was.
    unbent: Option<Suspect>,
    registered: Cow<'s, Registered>,
    estimate: JointEstimate,
}

/// What samples tell of a decimated suspect in the pose in which it was found, if that leaves bits open: [draws of its regions](Suspect::read_by_draws) go on from here. Samples of few triangles find bends of space that are none.
pub(super) struct Undecided {
    registered: Registered,
    estimate: JointEstimate,
}

/// Where a pose is off by less, in diagonals, lines along normals meet the suspect nearly where they should.
const SETTLED: f64 = 5e-4;

/// As a share of the noise.
const NEGLIGIBLE: f64 = 0.1;

/// Where samples tell more of a bit in the mean, it is not worth a while to draw regions.
const ENOUGH: f64 = 0.9;

/// Fields of a bending that may be told in the pose in which a suspect was found: where space is bent, lines along normals meet it elsewhere than they should, and a first look tells the coarsest of it.
const COARSEST: RangeInclusive<usize> = 0..=Bending::OF_DEGREE_2;

/// How often a suspect is sampled at most, and one that is bent: lines along normals meet that far from where they should at first.
const MOST_ROUNDS: [usize; 2] = [2, 4];

impl<'s> Round<'s> {
    /// In the pose in which a suspect was found.
    fn first(sampled: &Sampled, registered: &'s Registered, estimate: JointEstimate) -> Self {
        Self {
            pose: sampled.pose,
            unbent: None,
            registered: Cow::Borrowed(registered),
            estimate,
        }
    }

    /// The pose by this round's estimate.
    fn better(&self) -> Similarity {
        self.pose.then(&self.estimate.misalignment.inverse())
    }

    fn is_bent(&self) -> bool {
        self.unbent.is_some() || self.estimate.bending.is_some()
    }

    fn reading(&self, layout: &MarkLayout) -> Reading {
        Reading::of(layout, &self.registered, self.better(), &self.estimate)
    }
}

impl Suspect {
    pub(super) fn new(reference: PreparedMesh, mesh: PreparedMesh, seen_by: SeenBy) -> Self {
        Self {
            reference,
            mesh,
            seen_by,
        }
    }

    /// The suspect under a pose, at each vertex of the reference.
    ///
    /// # Errors
    /// [`MarkError::Job`].
    pub fn sample(&self, pose: &Similarity, job: &Job) -> Result<Registered, MarkError> {
        let everywhere = vec![true; self.reference.mesh().vertex_count()];
        let asked = Asked {
            vertices: &everywhere,
            layout: None,
        };
        let sampled = self.sampled(pose, job)?;
        Ok(self.foretold(&sampled, asked, job)?.into_owned())
    }

    /// The same without where decimation puts vertices, which takes longer than all else: positions alone, as the paper's rule reads them.
    ///
    /// # Errors
    /// As [`sample`](Self::sample).
    pub fn sample_positions(&self, pose: &Similarity, job: &Job) -> Result<Registered, MarkError> {
        Ok(self.sampled(pose, job)?.registered)
    }

    /// The suspect under a pose, but for where decimation puts a vertex.
    pub(super) fn sampled(&self, pose: &Similarity, job: &Job) -> Result<Sampled, MarkError> {
        match &self.seen_by {
            SeenBy::Vertices(map) => Ok(Sampled {
                pose: *pose,
                registered: carried(map, &self.mesh, pose),
                surface: None,
            }),
            SeenBy::Surface(survivors) => self.sample_surface(survivors.as_ref(), pose, job),
        }
    }

    /// Whether the suspect is clearly coarser than the reference where it was seen.
    pub(super) fn is_coarser(&self, sampled: &Sampled) -> bool {
        quadrics::is_coarser(self.reference.mesh(), self.mesh.mesh(), &sampled.registered)
    }

    /// The same, with where decimation puts vertices, at vertices of the reference that are asked for: that takes longer than all else.
    fn foretold<'s>(
        &self,
        sampled: &'s Sampled,
        asked: Asked<'_>,
        job: &Job,
    ) -> Result<Cow<'s, Registered>, MarkError> {
        quadrics::foretold(&self.reference, &self.mesh, sampled, asked, job)
    }

    /// Reads the bits in a pose that is nearly right, and betters it.
    ///
    /// The joint estimate sees the mark as noise to the pose; what is left is of second order in the error. Where that is not
    /// negligible, the suspect is sampled again.
    ///
    /// # Errors
    /// As [`Detector::detect`](crate::mark::Detector::detect).
    pub fn read(&self, method: &ReadingMethod, pose: &Similarity, job: &Job) -> Result<Reading, MarkError> {
        job.begin(MarkStage::Resampling)?;
        let sampled = self.sampled(pose, job)?;
        let (by_samples, undecided) = self.read_sampled(method, &sampled, job)?;
        let by_draws = match &undecided {
            Some(undecided) => self.read_by_draws(method, &sampled, undecided, job)?,
            None => None,
        };
        Ok(by_draws.unwrap_or(by_samples))
    }

    /// As [`read`](Self::read), of what was sampled in a pose, without draws; and what that leaves open.
    pub(super) fn read_sampled(
        &self,
        method: &ReadingMethod,
        sampled: &Sampled,
        job: &Job,
    ) -> Result<(Reading, Option<Undecided>), MarkError> {
        job.begin(MarkStage::Resampling)?;
        let layout = method.layout();
        let is_read = layout.is_read();
        let asked = Asked::by(method, &is_read);
        let estimator = method.estimator();
        // One thread alone tells much of what is foretold.
        let (registered, ()) = job.join(|| self.foretold(sampled, asked, job), || estimator.prepare())?;
        let registered = registered?;
        job.begin(MarkStage::Detection)?;
        let estimate = estimator.estimate_with(&registered, &COARSEST, job)?;
        if let Some(detector) = method.detector() {
            let better = sampled.pose.then(&estimate.misalignment.inverse());
            let registered = self.sample_again(&better, asked, job)?;
            let soft = detector.detect(&registered, job)?;
            let reading = Reading::of(layout, &registered, better, &estimate).with_soft(soft);
            return Ok((reading, None));
        }
        let first = Round::first(sampled, &registered, estimate.clone());
        let last = self.bettered(method, first, None, asked, job)?;
        let reading = last.reading(layout);
        let is_open = asked.layout.is_some() && last.estimate.tells() < ENOUGH;
        let undecided = match registered {
            Cow::Owned(registered) if is_open => Some(Undecided { registered, estimate }),
            // What is hardly coarser than the original leaves nothing to draw.
            _ => None,
        };
        Ok((reading, undecided))
    }

    /// What draws of its regions tell of a suspect that samples left undecided; none where nothing is drawn.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub(super) fn read_by_draws(
        &self,
        method: &ReadingMethod,
        sampled: &Sampled,
        by_samples: &Undecided,
        job: &Job,
    ) -> Result<Option<Reading>, MarkError> {
        job.begin(MarkStage::Resampling)?;
        let is_read = method.layout().is_read();
        let asked = Asked::by(method, &is_read);
        let Some(draws) = quadrics::draws(&self.reference, &self.mesh, sampled, asked, job)? else {
            return Ok(None);
        };
        job.begin(MarkStage::Detection)?;
        let Undecided { registered, estimate } = by_samples;
        let by_draws = self.estimated_by(&draws, method, &sampled.pose, registered, &COARSEST, job)?;
        let first = Round::first(sampled, registered, estimate.clone().or(by_draws));
        let last = self.bettered(method, first, Some(&draws), asked, job)?;
        Ok(Some(last.reading(method.layout())))
    }

    /// What is seen in the poses that the estimates of one round after the other better, by draws of regions, too, if there are some.
    fn bettered<'s>(
        &self,
        method: &ReadingMethod,
        mut last: Round<'s>,
        draws: Option<&[Regions]>,
        asked: Asked<'_>,
        job: &Job,
    ) -> Result<Round<'s>, MarkError> {
        let mut rounds = 1;
        while rounds < MOST_ROUNDS[usize::from(last.is_bent())] {
            rounds += 1;
            let pose = last.better();
            let bending = last.estimate.bending.as_ref();
            let step = self.farthest(&last.pose, &pose) + bending.map_or(0.0, |bending| self.bent(bending));
            if step < SETTLED && step * step < NEGLIGIBLE * last.estimate.noise {
                break;
            }
            let unbent = match bending {
                Some(bending) => Some(last.unbent.as_ref().unwrap_or(self).unbent(bending, &pose)?),
                None => last.unbent.take(),
            };
            let seen = unbent.as_ref().unwrap_or(self);
            let registered = seen.sample_again(&pose, asked, job)?;
            let optional = bending.map_or(0, Bending::fields)..=Bending::MOST;
            let mut estimate = method.estimator().estimate_with(&registered, &optional, job)?;
            if let Some(draws) = draws {
                let by_draws = seen.estimated_by(draws, method, &pose, &registered, &optional, job)?;
                estimate = estimate.or(by_draws);
            }
            last = Round {
                pose,
                unbent,
                registered: Cow::Owned(registered),
                estimate,
            };
        }
        Ok(last)
    }

    /// The joint estimate in a pose by the suspect's vertices and draws of their regions.
    fn estimated_by(
        &self,
        draws: &[Regions],
        method: &ReadingMethod,
        pose: &Similarity,
        registered: &Registered,
        optional: &RangeInclusive<usize>,
        job: &Job,
    ) -> Result<JointEstimate, MarkError> {
        let balances = quadrics::balances(&self.reference, &self.mesh, pose, method.layout(), draws, job)?;
        method
            .estimator()
            .estimate_by(&balances, registered, optional, job)
    }

    /// The suspect before space was bent, that lies on the reference in a pose.
    fn unbent(&self, bending: &Bending, pose: &Similarity) -> Result<Self, MarkError> {
        let (mesh, back) = (self.mesh.mesh(), pose.inverse());
        let before = |&p: &[f64; 3]| back.apply(bending.undone(pose.apply(p)));
        let positions = mesh.positions().iter().map(before).collect();
        Ok(Self {
            reference: self.reference.clone(),
            mesh: mesh.with_positions(positions)?.into(),
            seen_by: self.seen_by.clone(),
        })
    }

    /// What is sampled in a pose, with where decimation puts vertices.
    fn sample_again(&self, pose: &Similarity, asked: Asked<'_>, job: &Job) -> Result<Registered, MarkError> {
        job.begin(MarkStage::Resampling)?;
        let sampled = self.sampled(pose, job)?;
        let registered = self.foretold(&sampled, asked, job)?.into_owned();
        job.begin(MarkStage::Detection)?;
        Ok(registered)
    }

    /// How far a bending moves the corners of the reference's bounding box at most, in its diagonals.
    fn bent(&self, bending: &Bending) -> f64 {
        let bounds = self.reference.mesh().bounding_box();
        let moved = corners(&bounds).map(|p| (Vec3(bending.undone(p.into())) - p).norm());
        moved.into_iter().fold(0.0, f64::max) / bounds.diagonal()
    }

    /// How far two poses lay the suspect apart, in diagonals of the reference.
    fn farthest(&self, a: &Similarity, b: &Similarity) -> f64 {
        let apart = corners(&self.mesh.mesh().bounding_box()).map(|p| (a.apply(p) - b.apply(p)).norm());
        let farthest = apart.into_iter().fold(0.0, f64::max);
        farthest / self.reference.mesh().bounding_box().diagonal()
    }

    fn sample_surface(
        &self,
        survivors: Option<&Correspondence>,
        pose: &Similarity,
        job: &Job,
    ) -> Result<Sampled, MarkError> {
        let (reference, suspect) = (self.reference.mesh(), self.mesh.mesh());
        let options = ResampleOptions::default();
        let sampled = resample(&self.reference, &self.mesh, pose, &options, &job.quiet())?;
        let mut registered = Registered::by_vertices(vec![None; reference.vertex_count()]);
        registered.suspect_vertices = suspect.vertex_count();
        for (v, offset) in sampled.offsets.iter().enumerate() {
            if let Some(survivor) = survivors.and_then(|map| map.suspect_of[v]) {
                let place = suspect.positions()[survivor as usize];
                registered.positions[v] = Some(pose.apply(place));
            } else if let (Some(offset), Some(triangle)) = (*offset, sampled.triangles[v]) {
                let normal = Vec3(self.reference.vertex_normals()[v]);
                registered.positions[v] = Some((reference.point(v) + normal * offset).into());
                let facing = tessellation::normal(suspect, triangle as usize);
                let facing = Vec3(pose.rotation.map(|row| Vec3(row).dot(facing)));
                registered.along[v] = Some(gradient(normal, facing).into());
            }
        }
        let is_resampled = registered.along.iter().any(Option::is_some);
        if is_resampled {
            registered.tessellation_bias =
                tessellation::bias(&self.reference, suspect, &registered, &sampled, pose, job)?;
        }
        Ok(Sampled {
            pose: *pose,
            registered,
            surface: is_resampled.then_some(sampled),
        })
    }
}

fn corners(BoundingBox { min, max }: &BoundingBox) -> [Vec3; 8] {
    std::array::from_fn(|i| Vec3(std::array::from_fn(|axis| [min, max][i >> axis & 1][axis])))
}

/// A suspect whose vertices correspond to the reference's by a map, under a pose.
pub(super) fn carried(map: &Correspondence, suspect: &PreparedMesh, pose: &Similarity) -> Registered {
    let places = map.carry(suspect.mesh()).into_iter();
    Registered::by_vertices(places.map(|place| place.map(|p| pose.apply(p))).collect())
}

/// Steeper triangles are taken for this steep: their slope says little about the surface.
const STEEPEST: f64 = 0.5;

/// How the offset along a line with direction n grows when the plane that it meets moves: f / (f·n) for a plane with
/// normal f, on either side.
fn gradient(n: Vec3, f: Vec3) -> Vec3 {
    let length = f.norm();
    let cosine = f.dot(n) / length;
    if cosine.abs() >= STEEPEST {
        f / (length * cosine)
    } else {
        n
    }
}

#[cfg(test)]
mod tests {
    use std::{cell::RefCell, sync::Arc};

    use decimation::{Decimator, decimate};
    use mesh::{TriMesh, shapes};

    use super::*;
    use crate::mark::{
        ChipPlan, JointEstimator, MarkLayout, Original, Reader, SoftBits, Strength, Wanted, correlation,
    };

    /// Where a mark lies, its bits, and the model with it.
    fn marked() -> (Arc<MarkLayout>, Vec<bool>, TriMesh) {
        let (mesh, bits, job) = (shapes::bumpy_sphere(6, 3), 64, Job::default());
        let original = Original::pooled(mesh.clone(), bits, Default::default(), &job).unwrap();
        original.keep_a_gigabyte();
        let layout = MarkLayout::with_strength(
            original.into(),
            ChipPlan::pooled(bits, [1; 32]),
            Strength::default(),
        );
        let layout = Arc::new(layout.unwrap());
        let written: Vec<bool> = (0..bits).map(|t| t % 3 == 0).collect();
        let marked = layout.write(&written, &job).unwrap().positions(layout.original());
        (layout, written, mesh.with_positions(marked).unwrap())
    }

    fn decimated(marked: &TriMesh, decimator: Decimator) -> TriMesh {
        decimate(marked, marked.triangle_count() / 25, decimator, &Job::default()).unwrap()
    }

    fn margin(written: &[bool], soft: &SoftBits) -> f64 {
        let t = correlation(written, soft.values());
        t / (1.0 - t * t / written.len() as f64).max(1e-3).sqrt()
    }

    #[test]
    fn balances_of_draws_tell_more_of_a_decimated_suspect_than_samples() {
        let ((layout, written, marked), job) = (marked(), Job::default());
        let mesh = layout.original().mesh();
        let reader = Reader::new(mesh).unwrap();
        let everywhere = vec![true; mesh.vertex_count()];
        let read = |decimator: Decimator| -> [Option<f64>; 2] {
            let suspect = reader.surface(decimated(&marked, decimator));
            let asked = Asked {
                vertices: &everywhere,
                layout: Some(&layout),
            };
            let sampled = suspect.sampled(&Similarity::IDENTITY, &job).unwrap();
            let seen = suspect.foretold(&sampled, asked, &job).unwrap();
            let estimator = JointEstimator::new(&layout);
            let by_samples = estimator.estimate(&seen, &job).unwrap();
            let draws = quadrics::draws(&suspect.reference, &suspect.mesh, &sampled, asked, &job).unwrap();
            let by_balances = |draws: Vec<Regions>| {
                let (pose, optional) = (Similarity::IDENTITY, 0..=Bending::MOST);
                let (original, suspect) = (&suspect.reference, &suspect.mesh);
                let balances = quadrics::balances(original, suspect, &pose, &layout, &draws, &job).unwrap();
                estimator.estimate_by(&balances, &seen, &optional, &job).unwrap()
            };
            let margin = |estimate: JointEstimate| margin(&written, &estimate.soft);
            [Some(by_samples), draws.map(by_balances)].map(|estimate| estimate.map(margin))
        };
        let [by_samples, by_balances] = read(Decimator::Threshold).map(Option::unwrap);
        assert!(by_balances > 1.2 * by_samples, "{by_balances}, {by_samples}");
        // Another decimator leaves other triangles, and nothing is drawn.
        assert!(read(Decimator::Queue)[1].is_none());
    }

    #[test]
    fn regions_are_drawn_where_samples_are_not_enough_and_counted_either_way() {
        let ((layout, written, marked), job) = (marked(), Job::default());
        let method = ReadingMethod::joint(JointEstimator::new(&layout).into());
        let reader = Reader::new(layout.original().mesh()).unwrap();
        let read = |decimator: Decimator, looks: usize| {
            let margins = RefCell::new(Vec::new());
            let is_enough = |soft: &SoftBits, _| {
                margins.borrow_mut().push(margin(&written, soft));
                margins.borrow().len() == looks
            };
            let found = reader.find(decimated(&marked, decimator), &job).unwrap();
            let wanted = Wanted::until(&written, &is_enough);
            let tries = found.read(&method, wanted, &job).unwrap().tries;
            (margins.take(), tries)
        };
        let (every, tries) = read(Decimator::Threshold, usize::MAX);
        let [.., by_samples, by_draws] = every[..] else {
            panic!("{every:?}");
        };
        assert!(by_draws > 1.2 * by_samples, "{every:?}");
        assert_eq!(tries, every.len());
        let last = every.len() - 1;
        assert_eq!(read(Decimator::Threshold, last), (every[..last].to_vec(), tries));
        // Of another decimator nothing is drawn, and what samples told stands.
        let (every, tries) = read(Decimator::Queue, usize::MAX);
        assert_eq!((every[last], tries), (every[last - 1], every.len()));
    }
}
