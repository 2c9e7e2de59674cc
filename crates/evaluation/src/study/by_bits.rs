//! The algorithms of `baselines`: they see bits, and the harness judges what they read.

use anyhow::{Result, ensure};
use baselines::{Algorithm, AlgorithmId, Prepared, Reference, Subject};
use job::Job;
use registration::MatchedBy;
use serde_json::{Map, Value, json};
use sigmark::{
    Signature,
    claim::statistics::{binomial_tail, margin},
    mark::extraction_rate,
};

use super::{
    Cell, Rated, SCHEME, Scene, Signed,
    marking::{Attacked, Judge, Marking, Ready},
};
use crate::reading::{Finder, Reading};

/// An algorithm whose marks are the bits of the paper's signatures.
pub(crate) struct ByBits(pub(crate) Box<dyn Algorithm>);

impl Marking for ByBits {
    fn id(&self) -> AlgorithmId {
        self.0.id()
    }

    fn name(&self) -> String {
        self.0.name()
    }

    fn key(&self) -> Value {
        let parameters = self.0.parameters().into_iter();
        let parameters: Map<String, Value> = parameters
            .map(|(name, value)| (name.to_string(), json!(value)))
            .collect();
        json!({"id": self.0.id(), "parameters": parameters})
    }

    fn paper_alpha(&self) -> Option<f64> {
        self.0.paper_alpha()
    }

    fn prepare(&self, scene: &Scene<'_>, job: &Job) -> Result<Box<dyn Ready>> {
        let subject = Subject {
            mesh: &scene.standin.mesh,
            patches: &scene.patches,
            bits: SCHEME.bits(),
        };
        Ok(Box::new(ReadyByBits {
            prepared: self.0.prepare(&subject, job)?,
            reference: self.0.reference(),
        }))
    }
}

struct ReadyByBits {
    prepared: Box<dyn Prepared>,
    reference: Reference,
}

impl Ready for ReadyByBits {
    fn patches(&self) -> usize {
        self.prepared.patches()
    }

    fn functions(&self) -> usize {
        self.prepared.functions()
    }

    fn positions(&self, signed: &Signed, alpha: f64, job: &Job) -> Result<Vec<[f64; 3]>> {
        Ok(self.prepared.embed(&signed.signature.bits(), alpha, job)?)
    }

    fn judge<'a>(
        &'a self,
        scene: &'a Scene<'a>,
        signed: &'a Signed,
        alpha: f64,
    ) -> Result<Box<dyn Judge + 'a>> {
        let original = &scene.standin.mesh;
        let finder = match self.reference {
            Reference::Original => Finder::new(original)?,
            Reference::Marked => {
                let job = Job::new(scene.setup.threads);
                Finder::new(&original.with_positions(self.positions(signed, alpha, &job)?)?)?
            }
        };
        Ok(Box::new(JudgeOfBits {
            prepared: self.prepared.as_ref(),
            scene,
            signed,
            alpha,
            finder,
        }))
    }
}

struct JudgeOfBits<'a> {
    prepared: &'a dyn Prepared,
    scene: &'a Scene<'a>,
    signed: &'a Signed,
    alpha: f64,
    /// What suspects are brought onto.
    finder: Finder,
}

impl Judge for JudgeOfBits<'_> {
    fn judged(&self, suspect: Attacked) -> Result<Cell> {
        let found = self.finder.find(&suspect.mesh)?;
        let expected = self.signed.signature.bits();
        let read = found.read(self.prepared, self.alpha, &expected)?;
        // The true pose explains what the algorithm's rule lost; its other methods better the pose themselves.
        let all = read.readings[0].soft.hard() == expected;
        let in_true_pose = suspect.true_pose.filter(|_| !all);
        let in_true_pose = in_true_pose
            .map(|pose| found.read_in(&pose, self.prepared, self.alpha))
            .transpose()?;
        let rated = read
            .readings
            .iter()
            .enumerate()
            .map(|(i, reading)| self.rated(reading, in_true_pose.as_deref().filter(|_| i == 0)));
        Ok(Cell {
            readings: rated.collect::<Result<_>>()?,
            steps: Vec::new(),
            attack: suspect.report,
            vertices: suspect.mesh.vertex_count(),
            aligned: found.alignment.aligned,
            basis: name(found.alignment.matched_by),
            overlap: found.alignment.overlap,
            missing: read.missing,
            attack_seconds: suspect.seconds,
            reference_seconds: self.finder.seconds,
            registration_seconds: found.seconds,
            reading_seconds: read.seconds,
        })
    }
}

impl JudgeOfBits<'_> {
    fn rated(&self, reading: &Reading, in_true_pose: Option<&[bool]>) -> Result<Rated> {
        let Reading {
            detector,
            soft,
            tries,
        } = reading;
        let setup = self.scene.setup;
        let (bits, expected) = (soft.hard(), self.signed.signature.bits());
        let (count, wanted) = (bits.len(), expected.len());
        ensure!(
            count == wanted,
            "{} read {count} bits of {wanted}",
            detector.name()
        );
        let strangers = setup.strangers.iter();
        let read = Signature::from_bits(SCHEME, &bits)?;
        let verified = setup.public_key.verify(self.signed.message.as_bytes(), &read);
        let rate = extraction_rate(&expected, &bits);
        let right = (rate * wanted as f64).round() as usize;
        Ok(Rated {
            detector: detector.clone(),
            rate,
            margin: Some(margin(&expected, &soft.weights())),
            p_value: (binomial_tail(wanted, right) * *tries as f64).min(1.0),
            tries: *tries,
            rate_in_true_pose: in_true_pose.map(|bits| extraction_rate(&expected, bits)),
            strangers: strangers
                .map(|other| extraction_rate(&other.bits(), &bits))
                .collect(),
            verified: verified.is_ok(),
        })
    }
}

/// As JSON has it.
pub(super) fn name(matched_by: MatchedBy) -> String {
    let name = serde_json::to_value(matched_by).unwrap_or_default();
    name.as_str().unwrap_or_default().into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use baselines::{Lbf, Mhb, entries};

    #[test]
    fn finished_work_knows_algorithms_by_id_and_parameters() {
        let key = |algorithm: Box<dyn Algorithm>| ByBits(algorithm).key();
        let mhb = json!({"id": "mhb", "parameters": {"chip rate": "3", "methods": ""}});
        assert_eq!(key(Box::<Mhb>::default()), mhb);
        assert_ne!(key(Box::new(Mhb::default().chip_rate(1))), mhb);
        assert_ne!(key(Box::new(Lbf::new(400))), key(Box::new(Lbf::new(500))));
        let mut keys: Vec<String> = entries(400)
            .into_iter()
            .map(|entry| key(entry).to_string())
            .collect();
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), entries(400).len());
    }
}
