//! What an opponent does to a marked model, and what is read of the mark then.

use std::sync::Arc;

use anyhow::Result;
use evaluation::python::Python;
use mesh::{TriMesh, Vec3};
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use serde::{Deserialize, Serialize};
use sigmark::{
    Embedder, Strength, Verdict, Verifier,
    claim::EVIDENCE,
    mark::{Patch, PatchBasis},
};

use super::marked::{Marked, cut, job, key};
use crate::suspects::attacked;

/// Of a mark in its own band, relative to the owner's energy.
const ENERGIES: [f64; 4] = [1.0, 2.0, 4.0, 16.0];

/// Of a stranger's mark, relative to the owner's amplitude.
const AMPLITUDES: [f64; 3] = [1.0, 2.0, 4.0];

/// How many copies are averaged.
const COPIES: [usize; 4] = [2, 3, 5, 10];

/// Cells of distance fields along the longest edge.
const GRIDS: [usize; 2] = [128, 256];

/// A mark after an attack.
#[derive(Serialize, Deserialize)]
pub(super) struct Removal {
    pub(super) model: String,
    pub(super) attack: String,
    /// What moved a vertex beside the mark, root mean square in diagonals; none where vertices are others.
    pub(super) moved: Option<f64>,
    pub(super) ours: ReadMark,
    pub(super) paper: ReadMark,
}

/// What a verifier says of it.
#[derive(Serialize, Deserialize)]
pub(super) struct ReadMark {
    pub(super) correlation: f64,
    pub(super) p: f64,
    /// The share of the bits, of which something was read, that are right.
    pub(super) right: f64,
    pub(super) outcome: String,
    pub(super) is_evidence: bool,
}

impl ReadMark {
    fn of(verdict: &Verdict) -> Self {
        Self {
            correlation: verdict.correlation,
            p: verdict.p_value,
            right: verdict.extraction_rate.unwrap_or(0.0),
            outcome: verdict.outcome.name().replace('_', " "),
            is_evidence: verdict.is_evidence(),
        }
    }
}

/// The model whose marks have to stand more than chance.
const ASKED_OF: &str = "stanford_bunny_bun_zipper_36k";

impl Removal {
    /// The largest p that will do: a known figure of this attack on the bunny, and evidence wherever that is below 10⁻²⁰.
    pub(super) fn asked(&self) -> Option<f64> {
        let known = match self.attack.as_str() {
            _ if self.model != ASKED_OF => None,
            "overwritten, 1 × amplitude" => Some(2e-72),
            "overwritten, 2 × amplitude" => Some(2e-26),
            "overwritten, 4 × amplitude" => Some(3e-7),
            "average of 2 copies" => Some(1e-54),
            "average of 3 copies" => Some(2e-39),
            "average of 5 copies" => Some(9e-22),
            _ => None,
        };
        known.map(|p: f64| if p < 1e-20 { p.min(EVIDENCE) } else { p })
    }

    /// Whether more was asked than was read.
    pub(super) fn is_missed(&self) -> bool {
        self.asked().is_some_and(|asked| self.ours.p > asked)
    }
}

/// All attacks on a marked model.
pub(super) fn of(marked: &Marked, attacks: &Python) -> Result<Vec<Removal>> {
    let mut all = Vec::new();
    let mut read = |attack: String, suspect: &TriMesh| -> Result<()> {
        let verdict = |verifier: &Verifier| verifier.verify(suspect, &job());
        let removal = Removal {
            model: marked.name.clone(),
            attack,
            moved: moved(marked, suspect),
            ours: ReadMark::of(&verdict(&marked.ours)?),
            paper: ReadMark::of(&verdict(&marked.paper)?),
        };
        println!("{}", serde_json::to_string(&removal)?);
        all.push(removal);
        Ok(())
    };
    read("none".into(), marked.signed.mesh())?;
    for energy in ENERGIES {
        let noisy = with_chips_at_random(marked, energy)?;
        read(format!("random chips, {energy} × energy"), &noisy)?;
    }
    let published = cut(marked.signed.mesh())?;
    for amplitude in AMPLITUDES {
        let strength = Strength::Distortion(amplitude * marked.signed.layout().distortion_rms());
        let overwritten = Embedder::new(&key(2))
            .strength(strength)
            .embed_in(&published, &job())?;
        read(
            format!("overwritten, {amplitude} × amplitude"),
            overwritten.mesh(),
        )?;
    }
    read(
        "overwritten by four, 1 × amplitude each".into(),
        &overwritten_by_four(marked)?,
    )?;
    let copies = copies(marked)?;
    for count in COPIES {
        read(format!("average of {count} copies"), &average(&copies[..count])?)?;
    }
    for grid in GRIDS {
        let name = format!("{}-security", marked.name);
        let extracted = attacked(attacks, marked.signed.mesh(), &name, &format!("sdf:{grid}"), 0)?;
        read(format!("distance field, {grid} cells"), &extracted)?;
    }
    Ok(all)
}

/// The marked model with a second mark in the very places of the first, but with as many bits as chips: every coefficient has a random sign
/// of its own. Nobody but the owner knows these places exactly.
fn with_chips_at_random(marked: &Marked, energy: f64) -> Result<TriMesh> {
    let (layout, original) = (marked.signed.layout(), marked.signed.original());
    let of_patch = |patch: usize, _: &Patch, basis: &PatchBasis| {
        let mut rng = ChaCha20Rng::seed_from_u64(patch as u64);
        let amplitude = layout.amplitude(patch).map(|amplitude| energy.sqrt() * amplitude);
        let mut coefficients = vec![[0.0; 3]; original.functions()[patch]];
        for chip in layout.chips(patch) {
            let sign = if rng.next_u32() & 1 == 1 { 1.0 } else { -1.0 };
            coefficients[chip.frequency][chip.axis] = sign * amplitude[chip.axis];
        }
        basis.inverse_transform(&coefficients)
    };
    let added = original.map_bases(of_patch, &job())?;
    let mut positions = marked.signed.positions().to_vec();
    for (patch, added) in original.patches().iter().zip(added) {
        for (&v, d) in patch.vertices().iter().zip(added) {
            positions[v as usize] = (Vec3(positions[v as usize]) + Vec3(d)).into();
        }
    }
    Ok(original.mesh().with_positions(positions)?)
}

/// One stranger after the other marks what he got from the one before.
fn overwritten_by_four(marked: &Marked) -> Result<TriMesh> {
    let mut mesh = marked.signed.mesh().clone();
    for stranger in 2..6 {
        mesh = Embedder::new(&key(stranger)).embed(&mesh, &job())?.mesh().clone();
    }
    Ok(mesh)
}

/// Differently marked copies of one model; the first is the one that is looked for.
fn copies(marked: &Marked) -> Result<Vec<Arc<TriMesh>>> {
    let most = COPIES.into_iter().max().unwrap_or(1);
    let copy = |recipient| Ok(Arc::new(marked.copy(recipient)?.mesh().clone()));
    (0..most).map(copy).collect()
}

fn average(copies: &[Arc<TriMesh>]) -> Result<TriMesh> {
    let share = 1.0 / copies.len() as f64;
    let mean = |v: usize| {
        let sum = copies
            .iter()
            .fold(Vec3([0.0; 3]), |sum, copy| sum + copy.point(v));
        (sum * share).into()
    };
    let positions = (0..copies[0].vertex_count()).map(mean).collect();
    Ok(copies[0].with_positions(positions)?)
}

fn moved(marked: &Marked, suspect: &TriMesh) -> Option<f64> {
    let published = marked.signed.mesh();
    if suspect.triangles() != published.triangles() {
        return None;
    }
    let squares = (0..published.vertex_count()).map(|v| (suspect.point(v) - published.point(v)).squared());
    let mean = squares.sum::<f64>() / published.vertex_count() as f64;
    Some(mean.sqrt() / published.bounding_box().diagonal())
}
