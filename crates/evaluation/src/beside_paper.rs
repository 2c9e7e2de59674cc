//! What is read of the mark that `sigmark embed` writes, and of one in the paper's layout, of the same distortion in the same mesh, by the reader of `sigmark verify`.

use std::{f64::consts::TAU, fmt::Write, sync::Arc};

use anyhow::{Context, Result};
use decimation::{Decimator, decimate};
use job::Job;
use mesh::TriMesh;
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use sigmark::{
    Signed, Strength,
    mark::{
        ChipLayout, ChipPlan, JointEstimator, MarkError, MarkLayout, Original, PatchCount, Reader,
        ReadingMethod, extraction_rate,
    },
};

use crate::margin::margin_of_rate;

/// The bits of a signature, and how often each stands in a patch of the paper's layout.
const BITS: usize = 512;
const CHIP_RATE: usize = 3;

/// A mark in a mesh.
struct Marked {
    layout: Arc<MarkLayout>,
    bits: Vec<bool>,
    mesh: TriMesh,
}

/// A table for people: extraction rate and T₀ of both layouts after each of a few attacks.
///
/// # Errors
/// Where a mark is not to be read at all.
pub(crate) fn compared(signed: &Signed, job: &Job) -> Result<String> {
    let today = Marked {
        layout: Arc::clone(signed.layout()),
        bits: signed.certificate().bits(),
        mesh: signed.mesh().clone(),
    };
    let paper = match in_papers_layout(signed.original().mesh(), today.layout.distortion_rms(), job) {
        Ok(paper) => Some(paper),
        Err(MarkError::Room { .. } | MarkError::TooFewVertices { .. }) => None,
        Err(error) => return Err(error.into()),
    };
    let repeated = in_todays_layout(&today.layout, job)?;
    let rms = 100.0 * today.layout.distortion_rms();
    let mut text = format!(
        "    at RMS {rms:.4} %: {:26} {:>16} {:>24} {:>18}\n",
        "ER, T0", "today's layout", "its chips, 512 bits", "the paper's"
    );
    for (name, attack) in ATTACKS {
        let of = |marked: Option<&Marked>| match marked {
            Some(marked) => marked.read(&attack(&marked.mesh, job)?, job),
            None => Ok("no room".into()),
        };
        let [today, repeated, paper] = [of(Some(&today))?, of(repeated.as_ref())?, of(paper.as_ref())?];
        writeln!(text, "    {name:44} {today:>16} {repeated:>24} {paper:>18}")?;
    }
    Ok(text)
}

/// The same chips, of which as many stand for a bit as in the paper's layout, so that rates are comparable: those of a code's bits, of which each has few chips, are lower at one
/// signal-to-noise ratio of the whole mark.
fn in_todays_layout(today: &MarkLayout, job: &Job) -> Result<Option<Marked>, MarkError> {
    let original = Arc::clone(today.original());
    let plan = match *today.plan() {
        ChipPlan::Pooled { key, .. } => ChipPlan::pooled(BITS, key),
        plan => plan,
    };
    match MarkLayout::new(original, plan, today.alphas().to_vec()) {
        Ok(layout) => Ok(Some(marked(layout, job)?)),
        Err(MarkError::Room { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

/// Every patch carries every bit three times, by harmonics with free borders; α is the same everywhere.
fn in_papers_layout(mesh: &TriMesh, distortion: f64, job: &Job) -> Result<Marked, MarkError> {
    let layout = ChipLayout::new(BITS, CHIP_RATE)?;
    let original = Original::cut(mesh.clone(), layout.functions(), PatchCount::Paper, job)?;
    let plan = ChipPlan::EveryPatch(layout);
    let strength = Strength::Distortion(distortion);
    marked(
        MarkLayout::with_strength(Arc::new(original), plan, strength)?,
        job,
    )
}

/// By random bits.
fn marked(layout: MarkLayout, job: &Job) -> Result<Marked, MarkError> {
    let mut rng = ChaCha20Rng::seed_from_u64(3);
    let bits: Vec<bool> = (0..layout.bits()).map(|_| rng.next_u32() & 1 == 1).collect();
    let positions = layout.write(&bits, job)?.positions(layout.original());
    Ok(Marked {
        mesh: layout.original().mesh().with_positions(positions)?,
        layout: Arc::new(layout),
        bits,
    })
}

impl Marked {
    /// What is read of a suspect, of all patches, in the best of the ways in which it may lie.
    fn read(&self, suspect: &TriMesh, job: &Job) -> Result<String> {
        let reader = Reader::new(self.layout.original().mesh())?;
        let method = ReadingMethod::joint(Arc::new(JointEstimator::new(&self.layout)));
        let found = reader.find(suspect, job)?;
        let readings = found.readings(&method, job)?;
        let judged = readings.of_every_way(job)?.into_iter().map(|reading| {
            let rate = extraction_rate(&self.bits, &reading.soft.hard());
            (margin_of_rate(rate, self.bits.len(), self.bits.len()), rate)
        });
        let best = judged.max_by(|a, b| a.0.total_cmp(&b.0));
        let (margin, rate) = best.context("it lies nowhere")?;
        let least = if rate < 1.0 { "" } else { "≥ " };
        Ok(format!("{:.1} %, {least}{margin:.1}", 100.0 * rate))
    }
}

type Attack = fn(&TriMesh, &Job) -> Result<TriMesh>;

/// Those that need no other program. `cargo xtask bench visibility` has all of Tables 4 and 5.
const ATTACKS: [(&str, Attack); 5] = [
    ("noise of 0.5 %", |mesh, _| noisy(mesh, 5e-3)),
    ("rounded to 9 bits a coordinate", |mesh, _| rounded(mesh, 9)),
    ("a tenth of the triangles, MeshLab's way", |mesh, job| {
        Ok(decimate(mesh, mesh.triangle_count() / 10, Decimator::Queue, job)?)
    }),
    ("a tenth, fast-simplification's way", |mesh, job| {
        Ok(decimate(
            mesh,
            mesh.triangle_count() / 10,
            Decimator::Threshold,
            job,
        )?)
    }),
    ("half of it cut off", |mesh, _| cropped(mesh)),
];

/// Each coordinate off by a uniform amount of up to `share` of the bounding box's edge, as in the paper.
fn noisy(mesh: &TriMesh, share: f64) -> Result<TriMesh> {
    let (mut rng, edges) = (ChaCha20Rng::seed_from_u64(5), mesh.bounding_box().size());
    let mut off =
        |axis: usize| share * edges[axis] * (2.0 * f64::from(rng.next_u32()) / f64::from(u32::MAX) - 1.0);
    let moved = mesh.positions().iter();
    let moved = moved.map(|p| std::array::from_fn(|axis| p[axis] + off(axis)));
    Ok(mesh.with_positions(moved.collect())?)
}

/// To whole steps, of which the longest edge of the bounding box has 2^bits.
fn rounded(mesh: &TriMesh, bits: i32) -> Result<TriMesh> {
    let longest = mesh.bounding_box().size().into_iter().fold(0.0, f64::max);
    let step = longest / 2f64.powi(bits);
    let positions = mesh.positions().iter();
    let positions = positions.map(|p| p.map(|x| (x / step).round() * step));
    Ok(mesh.with_positions(positions.collect())?)
}

/// Without the triangles that lie on one side of a plane, so that half of the vertices are left.
fn cropped(mesh: &TriMesh) -> Result<TriMesh> {
    let angle = TAU / 7.0;
    let along: Vec<f64> = (0..mesh.vertex_count())
        .map(|v| {
            let p = mesh.point(v);
            p[0] * angle.cos() + p[1] * angle.sin()
        })
        .collect();
    let mut sorted = along.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    let triangles = mesh.triangles().iter();
    let kept = triangles.filter(|triangle| triangle.iter().all(|&v| along[v as usize] >= median));
    Ok(TriMesh::new(mesh.positions().to_vec(), kept.copied().collect())?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;
    use sigmark::{Curve, Embedder, SigningKey};

    #[test]
    fn both_layouts_are_read_after_every_attack_and_a_small_mesh_has_no_room_for_the_papers() {
        let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::seed_from_u64(1));
        let table = |mesh: &TriMesh| {
            let signed = Embedder::new(&key).embed(mesh, &Job::new(2)).unwrap();
            compared(&signed, &Job::new(2)).unwrap()
        };
        let large = table(&shapes::bumpy_sphere(4, 3));
        assert_eq!(large.lines().count(), 1 + ATTACKS.len());
        assert!(!large.contains("no room"), "{large}");
        let small = table(&shapes::bumpy_sphere(3, 3));
        assert!(small.matches("no room").count() >= ATTACKS.len(), "{small}");
    }

    #[test]
    fn a_crop_leaves_half_and_rounding_leaves_whole_steps() {
        let mesh = shapes::bumpy_sphere(4, 1);
        let left = cropped(&mesh).unwrap().triangle_count() as f64 / mesh.triangle_count() as f64;
        assert!((0.4..0.5).contains(&left), "{left}");
        let rounded = rounded(&mesh, 4).unwrap();
        let step = mesh.bounding_box().size().into_iter().fold(0.0, f64::max) / 16.0;
        let is_whole = |x: &f64| (x / step - (x / step).round()).abs() < 1e-9;
        assert!(rounded.positions().iter().flatten().all(is_whole));
    }
}
