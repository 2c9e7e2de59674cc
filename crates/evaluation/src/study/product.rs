//! Sigmark as people use it: marks of `sigmark embed`, judged by the code of `sigmark verify`.

use std::{sync::Arc, time::Instant};

use anyhow::Result;
use baselines::{AlgorithmId, DetectorId};
use job::Job;
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use serde_json::{Value, json};
use sigmark::{
    Curve, Embedder, Outcome, PayloadKind, Scheme, SigningKey, Strength, Verdict, Verifier,
    claim::statistics::read_and_wrong,
    mark::{Original, SoftBits},
};

use super::{
    Cell, Rated, Scene, Signed,
    by_bits::name,
    marking::{Attacked, Judge, Marking, Ready},
    steps,
};

/// Sigmark's default: keyed order, pooled chips, a coded payload of P-256. Its α is Sigmark's level, in thousandths of the diagonal.
pub(crate) struct Product {
    payload: PayloadKind,
}

/// With the whole signature in the shape.
pub(crate) const SIGMARK: AlgorithmId = AlgorithmId::new("sigmark");

/// With a tag of it.
pub(crate) const SIGMARK_TAG: AlgorithmId = AlgorithmId::new("sigmark-tag");

/// Who reads these marks.
pub(crate) const VERIFIER: DetectorId = DetectorId::new("verifier");

/// α = 1, as a fraction of the diagonal.
const UNIT: f64 = 1e-3;

impl Product {
    pub(crate) const ALL: [Self; 2] = [
        Self {
            payload: PayloadKind::Signature,
        },
        Self {
            payload: PayloadKind::Tag,
        },
    ];

    /// From a fixed seed: it protects nothing.
    fn key() -> SigningKey {
        SigningKey::generate(Curve::P256, &mut ChaCha20Rng::seed_from_u64(2012))
    }
}

impl Marking for Product {
    fn id(&self) -> AlgorithmId {
        match self.payload {
            PayloadKind::Tag => SIGMARK_TAG,
            _ => SIGMARK,
        }
    }

    fn name(&self) -> String {
        match self.payload {
            PayloadKind::Tag => "Sigmark, tag".into(),
            _ => "Sigmark".into(),
        }
    }

    fn key(&self) -> Value {
        let fingerprint = Self::key().public_key().fingerprint();
        json!({"id": self.id(), "payload": self.payload, "key": fingerprint})
    }

    fn paper_alpha(&self) -> Option<f64> {
        None
    }

    fn prepare(&self, scene: &Scene<'_>, job: &Job) -> Result<Box<dyn Ready>> {
        let key = Self::key();
        let embedder = Embedder::new(&key).payload(Some(self.payload));
        let original = embedder.cut(&scene.standin.mesh, job)?;
        original.keep_bases(job)?;
        Ok(Box::new(ReadyProduct {
            key,
            embedder,
            original: Arc::new(original),
        }))
    }
}

struct ReadyProduct {
    key: SigningKey,
    embedder: Embedder,
    original: Arc<Original>,
}

impl ReadyProduct {
    fn signed(&self, signed: &Signed, alpha: f64, job: &Job) -> Result<sigmark::Signed> {
        let embedder = self.embedder.clone().message(&signed.message);
        let strength = Strength::Level(UNIT * alpha);
        Ok(embedder.strength(strength).embed_in(&self.original, job)?)
    }
}

impl Ready for ReadyProduct {
    fn patches(&self) -> usize {
        self.original.patches().len()
    }

    fn functions(&self) -> usize {
        self.original.functions().iter().copied().max().unwrap_or(0)
    }

    fn positions(&self, signed: &Signed, alpha: f64, job: &Job) -> Result<Vec<[f64; 3]>> {
        Ok(match alpha > 0.0 {
            true => self.signed(signed, alpha, job)?.positions().to_vec(),
            false => self.original.mesh().positions().to_vec(),
        })
    }

    fn judge<'a>(
        &'a self,
        scene: &'a Scene<'a>,
        signed: &'a Signed,
        alpha: f64,
    ) -> Result<Box<dyn Judge + 'a>> {
        let mark = self.signed(signed, alpha, &Job::new(scene.setup.threads))?;
        let certificate = mark.certificate();
        let stranger = |message: &String| -> Result<Vec<bool>> {
            let stranger = self.key.sign(Scheme::default(), message.as_bytes())?;
            Ok(certificate.payload().bits(&stranger))
        };
        let messages = (0..scene.setup.strangers.len()).map(|i| format!("in no mesh {i}"));
        Ok(Box::new(JudgeOfProduct {
            strangers: messages
                .map(|message| stranger(&message))
                .collect::<Result<_>>()?,
            verifier: Verifier::with_original(&self.original, certificate, &self.key.public_key())?,
            mark,
        }))
    }
}

struct JudgeOfProduct {
    mark: sigmark::Signed,
    verifier: Verifier,
    /// What marks would hold of signatures that are in no mesh.
    strangers: Vec<Vec<bool>>,
}

impl Judge for JudgeOfProduct {
    fn judged(&self, suspect: Attacked) -> Result<Cell> {
        let begun = Instant::now();
        let verdict = self.verifier.verify(&suspect.mesh, &Job::default())?;
        let reading_seconds = begun.elapsed().as_secs_f64();
        let steps = match suspect.by_steps {
            true => steps::read(&self.mark, self.verifier.original(), &suspect.mesh)?,
            false => Vec::new(),
        };
        Ok(Cell {
            readings: vec![self.rated(&verdict)],
            steps,
            attack: suspect.report,
            vertices: suspect.mesh.vertex_count(),
            aligned: verdict.soft.is_some(),
            basis: name(verdict.matched_by),
            overlap: verdict.overlap,
            missing: verdict.missing,
            attack_seconds: suspect.seconds,
            reference_seconds: 0.0,
            // The verifier does both.
            registration_seconds: 0.0,
            reading_seconds,
        })
    }
}

impl JudgeOfProduct {
    fn rated(&self, verdict: &Verdict) -> Rated {
        let soft = verdict.soft.as_ref();
        let of = |bits: &[bool]| soft.map_or(0.5, |soft| rate(bits, soft));
        Rated {
            detector: VERIFIER,
            rate: of(&self.mark.certificate().bits()),
            margin: verdict.margin,
            p_value: verdict.p_value,
            tries: 1,
            rate_in_true_pose: None,
            strangers: self.strangers.iter().map(|bits| of(bits)).collect(),
            verified: verdict.outcome == Outcome::Verified,
        }
    }
}

/// The share of right bits among those of which something was read; a half where nothing was.
pub(super) fn rate(bits: &[bool], soft: &SoftBits) -> f64 {
    match read_and_wrong(bits, soft.values()) {
        [0, _] => 0.5,
        [read, wrong] => (read - wrong) as f64 / read as f64,
    }
}
