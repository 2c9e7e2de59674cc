//! Alignment of a suspect whose vertices are not, or not all, the original's any more: its surface is sampled at the
//! original's vertices, and what the samples say of the misalignment is taken back.
//!
//! A suspect's triangles are flat and the original is not, so samples between the suspect's vertices are off even where these
//! lie on the original; after decimation, by more than a mark. By how much is known but for a factor: it is what is left
//! when the suspect's vertices are put onto the original.

use job::Job;
use mesh::{
    BoundingBox, Similarity,
    vector::{add, cross, dot, scaled, sub},
};
use registration::{Correspondence, PreparedMesh, ResampleOptions, Resampled, resample};

use crate::mark::{MarkError, MarkStage, Original, Registered, SoftBits, detect::Equations};

/// Samples a suspect at the vertices of an original (section 4.4.1).
///
/// ```
/// use mesh::{Similarity, shapes};
/// use sigmark::mark::Sampler;
///
/// let (original, suspect) = (shapes::bumpy_sphere(3, 1), shapes::flipped(&shapes::bumpy_sphere(3, 1), 5));
/// let registered = Sampler::new(&original, &suspect).sample(&Similarity::IDENTITY, &Default::default())?;
/// assert_eq!(registered.missing(), 0.0);
/// # Ok::<(), sigmark::mark::MarkError>(())
/// ```
pub struct Sampler<'a> {
    original: PreparedMesh,
    suspect: PreparedMesh,
    survivors: Option<&'a Correspondence>,
}

impl<'a> Sampler<'a> {
    /// Search trees are built when they are first needed.
    pub fn new(original: impl Into<PreparedMesh>, suspect: impl Into<PreparedMesh>) -> Self {
        Self {
            original: original.into(),
            suspect: suspect.into(),
            survivors: None,
        }
    }

    /// Takes the vertices that were found again for what they are, in place of the surface there.
    pub fn survivors(mut self, map: &'a Correspondence) -> Self {
        self.survivors = Some(map);
        self
    }

    /// Betters a transform that is nearly right, in view of a mark with strengths `alphas`, which is noise to it. What is left
    /// is of second order in the error. `original` is that of the same mesh.
    ///
    /// # Errors
    /// When the original's bases can't be computed, or the threads not be started.
    pub fn refine(
        &self,
        original: &Original,
        alphas: &[f64],
        transform: &Similarity,
        job: &Job,
    ) -> Result<Similarity, MarkError> {
        let registered = self.sample(transform, job)?;
        let estimate = Equations::of(original, alphas, &registered, job)?.solve()?;
        Ok(transform.then(&estimate.misalignment.inverse()))
    }

    /// Bits by least squares under a transform that is nearly right, what was read, and the transform bettered. `original` is that
    /// of the same mesh.
    ///
    /// # Errors
    /// As [`refine`](Self::refine).
    pub fn read(
        &self,
        original: &Original,
        alphas: &[f64],
        transform: &Similarity,
        job: &Job,
    ) -> Result<(Registered, SoftBits, Similarity), MarkError> {
        let mut pose = *transform;
        let mut rounds = 0;
        loop {
            job.begin(MarkStage::Resampling)?;
            let registered = self.sample(&pose, job)?;
            job.begin(MarkStage::Detection)?;
            let estimate = Equations::of(original, alphas, &registered, job)?.solve()?;
            let better = pose.then(&estimate.misalignment.inverse());
            rounds += 1;
            let step = self.farthest(&pose, &better);
            // What the estimate leaves out is of second order.
            let settled = step < SETTLED && step * step < NEGLIGIBLE * estimate.noise;
            if settled || rounds == MOST_ROUNDS {
                return Ok((registered, SoftBits(estimate.bits), better));
            }
            pose = better;
        }
    }

    /// How far two transforms lay the suspect apart, in diagonals of the original.
    fn farthest(&self, a: &Similarity, b: &Similarity) -> f64 {
        let BoundingBox { min, max } = self.suspect.mesh().bounding_box();
        let corners = (0..8).map(|i| std::array::from_fn(|axis| [min, max][i >> axis & 1][axis]));
        let apart = corners.map(|p: [f64; 3]| sub(a.apply(p), b.apply(p)));
        let farthest = apart.map(|d| dot(d, d).sqrt()).fold(0.0, f64::max);
        farthest / self.original.mesh().bounding_box().diagonal()
    }

    /// The suspect under a transform to the original's frame, at each vertex of the original: the vertex itself where it
    /// survived, else the surface along the normal.
    ///
    /// # Errors
    /// When the threads can't be started; [`MarkError::Job`].
    pub fn sample(&self, transform: &Similarity, job: &Job) -> Result<Registered, MarkError> {
        let (options, quiet) = (ResampleOptions::default(), job.quiet());
        let sampled = resample(&self.original, &self.suspect, transform, &options, &quiet)?;
        let normals = self.original.vertex_normals();
        let (original, suspect) = (self.original.mesh(), self.suspect.mesh());
        let mut registered = Registered::by_vertices(vec![None; original.vertex_count()]);
        registered.suspect_vertices = suspect.vertex_count();
        for (v, offset) in sampled.offsets.iter().enumerate() {
            let survivor = self.survivors.and_then(|map| map.suspect_of[v]);
            if let Some(survivor) = survivor {
                let place = suspect.positions()[survivor as usize];
                registered.positions[v] = Some(transform.apply(place));
            } else if let (Some(offset), Some(triangle)) = (*offset, sampled.triangles[v]) {
                let (place, normal) = (original.positions()[v], normals[v]);
                registered.positions[v] = Some(add(place, scaled(normal, offset)));
                let facing = self.normal(triangle as usize);
                let facing = transform.rotation.map(|row| dot(row, facing));
                registered.along[v] = Some(gradient(normal, facing));
            }
        }
        if registered.along.iter().any(Option::is_some) {
            registered.facets = self.facets(&registered, &sampled, transform, job)?;
        }
        Ok(registered)
    }

    /// At each vertex that was sampled: the offset, had the suspect's vertices been on the original.
    fn facets(
        &self,
        registered: &Registered,
        sampled: &Resampled,
        transform: &Similarity,
        job: &Job,
    ) -> Result<Vec<f64>, MarkError> {
        let suspect = self.suspect.mesh();
        let positions = suspect.positions().iter();
        let placed: Vec<[f64; 3]> = positions.map(|&p| transform.apply(p)).collect();
        let nearest = self.original.surface().nearest_of(&placed, &job.quiet())?;
        let facet = |v: usize| {
            let (along, seen) = (registered.along[v]?, registered.positions[v]?);
            let corners = suspect.triangles()[sampled.triangles[v]? as usize].map(|w| w as usize);
            let weights = barycentric(corners.map(|w| placed[w]), seen);
            let moved = corners.iter().zip(weights).fold([0.0; 3], |sum, (&w, weight)| {
                add(sum, scaled(sub(nearest[w].point, placed[w]), weight))
            });
            Some(sampled.offsets[v]? + dot(along, moved))
        };
        Ok((0..registered.along.len())
            .map(|v| facet(v).unwrap_or(0.0))
            .collect())
    }

    /// Of a triangle of the suspect, of any length.
    fn normal(&self, triangle: usize) -> [f64; 3] {
        let [a, b, c] = self.suspect.mesh().corners(triangle);
        cross(sub(b, a), sub(c, a))
    }
}

/// Where a pose is off by less, in diagonals, lines along normals meet the suspect nearly where they should.
const SETTLED: f64 = 5e-4;

/// As a share of the noise.
const NEGLIGIBLE: f64 = 0.1;

/// How often a suspect is sampled at most.
const MOST_ROUNDS: usize = 2;

/// Steeper triangles are taken for this steep: their slope says little about the surface.
const STEEPEST: f64 = 0.5;

/// How the offset along a line with direction n grows when the plane that it meets moves: f / (f·n) for a plane with
/// normal f, on either side.
fn gradient(n: [f64; 3], f: [f64; 3]) -> [f64; 3] {
    let length = dot(f, f).sqrt();
    let cosine = dot(f, n) / length;
    if cosine.abs() >= STEEPEST {
        f.map(|x| x / (length * cosine))
    } else {
        n
    }
}

/// Weights of a triangle's corners, with sum 1, for a point of its plane; a third each where it has no area.
fn barycentric([a, b, c]: [[f64; 3]; 3], p: [f64; 3]) -> [f64; 3] {
    let normal = cross(sub(b, a), sub(c, a));
    let square = dot(normal, normal);
    if square == 0.0 {
        return [1.0 / 3.0; 3];
    }
    let of = |from: [f64; 3], to: [f64; 3]| dot(cross(sub(to, from), sub(p, from)), normal) / square;
    [of(b, c), of(c, a), of(a, b)]
}
