//! What is measured of a layout on a model.

use std::{f64::consts::PI, num::NonZero, sync::Arc, thread, time::Instant};

use anyhow::{Context, Result};
use evaluation::{margin::margin_of_rate, python::Python};
use job::Job;
use mesh::{TriMesh, Vec3};
use mesh_io::Asset;
use quality::{Dame, FacetTurn, Msdm2, TurnSummary, Visibility};
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use serde::{Deserialize, Serialize};
use sigmark::{
    Strength,
    mark::{JointEstimator, JointModel, MarkLayout, Original, Reader, ReadingMethod, extraction_rate},
};

use super::layouts::{Kind, TriedLayout};
use crate::suspects::attacked;

/// A triangle is as good as degenerate whose height is less than this share of its longest side, or of the model's diagonal: some units in the last place of single precision, so that writing
/// a file turns it.
const THIN: f64 = 1e-3;
const LOW: f64 = 1e-6;

/// No other facet is to turn further, in degrees.
const FAR: f64 = 20.0;

/// What is seen of a layout on a model.
#[derive(Serialize, Deserialize)]
pub(super) struct Seen {
    pub(super) model: String,
    pub(super) vertices: usize,
    pub(super) layout: TriedLayout,
    pub(super) patches: usize,
    /// Seconds for all harmonics, wall time.
    pub(super) seconds: f64,
    /// Root mean square displacement of what is marked, in diagonals.
    pub(super) rms: f64,
    pub(super) inside: Turn,
    pub(super) at_borders: Turn,
    pub(super) flipped: usize,
    /// How many facets turn by more than 20 degrees, and how many of those are no slivers.
    pub(super) far: [usize; 2],
    pub(super) look: Look,
}

/// How much people notice.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct Look {
    /// None of meshes that are too large for it.
    pub(super) msdm2: Option<f64>,
    pub(super) dame: f64,
}

/// [`TurnSummary`], to be kept.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct Turn {
    pub(super) median: f64,
    pub(super) p99: f64,
    pub(super) max: f64,
}

impl From<TurnSummary> for Turn {
    fn from(TurnSummary { median, p99, max, .. }: TurnSummary) -> Self {
        Self { median, p99, max }
    }
}

/// What a layout leaves to be read on a model.
#[derive(Serialize, Deserialize)]
pub(super) struct Outlasted {
    pub(super) model: String,
    pub(super) layout: TriedLayout,
    /// In the order of the attacks.
    pub(super) read: Vec<Read>,
}

/// What is read after an attack, of all draws together.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct Read {
    pub(super) rate: f64,
    /// T₀ = √l Φ⁻¹(ER); at least, where all are right.
    pub(super) margin: f64,
    /// Its standard deviation by chance, where not all are right.
    pub(super) deviation: f64,
}

/// Bits and attacks are drawn so often.
pub(super) const DRAWS: u8 = 3;

/// And as often as is asked for where those have less of T₀ than this: one draw tells it to ± 1.25.
const LITTLE: f64 = 10.0;

/// A model with a mark of random bits, by a layout.
pub(super) struct Marked<'a> {
    name: &'a str,
    asset: &'a Asset,
    layout: TriedLayout,
    mark: Arc<MarkLayout>,
    bits: Vec<bool>,
    /// Seconds for all harmonics, wall time.
    seconds: f64,
    /// As the file holds it.
    mesh: TriMesh,
}

fn job() -> Job {
    Job::new(thread::available_parallelism().map_or(1, NonZero::get))
}

impl<'a> Marked<'a> {
    /// Marks a model.
    ///
    /// # Errors
    /// Where it has no room for such a mark.
    pub(super) fn new(name: &'a str, asset: &'a Asset, layout: &TriedLayout) -> Result<Self> {
        let mark = layout.laid(asset.mesh(), &job())?;
        let start = Instant::now();
        mark.original().keep_bases(&job())?;
        let seconds = start.elapsed().as_secs_f64();
        Self::written(name, asset, layout, mark, 0, seconds)
    }

    /// With other bits.
    fn drawn(&self, draw: u8) -> Result<Self> {
        let mark = (*self.mark).clone();
        Self::written(self.name, self.asset, &self.layout, mark, draw, self.seconds)
    }

    /// The same harmonics, more or less strongly.
    pub(super) fn with_strength(&self, strength: f64) -> Result<Self> {
        let (original, layout) = (self.mark.original(), self.layout.with_strength(strength));
        let mark =
            MarkLayout::with_strength(Arc::clone(original), *self.mark.plan(), Strength::Level(strength))?;
        Self::written(self.name, self.asset, &layout, mark, 0, self.seconds)
    }

    fn written(
        name: &'a str,
        asset: &'a Asset,
        layout: &TriedLayout,
        mut mark: MarkLayout,
        draw: u8,
        seconds: f64,
    ) -> Result<Self> {
        let mut rng = ChaCha20Rng::from_seed([2 + draw; 32]);
        let bits: Vec<bool> = (0..mark.bits()).map(|_| rng.next_u32() & 1 == 1).collect();
        let mut written = mark.write(&bits, &job())?;
        if layout.kind == Kind::Windowed {
            // Windows take some of the strength, which is given back.
            let factor = mark.distortion_rms() / rms(mark.original(), &written.displacement);
            let alphas = mark.alphas().iter().map(|alpha| factor * alpha).collect();
            mark = MarkLayout::new(Arc::clone(mark.original()), *mark.plan(), alphas)?;
            written = mark.write(&bits, &job())?;
        }
        let is_levelled = matches!(
            layout.kind,
            Kind::Pooled | Kind::Repeated | Kind::Even | Kind::Windowed
        );
        let strength = Strength::Level(layout.strength);
        let mut levelled = is_levelled.then(|| mark.level_slivers(&mut written, strength));
        let mut positions = written.positions(mark.original());
        let mut held = asset.with_positions(&positions)?;
        while let Some(levelled) = &mut levelled {
            if !mark.level_rounded(&mut positions, held.mesh().positions(), levelled) {
                break;
            }
            held = asset.with_positions(&positions)?;
        }
        Ok(Self {
            name,
            asset,
            layout: *layout,
            mesh: held.mesh().clone(),
            mark: Arc::new(mark),
            bits,
            seconds,
        })
    }

    /// What is seen of it; MSDM2 where the model has no more vertices than `most`.
    pub(super) fn seen(&self, most: usize) -> Result<Seen> {
        let (before, original) = (self.asset.mesh(), self.mark.original());
        let turn = FacetTurn::between(before, &self.mesh)?;
        let is_at_border = near_borders(before, original.patches().labels());
        let far: Vec<usize> = (0..before.triangle_count())
            .filter(|&t| turn.degrees()[t].is_some_and(|angle| angle > FAR))
            .collect();
        let lowest = LOW * before.bounding_box().diagonal();
        let whole = far.iter().filter(|&&t| !is_thin(before, t, lowest)).count();
        let displacement = self.mesh.positions().iter().zip(before.positions());
        let displacement: Vec<Vec3> = displacement.map(|(&after, &at)| Vec3(after) - Vec3(at)).collect();
        Ok(Seen {
            model: self.name.into(),
            vertices: before.vertex_count(),
            layout: self.layout,
            patches: original.patches().len(),
            seconds: self.seconds,
            rms: rms(original, &displacement),
            inside: turn.summary_of(|t| !is_at_border[t]).into(),
            at_borders: turn.summary_of(|t| is_at_border[t]).into(),
            flipped: turn.flipped(),
            far: [far.len(), whole],
            look: self.look(most)?,
        })
    }

    /// How much people notice; without MSDM2 where the model has more vertices than `most`.
    pub(super) fn look(&self, most: usize) -> Result<Look> {
        let before = self.asset.mesh();
        let msdm2 = || Msdm2::between(&self.mesh, before, &job());
        let msdm2 = (before.vertex_count() <= most).then(msdm2).transpose()?;
        Ok(Look {
            msdm2: msdm2.map(|found| found.symmetric),
            dame: Dame::between(&self.mesh, before, Visibility::Seen, &job())?.error,
        })
    }

    /// What is read of marks of several draws after attacks, so many where they leave little, by the reader of `sigmark verify`, or one that knows less.
    pub(super) fn read<'s>(
        &self,
        specs: impl Iterator<Item = &'s str> + Clone,
        draws_of_little: u8,
        model: JointModel,
        attacks: &Python,
    ) -> Result<Vec<Read>> {
        let reader = Reader::new(self.mark.original().mesh())?;
        let estimator = JointEstimator::new(&self.mark).with_model(model);
        let method = ReadingMethod::joint(Arc::new(estimator));
        let mut rates = vec![Vec::new(); specs.clone().count()];
        for draw in 0..draws_of_little {
            let is_asked =
                |rates: &[f64]| draw < DRAWS || self.read_of(&rates[..DRAWS.into()]).margin < LITTLE;
            let asked = rates.iter_mut().zip(specs.clone());
            let asked: Vec<_> = asked.filter(|(rates, _)| is_asked(rates)).collect();
            if asked.is_empty() {
                break;
            }
            let marked = self.drawn(draw)?;
            for (rates, spec) in asked {
                rates.push(marked.rate_after(spec, draw, &reader, &method, attacks)?);
            }
        }
        Ok(rates.iter().map(|rates| self.read_of(rates)).collect())
    }

    /// What draws tell together.
    fn read_of(&self, rates: &[f64]) -> Read {
        let (bits, draws) = (self.bits.len(), rates.len());
        let rate = rates.iter().sum::<f64>() / draws as f64;
        let margin = margin_of_rate(rate, bits, draws * bits);
        // That of the rate, through the slope of √l Φ⁻¹.
        let slope = (0.5 * margin * margin / bits as f64).exp() * (2.0 * PI).sqrt();
        Read {
            rate,
            margin,
            deviation: slope * (rate * (1.0 - rate) / draws as f64).sqrt(),
        }
    }

    /// The share of right bits, of all patches, in the best of the ways in which the attacked mesh may lie.
    fn rate_after(
        &self,
        spec: &str,
        draw: u8,
        reader: &Reader,
        method: &ReadingMethod,
        attacks: &Python,
    ) -> Result<f64> {
        let name = format!("{}-{}", self.name, self.layout.to_string().replace(':', "-"));
        let suspect = attacked(attacks, &self.mesh, &name, spec, draw.into())?;
        let found = reader.find(&suspect, &job())?;
        let readings = found.readings(method, &job())?;
        let rates = readings.of_every_way(&job())?.into_iter();
        let rates = rates.map(|reading| extraction_rate(&self.bits, &reading.soft.hard()));
        rates.max_by(f64::total_cmp).context("it lies nowhere")
    }
}

/// Root mean square length of a displacement over the marked surface, as a share of the diagonal; a vertex stands for a third of the triangles around it.
fn rms<D: Copy + Into<Vec3>>(original: &Original, displacement: &[D]) -> f64 {
    let (mut squares, mut area) = (0.0, 0.0);
    for patch in original.patches().iter() {
        for (t, triangle) in patch.mesh().triangles().iter().enumerate() {
            let third = patch.mesh().triangle_area(t) / 3.0;
            for &v in triangle {
                let moved: Vec3 = displacement[patch.vertices()[v as usize] as usize].into();
                squares += third * moved.squared();
                area += third;
            }
        }
    }
    (squares / area).sqrt() / original.mesh().bounding_box().diagonal()
}

/// Whether a triangle is nearly a line: by its sides, or lower than anything.
fn is_thin(mesh: &TriMesh, triangle: usize, lowest: f64) -> bool {
    let [a, b, c] = mesh.corners(triangle);
    let longest = [b - a, c - b, a - c]
        .map(Vec3::norm)
        .into_iter()
        .fold(0.0, f64::max);
    2.0 * mesh.triangle_area(triangle) < longest * lowest.max(THIN * longest)
}

/// Triangles with a corner beside another patch, or beside what is unmarked.
fn near_borders(mesh: &TriMesh, labels: &[u32]) -> Vec<bool> {
    let mut beside = vec![false; labels.len()];
    for triangle in mesh.triangles() {
        let [a, b, c] = triangle.map(|v| labels[v as usize]);
        if a != b || b != c {
            triangle.iter().for_each(|&v| beside[v as usize] = true);
        }
    }
    let triangles = mesh.triangles().iter();
    triangles
        .map(|triangle| triangle.iter().any(|&v| beside[v as usize]))
        .collect()
}
