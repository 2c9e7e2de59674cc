//! A signed model, and what is read of it in a pose.

use std::{fmt, num::NonZero, sync::Arc, thread};

use anyhow::Result;
use job::Job;
use mesh::{Rig, Similarity, TriMesh};
use mesh_io::Asset;
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use registration::{AlignOptions, Aligner, Alignment, MatchedBy, Placement, unpose_any};
use serde::{Deserialize, Serialize};
use sigmark::{
    Curve, Embedder, SigningKey, Verdict, Verifier,
    claim::statistics::{margin, p_value, read_and_wrong},
    mark::{
        CoefficientDetector, Detector, JointEstimator, JointModel, Reader, ReadingMethod, SoftBits, Suspect,
    },
};

use crate::measure::timed;

/// By whom a suspect is read, as the page names them: the first two in the one position that a similarity gives.
pub(super) const ALGORITHMS: [&str; 3] = ["the paper's rule", "least squares", "sigmark verify"];

/// What p has to be at most to count as found.
const FOUND: f64 = 1e-6;

/// What was read of a suspect.
#[derive(Serialize, Deserialize)]
pub(super) struct Read {
    pub(super) outcome: String,
    /// By what the suspect was recognised.
    pub(super) way: String,
    pub(super) is_evidence: bool,
    /// T₀; none where the suspect does not fit.
    pub(super) margin: Option<f64>,
    pub(super) p: f64,
    /// Bits of which something was read, and how many are wrong.
    pub(super) bits: usize,
    pub(super) errors: Option<usize>,
    pub(super) cpu: f64,
}

/// A signed model, and who judges its copies.
pub(super) struct Signed {
    signed: sigmark::Signed,
    /// As its file holds it.
    marked: Option<TriMesh>,
    rig: Option<Rig>,
    reader: Reader,
    verifier: Verifier,
}

pub(super) fn job() -> Job {
    Job::new(thread::available_parallelism().map_or(1, NonZero::get))
}

impl Signed {
    /// Signs as `sigmark embed` does by default.
    pub(super) fn new(asset: &Asset) -> Result<Self> {
        let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([1; 32]));
        let rig = asset.rig()?;
        let embedder = Embedder::new(&key).rig(rig.as_ref());
        let original = Arc::new(embedder.cut(asset.mesh(), &job())?);
        original.keep_bases(&job())?;
        let signed = embedder.embed_in(&original, &job())?;
        let verifier = Verifier::with_original(&original, signed.certificate(), &key.public_key())?;
        let marked = asset.with_positions(signed.positions())?;
        Ok(Self {
            reader: Reader::new(asset.mesh())?,
            verifier: verifier.with_rig(rig.clone()),
            marked: Some(marked.mesh().clone()),
            signed,
            rig,
        })
    }

    /// The signed model's file, in one piece.
    pub(super) fn file(&self, asset: &Asset) -> Result<Vec<u8>> {
        let marked = asset.with_positions(self.signed.positions())?;
        Ok(marked.to_bytes().into_owned())
    }

    pub(super) fn marked(&self) -> &TriMesh {
        self.marked.as_ref().unwrap_or(self.signed.mesh())
    }

    pub(super) fn signed(&self) -> &sigmark::Signed {
        &self.signed
    }

    pub(super) fn reader(&self) -> &Reader {
        &self.reader
    }

    pub(super) fn rig(&self) -> Option<&Rig> {
        self.rig.as_ref()
    }

    /// What of the signature stands in the shape.
    pub(super) fn payload(&self) -> String {
        self.signed.certificate().statement().payload.name().into()
    }

    /// What each of [`ALGORITHMS`] reads.
    pub(super) fn read(&self, suspect: &TriMesh) -> Result<Vec<Read>> {
        let (rigid, aligning) = timed(|| self.rigid(suspect));
        let rigid = rigid?;
        let mut read = Vec::new();
        for model in [None, Some(JointModel::Bits)] {
            read.push(match &rigid {
                Some((suspect, pose)) => {
                    let (soft, cost) = timed(|| self.by_similarity(suspect, pose, model));
                    self.judged(&soft?, aligning.cpu + cost.cpu)
                }
                None => Read::nothing(aligning.cpu),
            });
        }
        let (verdict, cost) = timed(|| self.verifier.verify(suspect, &job()));
        read.push(Read::of(&verdict?, cost.cpu));
        Ok(read)
    }

    /// The suspect where a similarity lays it best: by its vertices, wherever they went, if they are found again; else by its surface, if that fits.
    fn rigid(&self, suspect: &TriMesh) -> Result<Option<(Suspect, Similarity)>> {
        let original = self.reader.reference();
        let aligner = Aligner::new(original.clone(), &AlignOptions::default())?;
        let alignment = match aligner.find(suspect, &job())? {
            Placement::ByVertices(maps) => {
                let Some(map) = maps.into_iter().next() else {
                    return Ok(None);
                };
                Alignment {
                    transform: map.fit(original.mesh(), suspect)?.transform,
                    matched_by: MatchedBy::Connectivity,
                    overlap: 0.0,
                    coverage: 0.0,
                    residual: 0.0,
                    aligned: true,
                    correspondence: Some(map),
                    alternatives: Vec::new(),
                    free_directions: 0,
                }
            }
            Placement::BySurface(alignment) => alignment,
        };
        let pose = alignment.transform;
        Ok(alignment
            .aligned
            .then(|| (self.reader.suspect(suspect, &alignment), pose)))
    }

    /// By the paper's rule, or by a joint estimate.
    fn by_similarity(
        &self,
        suspect: &Suspect,
        pose: &Similarity,
        model: Option<JointModel>,
    ) -> Result<SoftBits> {
        let layout = self.signed.layout();
        Ok(match model {
            None => {
                let sampled = suspect.sample(pose, &job())?;
                CoefficientDetector::new(layout).detect(&sampled, &job())?
            }
            Some(model) => {
                let estimator = JointEstimator::new(layout).with_model(model);
                let method = ReadingMethod::joint(estimator.into());
                suspect.read(&method, pose, &job())?.soft
            }
        })
    }

    fn judged(&self, soft: &SoftBits, cpu: f64) -> Read {
        let certificate = self.signed.certificate();
        let (expected, weights) = (certificate.bits(), soft.weights());
        let [bits, wrong] = read_and_wrong(&expected, &weights);
        let p = p_value(&expected, &weights);
        let outcome = match (certificate.is_read(soft, &code::LISTS), p <= FOUND) {
            (true, _) => "verified",
            (false, true) => "detected",
            (false, false) => "not found",
        };
        Read {
            outcome: outcome.into(),
            way: "similarity".into(),
            is_evidence: p <= sigmark::claim::EVIDENCE,
            margin: Some(margin(&expected, &weights)),
            p,
            bits,
            errors: Some(wrong),
            cpu,
        }
    }
}

impl Read {
    fn nothing(cpu: f64) -> Self {
        Self {
            outcome: "not found".into(),
            way: "does not fit".into(),
            is_evidence: false,
            margin: None,
            p: 1.0,
            bits: 0,
            errors: None,
            cpu,
        }
    }

    fn of(verdict: &Verdict, cpu: f64) -> Self {
        let way = serde_json::to_value(verdict.matched_by).unwrap_or_default();
        Self {
            outcome: verdict.outcome.name().replace('_', " "),
            way: way.as_str().unwrap_or_default().into(),
            is_evidence: verdict.is_evidence(),
            margin: verdict.margin,
            p: verdict.p_value,
            bits: verdict.bits,
            errors: verdict.bit_errors,
            cpu,
        }
    }

    /// The share of bits that are right.
    pub(super) fn rate(&self) -> Option<f64> {
        let right = self.bits.checked_sub(self.errors?)?;
        (self.bits > 0).then(|| right as f64 / self.bits as f64)
    }
}

impl fmt::Display for Read {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let margin = self.margin.unwrap_or(0.0);
        write!(
            f,
            "{} by {}, T₀ {margin:.1}, p {:.1e}",
            self.outcome, self.way, self.p
        )
    }
}

/// The suspect brought back by the original's rig; none where its vertices are not found.
pub(super) fn unposed(original: &TriMesh, rig: &Rig, suspect: &TriMesh) -> Result<Option<TriMesh>> {
    let aligner = Aligner::new(original, &AlignOptions::default())?;
    let Placement::ByVertices(maps) = aligner.find(suspect, &job())? else {
        return Ok(None);
    };
    let unposed = unpose_any(original, rig, suspect, &maps, &job())?;
    let back = unposed.map(|unposed| suspect.with_positions(unposed.completed(suspect).0));
    Ok(back.transpose()?)
}
