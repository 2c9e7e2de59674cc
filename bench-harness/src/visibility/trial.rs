//! What is measured of a layout on a model.

use std::{num::NonZero, sync::Arc, thread, time::Instant};

use anyhow::Result;
use evaluation::python::Python;
use job::Job;
use mesh::TriMesh;
use quality::{Dame, FacetTurn, Msdm2, TurnSummary, Visibility};
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use serde::{Deserialize, Serialize};
use sigmark::{
    Strength,
    mark::{JointEstimator, MarkLayout, Reader, ReadingMethod, correlation, extraction_rate},
};

use super::layouts::{Kind, TriedLayout};
use crate::suspects::attacked;

const BITS: usize = 512;

/// What a mark meets.
pub(super) const ATTACKS: [&str; 8] = [
    "noise:0.5",
    "laplacian:5",
    "laplacian:30",
    "quantise:8",
    "simplify-meshlab:10",
    "simplify-meshlab:5",
    "crop:50",
    "crop:50+simplify:10",
];

/// A layout on a model.
#[derive(Serialize, Deserialize)]
pub(super) struct Trial {
    pub(super) model: String,
    pub(super) vertices: usize,
    pub(super) layout: TriedLayout,
    pub(super) patches: usize,
    /// Seconds for all harmonics, wall time.
    pub(super) seconds: f64,
    pub(super) inside: Turn,
    pub(super) at_borders: Turn,
    pub(super) flipped: usize,
    pub(super) msdm2: f64,
    pub(super) dame: f64,
    /// In the order of [`ATTACKS`]; none where there were no attacks.
    pub(super) read: Vec<Read>,
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

/// What is read after an attack.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct Read {
    pub(super) rate: f64,
    /// T₀ = T / √(1 − T² / l).
    pub(super) margin: f64,
}

/// Marks a model with random bits, and measures.
pub(super) fn of(
    name: &str,
    mesh: &TriMesh,
    layout: &TriedLayout,
    attacks: Option<&Python>,
) -> Result<Trial> {
    let job = Job::new(thread::available_parallelism().map_or(1, NonZero::get));
    let (original, plan) = layout.cut(mesh, BITS, &job)?;
    let start = Instant::now();
    original.keep_bases(&job)?;
    let seconds = start.elapsed().as_secs_f64();
    let mark = MarkLayout::with_strength(Arc::new(original), plan, Strength::Distortion(layout.strength))?;
    let mark = Arc::new(mark);
    let mut rng = ChaCha20Rng::from_seed([2; 32]);
    let bits: Vec<bool> = (0..BITS).map(|_| rng.next_u32() & 1 == 1).collect();
    let mut written = mark.write(&bits, &job)?;
    if layout.kind == Kind::Pooled {
        mark.level_slivers(&mut written);
    }
    let positions = written.positions(mark.original());
    let marked = mesh.with_positions(positions)?;

    let turn = FacetTurn::between(mesh, &marked)?;
    let labels = mark.original().patches().labels();
    let is_at_border = near_borders(mesh, labels);
    let read = match attacks {
        None => Vec::new(),
        Some(attacks) => read(name, &marked, &mark, &bits, layout, attacks, &job)?,
    };
    let trial = Trial {
        model: name.into(),
        vertices: mesh.vertex_count(),
        layout: *layout,
        patches: mark.original().patches().len(),
        seconds,
        inside: turn.summary_of(|t| !is_at_border[t]).into(),
        at_borders: turn.summary_of(|t| is_at_border[t]).into(),
        flipped: turn.flipped(),
        msdm2: Msdm2::between(&marked, mesh, &job)?.symmetric,
        dame: Dame::between(&marked, mesh, Visibility::Seen, &job)?.error,
        read,
    };
    println!("{}", serde_json::to_string(&trial)?);
    Ok(trial)
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

fn read(
    name: &str,
    marked: &TriMesh,
    mark: &Arc<MarkLayout>,
    bits: &[bool],
    layout: &TriedLayout,
    attacks: &Python,
    job: &Job,
) -> Result<Vec<Read>> {
    let reader = Reader::new(mark.original().mesh())?;
    let method = ReadingMethod::joint(Arc::new(JointEstimator::new(mark)));
    let name = format!("{name}-{}", layout.to_string().replace(':', "-"));
    let of_attack = |spec: &&str| {
        let suspect = attacked(attacks, marked, &name, spec, 0)?;
        let found = reader.find(&suspect, job)?;
        let soft = found.read(&method, bits, job)?.soft;
        let t = correlation(bits, &soft.weights());
        Ok(Read {
            rate: extraction_rate(bits, &soft.hard()),
            // Where all are exact it is infinite, which JSON can't say.
            margin: (t / (1.0 - t * t / BITS as f64).sqrt()).min(f64::MAX),
        })
    };
    ATTACKS.iter().map(of_attack).collect()
}
