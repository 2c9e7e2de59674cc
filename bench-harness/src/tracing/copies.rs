//! Copies of one model, in three layouts, and what is read of mixtures of them.

use std::sync::Arc;

use anyhow::{Context, Result};
use job::Job;
use mesh::{TriMesh, Vec3};
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use sigmark::{
    Certificate, Curve, Embedder, SigningKey,
    claim::{
        Tracer,
        trace::{Order, Pattern, Residue, TracedSuspect},
    },
    mark::{MarkLayout, Original, Patch, PatchBasis},
};

use super::{
    BOUND, BUYERS, COLLUDERS, Traced,
    collusion::{Domain, Rule},
    is_named, right_and_wrong,
};

/// Chips to a bit of the signature: 8192 in all.
const CHIP_RATE: usize = 16;

/// Bits a coordinate that are left of a mixture.
const QUANTISED: i32 = 14;

/// How chips go to harmonics.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Layout {
    /// Ours.
    Rotated,
    /// Each chip on a harmonic, ±1.
    Plain,
    /// The same with the bits of Tardos' code, by the symmetric score (Škorić, Katzenbeisser and Celik 2008).
    Tardos,
}

impl Layout {
    pub(super) const ALL: [Self; 3] = [Self::Rotated, Self::Plain, Self::Tardos];

    /// In which domains its copies are mixed. Others than ours are weaker among harmonics, which is where their chips are.
    pub(super) fn domains(self) -> &'static [Domain] {
        match self {
            Self::Rotated => Domain::ALL,
            _ => &[Domain::Harmonics],
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Rotated => "rotated",
            Self::Plain => "plain",
            Self::Tardos => "Tardos",
        }
    }
}

/// One who sells copies of a model.
pub(super) struct Shop {
    key: SigningKey,
    original: Arc<Original>,
    layout: Arc<MarkLayout>,
    order: Arc<Order>,
    certificates: Vec<Certificate>,
    copies: Vec<TriMesh>,
    patterns: Vec<Pattern>,
    tracer: Tracer,
}

impl Shop {
    pub(super) fn open(mesh: &TriMesh, job: &Job) -> Result<Self> {
        let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([1; 32]));
        let embedder = Embedder::new(&key).chip_rate(CHIP_RATE).message("tracing");
        let original = Arc::new(embedder.cut(mesh, job)?);
        original.keep_bases(job)?;
        let prepared = embedder.prepare_in(&original)?;
        let (mut certificates, mut copies, mut layout) = (Vec::new(), Vec::new(), None);
        let most = COLLUDERS.into_iter().max().unwrap_or(0);
        for i in 0..most {
            let signed = prepared.embed_for(&format!("buyer {i}"), job)?;
            certificates.push(signed.certificate().clone());
            copies.push(signed.mesh().clone());
            layout = Some(Arc::clone(signed.layout()));
        }
        let layout = layout.context("nobody bought a copy")?;
        let pattern = |certificate: &Certificate| Pattern {
            hash: *certificate.statement_hash(),
            bits: certificate.bits(),
        };
        let patterns: Vec<Pattern> = certificates.iter().map(pattern).collect();
        let tracer = tracer(&original, &key, &certificates)?.with_decoys(BUYERS - most, 1);
        Ok(Self {
            order: Order::of(&layout).into(),
            key,
            original,
            layout,
            certificates,
            copies,
            patterns,
            tracer,
        })
    }

    /// That asks for the first buyers.
    pub(super) fn tracer(&self, buyers: usize) -> Result<Tracer> {
        tracer(&self.original, &self.key, &self.certificates[..buyers])
    }

    pub(super) fn order(&self) -> &Order {
        &self.order
    }

    pub(super) fn original(&self) -> &TriMesh {
        self.original.mesh()
    }

    pub(super) fn copy(&self, buyer: usize) -> &TriMesh {
        &self.copies[buyer]
    }

    /// T₀ of a buyer's copy in a suspect that was read.
    pub(super) fn margin(&self, buyer: usize, read: &TracedSuspect) -> f64 {
        let residues = read.residues().iter().flatten();
        let t = residues.map(|residue| residue.correlation(&self.patterns[buyer]));
        let t = t.fold(0.0, f64::max);
        t / (1.0 - t * t / self.order.bits() as f64).max(1e-4).sqrt()
    }

    /// Displacement of a copy.
    pub(super) fn rms(&self) -> f64 {
        rms(self.original(), &self.copies[0])
    }

    /// What so many buyers make of their copies by a rule, rounded; and who is named for it.
    pub(super) fn collude(
        &self,
        layout: Layout,
        domain: Domain,
        rule: Rule,
        colluders: usize,
        job: &Job,
    ) -> Result<(TriMesh, Traced)> {
        let mut rng = ChaCha20Rng::seed_from_u64(colluders as u64);
        let tardos = Tardos::new(self.order.chips());
        let coefficients: Vec<Vec<f64>> = (0..colluders)
            .map(|buyer| match layout {
                Layout::Rotated => self.patterns[buyer].coefficients(&self.order),
                Layout::Plain => self.plain(&self.patterns[buyer]),
                Layout::Tardos => tardos.chips(buyer as u64),
            })
            .collect();
        let displacement = match domain {
            Domain::Harmonics => {
                let own: Vec<&[f64]> = coefficients.iter().map(Vec::as_slice).collect();
                self.displacement(&rule.mixed(&own, &mut rng), job)?
            }
            Domain::Coordinates => {
                let fields: Result<Vec<Vec<f64>>> = coefficients
                    .iter()
                    .map(|own| self.displacement(own, job))
                    .collect();
                let fields = fields?;
                let own: Vec<&[f64]> = fields.iter().map(Vec::as_slice).collect();
                rule.mixed(&own, &mut rng)
            }
        };
        let suspect = quantised(self.original(), &displacement)?;
        let traced = match layout {
            Layout::Rotated => self.judged(&suspect, colluders, job)?,
            _ => self.scored(&suspect, colluders, layout, &tardos, job)?,
        };
        let traced = Traced {
            layout: layout.name().into(),
            domain: domain.name().into(),
            attack: rule.name().into(),
            rms: rms(self.original(), &suspect),
            ..traced
        };
        Ok((suspect, traced))
    }

    /// Who is named as `sigmark trace` does it.
    pub(super) fn judged(&self, suspect: &TriMesh, colluders: usize, job: &Job) -> Result<Traced> {
        let read = self.tracer.read(suspect, job)?;
        let residues: Vec<&Residue> = read.residues().iter().flatten().collect();
        let best = |pattern: &Pattern| {
            let all = residues.iter().map(|residue| residue.correlation(pattern));
            all.fold(0.0, f64::max)
        };
        let t = self.patterns[..colluders].iter().map(best).collect();
        let first = self.tracer.candidates() as u64;
        let decoys = (0..BUYERS as u64 - first).map(|i| Pattern::decoy(1, first + i, self.order.bits()));
        let innocents = self.patterns[colluders..]
            .iter()
            .map(best)
            .chain(decoys.map(|decoy| best(&decoy)));
        let innocent = innocents.fold(0.0, f64::max);
        let (named, wrong) = right_and_wrong(&self.tracer.accuse(read, job)?, colluders);
        Ok(traced(t, innocent, named, wrong))
    }

    /// The scores of other layouts from the same reading.
    fn scored(
        &self,
        suspect: &TriMesh,
        colluders: usize,
        layout: Layout,
        tardos: &Tardos,
        job: &Job,
    ) -> Result<Traced> {
        let read = self.tracer.read(suspect, job)?;
        let residue = read
            .residues()
            .first()
            .and_then(|ways| ways.first())
            .context("nothing was read")?;
        let said = &residue.values();
        let score = |buyer: u64| match layout {
            Layout::Tardos => tardos.score(buyer, said),
            _ => {
                let own = self.patterns.get(buyer as usize).cloned();
                let own = own.unwrap_or_else(|| Pattern::decoy(1, buyer, self.order.bits()));
                let products = self.plain(&own).into_iter().zip(said).map(|(chip, x)| chip * x);
                products.sum::<f64>() / said.iter().map(|x| x * x).sum::<f64>().sqrt()
            }
        };
        let t: Vec<f64> = (0..colluders as u64).map(score).collect();
        let innocents: Vec<f64> = (colluders as u64..BUYERS as u64).map(score).collect();
        let named = t.iter().filter(|t| is_named(**t)).count();
        let wrong = innocents.iter().filter(|t| is_named(**t)).count();
        Ok(traced(t, innocents.into_iter().fold(0.0, f64::max), named, wrong))
    }

    /// Chips on single harmonics.
    fn plain(&self, pattern: &Pattern) -> Vec<f64> {
        let patches = 0..self.layout.alphas().len();
        let chips = patches.flat_map(|patch| self.layout.chips(patch).iter());
        chips
            .map(|chip| if pattern.bits[chip.bit] { 1.0 } else { -1.0 })
            .collect()
    }

    /// What coefficients, in units of the amplitude, add to all coordinates, x, y and z of one vertex after the other.
    fn displacement(&self, coefficients: &[f64], job: &Job) -> Result<Vec<f64>> {
        let starts: Vec<usize> = (0..self.layout.alphas().len())
            .scan(0, |next, patch| {
                let start = *next;
                *next += self.layout.chips(patch).len();
                Some(start)
            })
            .collect();
        let of_patch = |index: usize, _: &Patch, basis: &PatchBasis| {
            let amplitude = self.layout.amplitude(index);
            let mut of_basis = vec![[0.0; 3]; self.original.functions()[index]];
            for (chip, u) in self
                .layout
                .chips(index)
                .iter()
                .zip(&coefficients[starts[index]..])
            {
                of_basis[chip.frequency][chip.axis] = amplitude[chip.axis] * u;
            }
            basis.inverse_transform(&of_basis)
        };
        let added = self.original.map_bases(of_patch, job)?;
        let mut all = vec![0.0; 3 * self.original().vertex_count()];
        for (patch, added) in self.original.patches().iter().zip(added) {
            for (&v, d) in patch.vertices().iter().zip(added) {
                all[3 * v as usize..3 * v as usize + 3].copy_from_slice(&d);
            }
        }
        Ok(all)
    }
}

fn tracer(original: &Original, key: &SigningKey, certificates: &[Certificate]) -> Result<Tracer> {
    let mut tracer = Tracer::new(original.mesh(), &key.public_key())?.p_bound(BOUND);
    for certificate in certificates {
        tracer.add(&certificate.clone().into())?;
    }
    Ok(tracer)
}

fn traced(mut t: Vec<f64>, innocent: f64, named: usize, wrong: usize) -> Traced {
    t.sort_by(|a, b| b.total_cmp(a));
    Traced {
        layout: Layout::Rotated.name().into(),
        domain: Domain::Coordinates.name().into(),
        attack: String::new(),
        colluders: t.len(),
        t,
        innocent,
        named,
        wrong,
        rms: 0.0,
    }
}

/// A mesh that was moved, each coordinate rounded to a grid over its bounding cube.
fn quantised(original: &TriMesh, displacement: &[f64]) -> Result<TriMesh> {
    let bounds = original.bounding_box();
    let step = bounds.size().into_iter().fold(0.0, f64::max) / (2f64.powi(QUANTISED) - 1.0);
    let rounded = |(p, d): (&[f64; 3], &[f64])| {
        std::array::from_fn(|axis| {
            let x = p[axis] + d[axis] - bounds.min[axis];
            bounds.min[axis] + step * (x / step).round()
        })
    };
    let positions = original
        .positions()
        .iter()
        .zip(displacement.chunks_exact(3))
        .map(rounded);
    Ok(original.with_positions(positions.collect())?)
}

/// How far the vertices of two meshes lie apart, as a fraction of the diagonal.
fn rms(original: &TriMesh, other: &TriMesh) -> f64 {
    let pairs = original.positions().iter().zip(other.positions());
    let squares: f64 = pairs.map(|(a, b)| (Vec3(*a) - Vec3(*b)).squared()).sum();
    (squares / original.vertex_count() as f64).sqrt() / original.bounding_box().diagonal()
}

/// Tardos' code: the probability of a 1 in each place is drawn from the arcsine distribution.
struct Tardos {
    biases: Vec<f64>,
}

/// Biases are no nearer to 0 or 1: 1 / (300 c) for twenty colluders.
const CUT: f64 = 1.0 / 6000.0;

impl Tardos {
    fn new(chips: usize) -> Self {
        let mut rng = ChaCha20Rng::seed_from_u64(99);
        let least = CUT.sqrt().asin();
        let most = std::f64::consts::FRAC_PI_2 - least;
        let bias = |u: f64| (least + u * (most - least)).sin().powi(2);
        Self {
            biases: (0..chips).map(|_| bias(uniform(&mut rng))).collect(),
        }
    }

    fn chips(&self, buyer: u64) -> Vec<f64> {
        let mut rng = ChaCha20Rng::seed_from_u64(1000 + buyer);
        let chip = |p: &f64| if uniform(&mut rng) < *p { 1.0 } else { -1.0 };
        self.biases.iter().map(chip).collect()
    }

    /// The symmetric score over its standard deviation.
    fn score(&self, buyer: u64, said: &[f64]) -> f64 {
        let of_place = |((chip, p), said): ((f64, &f64), &f64)| {
            let (p_said, same) = if *said >= 0.0 {
                (*p, chip > 0.0)
            } else {
                (1.0 - p, chip < 0.0)
            };
            if same {
                ((1.0 - p_said) / p_said).sqrt()
            } else {
                -(p_said / (1.0 - p_said)).sqrt()
            }
        };
        let places = self.chips(buyer).into_iter().zip(&self.biases).zip(said);
        places.map(of_place).sum::<f64>() / (self.biases.len() as f64).sqrt()
    }
}

fn uniform(rng: &mut ChaCha20Rng) -> f64 {
    f64::from(rng.next_u32()) / 4_294_967_296.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An innocent's score has the mean 0 and the variance 1, whatever the pirates say; theirs is far above under the majority.
    #[test]
    fn tardos_names_colluders_and_no_innocents() {
        let tardos = Tardos::new(4000);
        let own: Vec<Vec<f64>> = (0..3).map(|buyer| tardos.chips(buyer)).collect();
        let said: Vec<f64> = (0..4000)
            .map(|i| own.iter().map(|own| own[i]).sum::<f64>())
            .collect();
        let innocents: Vec<f64> = (3..203).map(|buyer| tardos.score(buyer, &said)).collect();
        let square = innocents.iter().map(|t| t * t).sum::<f64>() / 200.0;
        assert!((0.5..2.0).contains(&square), "{square}");
        assert!((0..3).all(|buyer| tardos.score(buyer, &said) > 8.0));
    }
}
